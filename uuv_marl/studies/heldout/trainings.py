"""Trainings on disk, as ``uuv-marl train mappo`` and ``train ppo`` leave them: one folder for each seed."""

import csv
import json
from pathlib import Path
from typing import NamedTuple

from uuv_marl.benchmark.results import ResultsError


class Validation(NamedTuple):
    """One validation of a training."""

    agent_steps: int
    seconds: float
    """Of training and validation until then."""
    score: float
    arrived: float


class Trained(NamedTuple):
    """One training."""

    algorithm: str
    seed: int
    policy: Path
    """The checkpoint that did best on validation."""
    validations: tuple[Validation, ...]

    @property
    def best(self) -> Validation:
        """The validation of the policy."""
        return max(self.validations, key=lambda v: v.score)


def find_trainings(folder: Path) -> list[Trained]:
    """The trainings in ``folder/*``, by algorithm and seed. Raises ResultsError where there is none."""
    read = [_read(path.parent) for path in folder.glob("*/config.json") if (path.parent / "best").is_dir()]
    found = [one for one in read if one.validations]
    if not found:
        raise ResultsError(
            f"{folder} holds no trainings with a best policy; give a folder of outputs of uuv-marl train"
        )
    return sorted(found, key=lambda one: (one.algorithm, one.seed))


def _read(folder: Path) -> Trained:
    settings = json.loads((folder / "config.json").read_text(encoding="utf-8"))["settings"]
    with (folder / "progress.csv").open(newline="", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["score"]]
    validations = tuple(
        Validation(int(row["agent_steps"]), float(row["seconds"]), float(row["score"]), float(row["arrived"]))
        for row in rows
    )
    return Trained(settings["algorithm"]["name"], int(settings["seed"]), folder / "best", validations)
