"""``uuv-marl train``: a command for each library."""

import re
import signal
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import typer
from typer.core import TyperCommand

from uuv_marl.cli.console import changes_of, console, explained, extra, find_modules, progress_bar, shown

app = typer.Typer(help="Train a policy; each command is named after its library.", no_args_is_help=True)


def _whole(text: str) -> int:
    if not re.fullmatch(r"[1-9]\d{0,14}|[1-9](\.\d+)?e\d{1,2}", str(text)):
        raise typer.BadParameter(f"{text!r} is no whole number from 1 on; give for instance 3000000 or 3e6")
    return int(float(text))


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
Vehicles = Annotated[
    int | None,
    typer.Option(min=1, help="Of every swarm. Default: the scenario's; 10 to 100 at once where that has 54."),
]
Steps = Annotated[
    int,
    typer.Option(parser=_whole, metavar="NUMBER", help="Agent-steps in all, such as 3e6: decisions times vehicles."),
]
Length = Annotated[
    int | None,
    typer.Option(
        parser=_whole, metavar="NUMBER",
        help="Agent-steps in all, such as 3e6: decisions times vehicles. More at a --resume prolong the training. "
        "Default: 3e7, or at a --resume those of before.",
    ),
]  # fmt: skip
Changes = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="FIELD=VALUE", help="Override a field, such as `sonar.echo_reports=surface`."),
]
Sizes = Annotated[
    str | None, typer.Option(metavar="N,N,...", help="Train on swarms of these sizes at once, such as 5,10,20.")
]
Reward = Annotated[
    str | None,
    typer.Option(
        metavar="MODULE:FUNCTION",
        help="A reward of your own: from the swarm after a decision to an array (world, vehicle). The module is looked "
        "for in the current folder too. Default: that of uuv_marl/train/shaping.py.",
    ),
]
Network = Annotated[
    str | None,
    typer.Option(metavar="UNITS,UNITS,...", help="Layers of the actor's and of the critic's network. Default: 96,96."),
]
Sees = Annotated[
    str,
    typer.Option(
        metavar="percept|memory",
        help="What the actor sees. percept: the latest percept; it gives a force. memory: what vehicles remember; it "
        "corrects the wish of scout, inside the safety filter.",
    ),
]
Device = Annotated[
    str, typer.Option(help="Where networks and batches are: cpu, or cuda for a GPU. Worlds are on the CPU.")
]
Seed = Annotated[int, typer.Option(min=0, help="Of worlds, weights and noise: one seed, one training.")]
Start = Annotated[
    Path | None, typer.Option(help="Start from the weights of another training: its best, or a checkpoint.")
]
Output = Annotated[Path, typer.Option(help="Folder of settings, progress and checkpoint.")]
Resume = Annotated[bool, typer.Option("--resume", help="Go on from the folder's last checkpoint.")]


@app.command("mappo", cls=_Command)
def train_mappo(
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

    Vehicles decide every 0.5 s, with yaw damping, whatever the scenario says. Noise and rates anneal over --steps.
    Needs the extra "train". Writes config.json (settings, seeds, versions), progress.csv (a row per iteration),
    checkpoints/, tensorboard/ and best/, the policy that did best on validation seeds: give it to uuv-marl benchmark as
    --policy. Ctrl-C ends the training with a checkpoint after the iteration under way; the same command with --resume
    goes on exactly. A kill leaves the last checkpoint, which is written every 20 iterations. With --resume and more
    --steps a finished training goes on, too, with the last noise and rates.

    Example: uuv-marl train mappo --scenario starter --steps 2e6 --output runs/starter
    """
    with explained():
        with extra("train", "training with MAPPO"):
            from uuv_marl.train.mappo import Hyperparameters

        given = {"noise": noise, "learning_rate": rate, "hidden": _whole_numbers("--network", network)}
        try:
            algorithm = replace(Hyperparameters(), **{name: value for name, value in given.items() if value})
        except ValueError as error:
            raise typer.BadParameter(str(error)) from None
        swarms = Swarms(scenario, num_vehicles, sizes, overrides or [])
        _train(
            output,
            resume,
            swarms,
            start,
            steps,
            device,
            reward=reward,
            sees=sees,
            seed=seed,
            algorithm=algorithm,
        )


@app.command("ppo", cls=_Command)
def train_ppo(
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

        units = _whole_numbers("--network", network)
        algorithm = replace(Hyperparameters(), hidden=units or Hyperparameters.hidden)
        swarms = Swarms(scenario, num_vehicles, sizes, overrides or [])
        _train(
            output,
            resume,
            swarms,
            start,
            steps,
            device,
            reward=reward,
            sees=sees,
            seed=seed,
            algorithm=algorithm,
        )


class Swarms(NamedTuple):
    """What is trained on, as the options say it."""

    scenario: str
    num_vehicles: int | None
    sizes: str | None
    overrides: Sequence[str]

    def settings(self) -> dict[str, Any]:
        """The same, as a training's settings hold it."""
        from uuv_marl.train.training import OVERRIDES, swarms_of

        size = {} if self.num_vehicles is None else {"swarm.num_vehicles": self.num_vehicles}
        sizes = _whole_numbers("--sizes", self.sizes)
        if sizes and size:
            raise typer.BadParameter("--num-vehicles is the size of every swarm; give it or --sizes")
        changes = {**OVERRIDES, **size, **changes_of(self.overrides)}
        return {"scenario": self.scenario, "overrides": changes, "sizes": swarms_of(sizes) if sizes else ()}


def _whole_numbers(option: str, text: str | None) -> tuple[int, ...]:
    """The numbers of a text such as 96,96; none where there is no text."""
    if text is None:
        return ()
    parts = text.split(",")
    if not all(re.fullmatch(r"[1-9]\d{0,5}", part) for part in parts):
        raise typer.BadParameter(f"{option} must be whole numbers from 1 on, such as 96,96; got {text!r}")
    return tuple(map(int, parts))


def _train(
    output: Path, resume: bool, swarms: Swarms, start: Path | None, steps: int | None, device: str, **settings: Any
) -> None:
    """Train with these settings, and show how it goes.

    Args:
        output: folder of the training.
        resume: go on with it.
        swarms: what is trained on.
        start: folder of another training's weights to begin with.
        steps: agent-steps in all; None for the default, or at a resume those of before.
        device: where networks and batches are.
        settings: the other settings of the training.
    """
    from uuv_marl.train.folder import begun_with
    from uuv_marl.train.training import Settings, train

    _check_device(device)
    if settings["sees"] not in ("percept", "memory"):
        raise typer.BadParameter(f"--sees must be percept or memory, got {settings['sees']!r}")
    if settings["reward"]:
        find_modules([settings["reward"]])
    before = begun_with(output).get("steps") if resume else None
    length = steps or before or Settings.steps
    chosen = Settings(**settings, **swarms.settings(), steps=length, start=None if start is None else str(start))
    texts = {
        "reward": "reward {reward:.3f}",
        "score": "validation: score {score:.3f} (best {best:.3f}), arrived {arrived:.0%}, collisions {collisions}",
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
    last, known = "no iteration was needed: --steps are done already", {}
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
        console.print("Stopping after this iteration, with a checkpoint. Ctrl-C again stops at once, without.")

    before = signal.signal(signal.SIGINT, note)
    try:
        yield lambda: bool(noted)
    except KeyboardInterrupt:
        noted.append(signal.SIGINT)
    finally:
        signal.signal(signal.SIGINT, before)
    if noted:
        kept = any((output / "checkpoints").glob("[0-9]*[0-9]"))
        rest = "The last checkpoint is" if kept else "There is no checkpoint yet, only settings"
        console.print(f"Stopped. {rest} in {output}; the same command with --resume goes on.")
        raise typer.Exit(130)


@app.command("rllib", cls=_Command)
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
        texts = {
            "agent_steps": "{agent_steps:,} agent-steps",
            "episode_return": "last return per vehicle {episode_return:.1f}",
        }
        console.print("Starting Ray takes about 15 s.")
        with _stoppable(output) as stop:
            last = _follow(
                train(
                    output, steps, settings, num_env_runners=env_runners, address=ray, resume=resume,
                    say=console.print, stop=stop,
                ), steps, texts,
            )  # fmt: skip
        console.print(f"Done: {last}. Progress: {output}/progress.csv   checkpoint: {output}/checkpoints")
