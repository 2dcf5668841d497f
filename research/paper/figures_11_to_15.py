"""Figures 11 to 15: obstacle avoidance (section 5.2)."""

# pyright: reportUnknownMemberType=false
# Matplotlib leaves the types of its keyword arguments open.

from collections.abc import Callable, Mapping, Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from research.columns import Columns
from research.paper.cases import DELTA_LARGE, DELTA_SMALL, MULTI, SINGLE, ZETA_LARGE, ZETA_SMALL
from research.paper.drawing import against_time, draw_routes, route_table
from research.part import Part, Share, Tables
from uuv_marl.baselines.paper.bio_inspired import BioInspiredGains
from uuv_marl.benchmark.paper import PAPER
from uuv_marl.benchmark.style import BLACK, COLOURS, ORANGE, legend, panels
from uuv_marl.benchmark.suite import Case, Suite

TableOf = tuple[Callable[[Suite, Case], Columns], Case]
"""A function that makes a table, and its case."""


def distances(suite: Suite, case: Case) -> Columns:
    """Smallest distance of any vehicle from each obstacle's surface over time."""
    trace = suite.trace(case, 0)
    columns = {f"obstacle_{k + 1}_m": d for k, d in enumerate(trace["obstacle_distance_m"][::5].T)}
    return {"time_s": trace["time_s"][::5], **columns}


def draw_distances(axes: Sequence[Axes], table: Columns, case: Case) -> None:
    """All obstacles' curves: the whole range, and the part below 40 m with the paper's numbers and the bounds."""
    names = [name for name in table if name != "time_s"]
    scenario, stated = case.load(), PAPER[case.scenario, "bio_inspired"].min_obstacle_distance_m or ()
    for ax, words in zip(axes, ("the whole range", "below 40 m"), strict=True):
        for k, name in enumerate(names):
            label = f"obstacle {k + 1}" if len(names) > 1 else "ours"
            ax.plot(table["time_s"], table[name], color=COLOURS[k], linestyle=("-", "--")[k % 2], label=label)
        title = f"distance to the obstacle{'s' * (len(names) > 1)}: {words}"
        against_time(ax, "smallest distance to the obstacle's surface [m]", title)
    for value, style in zip(stated, ("-.", (0, (1, 1))), strict=False):
        axes[1].axhline(value, color=BLACK, linestyle=style, linewidth=1.2, label=f"paper's smallest: {value:g} m")
    for value, style, label in (
        (scenario.constraints.s_o_m, ":", "keep clear (s_o)"),
        (scenario.collision.hull_radius_m, "--", "collision"),
    ):
        axes[1].axhline(value, color=ORANGE, linestyle=style, linewidth=1.0, label=f"{label}: {value:g} m")
    axes[1].set_ylim(-2.0, 40.0)


def draw_11(computed: Tables) -> Figure:
    """Routes past one obstacle, and the distance over time."""
    figure, axes = panels(3, size=(4.6, 4.6))
    draw_routes(axes[0], computed["figure-11a"], SINGLE, "routes")
    draw_distances(axes[1:], computed["figure-11b"], SINGLE)
    return legend(figure, columns=6)


def figure_12_or_13(name: str, symbol: str, small: Case, large: Case) -> Part:
    """Routes with one obstacle gain too small and too large."""

    def gain(case: Case) -> float:
        return float(getattr(case.parameters.get("gains", BioInspiredGains()), symbol))

    def draw(computed: Tables) -> Figure:
        figure, axes = panels(2)
        for ax, key, case, words in zip(axes, "ab", (small, large), ("too small", "too large"), strict=True):
            title = f"({key}) {symbol} {words}: {gain(case):g} (Table 1: {gain(SINGLE):g})"
            draw_routes(ax, computed[f"{name}{key}"], case, title)
        return legend(figure, columns=4)

    tables = {f"{name}a": (route_table, small), f"{name}b": (route_table, large)}
    return part(name, (small, large, SINGLE), tables, draw)


def part(name: str, cases: tuple[Case, ...], tables: Mapping[str, TableOf], draw: Callable[[Tables], Figure]) -> Part:
    """A part whose tables are each a function of one case."""

    def compute(suite: Suite, _report: Share) -> Tables:
        return {key: make(suite, case) for key, (make, case) in tables.items()}

    return Part(name, cases, compute, draw)


def draw_14(computed: Tables) -> Figure:
    """Routes among four obstacles."""
    figure, (ax,) = panels(1, size=(7.0, 6.8))
    draw_routes(ax, computed["figure-14"], MULTI)
    return legend(figure, columns=4)


def draw_15(computed: Tables) -> Figure:
    """Distance from each of four obstacles over time: the whole range, and the part below 40 m."""
    figure, axes = panels(2)
    draw_distances(axes, computed["figure-15"], MULTI)
    return legend(figure, columns=4)


PARTS = (
    part("figure-11", (SINGLE,), {"figure-11a": (route_table, SINGLE), "figure-11b": (distances, SINGLE)}, draw_11),
    figure_12_or_13("figure-12", "zeta_o", ZETA_SMALL, ZETA_LARGE),
    figure_12_or_13("figure-13", "delta_o", DELTA_SMALL, DELTA_LARGE),
    part("figure-14", (MULTI,), {"figure-14": (route_table, MULTI)}, draw_14),
    part("figure-15", (MULTI,), {"figure-15": (distances, MULTI)}, draw_15),
)
