"""The pictures of the held-out evaluation."""

# pyright: reportUnknownMemberType=false
# Matplotlib leaves the types of its keyword arguments open.

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from scipy.stats import binomtest

from uuv_marl.benchmark.figures import COLOURS
from uuv_marl.heldout.episodes import Episode
from uuv_marl.heldout.targets import of
from uuv_marl.heldout.trainings import Trained

BLUE, ORANGE, GREEN, *_ = COLOURS


def draw_fields(episodes: Sequence[Episode], name: str, path: Path) -> None:
    """Of each policy on a set: how many episodes arrive untouched, arrive with a collision, or never arrive."""
    policies = list(dict.fromkeys(e.policy for e in episodes if e.set == name and e.training_seed is None))
    figure = Figure(figsize=(8.0, 0.5 * len(policies) + 1.4), layout="constrained")
    ax = figure.add_subplot()
    for k, policy in enumerate(policies):
        mine = of(episodes, name, policy)
        good = sum(e.succeeded for e in mine)
        touched = sum(e.task_time_s is not None and not e.succeeded for e in mine)
        low, high = binomtest(good, len(mine)).proportion_ci(method="wilson")
        left = 0.0
        for count, colour in ((good, GREEN), (touched, ORANGE), (len(mine) - good - touched, "0.8")):
            ax.barh(k, count / len(mine), left=left, color=colour, height=0.7)
            left += count / len(mine)
        ax.plot([low, high], [k, k], color="black", linewidth=1.5)
    ax.set_yticks(range(len(policies)), policies)
    ax.invert_yaxis()
    ax.set_xlim(0.0, 1.0)
    ax.set_xlabel("episodes: green arrived untouched (line: 95 % interval), orange with collisions, grey never")
    _save(figure, path)


def draw_efficiency(trained: Sequence[Trained], path: Path) -> None:
    """Validation scores over agent-steps: every training, and the mean of each algorithm."""
    figure = Figure(figsize=(7.0, 4.2), layout="constrained")
    ax = figure.add_subplot()
    for algorithm, colour in zip(dict.fromkeys(one.algorithm for one in trained), (BLUE, ORANGE, GREEN), strict=False):
        runs = [one.validations for one in trained if one.algorithm == algorithm]
        for run in runs:
            ax.plot([v.agent_steps / 1e6 for v in run], [v.score for v in run], color=colour, linewidth=0.6, alpha=0.6)
        least = min(len(run) for run in runs)
        steps = [runs[0][k].agent_steps / 1e6 for k in range(least)]
        mean = np.mean([[v.score for v in run[:least]] for run in runs], axis=0)
        ax.plot(steps, mean, color=colour, linewidth=2.5, label=f"{algorithm}, {len(runs)} seeds and their mean")
    ax.set_xlabel("agent-steps [million]")
    ax.set_ylabel("validation score (0 is best)")
    ax.grid(alpha=0.25)
    ax.legend()
    _save(figure, path)


def _save(figure: Figure, path: Path) -> None:
    FigureCanvasAgg(figure)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110, metadata={"Software": None})
