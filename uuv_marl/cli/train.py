"""``uuv-marl train``: train a policy on a scenario or from a recipe."""

import shlex
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer

from uuv_marl.cli.console import (
    console,
    explained,
    extra,
    find_modules,
    overridden,
    overrides_option,
    path_option,
    progress_bar,
    progress_line,
    say,
)  # fmt: skip

_SUMMARY = "swarm success {swarm_success:.0%}, vehicles {share:.0%}, collisions {collisions:.1f} per episode"


def train_command(
    scenario: Annotated[
        str | None,
        typer.Argument(
            help="Name or TOML file of a scenario, or a file with fields of uuv_marl.train.training.Training. "
            "Default: starter."
        ),
    ] = None,
    overrides: Annotated[
        list[str] | None,
        overrides_option("`network.memory=true`, `critic=own` or, of the scenario, `sonar.echo_reports=surface`"),
    ] = None,
    minutes: Annotated[
        float | None, typer.Option(min=0.01, help="Processor time in all, validations apart. Default: 5.")
    ] = None,
    steps: Annotated[
        float | None,
        typer.Option(min=1, help="Instead of minutes, agent-steps in all, such as 3e6: decisions times vehicles."),
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
        from uuv_marl.train.folder import TrainingFolder
        from uuv_marl.train.training import Training, changed_fields, recipe_fields

        find_modules([":" if resume else scenario or "", *(overrides or [])])
        if resume:
            fixed = {"the scenario": scenario, "--set": overrides, "--seed": seed}
            if given := next((name for name, value in fixed.items() if value is not None), None):
                raise typer.BadParameter(f"--resume continues the training in the folder; leave out {given}")
            folder = TrainingFolder(output, None)
            training, until = folder.training, folder.budget_with(minutes, steps)
        else:
            options = {"minutes": minutes, "steps": steps, "seed": seed}
            named = [f"{name}={value}" for name, value in options.items() if value is not None]
            changes, fields = overridden([*named, *(overrides or [])]), recipe_fields(scenario or "starter")
            for name, other in (("minutes", "steps"), ("steps", "minutes")):
                if name in changes:
                    fields.pop(other, None)
            training = Training(**changed_fields(fields, changes))
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
        again = f"uuv-marl train --resume --output {shlex.quote(str(output))} continues from the last checkpoint"
        begun = (output / "config.json").exists()
        say(f"Stopped. {again if begun else 'Nothing was written yet; the same command starts again'}.")
        raise typer.Exit(130)
