"""``python -m research.learners.tune``: the trials by which each learner's settings were chosen."""

import json
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from research import FOLDER
from research.episodes import Row, read_rows, write_rows
from research.learners.cells import emptied, trainer_of
from research.learners.protocol import AGENT_STEPS, LEARNERS, MINUTES, TASKS, TRIED_ON
from research.learners.watch import Report, TrainingRequest
from uuv_marl.cli.console import console, explained, path_option, progress_line, working
from uuv_marl.errors import ResultsError

SEED, PART = 100, 3
"""Seed of the trainings, which no other training has, and the divisor of their budget."""
app = typer.Typer(add_completion=False)


@app.command()
def main(
    learner: Annotated[str, typer.Argument(help=f"One of {', '.join(LEARNERS)}.")],
    output: Annotated[Path, path_option("Folder for the trainings.")] = Path("results/learners-tuning"),
) -> None:
    """Train a learner with each of its settings on two tasks, and write the scores.

    A trial's score is the mean over both tasks of its best validation: the mean of the headline and of swarm
    success. OUTPUT/LEARNER.csv holds them all.

    Example: python -m research.learners.tune SB3-PPO
    """
    with explained(FOLDER):
        if learner not in LEARNERS:
            raise ResultsError(f"learner must be one of {', '.join(LEARNERS)}, got {learner!r}")
        learner_config = LEARNERS[learner]
        rows: list[Row] = []
        with working(f"Finished trials are in {output}") as bar:
            for k, settings in enumerate(learner_config.tried):
                path = output / f"{learner}-{k}.csv"
                if not path.exists():
                    report = progress_line(bar, f"{learner}, trial {k + 1} of {len(learner_config.tried)}")
                    write_rows(path, [_trial(learner, k, settings, output / f"{learner}-{k}", report)])
                rows += read_rows(path)
        write_rows(output / f"{learner}.csv", rows)
        for row in sorted(rows, key=lambda row: -float(row["score"])):
            console.print(f"  {row['score']}  trial {row['trial']}: {row['settings']}", highlight=False)


def _trial(learner: str, k: int, settings: dict[str, object], folder: Path, report: Report) -> Row:
    """One setting on the tasks of ``TRIED_ON``."""
    scores: dict[str, str] = {}
    for name in TRIED_ON:
        (folder / name).mkdir(parents=True, exist_ok=True)
        emptied(folder / name)  # of an interrupted trial
        asked = TrainingRequest(TASKS[name], SEED, folder / name, settings, AGENT_STEPS // PART, MINUTES / PART, report)
        curve = trainer_of(LEARNERS[learner])(asked)
        scores[name] = f"{max((float(row['share']) + float(row['swarm_success'])) / 2.0 for row in curve):.4f}"
    score = float(np.mean([float(each) for each in scores.values()]))
    return {"learner": learner, "trial": str(k), "score": f"{score:.4f}", **scores, "settings": json.dumps(settings)}


if __name__ == "__main__":
    app()
