"""The pictures of the held-out evaluation."""

# pyright: reportUnknownMemberType=false
# Matplotlib leaves the types of its keyword arguments open.

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import PercentFormatter
from scipy.stats import binomtest

from research.heldout.across import runs, success, tasks
from research.heldout.episodes import ByPolicy, Episode
from research.heldout.trainings import Trained
from uuv_marl.benchmark.style import AMBER, BLACK, BLUE, GREEN, GREY, ORANGE, PINK, SKY, legend, panels, save

ENDS = {
    "arrives, no collision": (True, False, GREEN, ""),
    "arrives, with a collision": (True, True, AMBER, ""),
    "never arrives, with a collision": (False, True, ORANGE, "////"),
    "never arrives, no collision": (False, False, "0.8", ""),
}
"""How an episode ends: whether it arrives, whether anybody collides, and how that is drawn."""


def draw_fields(episodes: Sequence[Episode], name: str, path: Path) -> Path:
    """Draw how many episodes of each policy on a set end in each of four ways, the best policy first."""
    shipped = dict.fromkeys(e.policy for e in episodes if e.set == name and e.training_seed is None)
    by_policy = ByPolicy(episodes)
    found = sorted((by_policy.select(name, policy) for policy in shipped), key=success, reverse=True)
    figure, (ax,) = panels(1, 1, (8.0, 0.42 * len(found) + 1.5))
    for k, mine in enumerate(found):
        left = 0.0
        for label, (arrives, collides, colour, hatch) in ENDS.items():
            share = np.mean([(e.arrived, e.collisions > 0) == (arrives, collides) for e in mine])
            ax.barh(k, share, left=left, height=0.7, color=colour, hatch=hatch, ec="white", lw=0.0, label=label)
            left += float(share)
        interval = binomtest(sum(e.succeeded for e in mine), len(mine)).proportion_ci(method="wilson")
        words = "95 % interval of the first share"
        ax.errorbar([sum(interval) / 2], [k], xerr=np.ptp(interval) / 2, color=BLACK, capsize=3, label=words)
    ax.set_yticks(range(len(found)), [f"{mine[0].policy} (n = {len(mine)})" for mine in found])
    ax.invert_yaxis()
    ax.set(xlim=(0.0, 1.0), xlabel="share of the episodes")
    ax.xaxis.set_major_formatter(PercentFormatter(1.0))
    ax.grid(visible=False, axis="y")
    figure.suptitle(f"How episodes end on the held-out set {name}")
    return save(legend(figure, columns=3), path)


def draw_trainings(episodes: Sequence[Episode], trained: Sequence[Trained], path: Path) -> Path:
    """What a decision is paid while training goes on; success on held-out tasks beside what ships."""
    figure, (left, right) = panels(2, size=(5.4, 4.4))
    compared = dict.fromkeys(one.algorithm for one in trained if not one.ablation)
    colours: dict[str, str] = dict(zip(compared, (BLUE, ORANGE, GREEN), strict=False))
    for algorithm, colour in colours.items():
        found = [np.array(one.rewards) for one in trained if one.algorithm == algorithm]
        for k, run in enumerate(found):
            label = "" if k else f"{algorithm}: one training"
            left.plot(run[:, 0] / 1e6, run[:, 1], color=colour, linewidth=0.6, alpha=0.6, label=label)
        least = min(map(len, found))
        mean = np.mean([run[:least] for run in found], axis=0)
        left.plot(mean[:, 0] / 1e6, mean[:, 1], color=colour, linewidth=2.5, label=f"{algorithm}: mean of {len(found)}")
    left.set(xlabel="agent-steps [million]", ylabel="mean reward of a decision, with noise [1]")
    left.set_title("(a) while training")
    _held_out(right, episodes, colours)
    right.set_title("(b) afterwards, on held-out tasks")
    right.set_ylabel("episodes that arrive untouched [share]")
    right.set_ylim(-0.04, 1.04)
    figure.suptitle("Trainings from nothing, beside the policies that ship")
    return save(legend(figure, columns=4), path)


def _held_out(ax: Axes, episodes: Sequence[Episode], colours: dict[str, str]) -> None:
    """Draw every training's success by task, and that of policies that ship."""
    shipped = {"scout": SKY, "scout_plus": GREY, "mappo": PINK}
    compared = tasks(episodes)
    for j, held in enumerate(compared):
        rows = [(f"{name}: one training", name, True, colour, ".") for name, colour in colours.items()]
        rows += [(f"{name}, as it ships", name, False, colour, "D") for name, colour in shipped.items()]
        for k, (label, name, trained, colour, mark) in enumerate(rows):
            scores = [success(run) for run in runs(episodes, held, name, trained)]
            place = j + 0.14 * (k - (len(rows) - 1) / 2)
            ax.plot([place] * len(scores), scores, mark, color=colour, ms=7 if trained else 5, alpha=0.8, label=label)
    ax.set_xticks(range(len(compared)), [held.name for held in compared])
    ax.set_xlim(-0.5, max(len(compared), 1) - 0.5)
