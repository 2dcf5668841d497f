"""What the reproduced figures share: axes in the paper's coordinates, routes, obstacles, saving."""

# pyright: reportUnknownMemberType=false
# Matplotlib leaves the types of its keyword arguments open.

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from numpy.typing import NDArray

from uuv_marl.benchmark.figures import COLOURS
from uuv_marl.reproduce.cases import Case, Study, Trace
from uuv_marl.reproduce.columns import Columns
from uuv_marl.reproduce.motion import corner_times

BLUE, ORANGE, GREEN, PINK, AMBER, SKY, BLACK, GREY = COLOURS


def panels(num: int, width: float = 5.2, height: float = 4.4) -> tuple[Figure, list[Axes]]:
    """A figure with panels (a), (b), ... side by side."""
    figure = Figure(figsize=(width * num, height), layout="constrained")
    axes = [figure.add_subplot(1, num, k + 1) for k in range(num)]
    for ax in axes:
        ax.grid(alpha=0.25)
    return figure, axes


def letter(ax: Axes, text: str) -> None:
    """A panel's heading, such as (a) start."""
    ax.set_title(text, fontsize=10, loc="left")


def plan(ax: Axes, case: Case) -> None:
    """The paper's plan view: its first coordinate (north) to the right; trajectory and obstacles of a case."""
    scenario = case.load()
    waypoints = np.array(scenario.trajectory.waypoints_m)
    ax.plot(waypoints[:, 0], waypoints[:, 1], "--", color=BLACK, linewidth=1.0, label="trajectory", zorder=3)
    for k, obstacle in enumerate(scenario.obstacles):
        x, y = obstacle.centre_m
        ax.add_patch(Circle((x, y), obstacle.radius_m, color="0.45", zorder=2))
        if len(scenario.obstacles) > 1:
            ax.annotate(f"{k + 1}", (x, y), ha="center", va="center", color="white", fontsize=8, zorder=4)
    ax.set_aspect("equal")
    ax.set_xlabel("x, north [m]")
    ax.set_ylabel("y, east [m]")


def against_time(ax: Axes, what: str) -> None:
    """Labels of a series."""
    ax.set_xlabel("time [s]")
    ax.set_ylabel(what)


def mark_corners(ax: Axes, case: Case) -> None:
    """When l(t) turns, and when it comes to rest."""
    scenario = case.load()
    times = corner_times(np.array(scenario.trajectory.waypoints_m, np.float32), scenario.trajectory.speed_mps)
    for k, time in enumerate(times):
        ax.axvline(time, color=GREY, linestyle=":", linewidth=1.0, label="l(t) turns, rests" if k == 0 else None)


def draw_routes(ax: Axes, table: Columns) -> None:
    """Routes by the group of the start: one side of the first leg blue, the other orange; dots at the end."""
    for vehicle in np.unique(table["vehicle"]):
        own = table["vehicle"] == vehicle
        colour = BLUE if table["group"][own][0] == 0 else ORANGE
        ax.plot(table["x_m"][own], table["y_m"][own], color=colour, linewidth=0.5, alpha=0.7)
        ax.plot(table["x_m"][own][-1], table["y_m"][own][-1], ".", color=colour, markersize=4)


def route_table(study: Study, case: Case, seed: int = 0) -> Columns:
    """Routes of a run: a row for each vehicle and second."""
    trace = study.trace(case, seed)
    position, time = trace["route_position"], trace["route_time_s"]
    kept: NDArray[np.int64] = np.unique(np.append(np.arange(0, len(time), 2), len(time) - 1))
    vehicles = int(position.shape[1])
    return {
        "vehicle": np.repeat(np.arange(vehicles), len(kept)),
        "group": np.repeat(start_groups(trace), len(kept)),
        "time_s": np.tile(time[kept], vehicles),
        "x_m": position[kept, :, 0].T.ravel(),
        "y_m": position[kept, :, 1].T.ravel(),
    }


def start_groups(trace: Trace) -> NDArray[np.int64]:
    """0 for vehicles that start to port of the first leg, 1 to starboard, shape (vehicle,)."""
    leg = trace["waypoints"][1] - trace["waypoints"][0]
    offset = trace["route_position"][0] - trace["waypoints"][0]
    return (leg[0] * offset[:, 1] - leg[1] * offset[:, 0] > 0.0).astype(np.int64)
