"""Trainings on disk, as ``uuv-marl train mappo`` and ``train ppo`` leave them: one folder for each seed.

Those in the subfolder ``ablations`` are each without one part of the others; they go by their folders' names.
"""

import csv
import json
from pathlib import Path
from typing import NamedTuple

from uuv_marl.benchmark.results import ResultsError

ABLATIONS = "ablations"


class Validation(NamedTuple):
    """One validation of a training."""

    agent_steps: int
    seconds: float
    """Seconds of training and validation until then."""
    score: float
    arrived: float


class Trained(NamedTuple):
    """One training."""

    algorithm: str
    """Or the ablation's name."""
    seed: int
    policy: Path
    """The checkpoint that counts."""
    validations: tuple[Validation, ...]
    rewards: tuple[tuple[int, float], ...] = ()
    """Agent-steps until the end of each iteration, and its mean reward of a decision, with exploration noise."""
    chosen: str = "best"
    """Which policy counts: that of the best validation, or the last one."""
    ablation: bool = False

    @property
    def policy_at(self) -> Validation:
        """The validation of the policy."""
        return self.validations[-1] if self.chosen == "last" else max(self.validations, key=lambda v: v.score)


def find_trainings(folder: Path) -> list[Trained]:
    """The trainings in ``folder`` by algorithm and seed, then its ablations.

    Raises:
        ResultsError: there is none, or two have the same algorithm and seed.
    """
    paths = [*folder.glob("*/config.json"), *folder.glob(f"{ABLATIONS}/*/config.json")]
    read = [_read(path.parent) for path in paths if (path.parent / "best").is_dir()]
    found = [one for one in read if one.validations]
    if not found:
        raise ResultsError(
            f"{folder} holds no trainings with a best policy; give a folder of outputs of uuv-marl train"
        )
    places: dict[tuple[object, ...], Path] = {}
    for one in found:
        name = one.algorithm, one.seed, one.ablation
        if name in places:
            raise ResultsError(
                f"{places[name]} and {one.policy.parent} are both {one.algorithm} with seed {one.seed}, whose episodes "
                "would be taken for one training's; move one of them out of the folder"
            )
        places[name] = one.policy.parent
    return sorted(found, key=lambda one: (one.ablation, one.algorithm, one.seed))


def _read(folder: Path) -> Trained:
    settings = json.loads((folder / "config.json").read_text(encoding="utf-8"))["settings"]
    with (folder / "progress.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    rewards = tuple((int(row["agent_steps"]), float(row["reward"])) for row in rows)
    validations = tuple(
        Validation(int(row["agent_steps"]), float(row["seconds"]), float(row["score"]), float(row["arrived"]))
        for row in rows
        if row["score"]
    )
    ablation = folder.parent.name == ABLATIONS
    name = folder.name if ablation else settings["algorithm"]["name"]
    chosen = settings.get("chosen", "best")
    return Trained(name, int(settings["seed"]), folder / "best", validations, rewards, chosen, ablation)
