"""Copy a held-out evaluation's episodes and its trainings into docs/heldout, and write the page there from the copies.

python tools/ship_heldout.py results/heldout results/trainings
"""

import shutil
import sys
from pathlib import Path

from uuv_marl.baselines.learned.checkpoint import WEIGHTS_FILE
from uuv_marl.studies.heldout.episodes import read_episodes
from uuv_marl.studies.heldout.page import write_page
from uuv_marl.studies.heldout.trainings import ABLATIONS, find_trainings

TARGET = Path(__file__).resolve().parent.parent / "docs" / "heldout"


def ship(results: Path, trainings: Path) -> None:
    """The page is written anew from the copies."""
    episodes = read_episodes(results / "episodes.csv")
    for one in find_trainings(trainings):
        name = f"{ABLATIONS}/{one.algorithm}" if one.ablation else f"{one.algorithm}-{one.seed}"
        source, target = one.policy.parent, TARGET / "trainings" / name
        (target / "best").mkdir(parents=True, exist_ok=True)
        for name in ("config.json", "progress.csv", f"best/{WEIGHTS_FILE}"):
            shutil.copyfile(source / name, target / name)
    write_page(TARGET, episodes, find_trainings(TARGET / "trainings"))


if __name__ == "__main__":
    ship(Path(sys.argv[1]), Path(sys.argv[2]))
