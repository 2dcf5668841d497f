"""Pictures of the comparison: a curve for each learner and task, and performance profiles."""

# pyright: reportUnknownMemberType=false
# Matplotlib leaves the types of its keyword arguments open.

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from research.episodes import Row, grouped, measured, select
from research.learners.protocol import LEARNERS, TASKS
from research.learners.statistics import profiles
from uuv_marl.benchmark.style import panels
from uuv_marl.types import Float64


def draw_curves(curves: Sequence[Row], rows: Sequence[Row], path: Path) -> Path:
    """Headline on validation over agent-steps: mean and range of the trainings, and the best controller as a line."""
    figure, axes = panels(len(TASKS), 3, (3.6, 2.8))
    for ax, (name, task) in zip(axes, TASKS.items(), strict=False):
        for k, learner in enumerate(LEARNERS):
            runs = grouped(select(curves, task=name, learner=learner), "training").values()
            length = min(map(len, runs))
            steps, share = (
                np.array([measured(run[:length], column) for run in runs]) for column in ("agent_steps", "share")
            )
            ax.plot(steps.mean(axis=0) / 1e6, share.mean(axis=0), color=f"C{k}", label=learner)
            ax.fill_between(
                steps.mean(axis=0) / 1e6, share.min(axis=0), share.max(axis=0), color=f"C{k}", alpha=0.15, linewidth=0
            )
        controller = [row for row in rows if (row["learner"], row["set"]) == (task.policies[0], task.tiers[0][0].name)]
        ax.axhline(float(np.mean(measured(controller, "share"))), color="0.4", linestyle="--", label="best controller")
        ax.set(title=name, xlabel="million agent-steps", ylabel="headline", ylim=(-0.02, 1.02))
    axes[0].legend()
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path)
    return path


def draw_profiles(scores: Mapping[str, Float64], path: Path) -> Path:
    """Share of trainings and tasks above a score, where 1 is the best controller's, with 95 % intervals."""
    levels = np.linspace(0.0, 1.2, 61)
    figure, (ax, *_) = panels(1, 1, (5.0, 3.4))
    for k, (learner, (share, low, high)) in enumerate(profiles(scores, levels).items()):
        ax.plot(levels, share, color=f"C{k}", label=learner)
        ax.fill_between(levels, low, high, color=f"C{k}", alpha=0.15, linewidth=0)
    ax.set(xlabel="headline, 0: random, 1: best controller", ylabel="share of trainings above it", ylim=(-0.02, 1.02))
    ax.legend()
    figure.savefig(path)
    return path
