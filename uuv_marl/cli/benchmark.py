"""``uuv-marl benchmark``, which compares policies, and ``uuv-marl tune``, which tunes controllers."""

import functools
import itertools
from pathlib import Path
from typing import Annotated

import typer

from uuv_marl.cli.console import (
    MANY_POLICIES,
    Restart,
    changes_of,
    console,
    explained,
    extra,
    find_modules,
    overrides_option,
    path_option,
    progress_line,
    say,
    working,
)  # fmt: skip


def benchmark(
    scenario: Annotated[
        list[str] | None, typer.Option(help="Name or TOML file. Repeat it for several. Default: single_obstacle.")
    ] = None,
    policy: Annotated[
        list[str] | None,
        typer.Option(
            help=MANY_POLICIES.format(
                "bio_inspired, sff, sdc, scout, mappo and ppo. Modules may also be in the current folder."
            )
        ),
    ] = None,
    seeds: Annotated[
        int, typer.Option(min=1, max=10_000, help="Runs seeds 0 to SEEDS - 1. Tuning and training use higher seeds.")
    ] = 20,
    overrides: Annotated[list[str] | None, overrides_option("`sonar.echo_reports=surface`")] = None,
    output: Annotated[Path, path_option("Folder of results, table and pictures.")] = Path("results/benchmark"),
    restart: Restart = False,
) -> None:
    """Compare policies on scenarios over seeds.

    It prints a table with the paper's figures and writes `results.json` (every seed and metric), `table.md` and
    `figures/*.png`. Table and pictures show every policy with runs in results.json on these scenarios and seeds.
    Ctrl-C keeps the finished seeds, and the same command continues.

    Example: uuv-marl benchmark --scenario tracking --scenario multi_obstacle --policy bio_inspired
    """
    with explained():
        from uuv_marl.baselines import make_policy, with_policy_requirements
        from uuv_marl.benchmark import runner
        from uuv_marl.benchmark.results import Results
        from uuv_marl.benchmark.tables import terminal_table
        from uuv_marl.replay.command import command
        from uuv_marl.scenario import load_scenario

        changes, files = changes_of(overrides or []), scenario or ["single_obstacle"]
        find_modules([*files, *(policy or []), *(overrides or [])])
        scenarios = [load_scenario(name, overrides=changes) for name in files]
        names = runner.distinct_names(scenarios, "table")
        policies = list(dict.fromkeys(policy or runner.default_policies(scenarios)))
        for name, loaded in itertools.product(policies, scenarios):
            make_policy(name, with_policy_requirements(name, loaded))  # raises now, not after hours of other runs
        wanted = range(seeds)
        with working(f"The finished runs are in {output}", alone=output) as bar:
            results = Results(output, scenarios)
            line = functools.cache(lambda name, policy_name: progress_line(bar, f"{name}: {policy_name}"))
            report = lambda name, policy_name, share: line(name, policy_name)(share)  # noqa: E731

            for name in policies if restart else ():
                results.forget_changed(name)
            runner.run_missing(results, scenarios, policies, wanted, report)
            tables, (markdown, *pictures) = runner.write_report(results, scenarios, wanted)
        for table in tables:
            console.print(terminal_table(table, console.width))
        say(f"Every seed: {output}/results.json   table: {markdown}   pictures:")
        for path in pictures:
            say(f"  {path}")
        worst = runner.worst(results, scenarios, policies, wanted)
        again = command(files[names.index(worst.scenario)], worst.policy, worst.seed, overrides or [])
        by = "collisions, arrival, distance"
        if "swarm_success" in worst.metrics.get("task", {}):  # other tasks are judged as follow is
            headline = scenarios[names.index(worst.scenario)].task_class.headline
            by = f"{headline.replace('_', ' ')}, collisions"
        say(f"The worst episode (by {by}) is seed {worst.seed} of {worst.policy}. To watch it:")
        say(f"  {again}")
        say(f'Next: read the numbers in Python with uuv_marl.benchmark.load("{output}"): needs the extra "analysis".')


def tune_command(
    policy: Annotated[list[str] | None, typer.Option(help="Name. Repeat it for several. Default: all.")] = None,
    trials: Annotated[int, typer.Option(min=1, help="Evaluations per policy.")] = 300,
    output: Annotated[Path, path_option("Folder for the trials.")] = Path("results/tune"),
) -> None:
    """Tune the free gains of controllers: same optimiser, evaluations, seeds and objective for each.

    This needs the extra "tune" and takes ten to forty minutes per policy. Ctrl-C keeps the finished trials, and the
    same command continues. The shipped results are in uuv_marl/baselines/tuned. The trials' journal may hold pickled
    data, which can run code: continue only a journal that you trust.
    """
    with explained():
        from uuv_marl.baselines import PolicyError
        from uuv_marl.benchmark.tuning import SPACES, tune

        names = policy or [*SPACES]
        for name in names:
            if name not in SPACES:
                raise PolicyError(f"policy {name!r} has no free gains to tune; choose one of {', '.join(SPACES)}")
        with extra("tune", "tuning"), working(f"The finished trials are in {output}", alone=output) as bar:
            for name in names:
                line = progress_line(bar, name, trials)
                report = lambda done, best, line=line, name=name: line(done, f"{name}: best {best:.1f} s")  # noqa: E731
                path = tune(name, output, trials, report)
                say(path)
