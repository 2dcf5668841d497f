"""Figures 7 to 10: trajectory tracking without obstacles (section 5.1)."""

# pyright: reportUnknownMemberType=false
# Matplotlib leaves the types of its keyword arguments open.

import numpy as np
from matplotlib.figure import Figure

from research.columns import Columns, where
from research.paper import drawing
from research.paper.cases import TRACKING
from research.paper.measures import SPEED_MPS, corner_times, mean_heading, path_distance
from research.part import Part, Share, Tables
from uuv_marl.benchmark.paper import PAPER
from uuv_marl.benchmark.style import BLACK, BLUE, GREEN, ORANGE, PINK, legend, panels
from uuv_marl.benchmark.suite import Suite


def figure_7(suite: Suite, _report: Share) -> Tables:
    """Positions and velocities at the start, and when the swarm has reached the end."""
    trace = suite.trace(TRACKING, 0)

    def at(index: int) -> Columns:
        position, velocity = trace["route_position"][index], trace["route_velocity"][index]
        return {
            "vehicle": np.arange(len(position)),
            "group": drawing.start_groups(trace),
            "time_s": np.full(len(position), trace["route_time_s"][index]),
            "x_m": position[:, 0],
            "y_m": position[:, 1],
            "velocity_x_mps": velocity[:, 0],
            "velocity_y_mps": velocity[:, 1],
            "heading_deg": np.degrees(trace["route_heading"][index]),
        }

    return {"figure-7a": at(0), "figure-7b": at(-1)}


def draw_7(computed: Tables) -> Figure:
    """Circles, and arrows for the velocities; an arrow of the fastest is 25 m long in each panel."""
    figure, axes = panels(2)
    for ax, name, words in zip(axes, ("figure-7a", "figure-7b"), ("start", "end"), strict=True):
        table = computed[name]
        fastest = float(f"{np.hypot(table['velocity_x_mps'], table['velocity_y_mps']).max():.1g}")
        drawing.plan(ax, TRACKING, f"({name[-1]}) {words}, t = {float(table['time_s'][0]):g} s")
        for group, colour, label in drawing.GROUPS:
            own = where(table, group=group)
            x, y, u, v = (own[column] for column in ("x_m", "y_m", "velocity_x_mps", "velocity_y_mps"))
            ax.plot(x, y, "o", color=colour, mfc="none", label=label)
            arrows = ax.quiver(x, y, u, v, color=colour, angles="xy", scale_units="xy", scale=fastest / 25, width=0.006)
            if not group:
                ax.quiverkey(arrows, 0.8, 1.04, fastest, f"{fastest:g} m/s", labelpos="E", color=BLACK)
        x, y = (float(table[column].min() + table[column].max()) / 2 for column in ("x_m", "y_m"))
        ax.set(xlim=(x - 125.0, x + 125.0), ylim=(y - 125.0, y + 125.0))
    return legend(figure)


def figure_8(suite: Suite, _report: Share) -> Tables:
    """Routes of all vehicles, and of their centre."""
    trace = suite.trace(TRACKING, 0)
    centre = trace["route_position"].mean(axis=1)
    return {
        "figure-8a": drawing.route_table(suite, TRACKING),
        "figure-8b": {"time_s": trace["route_time_s"], "centre_x_m": centre[:, 0], "centre_y_m": centre[:, 1]},
    }


def draw_8(computed: Tables) -> Figure:
    """Paths of the vehicles, and the centre's path over the trajectory."""
    figure, (left, right) = panels(2)
    drawing.draw_routes(left, computed["figure-8a"], TRACKING, "(a) every vehicle")
    drawing.plan(right, TRACKING, "(b) centre of the swarm")
    centre = computed["figure-8b"]
    right.plot(centre["centre_x_m"], centre["centre_y_m"], color=GREEN, label="route of the swarm's centre")
    return legend(figure, columns=4)


def figure_9(suite: Suite, _report: Share) -> Tables:
    """Every vehicle's heading, and the centre's deviation: from l(t), and from the path."""
    trace = suite.trace(TRACKING, 0)
    heading, time = trace["route_heading"], trace["route_time_s"]
    vehicles = int(heading.shape[1])
    legs = np.diff(trace["waypoints"], axis=0)
    leg = np.searchsorted(corner_times(trace["waypoints"], SPEED_MPS)[:-1], time, side="right")
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
            "order_parameter": trace["order_parameter"][::5],
        },
        "figure-9c": {
            "time_s": time,
            "mean_heading_deg": np.degrees(mean_heading(heading)),
            "leg_deg": np.degrees(np.arctan2(legs[leg, 1], legs[leg, 0])),
        },
    }


def draw_9(computed: Tables) -> Figure:
    """Every heading and their mean, how far they agree, and the centre's deviation."""
    figure, (left, middle, right) = panels(3, size=(4.4, 4.4))
    every, mean, deviation = (computed[f"figure-9{letter}"] for letter in "acb")
    left.plot(every["time_s"], every["heading_deg"], ",", color=BLUE, alpha=0.25)
    left.plot([], [], ".", color=BLUE, label="heading of a vehicle")
    left.plot(mean["time_s"], mean["mean_heading_deg"], color=ORANGE, label="mean heading")
    left.plot(mean["time_s"], mean["leg_deg"], "--", color=BLACK, linewidth=1.0, label="direction of l(t)'s leg")
    left.set(ylim=(-180, 180), yticks=range(-180, 181, 60))
    time, order = deviation["time_s"], deviation["order_parameter"]
    middle.plot(time, deviation["from_l_m"], color=GREEN, label="from l(t)")
    middle.plot(time, deviation["from_path_m"], color=PINK, label="from the path")
    right.plot(time, order, color=BLUE, label="length of the mean heading vector")
    right.set_ylim(0.0, 1.02)
    drawing.against_time(left, "heading psi, clockwise from north [deg]", "(a) headings")
    drawing.against_time(middle, "deviation of the swarm's centre [m]", "(b) centre and given trajectory")
    drawing.against_time(right, "order parameter, 1 where all are aligned [1]", "(c) how far headings agree")
    for ax in (left, middle, right):
        drawing.mark_corners(ax, TRACKING)
    return legend(figure, columns=7)


def figure_10(suite: Suite, _report: Share) -> Tables:
    """Largest and smallest distance between two vehicles over time."""
    trace = suite.trace(TRACKING, 0)
    return {"figure-10": {name: trace[name][::5] for name in ("time_s", "max_spacing_m", "min_spacing_m")}}


def draw_10(computed: Tables) -> Figure:
    """Each by itself, so that its changes can be seen, with the paper's numbers and the bounds."""
    figure, axes = panels(2)
    table, scenario, stated = computed["figure-10"], TRACKING.load(), PAPER["tracking", "bio_inspired"]
    for ax, name, words in zip(axes, ("max_spacing_m", "min_spacing_m"), ("(a) largest", "(b) smallest"), strict=True):
        ax.plot(table["time_s"], table[name], color=BLUE, label="ours")
        drawing.mark_corners(ax, TRACKING)
        drawing.against_time(ax, f"{words[4:]} distance between two vehicles [m]", words)
        ax.set_ylim(0.0, 1.05 * float(table[name].max()))
    for value, style, colour, label in (
        (stated.mean_min_spacing_m, "--", GREEN, "paper, time mean of the smallest"),
        (stated.min_spacing_m, "-.", GREEN, "paper, smallest"),
        (scenario.constraints.s_u_m, ":", ORANGE, "keep apart (s_u)"),
        (2.0 * scenario.collision.hull_radius_m, "--", ORANGE, "collision"),
    ):
        if value is not None:
            axes[1].axhline(value, color=colour, linestyle=style, linewidth=1.0, label=f"{label}: {value:g} m")
    return legend(figure, columns=3)


PARTS = (
    Part("figure-7", (TRACKING,), figure_7, draw_7),
    Part("figure-8", (TRACKING,), figure_8, draw_8),
    Part("figure-9", (TRACKING,), figure_9, draw_9),
    Part("figure-10", (TRACKING,), figure_10, draw_10),
)
