"""Picture of the comparison: a curve for each learner and task."""

# pyright: reportUnknownMemberType=false
# Matplotlib leaves the types of its keyword arguments open.

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from research.episodes import Row, grouped, measured, select
from research.learners.protocol import AGGREGATED, LEARNERS, MEASURES, TASKS
from uuv_marl.benchmark.style import panels, save


def draw_curves(curves: Sequence[Row], rows: Sequence[Row], path: Path) -> Path:
    """Headline on validation over agent-steps, and over minutes: mean and range of the trainings, and controller."""
    figure, axes = panels(2 * len(AGGREGATED), len(AGGREGATED), (2.8, 2.4))
    names = (("agent_steps", 1e6, "million agent-steps"), ("minutes", 1.0, "minutes"))
    for k, name in enumerate(AGGREGATED):
        controller = [row for row in rows if (row["learner"], row["set"]) == (TASKS[name].policies[0], name)]
        for row, (column, unit, words) in enumerate(names):
            ax = axes[row * len(AGGREGATED) + k]
            for colour, learner in enumerate(LEARNERS):
                _draw(ax, select(curves, task=name, learner=learner), column, unit, f"C{colour}", learner)
            ax.axhline(
                float(np.mean(measured(controller, "share"))), color="0.4", linestyle="--", label="best controller"
            )
            ax.set(title=name, xlabel=words, ylabel="main metric", ylim=(-0.02, 1.02))
    axes[0].legend()
    return save(figure, path)


def _draw(ax: Axes, curves: Sequence[Row], column: str, unit: float, colour: str, label: str) -> None:
    """Mean and range of a learner's trainings, between their measurements where all have some."""
    runs = [(measured(run, column), measured(run, "share")) for run in grouped(curves, "training").values()]
    at = np.linspace(max(x[0] for x, _ in runs), min(x[-1] for x, _ in runs), MEASURES)
    share = np.array([np.interp(at, x, y) for x, y in runs])
    ax.plot(at / unit, share.mean(axis=0), color=colour, label=label)
    ax.fill_between(at / unit, share.min(axis=0), share.max(axis=0), color=colour, alpha=0.15, linewidth=0)
