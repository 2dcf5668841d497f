"""``uuv-marl train``: a command for each library."""

import signal
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperCommand

from uuv_marl.cli.console import console, explained, extra, progress_bar

app = typer.Typer(help="Train a policy; each command is named after its library.", no_args_is_help=True)


def _whole(text: str) -> int:
    """A number of agent-steps, also as 3e6."""
    try:
        number = float(text)
    except ValueError:
        number = 0.0
    if not (1.0 <= number < 1e15 and number.is_integer()):
        raise typer.BadParameter(f"{text!r} is no whole number from 1 on; give for instance 3000000 or 3e6")
    return int(number)


def _swarms(text: str) -> tuple[tuple[int, int], ...]:
    """Vehicles and worlds of each swarm, from a text such as 10x20,54x5."""
    sizes = [part.partition("x")[::2] for part in text.split(",")]
    if not all(n.isdecimal() and worlds.isdecimal() and int(n) > 0 and int(worlds) > 0 for n, worlds in sizes):
        raise typer.BadParameter(f"{text!r} must be VEHICLESxWORLDS, such as 20x50 or 10x20,54x5")
    return tuple((int(n), int(worlds)) for n, worlds in sizes)


class _Command(TyperCommand):
    """Says how an option of two values looks."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """As a command does, with an example in the message."""
        try:
            return super().parse_args(ctx, args)
        except Exception as error:
            if "2 arguments" not in str(error):
                raise
            raise typer.BadParameter(f"{error} Give it at the start and at the end: --noise 0.4 0.08", ctx) from None


Scenario = Annotated[str, typer.Option(help="Name or TOML file.")]
Steps = Annotated[
    int,
    typer.Option(
        parser=_whole,
        metavar="INTEGER",
        help="Agent-steps in all, decisions times vehicles, in whole iterations. Noise and rates anneal over them.",
    ),
]
Sizes = Annotated[
    Any,
    typer.Option(
        parser=_swarms,
        metavar="NxWORLDS,...",
        help="Swarms trained on at once, such as 10x20,54x5: 20 worlds of 10 vehicles and 5 of 54. Default: 10 to 100 "
        "vehicles; the scenario's own number where it is not 54.",
    ),
]
Set = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="FIELD=VALUE", help="Override a field of the scenario, such as trajectory.speed_mps=3."
    ),
]
Seed = Annotated[int, typer.Option(min=0, help="Of worlds, weights and noise: one seed, one training.")]
Start = Annotated[
    Path | None, typer.Option(help="Start from the weights of another training: its best, or a checkpoint.")
]
Output = Annotated[Path, typer.Option(help="Folder of settings, progress, checkpoint and best.")]
Resume = Annotated[bool, typer.Option("--resume", help="Go on from the folder's last checkpoint.")]


@app.command("mappo", cls=_Command)
def train_mappo(
    scenario: Scenario = "random_field",
    sizes: Sizes = None,
    overrides: Set = None,
    steps: Steps = 30_000_000,
    seed: Seed = 0,
    start: Start = None,
    noise: Annotated[
        tuple[float, float] | None,
        typer.Option(
            min=1e-3, max=10.0, help="Of actions, at the start and at the end [full force]. Default: 0.4 0.08."
        ),
    ] = None,
    rate: Annotated[
        tuple[float, float] | None,
        typer.Option(
            min=1e-9, max=1.0, help="The actor's learning rate, at the start and at the end. Default: 0.0015 0.00015."
        ),
    ] = None,
    output: Output = Path("results/mappo"),
    resume: Resume = False,
) -> None:
    """Train one policy for all vehicles with MAPPO, on swarms of 10 to 100 at once, on one core.

    Vehicles decide every 0.5 s, with yaw damping, whatever the scenario says; --set changes it. Needs the extra
    "train". Writes config.json (settings, seeds, versions), progress.csv (a row per iteration), checkpoints/,
    tensorboard/ and best/, the policy that did best on validation seeds: give it to uuv-marl benchmark as --policy.
    Ctrl-C ends the training with a checkpoint after the iteration under way; the same command with --resume goes on
    exactly. A kill leaves the last checkpoint, which is written every 20 iterations.

    Example: uuv-marl train mappo --output runs/mappo
    """
    with explained():
        with extra("train", "training with MAPPO"):
            from uuv_marl.train.mappo import Hyperparameters

        by = Hyperparameters()
        try:
            algorithm = replace(by, noise=noise or by.noise, learning_rate=rate or by.learning_rate)
        except ValueError as error:
            raise typer.BadParameter(str(error)) from None
        _train(output, resume, overrides, scenario=scenario, sizes=sizes, steps=steps, seed=seed, start=start,
               algorithm=algorithm)  # fmt: skip


@app.command("ppo", cls=_Command)
def train_ppo(
    scenario: Scenario = "random_field",
    sizes: Sizes = None,
    overrides: Set = None,
    steps: Steps = 30_000_000,
    seed: Seed = 0,
    start: Start = None,
    output: Output = Path("results/ppo"),
    resume: Resume = False,
) -> None:
    """Train one policy for all vehicles with Stable-Baselines3's PPO, on swarms of 10 to 100 at once, on one core.

    Problem, files and habits are those of uuv-marl train mappo: the critic sees what the actor sees, and noise is
    learned. Needs the extra "train".

    Example: uuv-marl train ppo --output runs/ppo
    """
    with explained():
        with extra("train", "training with Stable-Baselines3"):
            from uuv_marl.train.ppo import Hyperparameters

        _train(output, resume, overrides, scenario=scenario, sizes=sizes, steps=steps, seed=seed, start=start,
               algorithm=Hyperparameters())  # fmt: skip


def _train(
    output: Path, resume: bool, overrides: Sequence[str] | None, *, sizes: Any, start: Path | None, **settings: Any
) -> None:
    """Train with these settings, and show how it goes."""
    from uuv_marl.scenario_files import parse_override
    from uuv_marl.train.training import OVERRIDES, Settings, train

    changes = {**OVERRIDES, **dict(parse_override(text) for text in overrides or [])}
    begin = None if start is None else str(start)
    chosen = Settings(**settings, sizes=sizes or (), start=begin, overrides=changes)
    validated = ""

    def describe(record: Any) -> str:
        nonlocal validated
        if record.score is not None:
            validated = (
                f", validation: score {record.score:.3f} (best {record.best:.3f}), arrived {record.arrived:.0%}, "
                f"collisions {record.collisions}"
            )
        return f"reward {record.reward:.3f}{validated}"

    with _stoppable(output) as stop:
        last = _follow(train(output, chosen, resume=resume, say=console.print, stop=stop), chosen.steps, describe)
        _ended(output, stop())
    console.print(f"Done: {last}. Policy: {output}/best   progress: {output}/progress.csv")


def _follow(records: Iterator[Any], steps: int, describe: Callable[[Any], str]) -> str:
    """Show a training in a bar; how it stood at last."""
    last = "no iteration was needed: --steps are done already"
    with progress_bar() as bar:
        task = bar.add_task("starting", total=steps)
        for record in records:
            last = f"{record.agent_steps / record.seconds:,.0f} agent-steps/s, {describe(record)}"
            bar.update(task, completed=record.agent_steps, description=last)
    return last


@contextmanager
def _stoppable(output: Path) -> Iterator[Callable[[], bool]]:
    """The first Ctrl-C of the block is only noted, and the second ends it at once; whether there was one."""
    noted: list[int] = []

    def note(number: int, frame: Any) -> None:
        if noted:
            signal.default_int_handler(number, frame)
        noted.append(number)
        console.print("Stopping after this iteration, with a checkpoint. Ctrl-C again stops at once, without.")

    before = signal.signal(signal.SIGINT, note)
    try:
        yield lambda: bool(noted)
    except KeyboardInterrupt:
        kept = any((output / "checkpoints").glob("[0-9]*[0-9]"))
        rest = "The last checkpoint is" if kept else "No checkpoint was written yet: settings alone are"
        console.print(f"Stopped at once. {rest} in {output}; the same command with --resume goes on.")
        raise typer.Exit(130) from None
    finally:
        signal.signal(signal.SIGINT, before)


def _ended(output: Path, stopped: bool) -> None:
    if stopped:
        console.print(f"Stopped. The checkpoint is in {output}; the same command with --resume goes on.")
        raise typer.Exit(130)


@app.command("rllib")
def train_rllib(
    scenario: Scenario = "single_obstacle",
    num_vehicles: Annotated[int | None, typer.Option(min=1, help="Replaces the scenario's.")] = None,
    steps: Steps = 1_000_000,
    seed: Annotated[int, typer.Option(min=0, help="Of the first worlds and weights.")] = 0,
    env_runners: Annotated[int, typer.Option(min=0, max=1000, help="Processes that sample, a core each.")] = 2,
    ray: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="A Ray cluster (auto: the one here). Default: this machine.")
    ] = None,
    output: Output = Path("results/rllib"),
    resume: Resume = False,
) -> None:
    """Train one policy for all vehicles with RLlib's PPO, on this machine or a Ray cluster.

    Vehicles decide every 0.5 s, with yaw damping. Needs the extra "distributed". Writes config.json (settings, seeds,
    versions), progress.csv (a row per iteration) and checkpoints/. Ctrl-C ends it with a checkpoint after the iteration
    under way; the same command with --resume goes on, to more --steps too.

    Example: uuv-marl train rllib --scenario tracking --num-vehicles 8 --steps 200000
    """
    with explained():
        with extra("distributed", "training with RLlib"):
            from uuv_marl.train.rllib import Settings, train

        settings = Settings(scenario=scenario, num_vehicles=num_vehicles, seed=seed)
        shown = "–"

        def describe(record: Any) -> str:
            nonlocal shown
            if record.episode_return is not None:
                shown = f"{record.episode_return:.1f}"
            return f"{record.agent_steps:,} agent-steps, last return per vehicle {shown}"

        console.print("Starting Ray takes about 15 s.")
        with _stoppable(output) as stop:
            records = train(
                output, steps, settings, num_env_runners=env_runners, address=ray, resume=resume, say=console.print,
                stop=stop,
            )  # fmt: skip
            last = _follow(records, steps, describe)
            _ended(output, stop())
        console.print(f"Done: {last}. Progress: {output}/progress.csv   checkpoint: {output}/checkpoints")
