"""The options of ``uuv-marl train``, which its commands share, and what they say of the task."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import typer
from typer.core import TyperCommand

from uuv_marl.cli.console import changes_of, find_modules, path_option


def whole_number(text: str) -> int:
    """A number such as 3000000 or 3e6."""
    if not re.fullmatch(r"[1-9]\d{0,14}|[1-9](\.\d+)?e\d{1,2}", str(text)):
        raise typer.BadParameter(f"{text!r} is no whole number from 1 on; give a number such as 3000000 or 3e6")
    return int(float(text))


class Command(TyperCommand):
    """Says how an option of two values looks."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse arguments as every command does, with an example in the message."""
        try:
            return super().parse_args(ctx, args)
        except Exception as error:
            if "2 arguments" not in str(error):
                raise
            raise typer.BadParameter(
                f"{error} Give the value at the start and at the end: --noise 0.4 0.08", ctx
            ) from None


Scenario = Annotated[str, typer.Option(help="Name or TOML file.")]
Vehicles = Annotated[
    int | None,
    typer.Option(
        min=1,
        help="Vehicles of every swarm. Default: those of the scenario; if these are 54, several sizes from 10 to 100.",
    ),
]
Length = Annotated[
    int | None,
    typer.Option(
        parser=whole_number, metavar="NUMBER",
        help="Agent-steps in all, such as 3e6: decisions times vehicles. With --resume, more steps prolong the "
        "training. Default: 3e7; with --resume, the steps given before.",
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
        help="A reward of your own: a function from the swarm after a decision to an array (world, vehicle). The "
        "module may be in the current folder. Default: the reward of uuv_marl/train/shaping.py.",
    ),
]
Network = Annotated[
    str | None,
    typer.Option(metavar="UNITS,UNITS,...", help="Units of each layer, in actor and critic. Default: 96,96."),
]
Sees = Annotated[
    str,
    typer.Option(
        metavar="percept|memory",
        help="percept: the actor sees the latest percept and gives a force. memory: the actor sees what vehicles "
        "remember, and trims the gains of a law such as scout, inside the safety filter.",
    ),
]
Device = Annotated[
    str, typer.Option(help="Device of networks and batches: cpu, or cuda for a GPU. Worlds always run on the CPU.")
]
Recipe = Annotated[
    str | None,
    typer.Option(
        metavar="NAME|FILE",
        help="A file with all settings of a training: scenario, sizes, disturbances, reward and algorithm. These "
        "recipes ship: mappo_v4, also named shipped; mappo_v3; mappo_v2, and without one of its parts "
        "mappo_v2_calm, mappo_v2_one_size, mappo_v2_percept and mappo_v2_unfiltered. Only --seed, --steps, "
        "--device, --output and --resume may stand beside it.",
    ),
]
Seed = Annotated[int, typer.Option(min=0, help="Seed of worlds, weights and noise. It fixes the training.")]
Start = Annotated[
    Path | None, path_option("Start from the weights of another training: its folder best, or a checkpoint.")
]
Output = Annotated[Path, path_option("Folder for settings, progress and checkpoints.")]
Resume = Annotated[bool, typer.Option("--resume", help="Continue from the folder's last checkpoint.")]


class Task(NamedTuple):
    """What is trained on, as the options say it."""

    scenario: str
    num_vehicles: int | None
    sizes: str | None
    overrides: Sequence[str] | None
    reward: str | None
    sees: str
    seed: int
    start: Path | None

    def settings(self, algorithm: Any) -> Any:
        """The settings of a training with this algorithm."""
        from uuv_marl.train.settings import Settings, swarms_of
        from uuv_marl.train.shaping import overrides_for

        own = changes_of(self.overrides or [])
        size = {} if self.num_vehicles is None else {"swarm.num_vehicles": self.num_vehicles}
        sizes = whole_numbers("--sizes", self.sizes)
        given = {"--num-vehicles": size, "--sizes": sizes, "--set swarm.num_vehicles": "swarm.num_vehicles" in own}
        named = [name for name, value in given.items() if value]
        if len(named) > 1:
            raise typer.BadParameter(f"{' and '.join(named)} each say how many vehicles a swarm has; give one of them")
        if self.sees not in ("percept", "memory"):
            raise typer.BadParameter(f"--sees must be percept or memory, got {self.sees!r}")
        if self.reward:
            find_modules([self.reward])
        changes = overrides_for(self.scenario, {**size, **own})
        return Settings(
            scenario=self.scenario, overrides=changes, sizes=swarms_of(sizes) if sizes else (), reward=self.reward,
            sees=self.sees, seed=self.seed, start=None if self.start is None else str(self.start), algorithm=algorithm,
        )  # fmt: skip


def alone(context: typer.Context, option: str, beside: Sequence[str]) -> None:
    """Refuse other options than these beside one that says all the rest."""
    if context.params[option] is None:
        return
    for name, value in context.params.items():
        source = context.get_parameter_source(name)
        if name not in (option, *beside) and source is not None and source.name == "COMMANDLINE":
            given = next(parameter.opts[0] for parameter in context.command.params if parameter.name == name)
            raise typer.BadParameter(f"--{option} says this already; leave out {given} {value}")


def whole_numbers(option: str, text: str | None) -> tuple[int, ...]:
    """The numbers of a text such as 96,96; none where there is no text."""
    if text is None:
        return ()
    parts = text.split(",")
    if not all(re.fullmatch(r"[1-9]\d{0,5}", part) for part in parts):
        raise typer.BadParameter(f"{option} must be whole numbers from 1 on, such as 96,96; got {text!r}")
    return tuple(map(int, parts))
