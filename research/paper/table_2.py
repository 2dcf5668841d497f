"""Table 2: task time and smallest obstacle distance of the three methods (section 5.3)."""

# pyright: reportUnknownMemberType=false
# Matplotlib leaves the types of its keyword arguments open.

import numpy as np
from matplotlib.figure import Figure

from research.columns import columns, groups
from research.paper.cases import COMPARATORS, SINGLE
from research.part import Part, Share, Tables
from uuv_marl.benchmark.paper import PAPER, PaperFigure
from uuv_marl.benchmark.style import BLUE, GREEN, ORANGE, legend, panels
from uuv_marl.benchmark.suite import Suite

CASES = (*COMPARATORS, SINGLE)
_HEADS = {"task_time_s": "task time [s]", "min_obstacle_distance_m": "smallest distance to the obstacle [m]"}


def table_2(suite: Suite, _report: Share) -> Tables:
    """All seeds."""
    rows = [
        {
            "policy": case.policy,
            "seed": seed,
            **{name: suite.metric(case, name)[k] for name in _HEADS},
            "paper_task_time_s": stated.task_time_s or np.nan,
            "paper_min_obstacle_distance_m": (stated.min_obstacle_distance_m or (np.nan,))[0],
        }
        for case in CASES
        for stated in [PAPER.get((case.scenario, case.policy), PaperFigure())]
        for k, seed in enumerate(suite.seeds)
    ]
    return {"table-2": columns(rows)}


def draw(computed: Tables) -> Figure:
    """Every seed, side by side so that all can be seen, and the paper's value."""
    by_policy = groups(computed["table-2"], "policy")
    figure, axes = panels(2)
    for ax, (name, words) in zip(axes, _HEADS.items(), strict=True):
        for k, own in enumerate(by_policy.values()):
            place = k + np.linspace(-0.25, 0.25, len(own["seed"]))
            ax.plot(place, own[name], "o", color=BLUE, mec="none", alpha=0.6, label="ours: one seed")
            ax.plot(k, own[f"paper_{name}"][0], "D", color=ORANGE, ms=7, ls="", label="paper, Table 2")
        ax.set_xticks(range(len(by_policy)), [policy for (policy,) in by_policy], rotation=20, ha="right")
        ax.set_ylabel(words)
    stated = PAPER["single_obstacle", "bio_inspired"].min_obstacle_distance_m or (np.nan,)
    axes[1].plot(len(by_policy) - 1, stated[-1], "s", color=GREEN, ms=7, ls="", label="paper, section 5.2.1")
    axes[1].set_ylim(bottom=0.0)
    return legend(figure)


PART = Part("table-2", CASES, table_2, draw)
