"""``python -m research.tasks.failures``: how the vehicles of a task fail, counted and drawn."""

# pyright: reportUnknownMemberType=false
# Matplotlib leaves the types of its keyword arguments open.

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
import typer
from matplotlib.axes import Axes
from numpy.typing import NDArray

from research import FOLDER
from research.episodes import Row, read_rows, select, short, write_rows
from research.tasks.studies import SEEDS, STUDIES
from uuv_marl.baselines import with_policy_requirements
from uuv_marl.benchmark.evaluate import episodes
from uuv_marl.benchmark.style import GREY, ORANGE, SKY, draw_map, house_style, legend, panels, save
from uuv_marl.benchmark.tables import markdown_table
from uuv_marl.cli.console import console, explained, path_option
from uuv_marl.errors import ResultsError
from uuv_marl.replay.events import events_of
from uuv_marl.scenario import load_scenario
from uuv_marl.sim.swarm import Swarm
from uuv_marl.tasks import Task
from uuv_marl.types import Bool, Float32, Float64

ROWS = Path(__file__).with_name("failures.csv")
"""The rows of the pages."""
FIRST, NUM_SHOWN = 30_000, 3
"""First seed; ways in the picture."""
_STILL_M, _LATE = 40.0, 2.0 / 3.0
"""A vehicle remains in one place if it is so near its last position from this share of its episode on. Assumed."""
_DETOUR_M = 20.0
"""Distance to move back from the goal for a detour [m]. Assumed."""
_COLLISIONS = {"obstacle": "collides with an obstacle", "collision": "collides with a vehicle"}
"""Ways by the kind of a replay's event."""
_TARGETS, _INFORMED = "silent_targets", "few_informed"
app = typer.Typer(add_completion=False)


class Episode(NamedTuple):
    """What is recorded of an episode; positions are north and east [m]."""

    position: Float64
    """Shape (time, vehicle, 2)."""
    away: Float64
    """Distance to the reference [m], shape (time, vehicle)."""
    targets: Float64
    """Positions of the obstacles, shape (time, obstacle, 2)."""
    collided: Mapping[int, str]
    """What the first collision of a vehicle is with, of ``_COLLISIONS``, by its index."""
    counts: Bool
    """Vehicles whose success the task's main metric counts, shape (vehicle,)."""
    swarm: Swarm
    """At the episode's end."""

    @property
    def half(self) -> int:
        """Number of decisions in the last half."""
        return (len(self.position) - 1) // 2

    @property
    def units(self) -> int:
        """Number of vehicles that count; in ``silent_targets`` of decisions of the last half, for each target."""
        targets = self.swarm.scenario.task.name == _TARGETS
        return self.half * self.targets.shape[1] if targets else int(self.counts.sum())


class Recorder:
    """A ``watch`` of the evaluation that keeps the samples of one world."""

    def __init__(self) -> None:
        self._samples: list[tuple[NDArray[Any] | float, ...]] = []
        self.swarm: Swarm

    def __call__(self, swarm: Swarm, _action: Float32 | None) -> None:
        """Record a sample."""
        self.swarm, facts, state = swarm, swarm.facts, swarm.state
        self._samples.append((
            state.eta[0, :, :2].copy(), facts.away[0].copy(), swarm.world_map.obstacles[0, :, :2].copy(),
            float(facts.time_s[0]), state.alive[0].copy(), facts.vehicle_collisions[0].copy(),
            facts.spacing[0].copy(), facts.clearance[0].copy(),
        ))  # fmt: skip

    def episode(self) -> Episode:
        """The episode that has ended."""
        arrays: list[Any] = [np.array(values) for values in zip(*self._samples, strict=True)]
        position, away, targets, time_s, alive, collisions, spacing, clearance = arrays
        collided: dict[int, str] = {}
        for event in events_of(self.swarm.scenario, time_s, alive, collisions, spacing, clearance, None):
            for k in event.vehicles if event.kind in _COLLISIONS else ():
                collided.setdefault(k, _COLLISIONS[event.kind])
        informed = self.swarm.world_map.informed[0]
        counts = ~informed if self.swarm.scenario.task.name == _INFORMED else np.ones_like(informed)
        return Episode(position, away, targets, collided, counts, self.swarm)


def run_one(policy: str, task: str, seed: int) -> Episode:
    """An episode of a policy on a task's medium tier."""
    recorder = Recorder()
    for _ in episodes(with_policy_requirements(policy, load_scenario(task)), policy, [seed], recorder):
        pass
    return recorder.episode()


def ways(episode: Episode) -> Iterator[tuple[str, int]]:
    """How each vehicle fails, with its index; in ``silent_targets`` each decision at which a target is not held."""
    if episode.swarm.scenario.task.name == _TARGETS:
        yield from _not_held(episode)
        return
    for k in np.flatnonzero(episode.counts & ~episode.swarm.task.succeeded()[0]).tolist():
        yield episode.collided.get(k) or _out_of_time(episode, k), k


def _out_of_time(episode: Episode, k: int) -> str:
    """Why a vehicle without a collision does not succeed."""
    position, away, swarm = episode.position[:, k], episode.away[:, k], episode.swarm
    if swarm.scenario.task.name == _INFORMED:
        apart = np.linalg.norm(episode.position[-1, swarm.world_map.informed[0]] - position[-1], axis=1)
        if apart.min() > max(array.range_m for array in swarm.scenario.sonar.arrays):
            return "ends without an informed vehicle in range"
    late = position[int(_LATE * (len(position) - 1)) :]
    if np.linalg.norm(late - position[-1], axis=1).max() <= _STILL_M:
        return f"remains within {_STILL_M:.0f} m of a place"
    if not _follows(swarm) and (away - np.minimum.accumulate(away)).max() > _DETOUR_M:
        return "runs out of time after a detour"
    return "runs out of time"


def _follows(swarm: Swarm) -> bool:
    """Whether the reference is l(t), and not a goal at rest."""
    return swarm.task.reference_label == Task.reference_label


def _not_held(episode: Episode) -> Iterator[tuple[str, int]]:
    scenario, half = episode.swarm.scenario, episode.half
    sensing = max(array.range_m for array in scenario.sonar.arrays if array.kind == "active")
    away = np.linalg.norm(episode.position[:, :, None] - episode.targets[:, None], axis=3).min(axis=1)
    held = away <= scenario.task_numbers.held_m
    found = np.logical_or.accumulate(held)
    for t, k in np.argwhere(~held[-half:]) - [half, 0]:
        near = "in" if away[t, k] <= sensing else "out of"
        yield f"{'lost' if found[t, k] else 'not found yet'}, {near} sonar range", int(k)


def count(policy: str, task: str, seeds: Sequence[int]) -> list[Row]:
    """A row for each way to fail, the commonest first, with its first example: seed, and index of vehicle or target."""
    counts, first, total = Counter[str](), dict[str, tuple[int, int]](), 0
    for seed in seeds:
        episode = run_one(policy, task, seed)
        total += episode.units
        for way, k in ways(episode):
            counts[way] += 1
            first.setdefault(way, (seed, k))
    return [
        {
            "task": task, "policy": policy, "of": str(total), "way": way, "count": str(number),
            **dict(zip(("seed", "index"), map(str, first[way]), strict=True)),
        }
        for way, number in counts.most_common()
    ]  # fmt: skip


def table(rows: Sequence[Row], task: str) -> str:
    """The page's table: each way's share, for each policy."""
    mine = select(rows, task=task)
    policies = list(dict.fromkeys(row["policy"] for row in mine))
    share = {(row["way"], row["policy"]): short(int(row["count"]) / int(row["of"])) for row in mine}
    lines = [
        [way, *(share.get((way, policy), ".00") for policy in policies)]
        for way in dict.fromkeys(row["way"] for row in mine)
    ]
    return markdown_table(["", *policies], lines)


def draw(rows: Sequence[Row], task: str, path: Path) -> None:
    """Draw the first example of the commonest ways of the task's first policy."""
    policy = STUDIES[task].failures[0]
    with house_style():
        shown = select(rows, task=task, policy=policy)[:NUM_SHOWN]
        figure, axes = panels(len(shown), len(shown), (4.4, 4.6))
        for ax, row in zip(axes, shown, strict=True):
            _example(ax, run_one(policy, task, int(row["seed"])), int(row["index"]))
            ax.set_title(f"{row['way']}\n{policy}, seed {row['seed']}")
            ax.set(xlabel="east [m]", ylabel="north [m]")
        save(legend(figure, columns=2 * len(shown)), path)


def _example(ax: Axes, episode: Episode, index: int) -> None:
    """All trajectories, those of what fails in orange; targets move."""
    swarm, targets = episode.swarm, episode.swarm.scenario.task.name == _TARGETS
    if not targets:
        corners = swarm.world_map.waypoints[0, swarm.world_map.group[0, index], : int(swarm.world_map.last[0, 0]) + 1]
        discs = swarm.world_map.obstacles[0, : int(swarm.world_map.num_obstacles[0]), [1, 0, 2]].T
        draw_map(ax, corners[0 if _follows(swarm) else -1 :, ::-1], discs)
    drawn = [(episode.position, GREY, "vehicles"), *([(episode.targets, SKY, "targets")] if targets else [])]
    for moved, colour, label in drawn:
        ax.plot(*np.moveaxis(moved[:, :, ::-1], 2, 0), color=colour, linewidth=0.8)[0].set_label(label)
    route = (episode.targets if targets else episode.position)[:, index, ::-1]
    label = "target" if targets else "vehicle"
    ax.plot(*route.T, color=ORANGE, linewidth=1.5, label=f"{label} of this failure")
    ax.plot(*route[-1], "X", color=ORANGE, ms=8, mec="white", zorder=7, ls="", label="its end")
    ax.set_aspect("equal", adjustable="datalim")


@app.command()
def main(
    task: Annotated[str, typer.Argument(help=f"One of {', '.join(STUDIES)}.")],
    seeds: Annotated[int, typer.Option(min=1, max=10_000, help="Number of episodes.")] = SEEDS,
    output: Annotated[Path, path_option("Folder of failures.csv and the picture.")] = Path("results/failures"),
) -> None:
    """Count how the vehicles of a task fail, with its network and its best controller, and draw the commonest ways.

    The rows of other tasks in failures.csv are kept. The page of the task has the table.

    Example: python -m research.tasks.failures hard_water --seeds 10
    """
    with explained(FOLDER):
        if task not in STUDIES:
            raise ResultsError(f"task must be one of {', '.join(STUDIES)}, got {task!r}")
        path = output / "failures.csv"
        rows = [row for row in (read_rows(path) if path.exists() else []) if row["task"] != task]
        for policy in STUDIES[task].failures:
            rows += count(policy, task, range(FIRST, FIRST + seeds))
        if not select(rows, task=task, policy=STUDIES[task].failures[0]):
            raise ResultsError(f"{STUDIES[task].failures[0]} fails in none of {seeds} episodes; raise --seeds")
        write_rows(path, rows)
        draw(rows, task, output / f"{task}_failures.png")
        console.print(table(rows, task), highlight=False)


if __name__ == "__main__":
    app()
