"""Figures 7 to 10: trajectory tracking without obstacles (section 5.1)."""

# pyright: reportUnknownMemberType=false
# Matplotlib leaves the types of its keyword arguments open.

import numpy as np
from matplotlib.figure import Figure

from uuv_marl.benchmark.paper import PAPER
from uuv_marl.benchmark.style import BLACK, BLUE, GREEN, ORANGE, PINK, legend, panels
from uuv_marl.reproduce.drawing import against_time, draw_routes, mark_corners, plan, route_table, start_groups
from uuv_marl.reproduce.measures import SPEED_MPS, corner_times, mean_heading, path_distance
from uuv_marl.reproduce.study import TRACKING, Columns, Part, Report, Study, Tables

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
    """Circles, and arrows for the velocities; an arrow of the fastest is 25 m long in each panel."""
    figure, axes = panels(2)
    for ax, name, words in zip(axes, ("figure-7a", "figure-7b"), ("start", "end"), strict=True):
        table = made[name]
        plan(ax, TRACKING)
        for group, colour, label in ((0, BLUE, "starts to port"), (1, ORANGE, "starts to starboard")):
            x, y, u, v = (
                table[column][table["group"] == group] for column in ("x_m", "y_m", "velocity_x_mps", "velocity_y_mps")
            )
            ax.plot(x, y, "o", color=colour, mfc="none", label=label)
            fastest = float(f"{np.hypot(table['velocity_x_mps'], table['velocity_y_mps']).max():.1g}")
            arrows = ax.quiver(x, y, u, v, color=colour, angles="xy", scale_units="xy", scale=fastest / 25, width=0.006)
            if not group:
                ax.quiverkey(arrows, 0.8, 1.04, fastest, f"{fastest:g} m/s", labelpos="E", color=BLACK)
        for limits, values in ((ax.set_xlim, table["x_m"]), (ax.set_ylim, table["y_m"])):
            middle = float(values.min() + values.max()) / 2
            limits(middle - 125.0, middle + 125.0)
        ax.set_title(f"({name[-1]}) {words}, t = {float(table['time_s'][0]):g} s")
    legend(figure)
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
    left.set_title("(a) every vehicle")
    plan(right, TRACKING)
    centre = made["figure-8b"]
    right.plot(centre["centre_x_m"], centre["centre_y_m"], color=GREEN, label="route of the swarm's centre")
    right.set_title("(b) centre of the swarm")
    legend(figure, columns=4)
    return figure


def headings(study: Study, _report: Report) -> Tables:
    """Every vehicle's heading, and the centre's deviation: from l(t), and from the path."""
    trace = study.trace(TRACKING, 0)
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


def draw_headings(made: Tables) -> Figure:
    """Every heading and their mean, how far they agree, and the centre's deviation."""
    figure, axes = panels(3, size=(4.4, 4.4))
    every, mean, deviation = (made[f"figure-9{letter}"] for letter in "acb")
    axes[0].plot(every["time_s"], every["heading_deg"], ",", color=BLUE, alpha=0.25)
    axes[0].plot([], [], ".", color=BLUE, label="heading of a vehicle")
    axes[0].plot(mean["time_s"], mean["mean_heading_deg"], color=ORANGE, label="mean heading")
    axes[0].plot(mean["time_s"], mean["leg_deg"], "--", color=BLACK, linewidth=1.0, label="direction of l(t)'s leg")
    axes[0].set_ylim(-180, 180)
    axes[0].set_yticks(range(-180, 181, 60))
    against_time(axes[0], "heading psi, clockwise from north [deg]")
    axes[0].set_title("(a) headings")
    axes[1].plot(deviation["time_s"], deviation["from_l_m"], color=GREEN, label="from l(t)")
    axes[1].plot(deviation["time_s"], deviation["from_path_m"], color=PINK, label="from the path")
    against_time(axes[1], "deviation of the swarm's centre [m]")
    axes[1].set_title("(b) centre and given trajectory")
    axes[2].plot(
        deviation["time_s"], deviation["order_parameter"], color=BLUE, label="length of the mean heading vector"
    )
    axes[2].set_ylim(0.0, 1.02)
    against_time(axes[2], "order parameter, 1 where all are aligned [1]")
    axes[2].set_title("(c) how far headings agree")
    for ax in axes:
        mark_corners(ax, TRACKING)
    legend(figure, columns=7)
    return figure


def spacing(study: Study, _report: Report) -> Tables:
    """Largest and smallest distance between two vehicles over time."""
    trace = study.trace(TRACKING, 0)
    return {"figure-10": {name: trace[name][::5] for name in ("time_s", "max_spacing_m", "min_spacing_m")}}


def draw_spacing(made: Tables) -> Figure:
    """Each by itself, so that its changes can be seen, with the paper's numbers and the bounds."""
    figure, axes = panels(2)
    table, scenario = made["figure-10"], TRACKING.load()
    for ax, name, words in zip(axes, ("max_spacing_m", "min_spacing_m"), ("largest", "smallest"), strict=True):
        ax.plot(table["time_s"], table[name], color=BLUE, label="ours")
        mark_corners(ax, TRACKING)
        against_time(ax, f"{words} distance between two vehicles [m]")
        ax.set_title(f"({'ab'[words == 'smallest']}) {words}")
        ax.set_ylim(0.0, 1.05 * float(table[name].max()))
    for value, style, colour, label in (
        (LAW.mean_min_spacing_m, "--", GREEN, "paper, time mean of the smallest"),
        (LAW.min_spacing_m, "-.", GREEN, "paper, smallest"),
        (scenario.constraints.s_u_m, ":", ORANGE, "keep apart (s_u)"),
        (2.0 * scenario.contact.hull_radius_m, "--", ORANGE, "collision"),
    ):
        if value is not None:
            axes[1].axhline(value, color=colour, linestyle=style, linewidth=1.0, label=f"{label}: {value:g} m")
    legend(figure, columns=3)
    return figure


PARTS = (
    Part("figure-7", (TRACKING,), states, draw_states),
    Part("figure-8", (TRACKING,), routes, draw_all_routes),
    Part("figure-9", (TRACKING,), headings, draw_headings),
    Part("figure-10", (TRACKING,), spacing, draw_spacing),
)
