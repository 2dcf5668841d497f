"""The benchmark's pictures: routes with obstacles, distance to obstacles and spacing over time."""

# pyright: reportUnknownMemberType=false
# Matplotlib leaves the types of its keyword arguments open.

import textwrap
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from numpy.typing import NDArray

from uuv_marl.benchmark.results import Results, scenario_hash

Float32 = NDArray[np.float32]
Value = Callable[[dict[str, Float32]], Float32]
# Okabe and Ito's palette, distinguishable without colour vision; the yellow is left out on white.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#999999")
_GRID_S = 0.5


def draw_all(results: Results, scenario: str, policies: Sequence[str], seeds: Sequence[int]) -> list[Path]:
    """All pictures of a scenario, as PNG in ``figures/``; the paths."""
    folder = results.folder / "figures"
    folder.mkdir(exist_ok=True)
    present = [policy for policy in policies if results.select(scenario, policy, seeds)]
    if not present:
        return []
    made = [_routes(results, scenario, present, folder)]
    if results.trace(scenario, present[0], results.select(scenario, present[0], seeds)[0].seed)["obstacles"].size:
        made.append(_distance(results, scenario, present, seeds, folder))
    made.append(_spacing(results, scenario, present, seeds, folder))
    return [path for path in made if path is not None]


def _routes(results: Results, scenario: str, policies: Sequence[str], folder: Path) -> Path | None:
    shown = [p for p in policies if results.has(scenario, p, 0)]
    if not shown:
        return None
    columns = min(3, len(shown))
    rows = -(-len(shown) // columns)
    figure = Figure(figsize=(4.2 * columns + 0.4, 4.2 * rows + 0.6), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
    for k, policy in enumerate(shown):
        ax: Axes = axes[k // columns, k % columns]
        trace = results.trace(scenario, policy, 0)
        routes, waypoints = trace["route_position"], trace["waypoints"]
        ax.plot(routes[:, :, 1], routes[:, :, 0], color=COLOURS[0], linewidth=0.4, alpha=0.6)
        ax.plot(waypoints[:, 1], waypoints[:, 0], color="black", linewidth=1.0, linestyle="--")
        ax.plot(routes[0, :, 1], routes[0, :, 0], ".", color=COLOURS[2], markersize=3)
        ax.plot(routes[-1, :, 1], routes[-1, :, 0], ".", color=COLOURS[1], markersize=3)
        for x, y, radius in trace["obstacles"]:
            ax.add_patch(Circle((float(y), float(x)), float(radius), color="0.35"))
        ax.set_title(policy, fontsize=10)
        ax.set_aspect("equal")
        ax.grid(alpha=0.25)
    for k in range(len(shown), rows * columns):
        axes[k // columns, k % columns].axis("off")
    figure.supxlabel("east [m]")
    figure.supylabel("north [m]")
    title = f"{_name(results, scenario)}: routes, seed 0; green start, orange end, dashed trajectory, grey obstacles"
    figure.suptitle(textwrap.fill(title, 55 * columns), fontsize=10)
    return _save(figure, folder / f"{scenario}_routes.png")


def _distance(results: Results, scenario: str, policies: Sequence[str], seeds: Sequence[int], folder: Path) -> Path:
    def nearest(trace: dict[str, Float32]) -> Float32:
        distance = trace["obstacle_distance_m"]
        return distance.min(axis=1) if distance.shape[1] else np.full(len(distance), np.nan, np.float32)

    safe = results.scenarios[scenario].constraints.s_o_m
    figure, ax = _time_axes(results, scenario, "smallest distance to an obstacle's surface")
    _bands(ax, results, scenario, policies, seeds, nearest)
    ax.axhline(safe, color="black", linestyle=":", linewidth=1.0)
    ax.annotate(f"s_o = {safe:g} m", (1.0, safe), xycoords=("axes fraction", "data"), ha="right", va="bottom")
    ax.axhline(0.0, color="0.35", linewidth=1.0)
    ax.set_ylabel("distance to obstacle [m]")
    ax.set_yscale("symlog", linthresh=10.0)
    ax.set_ylim(bottom=min(-1.0, float(ax.dataLim.ymin) - 1.0))
    ax.set_yticks([0, 5, 10, 20, 50, 100, 200], labels=["0", "5", "10", "20", "50", "100", "200"])
    return _save(figure, folder / f"{scenario}_obstacle_distance.png")


def _spacing(results: Results, scenario: str, policies: Sequence[str], seeds: Sequence[int], folder: Path) -> Path:
    safe = results.scenarios[scenario].constraints.s_u_m
    figure, ax = _time_axes(results, scenario, "smallest distance between two vehicles")
    _bands(ax, results, scenario, policies, seeds, lambda trace: trace["min_spacing_m"])
    ax.axhline(safe, color="black", linestyle=":", linewidth=1.0)
    ax.annotate(f"s_u = {safe:g} m", (1.0, safe), xycoords=("axes fraction", "data"), ha="right", va="bottom")
    ax.set_ylabel("smallest spacing [m]")
    ax.set_ylim(bottom=0.0)
    return _save(figure, folder / f"{scenario}_spacing.png")


def _time_axes(results: Results, scenario: str, what: str) -> tuple[Figure, Axes]:
    figure = Figure(figsize=(9.0, 4.8), layout="constrained")
    ax = figure.subplots()
    ax.set_title(f"{_name(results, scenario)}: {what}\nmedian over seeds, band from lowest to highest", fontsize=10)
    ax.set_xlabel("time [s]")
    ax.grid(alpha=0.25)
    return figure, ax


def _bands(
    ax: Axes, results: Results, scenario: str, policies: Sequence[str], seeds: Sequence[int], value: Value
) -> None:
    styles = ("-", "--")
    for k, policy in enumerate(policies):
        traces = [results.trace(scenario, policy, row.seed) for row in results.select(scenario, policy, seeds)]
        end = max(float(trace["time_s"][-1]) for trace in traces)
        grid = np.arange(0.0, end, _GRID_S)
        curves = np.array([np.interp(grid, trace["time_s"], value(trace), right=np.nan) for trace in traces])
        kept = np.isfinite(curves).sum(axis=0) > len(traces) / 2
        curves, grid = curves[:, kept], grid[kept]
        if not grid.size:
            continue
        colour = COLOURS[k % len(COLOURS)]
        ax.fill_between(grid, np.nanmin(curves, axis=0), np.nanmax(curves, axis=0), color=colour, alpha=0.15, lw=0)
        ax.plot(grid, np.nanmedian(curves, axis=0), styles[k % 2], color=colour, lw=1.4, label=policy)
    ax.legend(fontsize=8, ncols=2)


def _name(results: Results, scenario: str) -> str:
    loaded = results.scenarios[scenario]
    return f"{scenario} v{loaded.version}, n = {loaded.swarm.num_vehicles}, configuration {scenario_hash(loaded)}"


def _save(figure: Figure, path: Path) -> Path:
    FigureCanvasAgg(figure).print_png(str(path))
    return path
