"""Figures 7 to 10: trajectory tracking without obstacles (section 5.1)."""

# pyright: reportUnknownMemberType=false
# Matplotlib leaves the types of its keyword arguments open.

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from uuv_marl.benchmark.paper import PAPER
from uuv_marl.reproduce.cases import TRACKING, Report, Study
from uuv_marl.reproduce.columns import Columns
from uuv_marl.reproduce.drawing import (
    BLACK,
    BLUE,
    GREEN,
    ORANGE,
    against_time,
    draw_routes,
    letter,
    mark_corners,
    panels,
    plan,
    route_table,
    start_groups,
)
from uuv_marl.reproduce.motion import path_distance
from uuv_marl.reproduce.parts import Part, Tables

CAPTION = TRACKING.label(0)
LAW = PAPER["tracking", "bio_inspired"]


def states(study: Study, _report: Report) -> Tables:
    """Positions and velocities at the start, and when the swarm has reached the end."""
    trace = study.trace(TRACKING, 0)

    def at(index: int) -> Columns:
        position, velocity = trace["route_position"][index], trace["route_velocity"][index]
        return {
            "vehicle": np.arange(len(position)),
            "group": start_groups(trace),
            "time_s": np.full(len(position), trace["route_time_s"][index]),
            "x_m": position[:, 0],
            "y_m": position[:, 1],
            "velocity_x_mps": velocity[:, 0],
            "velocity_y_mps": velocity[:, 1],
            "heading_deg": np.degrees(trace["route_heading"][index]),
        }

    return {"figure-7a": at(0), "figure-7b": at(-1)}


def draw_states(made: Tables) -> Figure:
    """Circles, and arrows for the velocities."""
    figure, axes = panels(2)
    for ax, name, words in zip(axes, ("figure-7a", "figure-7b"), ("start", "end"), strict=True):
        table = made[name]
        plan(ax, TRACKING)
        colours = np.where(table["group"] == 0, BLUE, ORANGE).tolist()
        ax.scatter(table["x_m"], table["y_m"], s=18, facecolors="none", edgecolors=colours)
        arrows = ax.quiver(
            table["x_m"], table["y_m"], table["velocity_x_mps"], table["velocity_y_mps"],
            color=colours, angles="xy", scale_units="xy", scale=0.2, width=0.003,
        )  # fmt: skip
        ax.quiverkey(arrows, 0.82, 1.03, 4.0, "4 m/s", labelpos="E", coordinates="axes", color=BLACK)
        for low, high, values in ((ax.set_xlim, 0, table["x_m"]), (ax.set_ylim, 0, table["y_m"])):
            middle = float(values.min() + values.max()) / 2 + high
            low(middle - 125.0, middle + 125.0)
        letter(ax, f"({name[-1]}) {words}, t = {float(table['time_s'][0]):g} s")
    return figure


def routes(study: Study, _report: Report) -> Tables:
    """Routes of all vehicles, and of their centre."""
    trace = study.trace(TRACKING, 0)
    centre = trace["route_position"].mean(axis=1)
    return {
        "figure-8a": route_table(study, TRACKING),
        "figure-8b": {"time_s": trace["route_time_s"], "centre_x_m": centre[:, 0], "centre_y_m": centre[:, 1]},
    }


def draw_all_routes(made: Tables) -> Figure:
    """Routes, and the centre's route over the trajectory."""
    figure, (left, right) = panels(2)
    draw_routes(left, made["figure-8a"])
    plan(left, TRACKING)
    letter(left, "(a) routes; dots: end; colour: group at the start")
    plan(right, TRACKING)
    centre = made["figure-8b"]
    right.plot(centre["centre_x_m"], centre["centre_y_m"], color=BLUE, linewidth=1.4, label="swarm's centre")
    right.legend(fontsize=8)
    letter(right, "(b) centre of the swarm")
    return figure


def headings(study: Study, _report: Report) -> Tables:
    """Every vehicle's heading, and the centre's deviation: from l(t), and from the path."""
    trace = study.trace(TRACKING, 0)
    heading, time = trace["route_heading"], trace["route_time_s"]
    vehicles = int(heading.shape[1])
    distance = np.interp(trace["time_s"], time, path_distance(trace["route_position"].mean(axis=1), trace["waypoints"]))
    return {
        "figure-9a": {
            "vehicle": np.repeat(np.arange(vehicles), len(time)),
            "time_s": np.tile(time, vehicles),
            "heading_deg": np.degrees(heading).T.ravel(),
        },
        "figure-9b": {
            "time_s": trace["time_s"][::5],
            "from_l_m": trace["centre_error_m"][::5],
            "from_path_m": distance[::5],
        },
    }


def draw_headings(made: Tables) -> Figure:
    """Figure 9."""
    figure, (left, right) = panels(2)
    table = made["figure-9a"]
    left.plot(table["time_s"], table["heading_deg"], ",", color=BLUE, alpha=0.6)
    mark_corners(left, TRACKING)
    left.set_ylim(-180, 180)
    left.set_yticks(range(-180, 181, 60))
    against_time(left, "heading psi, clockwise from north [deg]")
    letter(left, "(a) heading of every vehicle")
    deviation = made["figure-9b"]
    right.plot(deviation["time_s"], deviation["from_l_m"], color=BLUE, label="from l(t)")
    right.plot(deviation["time_s"], deviation["from_path_m"], "--", color=ORANGE, label="from the path")
    mark_corners(right, TRACKING)
    right.legend(fontsize=8)
    against_time(right, "deviation of the swarm's centre [m]")
    letter(right, "(b) centre and given trajectory")
    return figure


def spacing(study: Study, _report: Report) -> Tables:
    """Largest and smallest distance between two vehicles over time."""
    trace = study.trace(TRACKING, 0)
    return {"figure-10": {name: trace[name][::5] for name in ("time_s", "max_spacing_m", "min_spacing_m")}}


def draw_spacing(made: Tables) -> Figure:
    """Both in one panel, and the smallest by itself, where its changes can be seen."""
    figure, axes = panels(2)
    table = made["figure-10"]
    for ax, names in zip(axes, (("max_spacing_m", "min_spacing_m"), ("min_spacing_m",)), strict=True):
        for name in names:
            colour, label = (ORANGE, "largest") if name.startswith("max") else (BLUE, "smallest")
            ax.plot(table["time_s"], table[name], color=colour, label=label, linewidth=1.2)
        mark_corners(ax, TRACKING)
        against_time(ax, "distance between vehicles [m]")
        ax.set_ylim(bottom=0.0)
    _paper_line(axes[1], LAW.min_spacing_m, "paper, smallest")
    _paper_line(axes[1], LAW.mean_min_spacing_m, "paper, time mean")
    letter(axes[0], "largest and smallest")
    letter(axes[1], "the smallest alone")
    for ax in axes:
        ax.legend(fontsize=8)
    return figure


def _paper_line(ax: Axes, value: float | None, label: str) -> None:
    if value is not None:
        ax.axhline(value, color=GREEN, linestyle="--" if "mean" in label else "-.", label=f"{label}: {value:g} m")


PARTS = (
    Part("figure-7", "Start and end of the swarm's tracking", (TRACKING,), states, draw_states, CAPTION),
    Part("figure-8", "Routes of the swarm and of its centre", (TRACKING,), routes, draw_all_routes, CAPTION),
    Part("figure-9", "Headings, and the centre's deviation", (TRACKING,), headings, draw_headings, CAPTION),
    Part("figure-10", "Largest and smallest distance between vehicles", (TRACKING,), spacing, draw_spacing, CAPTION),
)
