"""``uuv-marl train``: a command for each library."""

import signal
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from uuv_marl.cli.console import console, explained, extra, progress_bar, shown
from uuv_marl.cli.train_options import (
    Changes,
    Command,
    Device,
    Length,
    Network,
    Output,
    Recipe,
    Resume,
    Reward,
    Scenario,
    Seed,
    Sees,
    Sizes,
    Start,
    Task,
    Vehicles,
    alone,
    whole_numbers,
)

_BESIDE_RECIPE = ("seed", "steps", "device", "output", "resume")
"""Options that a recipe leaves open."""
app = typer.Typer(help="Train a policy; each command is named after its library.", no_args_is_help=True)


@app.command("mappo", cls=Command)
def train_mappo(
    context: typer.Context,
    recipe: Recipe = None,
    scenario: Scenario = "random_field",
    num_vehicles: Vehicles = None,
    sizes: Sizes = None,
    overrides: Changes = None,
    reward: Reward = None,
    network: Network = None,
    sees: Sees = "percept",
    steps: Length = None,
    seed: Seed = 0,
    start: Start = None,
    device: Device = "cpu",
    noise: Annotated[
        tuple[float, float] | None,
        typer.Option(
            min=1e-3, max=10.0, help="Noise of actions at the start and at the end [full force]. Default: 0.4 0.08."
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

    Vehicles decide every 0.5 s, with yaw damping, whatever the scenario says. Noise and rates fall over --steps. This
    needs the extra "train". It writes config.json (settings, seeds, versions), progress.csv (a row per iteration),
    checkpoints/, tensorboard/ and best/: the policy that was best on validation seeds, or the last if the recipe says
    so. Compare it with uuv-marl benchmark --policy FOLDER/best. Ctrl-C stops the training after the current iteration,
    with a checkpoint; the same command with --resume continues exactly. A killed training leaves its last checkpoint,
    which is written every 20 iterations. With --resume and more --steps a finished training continues with its last
    noise and rates.

    Example: uuv-marl train mappo --scenario starter --steps 2e6 --output runs/starter
    """
    with explained():
        with extra("train", "training with MAPPO"):
            from uuv_marl.train.mappo import Hyperparameters

        alone(context, "recipe", _BESIDE_RECIPE)
        if recipe is not None:
            from uuv_marl.train.recipe import load_recipe

            _train(output, resume, load_recipe(recipe).settings(seed), steps, device)
            return
        given = {"noise": noise, "learning_rate": rate, "hidden": whole_numbers("--network", network)}
        try:
            algorithm = replace(Hyperparameters(), **{name: value for name, value in given.items() if value})
        except ValueError as error:
            raise typer.BadParameter(str(error)) from None
        task = Task(scenario, num_vehicles, sizes, overrides, reward, sees, seed, start)
        _train(output, resume, task.settings(algorithm), steps, device)


def _train(output: Path, resume: bool, settings: Any, steps: int | None, device: str) -> None:
    """Train, and show how it goes.

    Args:
        output: folder of the training.
        resume: go on with it.
        settings: of the training.
        steps: agent-steps in all; None for those of the settings, or at a resume those of before.
        device: where networks and batches are.
    """
    from uuv_marl.train.folder import steps_before
    from uuv_marl.train.training import train

    _check_device(device)
    chosen = replace(settings, steps=steps or (steps_before(output) if resume else 0) or settings.steps)
    texts = {
        "reward": "reward {reward:.3f}",
        "score": "validation: score {score:z.3f} (best {best:z.3f}), arrived {arrived:.0%}, collisions {collisions}",
    }
    with _stoppable(output) as stop:
        records = train(output, chosen, resume=resume, device=device, say=console.print, stop=stop)
        last = _follow(records, chosen.steps, texts)
    console.print(f"Done: {last}. Policy: {output}/best   progress: {output}/progress.csv")


def _check_device(device: str) -> None:
    """Refuse what torch can't compute on here."""
    import torch

    try:
        torch.zeros(1, device=device)
    except (RuntimeError, AssertionError) as error:
        reason = str(error).splitlines()[0]
        raise typer.BadParameter(
            f"--device {device} can't be used: {reason}; give cpu, or install a torch that can"
        ) from None


def _follow(records: Iterator[Any], steps: int, texts: Mapping[str, str]) -> str:
    """Show a training in a bar, with a text for each field that was known so far; how it stood at last."""
    last, known = "no iteration was needed, because all --steps are done already", {}
    with progress_bar() as bar:
        report = shown(bar, "starting", steps)
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
            rest = f"The last checkpoint is in {output}; the same command with --resume continues."
        elif (output / "config.json").exists():
            rest = f"There is no checkpoint yet, only settings in {output}; give the command with --resume."
        else:
            rest = "Nothing was written yet; the same command begins again."
        console.print(f"Stopped. {rest}")
        raise typer.Exit(130)
