"""The command line: ``uuv-marl --help``."""

import sys
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.markup import escape
from rich.progress import (
    BarColumn,
    Progress,
    TaskID,
    TaskProgressColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.syntax import Syntax
from rich.table import Table

from uuv_marl import __version__

if TYPE_CHECKING:
    from uuv_marl.benchmark.runner import Evaluate

app = typer.Typer(
    help="Swarms of unmanned underwater vehicles: scenarios, controllers and their benchmark.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_show_locals=False,
    rich_markup_mode="markdown",
)
train_app = typer.Typer(help="Train a policy; each command is named after its library.", no_args_is_help=True)
app.add_typer(train_app, name="train")
# Piped output keeps a width at which tables are legible.
console = Console(width=None if sys.stdout.isatty() else 130)
errors = Console(stderr=True)


@contextmanager
def _explained() -> Iterator[None]:
    """Turn what a user can mend into one message, without a traceback."""
    from uuv_marl.baselines import PolicyError
    from uuv_marl.benchmark.results import ResultsError
    from uuv_marl.benchmark.runner import ClusterError
    from uuv_marl.scenario_files import ScenarioError

    try:
        yield
    except (ScenarioError, PolicyError, ResultsError, ClusterError) as error:
        errors.print(f"[bold red]Error:[/] {escape(str(error))}", highlight=False)
        raise typer.Exit(2) from None


@contextmanager
def _extra(name: str, what: str) -> Iterator[None]:
    """Say which extra to install where a library is missing."""
    from uuv_marl.baselines import PolicyError

    try:
        yield
    except ModuleNotFoundError as error:
        raise PolicyError(
            f"{what} needs {error.name}: install the extra, in the checkout: pip install -e '.[{name}]'"
        ) from None


def _show_version(value: bool) -> None:
    if value:
        console.print(f"uuv_marl {__version__}")
        raise typer.Exit


@app.callback()
def _main(
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    pass


@app.command()
def benchmark(
    scenario: Annotated[
        list[str] | None, typer.Option(help="Name or TOML file; repeat for several. Default: single_obstacle.")
    ] = None,
    policy: Annotated[
        list[str] | None,
        typer.Option(
            help="Name, or module:Class; repeat for several. Default: the paper's three and stronger variants."
        ),
    ] = None,
    seeds: Annotated[
        int, typer.Option(min=1, max=10_000, help="Seeds 0 to SEEDS - 1; tuning and training use those above 9,999.")
    ] = 20,
    overrides: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="FIELD=VALUE", help="Override a field, such as sonar.echo_reports=surface."),
    ] = None,
    output: Annotated[Path, typer.Option(help="Folder of results, table and pictures.")] = Path("results/benchmark"),
    ray: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS", help="Spread the seeds over this Ray cluster (auto: the one here). Needs: distributed."
        ),
    ] = None,
) -> None:
    """Compare policies on scenarios over seeds.

    Prints a table beside the paper's figures and writes results.json (every seed and metric), table.md and
    figures/*.png. Ctrl-C keeps the finished seeds; the same command goes on.

    Example: uuv-marl benchmark --scenario tracking --scenario multi_obstacle --policy bio_inspired
    """
    with _explained():
        from uuv_marl.baselines import PolicyError
        from uuv_marl.baselines.registry import policy_class
        from uuv_marl.benchmark.results import Results
        from uuv_marl.benchmark.runner import DEFAULT_POLICIES, make_tables, run_missing, write_report
        from uuv_marl.benchmark.tables import rich_table
        from uuv_marl.scenario_files import ScenarioError, load_scenario, parse_override
        from uuv_marl.sim.compiled import announce_compilation

        changes = dict(parse_override(text) for text in overrides or [])
        for field in sorted({"sonar.channels", "actuators.yaw_damping_nms"} & set(changes)):
            raise PolicyError(f"{field} can't be set here: every policy brings its own, see 'uuv-marl policies'")
        scenarios = [load_scenario(name, overrides=changes) for name in scenario or ["single_obstacle"]]
        names = [loaded.name for loaded in scenarios]
        if len(set(names)) < len(names):
            raise ScenarioError(f"scenarios of one table need different names, got {', '.join(names)}; rename a file")
        policies = list(dict.fromkeys(policy or DEFAULT_POLICIES))
        sys.path.insert(0, "")  # --policy module:Class finds modules of this folder
        for name in policies:
            policy_class(name)
        evaluator, cluster = _where(ray, policies)
        results = Results(output, scenarios)
        announce_compilation()
        wanted = list(range(seeds))
        try:
            with cluster, _progress() as progress:
                tasks: dict[tuple[str, str], TaskID] = {}

                def report(name: str, policy_name: str, share: float) -> None:
                    key = (name, policy_name)
                    if key not in tasks:
                        tasks[key] = progress.add_task(f"{name}: {policy_name}", total=1.0)
                    progress.update(tasks[key], completed=share)

                run_missing(results, scenarios, policies, wanted, report, evaluator)
        except KeyboardInterrupt:
            console.print(
                f"Stopped. {len(results.rows)} finished runs are in {output}/results.json; the same command goes on."
            )
            raise typer.Exit(130) from None
        tables = make_tables(results, scenarios, policies, wanted)
        written = write_report(results, tables, scenarios, policies, wanted)
        for table in tables:
            console.print(rich_table(table.title, table.rows))
        console.print(f"Every seed: {output}/results.json   table: {written[0]}   pictures:")
        for path in written[1:]:
            console.print(f"  {path}", highlight=False)


def _where(ray: str | None, policies: Sequence[str]) -> "tuple[Evaluate, AbstractContextManager[None]]":
    """What runs the seeds, and the connection that it needs: this machine, or the Ray cluster at an address."""
    from uuv_marl.benchmark.evaluate import evaluate

    if ray is None:
        return evaluate, nullcontext()
    with _extra("distributed", "--ray"):
        from uuv_marl.benchmark.distributed import connected, evaluate_on_cluster
    own = any(":" in name for name in policies)
    return evaluate_on_cluster, connected(ray, working_dir=Path.cwd() if own else None)


@app.command()
def scenarios(
    show: Annotated[
        str | None, typer.Option(metavar="NAME", help="Print one, complete, with the source of every number.")
    ] = None,
) -> None:
    """List the scenarios, or show one."""
    with _explained():
        from uuv_marl.scenario_files import load_scenario, scenario_names
        from uuv_marl.scenario_files import show as show_scenario

        if show is not None:
            text = show_scenario(show)
            console.print(
                Syntax(text, "toml", background_color="default") if console.is_terminal else text,
                markup=False,
                highlight=False,
                soft_wrap=True,
            )
            return
        table = Table("name", "version", "what", "source")
        for name in scenario_names():
            loaded = load_scenario(name)
            table.add_row(name, str(loaded.version), loaded.title, loaded.source)
        console.print(table)


@app.command()
def policies() -> None:
    """List the policies and what they need beyond the percept."""
    from uuv_marl.baselines import POLICIES

    table = Table("name", "channels", "yaw damping [N m s]", "what")
    for name, made in POLICIES.items():
        what = (made.__doc__ or "").strip().splitlines()[0]
        table.add_row(name, ", ".join(made.channels) or "–", f"{made.yaw_damping_nms:g}", what)
    console.print(table)


@app.command()
def tune(
    policy: Annotated[list[str] | None, typer.Option(help="Name; repeat for several. Default: all.")] = None,
    trials: Annotated[int, typer.Option(min=1, help="Evaluations per policy.")] = 300,
    output: Annotated[Path, typer.Option(help="Folder of the trials.")] = Path("results/tune"),
) -> None:
    """Search the free gains of hand-made policies: same optimiser, evaluations, seeds and objective for each.

    Needs the extra "tune". Takes ten to fifteen minutes per policy. Ctrl-C keeps the finished trials; the same command
    goes on. The shipped results are in uuv_marl/baselines/tuned.
    """
    with _explained():
        from uuv_marl.baselines import PolicyError
        from uuv_marl.benchmark.tuning import SPACES
        from uuv_marl.benchmark.tuning import tune as search

        for name in policy or SPACES:
            if name not in SPACES:
                raise PolicyError(f"policy {name!r} has no free gains to tune; there are {', '.join(SPACES)}")
        try:
            with _extra("tune", "tuning"), _progress() as progress:
                for name in policy or SPACES:
                    task = progress.add_task(name, total=trials)
                    path = search(
                        name, output, trials,
                        lambda done, best, task=task, name=name: progress.update(
                            task, completed=done, description=f"{name}: best {best:.1f} s"
                        ),
                    )  # fmt: skip
                    progress.console.print(f"{path}", highlight=False)
        except KeyboardInterrupt:
            console.print(f"Stopped. The finished trials are in {output}; the same command goes on.")
            raise typer.Exit(130) from None


@train_app.command("rllib")
def train_rllib(
    scenario: Annotated[str, typer.Option(help="Name or TOML file.")] = "single_obstacle",
    num_vehicles: Annotated[int | None, typer.Option(min=1, help="Replaces the scenario's.")] = None,
    steps: Annotated[
        int, typer.Option(min=1, help="Agent-steps in all: decisions times vehicles; whole batches.")
    ] = 1_000_000,
    seed: Annotated[int, typer.Option(min=0, help="Of the first worlds and weights.")] = 0,
    env_runners: Annotated[int, typer.Option(min=0, help="Processes that sample, a core each.")] = 2,
    ray: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="A Ray cluster (auto: the one here). Default: this machine.")
    ] = None,
    output: Annotated[Path, typer.Option(help="Folder of settings, progress and checkpoint.")] = Path("results/rllib"),
    resume: Annotated[bool, typer.Option("--resume", help="Go on from the folder's last checkpoint.")] = False,
) -> None:
    """Train one policy for all vehicles with RLlib's PPO, on this machine or a Ray cluster.

    Vehicles decide every 0.5 s, with yaw damping. Needs the extra "distributed". Writes config.json (settings, seeds,
    versions), progress.csv (a row per iteration) and checkpoints/. Ctrl-C keeps the last checkpoint; the same command
    with --resume goes on, to more --steps too.

    Example: uuv-marl train rllib --scenario tracking --num-vehicles 8 --steps 200000
    """
    with _explained():
        with _extra("distributed", "training with RLlib"):
            from uuv_marl.train.rllib import Settings, train

        from uuv_marl.sim.compiled import announce_compilation

        settings = Settings(scenario=scenario, num_vehicles=num_vehicles, seed=seed)
        records = train(output, steps, settings, num_env_runners=env_runners, address=ray, resume=resume)
        last = "no iteration was needed: --steps are done already"
        announce_compilation()
        console.print("Starting Ray takes about 15 s.")
        try:
            with _progress() as progress:
                task = progress.add_task("sampling", total=steps)
                shown = "–"
                for record in records:
                    if record.episode_return is not None:
                        shown = f"{record.episode_return:.1f}"
                    rate = f"{record.agent_steps / record.seconds:,.0f} agent-steps/s"
                    progress.update(task, completed=record.agent_steps, description=f"{rate}, return {shown}")
                    last = f"{record.agent_steps:,} agent-steps, {rate}, last return per vehicle {shown}"
        except KeyboardInterrupt:
            console.print(f"Stopped. The last checkpoint is in {output}; the same command with --resume goes on.")
            raise typer.Exit(130) from None
        console.print(f"Done: {last}. Progress: {output}/progress.csv   checkpoint: {output}/checkpoints")


def _progress() -> Progress:
    return Progress(
        TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeElapsedColumn(), TimeRemainingColumn(),
        console=console,
    )  # fmt: skip


def main() -> None:
    """Entry point of ``uuv-marl``."""
    app()
