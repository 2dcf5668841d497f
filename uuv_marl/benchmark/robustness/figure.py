"""Picture of a scenario: success over severity, a panel for every axis, a line for every policy."""

# pyright: reportUnknownMemberType=false
# Matplotlib leaves the types of its keyword arguments open.

import itertools
from typing import Any

from uuv_marl.benchmark.robustness.axes import AXES, CALM, Axis
from uuv_marl.benchmark.robustness.scores import ENOUGH, scored
from uuv_marl.benchmark.style import BLACK, COLOURS, legend, panels
from uuv_marl.extras import pictures

with pictures():
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_AGAIN = ((".", "-"), ("x", "--"), ("^", ":"))
"""Marker and line of the first policies, and of those that reuse their colours."""
_CROWD = 5
"""Largest number of lines in a panel with intervals."""


def draw(table: Any) -> Figure:
    """Draw one scenario's rows of ``scores.by_seed``."""
    axes = [axis for name, axis in AXES.items() if name in table]
    policies: list[str] = list(table.index.unique("policy"))
    looks = dict(zip(policies, itertools.product(_AGAIN * len(policies), COLOURS), strict=False))
    intervals = len(policies) <= _CROWD
    figure, fields = panels(len(axes) + 1, 5, (4.0, 2.9), sharey=True)
    for ax, axis in zip(fields, axes, strict=False):
        for policy, own in table.groupby(level="policy", sort=False):
            (marker, line), colour = looks[policy]
            _draw_line(ax, axis, own, intervals, marker=marker, color=colour, linestyle=line, label=policy)
        ax.axhline(ENOUGH, color=BLACK, linestyle=":", linewidth=0.8, label=f"success of {ENOUGH:g}")
        ax.set_xticks([0, *axis.levels], axis.labels, fontsize=8, rotation=25 if max(map(len, axis.labels)) > 6 else 0)
        ax.set_xlabel(axis.unit, fontsize=8)
        ax.set_title(f"{axis.name}: {axis.title}", fontsize=10)
        ax.set_ylim(-0.04, 1.04)
    for ax in fields[len(axes) :]:
        ax.set_axis_off()
    figure.supylabel("success")
    where = ", ".join(table.index.unique("scenario"))
    what = "mean over seeds" + " and its 95 % bootstrap interval" * intervals
    figure.suptitle(f"Success over severity on {where}:\n{what}")
    return legend(figure, fields[len(axes)])


def _draw_line(ax: Axes, axis: Axis, own: Any, intervals: bool, **style: Any) -> None:
    """Draw a policy's success at every level that was run, with intervals if asked."""
    if axis.name not in own or CALM not in own:
        return
    cells = own[[CALM, axis.name]].dropna(axis="columns", how="all")
    levels_shown = {level: cells[name, level].dropna().to_numpy() for name, level in cells}
    if len(levels_shown) > 1:
        levels = list(levels_shown)
        if intervals:
            _, lows, highs = zip(*map(scored, levels_shown.values()), strict=True)
            ax.fill_between(levels, lows, highs, color=style["color"], alpha=0.15, lw=0)
        ax.plot(levels, [values.mean() for values in levels_shown.values()], **style)
