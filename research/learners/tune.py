"""``python -m research.learners.tune``: the trials by which each learner's settings were chosen."""

from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import typer
from filelock import FileLock, Timeout

from research import FOLDER
from research.episodes import Row, grouped, read_rows, select, write_rows
from research.learners.cells import check_protocol, emptied, trainer_of
from research.learners.protocol import LEARNERS, TASKS, TUNING
from research.learners.watch import Report, TrainingRequest
from uuv_marl.cli.console import console, explained, path_option, progress_line, working
from uuv_marl.train.validation import validate

app = typer.Typer(add_completion=False)


class Trial(NamedTuple):
    """A short training of a learner with one of its settings."""

    learner: str
    trial: int
    """Index of the setting."""
    seed: int
    task: str

    def folder(self, output: Path) -> Path:
        """Folder of the trial."""
        return output / "-".join(map(str, self))


@app.command()
def main(output: Annotated[Path, path_option("Folder for the trials.")] = Path("results/learners-tuning")) -> None:
    """Train every learner with each of its settings for a short time, and write the scores into OUTPUT/trials.csv.

    A trial's score is its best validation, the mean of main metric and swarm success, over the best controller's. The
    best settings after the first seed have a second one. Several processes may share the folder, as in
    python -m research.learners.

    Example: python -m research.learners.tune --output results/learners-tuning
    """
    with explained(FOLDER):
        check_protocol(output)
        first, second = ([seed] for seed in TUNING["seeds"])
        with working(f"Finished trials are in {output}") as bar:
            rows = _run(trials(first), output, lambda what: progress_line(bar, what))
            rows += _run(
                [each for each in trials(second) if each.trial in kept(rows, each.learner)], output,
                lambda what: progress_line(bar, what),
            )  # fmt: skip
        write_rows(output / "trials.csv", rows)
        console.print(f"  {len(rows)} trials: {output / 'trials.csv'}", highlight=False)


def trials(seeds: list[int]) -> list[Trial]:
    """Every setting on every task with these seeds."""
    return [
        Trial(learner.name, k, seed, task)
        for seed in seeds
        for k in range(max(len(learner.tried) for learner in LEARNERS.values()))
        for learner in LEARNERS.values()
        for task in TUNING["tasks"]
        if k < len(learner.tried)
    ]


def kept(rows: list[Row], learner: str) -> list[int]:
    """The best settings of a learner, the best one first; none before all have a score on all tasks."""
    if len(select(rows, learner=learner)) < len(LEARNERS[learner].tried) * len(TUNING["tasks"]):
        return []
    means = {
        int(trial): float(np.mean([float(row["score"]) for row in own]))
        for (name, trial), own in grouped(rows, "learner", "trial").items()
        if name == learner
    }
    return sorted(means, key=lambda trial: -means[trial])[: TUNING["kept"]]


def _run(todo: list[Trial], output: Path, line: Callable[[str], Report]) -> list[Row]:
    """Run the trials that no other process runs; the rows of all that are done."""
    for k, trial in enumerate(todo):
        folder = trial.folder(output)
        if not (folder / "score.csv").exists():
            folder.mkdir(parents=True, exist_ok=True)
            with suppress(Timeout), FileLock(folder.with_suffix(".lock"), timeout=0):
                report = line(f"{k + 1} of {len(todo)}: {' '.join(map(str, trial))}")
                write_rows(folder / "score.csv", [_score(trial, folder, output, report)])
    return [row for trial in todo for row in _done(trial.folder(output) / "score.csv")]


def _done(path: Path) -> Iterator[Row]:
    yield from read_rows(path) if path.exists() else []


def _score(trial: Trial, folder: Path, output: Path, report: Report) -> Row:
    emptied(folder)  # of an interrupted trial
    settings, budget = LEARNERS[trial.learner].tried[trial.trial], (TUNING["agent_steps"], TUNING["minutes"])
    asked = TrainingRequest(TASKS[trial.task], trial.seed, folder, settings, *budget, report)
    curve = trainer_of(LEARNERS[trial.learner])(asked)
    best = max((float(row["share"]) + float(row["swarm_success"])) / 2.0 for row in curve)
    named = {name: str(value) for name, value in trial._asdict().items()}
    return {**named, "score": f"{best / _controller(trial.task, output):.4f}"}


def _controller(name: str, output: Path) -> float:
    """The best controller's score on the validations of a task."""
    path, task = output / f"{name}-controller.csv", TASKS[name]
    if not path.exists():
        write_rows(path, [{"score": f"{validate(task.policies[0], task.training(steps=1)).score:.6f}"}])
    return float(read_rows(path)[0]["score"])


if __name__ == "__main__":
    app()
