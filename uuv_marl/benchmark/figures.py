"""The benchmark's pictures, a panel for each policy: trajectories, distance to obstacles and spacing over time."""

# pyright: reportUnknownMemberType=false
# Matplotlib leaves the types of its keyword arguments open.

from collections.abc import Callable, Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from uuv_marl.benchmark.results import Results, Trace
from uuv_marl.benchmark.style import BLACK, BLUE, GREEN, ORANGE, PINK, draw_map, house_style, legend, panels, save
from uuv_marl.extras import pictures
from uuv_marl.scenario import Scenario, conditions, disturbances
from uuv_marl.sim.swarm import Swarm
from uuv_marl.tasks.groups import groups_of
from uuv_marl.types import Float32, Float64

with pictures():
    from matplotlib.axes import Axes
    from matplotlib.collections import LineCollection
    from matplotlib.figure import Figure

_TEAMS = (BLUE, GREEN, PINK, BLACK)
_GRID_S = 0.5
_ROUTE_S = 2.0
_TICKS_M = (-20, -10, -5, 0, 5, 10, 20, 50, 100, 200)


def draw_all(results: Results, scenario: str, policies: Sequence[str], seeds: Sequence[int]) -> list[Path]:
    """Draw all pictures of a scenario as PNG in ``figures/``; return their paths."""
    present = [policy for policy in policies if results.select(scenario, policy, seeds)]
    if not present:
        return []
    constraints, hull_m = results.scenarios[scenario].constraints, results.scenarios[scenario].collision.hull_radius_m
    curves = {p: [results.trace(scenario, p, row.seed) for row in results.select(scenario, p, seeds)] for p in present}
    where = _where(results.scenarios[scenario], f"{len(seeds)} seeds")
    figures: dict[str, Figure] = {}
    with house_style():
        if shown := [p for p in present if results.has(scenario, p, 0)]:
            figures["routes"] = _routes(results, scenario, shown)
        if curves[present[0]][0]["obstacles"].size:
            limits = {"keep clear (s_o)": constraints.s_o_m, "collision": hull_m}
            figure, axes = _over_time(curves, _nearest, limits, "distance to the nearest obstacle [m]")
            low = min(-1.0, *(float(ax.dataLim.ymin) - 1.0 for ax in axes))
            axes[0].set_yscale("symlog", linthresh=10.0)
            axes[0].set_yticks(_TICKS_M, labels=[str(tick) for tick in _TICKS_M], minor=False)
            axes[0].set_ylim(bottom=low)
            for ax in axes:
                ax.axhspan(low, 0.0, color="0.85", zorder=0, label="inside the obstacle")
            figure.suptitle(f"How near the swarm comes to obstacles' surfaces: {where}")
            figures["obstacle_distance"] = figure
        limits = {"keep apart (s_u)": constraints.s_u_m, "collision": 2.0 * hull_m}
        figure, axes = _over_time(curves, lambda trace: trace["min_spacing_m"], limits, "smallest spacing [m]")
        axes[0].set_ylim(bottom=0.0)
        figure.suptitle(f"How near the two closest vehicles are: {where}")
        figures["spacing"] = figure
        for figure in (figure for name, figure in figures.items() if name != "routes"):
            legend(figure, figure.axes[-1])
        return [save(figure, results.folder / "figures" / f"{scenario}_{name}.png") for name, figure in figures.items()]


def _where(scenario: Scenario, seeds: str) -> str:
    """Scenario, vehicles and seeds of a picture; disturbances in a second line."""
    conditions_line = f"\n{conditions(scenario)}" if disturbances(scenario) else ""
    return (
        f"{scenario.name}, {scenario.swarm.num_vehicles} vehicles ({scenario.vehicle.name}), {seeds}{conditions_line}"
    )


def _grid(num: int, size: tuple[float, float]) -> tuple[Figure, list[Axes]]:
    """Panels on common axes, with at least one empty panel for the legend."""
    rows = -(-(num + 1) // 4)
    figure, axes = panels(num + 1, -(-(num + 1) // rows), size, sharex=True, sharey=True)
    for ax in axes[num:]:
        ax.set_axis_off()
    for ax in axes[max(0, num - len(axes) // rows) : num]:
        ax.xaxis.set_tick_params(labelbottom=True)
    return figure, axes


def _routes(results: Results, scenario: str, policies: Sequence[str]) -> Figure:
    figure, axes = _grid(len(policies), (3.4, 3.6))
    hull_m = results.scenarios[scenario].collision.hull_radius_m
    traces = [results.trace(scenario, policy, 0) for policy in policies]
    swarm = Swarm(results.scenarios[scenario])
    swarm.reset(0)
    groups = groups_of(swarm)
    colours = _TEAMS[: int(groups.team.max()) + 1]
    for ax, policy, trace in zip(axes, policies, traces, strict=False):
        every = max(1, round(_ROUTE_S / float(np.diff(trace["route_time_s"][:2])[0])))
        position = trace["route_position"][::every, :, ::-1]
        legs = np.stack([position[:-1], position[1:]], axis=2)
        lines = LineCollection(legs.reshape(-1, 2, 2).tolist(), linewidths=0.5)
        lines.set(color=[colours[k] for k in groups.team] * len(legs))
        if not groups.informed.all():
            lines.set_linewidth(np.where(groups.informed, 1.5, 0.5).tolist() * len(legs))
            ax.plot([], [], color=BLACK, linewidth=1.5, label="thick: observes l(t)")
        ax.add_collection(lines)
        for k, (team, corners) in enumerate(groups.paths.values()):
            discs = trace["obstacles"][: 0 if k else None, [1, 0, 2]]
            draw_map(ax, corners[:, ::-1], discs, None if team is None else colours[team])
        for (label, k, mark), (team, colour) in product((("start", 0, "o"), ("end", -1, ".")), enumerate(colours)):
            place, fill = trace["route_position"][k, groups.team == team], "none" if mark == "o" else colour
            name = label if len(colours) == 1 else f"{label} of group {team + 1}"
            ax.plot(*place.T[::-1], mark, color=colour, mfc=fill, ms=3, mew=0.5, label=name)
        collisions = _collisions_of(trace, hull_m)
        ax.plot(*collisions.T[::-1], "x", color=ORANGE, ms=8, mew=2.0, zorder=6, label="collision")
        ax.set_title(f"{policy[-28:]}\n{_outcome(results.select(scenario, policy, [0])[0].metrics)}")
    figure.supxlabel("east [m]")
    figure.supylabel("north [m]")
    figure.suptitle(f"Trajectories of each policy: {_where(results.scenarios[scenario], 'seed 0')}")
    named = dict(zip(*axes[0].get_legend_handles_labels()[::-1], strict=True))
    axes[-1].legend(named.values(), named.keys(), loc="upper center", fontsize=9)
    return figure


def _outcome(metrics: Mapping[str, Any]) -> str:
    time, collisions, own = metrics["task_time_s"], metrics["collisions"], metrics.get("task")
    if own is not None and (share := own.get("success_share")) is not None:
        arrived = f"success {share:.0%}"
    else:
        arrived = "never arrives" if time is None else f"arrives after {time:.0f} s"
    return f"{arrived}, {collisions or 'no'} collision{'' if collisions == 1 else 's'}"


def _collisions_of(trace: Trace, hull_m: float) -> Float32:
    """Places where collisions begin, shape (collision, 2): the vehicle nearest to another or to an obstacle."""
    points: list[Float32] = []
    for distance, limit, of_pair in ((trace["min_spacing_m"], 2.0 * hull_m, True), (_nearest(trace), hull_m, False)):
        below = distance < limit
        for time in trace["time_s"][below & ~np.append(np.False_, below[:-1])]:
            place = trace["route_position"][np.argmin(np.abs(trace["route_time_s"] - time))]
            if of_pair:
                gap = np.linalg.norm(place[:, None] - place, axis=-1) + np.diag(np.full(len(place), np.inf))
            else:
                discs = trace["obstacles"]
                gap = np.linalg.norm(place[:, None] - discs[:, :2], axis=-1) - discs[:, 2]
            points.append(place[np.argmin(np.nan_to_num(gap, nan=np.inf).min(axis=1))])  # lost vehicles are NaN
    return np.array(points, np.float32).reshape(-1, 2)


def _nearest(trace: Trace) -> Float32:
    """Smallest distance of any vehicle to any obstacle over time [m]; NaN without obstacles."""
    distance = trace["obstacle_distance_m"]
    return distance.min(axis=1) if distance.shape[1] else np.full(len(distance), np.nan, np.float32)


def _over_time(
    curves: Mapping[str, Sequence[Trace]], value: Callable[[Trace], Float32], limits: Mapping[str, float], what: str
) -> tuple[Figure, list[Axes]]:
    """Median and range over seeds, a panel for each policy, with the other medians in grey; the used panels.

    ``value`` of a run has shape (time,); ``limits`` are lines across all panels [m], by their labels.
    """
    figure, axes = _grid(len(curves), (3.1, 2.7))
    bands = {policy: _band([(trace["time_s"], value(trace)) for trace in traces]) for policy, traces in curves.items()}
    for ax, (policy, traces) in zip(axes, curves.items(), strict=False):
        for grid, _, median, _ in bands.values():
            ax.plot(grid, median, color="0.75", linewidth=0.7, label="medians of the others")
        grid, low, median, high = bands[policy]
        ax.fill_between(grid, low, high, color=BLUE, alpha=0.25, lw=0, label="lowest to highest seed")
        ax.plot(grid, median, color=BLUE, label="median over seeds")
        for (label, limit), style in zip(limits.items(), (":", "--"), strict=True):
            ax.axhline(limit, color=ORANGE, linestyle=style, linewidth=1.0, label=f"{label}: {limit:g} m")
        smallest = min(float(np.nanmin(value(trace), initial=np.inf)) for trace in traces)
        ax.set_title(f"{policy[-28:]}\nsmallest of all seeds: {smallest:.2f} m")
    figure.supxlabel("time [s]")
    figure.supylabel(what)
    return figure, axes[: len(curves)]


def _band(series: Sequence[tuple[Float32, Float32]]) -> tuple[Float64, ...]:
    """Time, lowest, median and highest value, shape (time,) each, while more than half of the seeds run."""
    grid = np.arange(0.0, max(float(time[-1]) for time, _ in series), _GRID_S)
    curves = np.array([np.interp(grid, time, values, right=np.nan) for time, values in series])
    most = np.isfinite(curves).sum(axis=0) > len(series) / 2
    curves = curves[:, most]
    return grid[most], np.nanmin(curves, axis=0), np.nanmedian(curves, axis=0), np.nanmax(curves, axis=0)
