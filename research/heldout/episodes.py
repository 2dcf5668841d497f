"""Episodes as rows: what the page and the files are made of."""

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import TypeAdapter

from research.heldout.trainings import Trained
from uuv_marl.benchmark.metrics import Metrics
from uuv_marl.benchmark.suite import Case, Suite


class Episode(NamedTuple):
    """One episode; lengths in m, times in s, None where there is nothing to measure."""

    set: str
    policy: str
    training_seed: int | None
    """Seed of the training; None for a policy that ships."""
    seed: int
    duration_s: float
    """What l(t) takes."""
    limit_s: float
    """When an episode ends at the latest."""
    task_time_s: float | None
    """None where the swarm did not arrive."""
    collisions: int
    min_obstacle_distance_m: float | None
    min_spacing_m: float | None
    mean_min_spacing_m: float | None
    within_eq7: float
    """Share of the time in which all three bounds of Eq. 7 hold."""
    centre_error_m: float | None
    effort: float
    """Mean squared action, share of full force."""
    clamps: int
    """How often a numerical bound of a policy bound."""

    @property
    def arrived(self) -> bool:
        """Whether the swarm did."""
        return self.task_time_s is not None

    @property
    def succeeded(self) -> bool:
        """Arrived, and nobody touched anything."""
        return self.arrived and not self.collisions

    @property
    def time_s(self) -> float:
        """The task time, or the limit where the swarm does not arrive: a mean over all episodes leaves out none."""
        return self.limit_s if self.task_time_s is None else self.task_time_s

    @property
    def efficiency(self) -> float:
        """l(t)'s time over the task's, 0 where the swarm does not arrive."""
        return 0.0 if self.task_time_s is None else self.duration_s / self.task_time_s


class ByPolicy:
    """Episodes of all sets and policies, sorted once, since a page asks for those of a policy thousands of times.

    Args:
        episodes: in any order.
    """

    def __init__(self, episodes: Iterable[Episode]) -> None:
        self._found: dict[tuple[str, str, int | None], list[Episode]] = {}
        for e in sorted(episodes, key=lambda e: e.seed):
            self._found.setdefault((e.set, e.policy, e.training_seed), []).append(e)

    def select(self, name: str, policy: str, training_seed: int | None = None) -> list[Episode]:
        """A policy's episodes of a set, by seed; none if it was not run there.

        Args:
            name: of the set.
            policy: its name.
            training_seed: which of its trainings; None for the policy of that name that ships.
        """
        return self._found.get((name, policy, training_seed), [])


def measured(episodes: Sequence[Episode], name: str) -> list[float]:
    """What was measured of a field, one value for each episode that has one."""
    return [value for e in episodes if (value := getattr(e, name)) is not None]


def episodes_of(suite: Suite, cases: Sequence[Case], trained: Sequence[Trained]) -> list[Episode]:
    """The episodes of these cases, by set in their order, policy and seed; not what else the suite's folder holds."""
    trainings = {str(one.policy): (one.algorithm, one.seed) for one in trained}
    sets = list(dict.fromkeys(case.name for case in cases))
    rows: list[Episode] = []
    for case in sorted(cases, key=lambda case: (sets.index(case.name), case.policy)):
        scenario, (policy, training_seed) = case.load(), trainings.get(case.policy, (case.policy, None))
        for row in suite.results(case).select(scenario.name, case.policy, suite.seeds_of(case)):
            limit_s = scenario.time_limit.of(row.metrics["duration_s"])
            rows.append(episode_of(case.name, policy, training_seed, row.seed, limit_s, row.metrics))
    return rows


def episode_of(
    name: str, policy: str, training_seed: int | None, seed: int, limit_s: float, metrics: Metrics
) -> Episode:
    """The row of a run.

    Args:
        name: of the set.
        policy: its name.
        training_seed: of its training; None for a policy that ships.
        seed: of the run.
        limit_s: when the episode ends at the latest.
        metrics: of the run.
    """
    values: dict[str, Any] = {**metrics, "within_eq7": metrics["constraint_share"]["all"], "limit_s": limit_s}
    fields = {field: values[field] for field in Episode._fields if field in values}
    return Episode(set=name, policy=policy, training_seed=training_seed, seed=seed, **fields)


def written(episode: Episode) -> list[str]:
    """An episode's cells in the file: lengths and times to a millimetre and a millisecond, nothing for None."""
    return ["" if v is None else f"{v:.3f}" if isinstance(v, float) else str(v) for v in episode]


def write_episodes(episodes: Iterable[Episode], path: Path) -> None:
    """Write the episodes as CSV, a line for each."""
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(Episode._fields)
        table.writerows(map(written, episodes))


def read_episodes(path: Path) -> list[Episode]:
    """What ``write_episodes`` wrote."""
    with path.open(newline="", encoding="utf-8") as file:
        rows = [{name: text or None for name, text in row.items()} for row in csv.DictReader(file)]
    return TypeAdapter(list[Episode]).validate_python(rows)
