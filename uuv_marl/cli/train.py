"""``uuv-marl train``: train a policy on a scenario or from a recipe."""

import re
import shlex
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from decimal import Decimal
from pathlib import Path
from typing import Annotated, Any

import typer

from uuv_marl.cli.console import (
    console,
    explained,
    extra,
    find_modules,
    overridden,
    path_option,
    progress_bar,
    progress_line,
    say,
)  # fmt: skip

_SUMMARY = "swarm success {swarm_success:.0%}, vehicles {share:.0%}, collisions {collisions:.1f} per episode"


def _whole_number(text: str) -> int:
    """A number such as 3000000 or 3e6."""
    number = re.fullmatch(r"[0-9]{1,15}(\.[0-9]{1,15})?(e[0-9]{1,2})?", str(text)) and Decimal(text)
    if not number or number < 1 or number != int(number):
        raise typer.BadParameter(f"{text!r} is not a whole number from 1 on; give a number such as 3000000 or 3e6")
    return int(number)


def train_command(
    context: typer.Context,
    scenario: Annotated[
        str,
        typer.Argument(
            help="Name or TOML file of a scenario, or a file with fields of uuv_marl.train.training.Training."
        ),
    ] = "starter",
    overrides: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="FIELD=VALUE",
            help="Change a field of the training, such as `network.memory=true`, `sizes=[5,10]`, `critic=own` or "
            "`reward=mine:reward`, or of the scenario, such as `sonar.echo_reports=surface`.",
        ),
    ] = None,
    minutes: Annotated[
        float | None, typer.Option(min=0.01, help="Processor time in all, validations apart. Default: 5.")
    ] = None,
    steps: Annotated[
        int | None,
        typer.Option(
            parser=_whole_number,
            metavar="NUMBER",
            help="Instead of minutes, agent-steps in all, such as 3e6: decisions times vehicles.",
        ),
    ] = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Seed of worlds, weights and noise.")] = None,
    output: Annotated[Path, path_option("Folder for the training's description, progress and checkpoints.")] = Path(
        "runs/train"
    ),
    resume: Annotated[
        bool,
        typer.Option(
            "--resume", help="Continue from the folder's last checkpoint, optionally with more --minutes or --steps."
        ),
    ] = False,
) -> None:
    """Train one policy for all vehicles with PPO (MAPPO or IPPO), on one core.

    Unless the scenario fixes them, the decision period is 0.5 s, with yaw damping. This needs the extra "train".
    It writes config.json (the training, versions), progress.csv (a row per iteration), curve.png, checkpoints/ and
    best/, the policy that was best on validation seeds. Compare it with uuv-marl benchmark --policy FOLDER/best. Ctrl-C
    stops the training after the current iteration, with a checkpoint; --resume continues it. With --steps a seed
    determines a training on one machine, stopped and continued or not.

    Example: uuv-marl train starter --minutes 1 --output runs/starter
    """
    with explained():
        with extra("train", "training"):
            from uuv_marl.train import run
        from uuv_marl.errors import TrainingError
        from uuv_marl.train.folder import TrainingFolder
        from uuv_marl.train.training import Training, changed_fields, recipe_fields

        find_modules([":" if resume else scenario, *(overrides or [])])
        named = {"minutes": minutes, "steps": steps, "seed": seed}
        changes = {name: value for name, value in named.items() if value is not None}
        if resume:
            _alone(context)
            folder = TrainingFolder(output, None)
            training, until = folder.training, folder.budget_with(minutes, steps)
        else:
            fields_given = recipe_fields(scenario)
            for name in {"minutes", "steps"} & changes.keys():
                fields_given.pop("steps" if name == "minutes" else "minutes", None)
            fields = overridden(overrides or [])
            if twice := next((name for name in changes if name in fields), None):
                raise TrainingError(f"--{twice} and --set {twice} are both given; leave one out")
            training = Training(**changed_fields(fields_given, {**fields, **changes}))
            until = training.budget
        with _stoppable(output) as stop:
            how: Any = {"say": say, "stop": stop}
            records = run.resume(output, until, **how) if resume else run.train(output, training, **how)
            last = _follow(records, training, until)
        say(f"Done: {last}. Policy: {output}/best   curve: {output}/curve.png")
        if (output / "best").is_dir():
            best, worst = run.best_of(output)
            scores = f"{_SUMMARY.format(**best._asdict())}, after {best.seconds / 60.0:.1f} min"
            say(f"Best validation: {scores}. Its worst episode:")
            say(f"  {worst}")


_OPTIONS = {"overrides": "--set", "scenario": "the scenario"}


def _alone(context: typer.Context) -> None:
    """Refuse options that the folder determines."""
    for name in context.params:
        given = getattr(context.get_parameter_source(name), "name", None) == "COMMANDLINE"
        if given and name not in ("resume", "output", "steps", "minutes"):
            raise typer.BadParameter(
                f"--resume continues the training in the folder; leave out {_OPTIONS.get(name, f'--{name}')}"
            )


def _follow(records: Iterator[Any], training: Any, until: float) -> str:
    """Show a training in a bar, with a line for each validation; return its final summary."""
    last, judged = "the budget was already spent", "no validation yet"
    with progress_bar() as bar:
        report = progress_line(bar, "starting", until)
        for record in records:
            if record.swarm_success is not None:
                judged = _SUMMARY.format(**record._asdict())
                time = "" if record.time_s is None else f", time {record.time_s:.0f} s"
                console.print(f"  {record.seconds / 60.0:5.1f} min  {judged}{time}", highlight=False)
            last = f"{judged}, {record.agent_steps / max(record.seconds, 1e-9):,.0f} agent-steps/s"
            report(record.spent(training), f"reward {record.reward:.3f}, {last}")
    return last


@contextmanager
def _stoppable(output: Path) -> Iterator[Callable[[], bool]]:
    """Whether the block should stop, as a function; the first Ctrl-C sets it, and the second ends the block at once."""
    noted: list[int] = []

    def note(number: int, frame: Any) -> None:
        if noted:
            signal.default_int_handler(number, frame)
        noted.append(number)
        console.print("Stopping after this iteration, with a checkpoint. Ctrl-C again stops at once, without one.")

    before = signal.signal(signal.SIGINT, note)
    try:
        yield lambda: bool(noted)
    except KeyboardInterrupt:
        noted.append(signal.SIGINT)
    finally:
        signal.signal(signal.SIGINT, before)
    if noted:
        again = f"uuv-marl train --resume --output {shlex.quote(str(output))}"
        if any((output / "checkpoints").glob("[0-9]*[0-9]")):
            rest = f"The last checkpoint is in {output}; {again} continues."
        elif (output / "config.json").exists():
            rest = f"There is no checkpoint yet: {again} starts again."
        else:
            rest = "Nothing was written yet; the same command starts again."
        say(f"Stopped. {rest}")
        raise typer.Exit(130)
