"""The picture of the held-out evaluation."""

# pyright: reportUnknownMemberType=false
# Matplotlib leaves the types of its keyword arguments open.

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.ticker import PercentFormatter
from scipy.stats import binomtest

from research.episodes import Row, select, succeeded
from uuv_marl.benchmark.style import AMBER, BLACK, GREEN, ORANGE, legend, panels, save

ENDS = {
    "arrives, no collision": (True, False, GREEN, ""),
    "arrives, with a collision": (True, True, AMBER, ""),
    "never arrives, with a collision": (False, True, ORANGE, "////"),
    "never arrives, no collision": (False, False, "0.8", ""),
}
"""Endings of an episode: whether it arrives, whether there is a collision, and its colour and hatch."""


def draw_fields(rows: Sequence[Row], path: Path) -> Path:
    """Draw how many episodes of each policy on a set end in each of four ways, the best policy first."""
    by_policy = [select(rows, policy=policy) for policy in dict.fromkeys(row["policy"] for row in rows)]
    ranking = sorted(by_policy, key=lambda mine: np.mean([*map(succeeded, mine)]), reverse=True)
    figure, (ax,) = panels(1, 1, (8.0, 0.42 * len(ranking) + 1.5))
    for k, mine in enumerate(ranking):
        left = 0.0
        for label, (arrives, collides, colour, hatch) in ENDS.items():
            ends = [(bool(row["task_time_s"]), row["collisions"] != "0") for row in mine]
            share = float(np.mean([end == (arrives, collides) for end in ends]))
            ax.barh(k, share, left=left, height=0.7, color=colour, hatch=hatch, ec="white", lw=0.0, label=label)
            left += share
        interval = binomtest(sum(map(succeeded, mine)), len(mine)).proportion_ci(method="wilson")
        words = "95 % interval of the first share"
        ax.errorbar([sum(interval) / 2], [k], xerr=np.ptp(interval) / 2, color=BLACK, capsize=3, label=words)
    ax.set_yticks(range(len(ranking)), [f"{mine[0]['policy']} (n = {len(mine)})" for mine in ranking])
    ax.invert_yaxis()
    ax.set(xlim=(0.0, 1.0), xlabel="share of the episodes")
    ax.xaxis.set_major_formatter(PercentFormatter(1.0))
    ax.grid(visible=False, axis="y")
    figure.suptitle(f"How episodes end on the held-out set {rows[0]['set']}")
    return save(legend(figure, columns=3), path)
