"""Episodes as rows: what the page and the files are made of."""

import csv
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from uuv_marl.benchmark.metrics import Metrics
from uuv_marl.benchmark.results import Results
from uuv_marl.heldout.trainings import Trained


class Episode(NamedTuple):
    """One episode; lengths in m, times in s, None where there is nothing to measure."""

    set: str
    policy: str
    training_seed: int | None
    """Of a training; None for a policy that ships."""
    seed: int
    duration_s: float
    """What l(t) takes."""
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
    def succeeded(self) -> bool:
        """Arrived, and nobody touched anything."""
        return self.task_time_s is not None and not self.collisions


def episodes_of(results: Mapping[str, Results], trained: Sequence[Trained]) -> list[Episode]:
    """All that the results hold, in their order."""
    labels = {str(one.policy): one for one in trained}
    rows: list[Episode] = []
    for name, kept in results.items():
        for row in sorted(kept.rows, key=lambda row: (row.policy, row.seed)):
            one = labels.get(row.policy)
            policy, seed = (one.algorithm, one.seed) if one else (row.policy, None)
            rows.append(_episode(name, policy, seed, row.seed, row.metrics))
    return rows


def _episode(name: str, policy: str, training_seed: int | None, seed: int, metrics: Metrics) -> Episode:
    shares = metrics["constraint_share"]
    return Episode(
        set=name,
        policy=policy,
        training_seed=training_seed,
        seed=seed,
        duration_s=_number(metrics, "duration_s") or 0.0,
        task_time_s=_number(metrics, "task_time_s"),
        collisions=int(_number(metrics, "collisions") or 0),
        min_obstacle_distance_m=_number(metrics, "min_obstacle_distance_m"),
        min_spacing_m=_number(metrics, "min_spacing_m"),
        mean_min_spacing_m=_number(metrics, "mean_min_spacing_m"),
        within_eq7=shares["all"] if isinstance(shares, dict) else 0.0,
        centre_error_m=_number(metrics, "centre_error_m"),
        effort=_number(metrics, "effort") or 0.0,
        clamps=int(_number(metrics, "clamps") or 0),
    )


def _number(metrics: Metrics, name: str) -> float | None:
    value = metrics[name]
    return None if value is None or isinstance(value, dict) else float(value)


def write_episodes(episodes: Iterable[Episode], path: Path) -> None:
    """As CSV, lengths and times to a millimetre and a millisecond."""
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(Episode._fields)
        for episode in episodes:
            table.writerow(["" if v is None else f"{v:.3f}" if isinstance(v, float) else v for v in episode])


def read_episodes(path: Path) -> list[Episode]:
    """What ``write_episodes`` wrote."""
    with path.open(newline="", encoding="utf-8") as file:
        return [_parsed(row) for row in csv.DictReader(file)]


def _parsed(row: Mapping[str, str]) -> Episode:
    def number(name: str) -> float | None:
        return float(row[name]) if row[name] else None

    return Episode(
        set=row["set"],
        policy=row["policy"],
        training_seed=int(row["training_seed"]) if row["training_seed"] else None,
        seed=int(row["seed"]),
        duration_s=float(row["duration_s"]),
        task_time_s=number("task_time_s"),
        collisions=int(row["collisions"]),
        min_obstacle_distance_m=number("min_obstacle_distance_m"),
        min_spacing_m=number("min_spacing_m"),
        mean_min_spacing_m=number("mean_min_spacing_m"),
        within_eq7=float(row["within_eq7"]),
        centre_error_m=number("centre_error_m"),
        effort=float(row["effort"]),
        clamps=int(row["clamps"]),
    )
