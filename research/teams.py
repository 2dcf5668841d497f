"""``python -m research.teams``: swarms of a network in which a share of the vehicles runs another policy.

It writes the counts of each swarm and the picture of docs/policies.md, and prints the page's table.
"""

# pyright: reportUnknownMemberType=false
# Matplotlib leaves the types of its keyword arguments open.

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from matplotlib.ticker import PercentFormatter

from research.episodes import Row, read_rows, short, write_rows
from research.second import runnable
from uuv_marl.baselines import with_policy_requirements
from uuv_marl.baselines.team_names import parse_team
from uuv_marl.benchmark.evaluate import episodes
from uuv_marl.benchmark.style import BLUE, GREEN, ORANGE, house_style, legend, panels, save
from uuv_marl.benchmark.tables import markdown_table
from uuv_marl.cli.console import explained
from uuv_marl.errors import PolicyError
from uuv_marl.scenario import load_scenario
from uuv_marl.sim.swarm import Swarm
from uuv_marl.types import Bool, Float32

FIRST, EPISODES = 30_000, 100
SCENARIO, LEARNED = "hard_water", "mappo_hard_water"
OTHERS = {"mappo_hard_water_2": GREEN, "tangent_bug": BLUE, "random": ORANGE}
"""Policies of the other vehicles, and their colours."""
PERCENTS = (0, 25, 50, 75, 100)
KINDS, OUTCOMES = ("other", "learned"), ("vehicles", "succeeded", "collided")


class Outcomes:
    """A ``watch`` of the evaluation: vehicles that succeed and that have collided, shape (2, vehicle), by seed."""

    def __init__(self) -> None:
        self.by_seed: dict[int, Bool] = {}

    def __call__(self, swarm: Swarm, _action: Float32 | None) -> None:
        """Note the present ones; a world whose episode has ended keeps its state."""
        now = np.stack([swarm.task.succeeded(), swarm.state.collided])
        for w, seed in enumerate(swarm.percept.clock.seed if swarm.percept.clock else ()):
            self.by_seed[int(seed)] = now[:, w]


def counts(other: str, percent: int, seeds: Sequence[int]) -> dict[str, str]:
    """Counts over episodes in which a share of the vehicles runs another policy than the rest."""
    name = f"{runnable(other)}@{percent}%+{LEARNED}"
    team, watch, scenario = parse_team(name), Outcomes(), load_scenario(SCENARIO)
    if team is None:
        raise PolicyError(f"{name!r} is not a team")
    runs = [*episodes(with_policy_requirements(name, scenario), name, seeds, watch)]
    sums = np.zeros((len(KINDS), len(OUTCOMES)), np.int64)
    for seed, (succeeded, collided) in watch.by_seed.items():
        kind = team.assigned(scenario.swarm.num_vehicles, seed)
        for k in range(len(KINDS)):
            sums[k] += (kind == k).sum(), succeeded[kind == k].sum(), collided[kind == k].sum()
    cells = {f"{kind}_{what}": str(sums[k, m]) for k, kind in enumerate(KINDS) for m, what in enumerate(OUTCOMES)}
    swarms = sum(run.metrics.get("task", {})["swarm_success"] == 1.0 for run in runs)
    return {"other": other, "percent": str(percent), "episodes": str(len(runs)), "swarm_success": str(swarms), **cells}


def share(row: Row, kind: str, outcome: str) -> float:
    """Share of the vehicles of a kind with an outcome; NaN without such vehicles."""
    vehicles = int(row[f"{kind}_vehicles"])
    return int(row[f"{kind}_{outcome}"]) / vehicles if vehicles else np.nan


def draw(rows: Sequence[Row], path: Path) -> None:
    """Draw the shares of both kinds of vehicles that succeed and collide."""
    titles = {"succeeded": "vehicles that succeed", "collided": "vehicles that collide"}
    with house_style():
        figure, axes = panels(2, 2, (4.6, 3.6))
        for ax, (outcome, title) in zip(axes, titles.items(), strict=True):
            for other, colour in OTHERS.items():
                mine = [row for row in rows if row["other"] == other]
                x = [int(row["percent"]) / 100.0 for row in mine]
                for kind, line, label in (("learned", "o-", f"{LEARNED} among {other}"), ("other", "s:", other)):
                    ax.plot(x, [share(row, kind, outcome) for row in mine], line, color=colour, label=label)
            ax.set(xlabel="vehicles that run the other policy", ylabel=title, ylim=(-0.02, 1.02))
            ax.set_xticks([percent / 100.0 for percent in PERCENTS])
            for axis in (ax.xaxis, ax.yaxis):
                axis.set_major_formatter(PercentFormatter(1.0))
        save(legend(figure, columns=3), path)


def table(rows: Sequence[Row]) -> str:
    """The page's table: success and collisions of both kinds by share, and swarm success."""
    lines: list[list[str]] = []
    for other in OTHERS:
        mine: Mapping[int, Row] = {int(row["percent"]): row for row in rows if row["other"] == other}
        for kind, name in (("learned", LEARNED), ("other", other)):
            pairs = [[share(mine[p], kind, outcome) for outcome in OUTCOMES[1:]] for p in PERCENTS]
            values = ("" if np.isnan(pair[0]) else ", ".join(map(short, pair)) for pair in pairs)
            lines.append([f"`{other}`" if kind == "learned" else "", f"`{name}`", *values])
        swarms = (short(int(mine[p]["swarm_success"]) / int(mine[p]["episodes"])) for p in PERCENTS)
        lines.append(["", "swarm success", *swarms])
    return markdown_table(["others", "success, collided", *(f"{p} % others" for p in PERCENTS)], lines)


def main(
    output: Annotated[Path, typer.Option(help="Folder of teams.csv and teams.png.")] = Path("results/teams"),
) -> None:
    """Run what is missing in teams.csv, then write the picture and print the table."""
    path = output / "teams.csv"
    rows = read_rows(path) if path.exists() else []
    with explained():
        for other in OTHERS:
            for percent in PERCENTS:
                if not any(row["other"] == other and row["percent"] == str(percent) for row in rows):
                    rows.append(counts(other, percent, range(FIRST, FIRST + EPISODES)))
                    write_rows(path, rows)
        draw(rows, output / "teams.png")
        typer.echo(table(rows))


if __name__ == "__main__":
    typer.run(main)
