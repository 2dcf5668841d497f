"""``uuv-marl train``: from a recipe and what differs from it to a policy."""

import re
import signal
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer

from uuv_marl.cli.console import (
    changes_of,
    console,
    explained,
    extra,
    find_modules,
    path_option,
    progress_bar,
    progress_line,
)


def _whole_number(text: str) -> int:
    """A number such as 3000000 or 3e6."""
    if not re.fullmatch(r"[1-9]\d{0,14}|[1-9](\.\d+)?e\d{1,2}", str(text)):
        raise typer.BadParameter(f"{text!r} is no whole number from 1 on; give a number such as 3000000 or 3e6")
    return int(float(text))


def train_command(
    context: typer.Context,
    recipe: Annotated[
        str,
        typer.Argument(help="mappo, trimmed_scout, or a TOML file with fields of uuv_marl.train.training.Training."),
    ] = "mappo",
    scenario: Annotated[str | None, typer.Option(help="Name or TOML file, in place of the recipe's.")] = None,
    overrides: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="FIELD=VALUE",
            help="Change a field of the training, such as `sizes=[5,10]`, `reward=mine:reward` or `mappo.gamma=0.99`, "
            "or of the scenario, such as `sonar.echo_reports=surface`.",
        ),
    ] = None,
    steps: Annotated[
        int | None,
        typer.Option(
            parser=_whole_number,
            metavar="NUMBER",
            help="Agent-steps in all, such as 3e6: decisions times vehicles. With --resume, more prolong the training.",
        ),
    ] = None,
    seed: Annotated[
        int | None, typer.Option(min=0, help="Seed of worlds, weights and noise. It fixes the training.")
    ] = None,
    output: Annotated[Path, path_option("Folder for the training's description, progress and checkpoints.")] = Path(
        "runs/train"
    ),
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on from the folder's last checkpoint; only --steps may stand beside.")
    ] = False,
) -> None:
    """Train one policy for all vehicles with MAPPO, on one core.

    The recipe says all of a training; the options change it. Vehicles decide every 0.5 s, with yaw damping, unless you
    set other values. This needs the extra "train". It writes config.json (the training, versions), progress.csv (a row
    per iteration), checkpoints/, tensorboard/ and best/: the policy that was best on validation seeds, or the last if
    the recipe says so. Compare it with uuv-marl benchmark --policy FOLDER/best. Ctrl-C stops the training after the
    current iteration, with a checkpoint; with --resume it continues exactly. A killed training leaves its last
    checkpoint, which is written every 20 iterations. With --resume and more --steps a finished training continues with
    its last noise and rates.

    Example: uuv-marl train --scenario starter --steps 2e6 --output runs/starter
    """
    with explained():
        with extra("train", "training"):
            from uuv_marl.train import run
        from uuv_marl.train.folder import TrainingFolder
        from uuv_marl.train.training import Training, changed_fields, read_recipe

        find_modules([scenario or "", recipe, *(overrides or [])])
        if resume:
            _alone(context)
            folder = TrainingFolder(output, None)
            training, until = folder.training, steps or folder.until
        else:
            named = {"scenario": scenario, "steps": steps, "seed": seed}
            changes = {name: value for name, value in named.items() if value is not None}
            training = Training(**changed_fields(read_recipe(recipe), {**changes_of(overrides or []), **changes}))
            until = training.steps
        texts = {
            "reward": "reward {reward:.3f}",
            "score": "validation: score {score:z.3f} (best {best:z.3f}), arrived {arrived:.0%}, "
            "collisions {collisions}",
        }
        with _stoppable(output) as stop:
            told: Any = {"say": console.print, "stop": stop}
            records = run.resume(output, until, **told) if resume else run.train(output, training, **told)
            last = _follow(records, until, texts)
        console.print(f"Done: {last}. Policy: {output}/best   progress: {output}/progress.csv")


def _alone(context: typer.Context) -> None:
    """Refuse what the folder says already."""
    for name, value in context.params.items():
        source = context.get_parameter_source(name)
        if name not in ("resume", "output", "steps") and source is not None and source.name == "COMMANDLINE":
            raise typer.BadParameter(f"--resume goes on with the training that the folder holds; leave out {value}")


def _follow(records: Iterator[Any], steps: int, texts: Mapping[str, str]) -> str:
    """Show a training in a bar, with a text for each field that was known so far; how it stood at last."""
    last, known = "no iteration was needed, because all --steps are done already", {}
    with progress_bar() as bar:
        report = progress_line(bar, "starting", steps)
        for record in records:
            known |= {name: value for name, value in record._asdict().items() if value is not None}
            told = [text.format(**known) for name, text in texts.items() if name in known]
            last = ", ".join([f"{record.agent_steps / record.seconds:,.0f} agent-steps/s", *told])
            report(record.agent_steps, last)
    return last


@contextmanager
def _stoppable(output: Path) -> Iterator[Callable[[], bool]]:
    """Gives whether the block is to stop: the first Ctrl-C is only noted, and the second ends the block at once."""
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
        if any((output / "checkpoints").glob("[0-9]*[0-9]")):
            rest = f"The last checkpoint is in {output}; uuv-marl train --resume --output {output} continues."
        elif (output / "config.json").exists():
            rest = f"There is no checkpoint yet: uuv-marl train --resume --output {output} begins again."
        else:
            rest = "Nothing was written yet; the same command begins again."
        console.print(f"Stopped. {rest}")
        raise typer.Exit(130)
