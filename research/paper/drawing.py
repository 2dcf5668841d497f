"""Shared by the paper's figures: plan views in its coordinates, paths, and series over time."""

# pyright: reportUnknownMemberType=false
# Matplotlib leaves the types of its keyword arguments open.

import numpy as np
from matplotlib.axes import Axes

from research.columns import Columns
from research.paper.measures import corner_times
from uuv_marl.benchmark.results import Trace
from uuv_marl.benchmark.style import BLACK, BLUE, GREY, ORANGE, draw_map
from uuv_marl.benchmark.suite import Case, Suite
from uuv_marl.types import Int64

GROUPS = ((0, BLUE, "starts to port"), (1, ORANGE, "starts to starboard"))
"""Groups as ``start_groups`` numbers them, with colour and label."""


def plan(ax: Axes, case: Case, title: str = "") -> None:
    """The paper's plan view: its first coordinate (north) to the right; trajectory and obstacles of a case."""
    scenario = case.load()
    discs = [(*obstacle.centre_m, obstacle.radius_m) for obstacle in scenario.obstacles]
    draw_map(ax, np.array(scenario.trajectory.waypoints_m), discs)
    for k, (x, y, _) in enumerate(discs if len(discs) > 1 else ()):
        ax.annotate(f"{k + 1}", (x, y), ha="center", va="center", color="white", fontsize=8, zorder=4)
    ax.set(xlabel="x, north [m]", ylabel="y, east [m]", title=title)


def against_time(ax: Axes, what: str, title: str) -> None:
    """Labels of a series."""
    ax.set(xlabel="time [s]", ylabel=what, title=title)


def mark_corners(ax: Axes, case: Case) -> None:
    """When l(t) turns, and when it comes to rest."""
    scenario = case.load()
    times = corner_times(np.array(scenario.trajectory.waypoints_m, np.float32), scenario.trajectory.speed_mps)
    for k, time in enumerate(times):
        ax.axvline(time, color=GREY, linestyle=":", linewidth=1.0, label="l(t) turns, rests" if k == 0 else None)


def draw_routes(ax: Axes, table: Columns, case: Case, title: str = "") -> None:
    """Routes by the group of the start, with start and end of every vehicle, and the centre's place in time."""
    vehicles = len(np.unique(table["vehicle"]))
    x, y, group, time = (table[name].reshape(vehicles, -1).T for name in ("x_m", "y_m", "group", "time_s"))
    for side, colour, label in GROUPS:
        own = group[0] == side
        lines = ax.plot(x[:, own], y[:, own], color=colour, linewidth=0.5, alpha=0.7)
        lines[0].set_label(label)
        ax.plot(x[0, own], y[0, own], "o", color=colour, mfc="none", ms=3, mew=0.6, label="" if side else "start")
        ax.plot(x[-1, own], y[-1, own], ".", color=colour, label="" if side else "end")
    end = float(time[-1, 0])
    for moment in np.arange(60.0, end - 30.0, 60.0 if end < 300.0 else 120.0):
        k = int(np.searchsorted(time[:, 0], moment))
        at = (float(x[k].mean()), float(y[k].mean()))
        ax.plot(*at, "P", color=BLACK, mec="white", mew=0.6, ms=6, ls="", zorder=6, label="swarm's centre at a time")
        ax.annotate(f"{moment:g} s", at, xytext=(6, 4), textcoords="offset points", fontsize=7, zorder=6,
                    bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": 0.5})  # fmt: skip
    plan(ax, case, title)


def route_table(suite: Suite, case: Case) -> Columns:
    """Routes of seed 0: a row for each vehicle and second."""
    trace = suite.trace(case, 0)
    position, time = trace["route_position"], trace["route_time_s"]
    samples: Int64 = np.unique(np.append(np.arange(0, len(time), 2), len(time) - 1))
    vehicles = int(position.shape[1])
    return {
        "vehicle": np.repeat(np.arange(vehicles), len(samples)),
        "group": np.repeat(start_groups(trace), len(samples)),
        "time_s": np.tile(time[samples], vehicles),
        "x_m": position[samples, :, 0].T.ravel(),
        "y_m": position[samples, :, 1].T.ravel(),
    }


def start_groups(trace: Trace) -> Int64:
    """0 for vehicles that start to port of the first leg, 1 to starboard, shape (vehicle,)."""
    leg = trace["waypoints"][1] - trace["waypoints"][0]
    offset = trace["route_position"][0] - trace["waypoints"][0]
    return (leg[0] * offset[:, 1] - leg[1] * offset[:, 0] > 0.0).astype(np.int64)
