"""Figures 11 to 15 and Table 2: obstacle avoidance (sections 5.2 and 5.3)."""

# pyright: reportUnknownMemberType=false
# Matplotlib leaves the types of its keyword arguments open.

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from uuv_marl.baselines.bio_inspired import Gains
from uuv_marl.benchmark.paper import PAPER
from uuv_marl.benchmark.style import BLACK, BLUE, COLOURS, GREEN, ORANGE, legend, panels
from uuv_marl.reproduce.drawing import against_time, draw_routes, plan, route_table
from uuv_marl.reproduce.study import (
    COMPARATORS,
    DELTA_LARGE,
    DELTA_SMALL,
    MULTI,
    SINGLE,
    ZETA_LARGE,
    ZETA_SMALL,
    Case,
    Columns,
    Part,
    Report,
    Study,
    Tables,
    stack,
)


def distances(study: Study, case: Case) -> Columns:
    """Smallest distance of any vehicle from each obstacle's surface over time."""
    trace = study.trace(case, 0)
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
        against_time(ax, "smallest distance to the obstacle's surface [m]")
        ax.set_title(f"distance to the obstacle{'s' * (len(names) > 1)}: {words}")
    for value, style in zip(stated, ("-.", (0, (1, 1))), strict=False):
        axes[1].axhline(value, color=BLACK, linestyle=style, linewidth=1.2, label=f"paper's smallest: {value:g} m")
    for value, style, label in (
        (scenario.constraints.s_o_m, ":", "keep clear (s_o)"),
        (scenario.contact.hull_radius_m, "--", "collision"),
    ):
        axes[1].axhline(value, color=ORANGE, linestyle=style, linewidth=1.0, label=f"{label}: {value:g} m")
    axes[1].set_ylim(-2.0, 40.0)


def single(study: Study, _report: Report) -> Tables:
    """Figure 11."""
    return {"figure-11a": route_table(study, SINGLE), "figure-11b": distances(study, SINGLE)}


def draw_single(made: Tables) -> Figure:
    """Routes, and the distance over time."""
    figure, axes = panels(3, size=(4.6, 4.6))
    draw_routes(axes[0], made["figure-11a"])
    plan(axes[0], SINGLE)
    axes[0].set_title("routes")
    draw_distances(axes[1:], made["figure-11b"], SINGLE)
    legend(figure, columns=6)
    return figure


def gains_part(name: str, symbol: str, small: Case, large: Case) -> Part:
    """Figures 12 and 13: routes with one obstacle gain too small and too large."""

    def tables(study: Study, _report: Report) -> Tables:
        return {f"{name}a": route_table(study, small), f"{name}b": route_table(study, large)}

    def draw(made: Tables) -> Figure:
        figure, axes = panels(2)
        for ax, key, case, words in zip(axes, "ab", (small, large), ("too small", "too large"), strict=True):
            draw_routes(ax, made[f"{name}{key}"])
            plan(ax, case)
            ax.set_title(f"({key}) {symbol} {words}: {_gain(case, symbol):g} (Table 1: {_gain(SINGLE, symbol):g})")
        legend(figure, columns=4)
        return figure

    return Part(name, (small, large, SINGLE), tables, draw)


def _gain(case: Case, symbol: str) -> float:
    gains = case.parameters.get("gains", Gains())
    return float(getattr(gains, symbol))


def multiple(study: Study, _report: Report) -> Tables:
    """Figure 14."""
    return {"figure-14": route_table(study, MULTI)}


def draw_multiple(made: Tables) -> Figure:
    """Routes among four obstacles."""
    figure, (ax,) = panels(1, size=(7.0, 6.8))
    draw_routes(ax, made["figure-14"])
    plan(ax, MULTI)
    legend(figure, columns=4)
    return figure


def each_obstacle(study: Study, _report: Report) -> Tables:
    """Figure 15."""
    return {"figure-15": distances(study, MULTI)}


def draw_each_obstacle(made: Tables) -> Figure:
    """The whole range, and the part below 40 m."""
    figure, axes = panels(2)
    draw_distances(axes, made["figure-15"], MULTI)
    legend(figure, columns=4)
    return figure


def comparison(study: Study, _report: Report) -> Tables:
    """Table 2 with all seeds, in both forms of the comparators."""
    parts: list[Columns] = []
    for policy, case in {**COMPARATORS, "bio_inspired": SINGLE}.items():
        stated = PAPER.get(("single_obstacle", policy))
        distance = stated.min_obstacle_distance_m if stated else None
        seeds = len(study.seeds)
        parts.append(
            {
                "policy": np.full(seeds, policy),
                "seed": np.arange(seeds),
                "task_time_s": study.metric(case, "task_time_s"),
                "min_obstacle_distance_m": study.metric(case, "min_obstacle_distance_m"),
                "paper_task_time_s": np.full(seeds, (stated.task_time_s if stated else None) or np.nan),
                "paper_min_obstacle_distance_m": np.full(seeds, distance[0] if distance else np.nan),
            }
        )
    return {"table-2": stack(parts)}


def draw_comparison(made: Tables) -> Figure:
    """Every seed, side by side so that all can be seen, and the paper's value."""
    table = made["table-2"]
    policies = list(dict.fromkeys(table["policy"].tolist()))
    figure, axes = panels(2)
    heads = (("task_time_s", "task time [s]"), ("min_obstacle_distance_m", "smallest distance to the obstacle [m]"))
    for ax, (name, words) in zip(axes, heads, strict=True):
        for k, policy in enumerate(policies):
            own = table["policy"] == policy
            place = k + np.linspace(-0.25, 0.25, int(own.sum()))
            ax.plot(place, table[name][own], "o", color=BLUE, mec="none", alpha=0.6, label="ours: one seed")
            ax.plot(k, table[f"paper_{name}"][own][0], "D", color=ORANGE, ms=7, ls="", label="paper, Table 2")
        ax.set_xticks(range(len(policies)), policies, rotation=20, ha="right")
        ax.set_ylabel(words)
    stated = PAPER["single_obstacle", "bio_inspired"].min_obstacle_distance_m or (np.nan,)
    axes[1].plot(len(policies) - 1, stated[-1], "s", color=GREEN, ms=7, ls="", label="paper, section 5.2.1")
    axes[1].set_ylim(bottom=0.0)
    legend(figure)
    return figure


PARTS = (
    Part("figure-11", (SINGLE,), single, draw_single),
    gains_part("figure-12", "zeta_o", ZETA_SMALL, ZETA_LARGE),
    gains_part("figure-13", "delta_o", DELTA_SMALL, DELTA_LARGE),
    Part("figure-14", (MULTI,), multiple, draw_multiple),
    Part("figure-15", (MULTI,), each_obstacle, draw_each_obstacle),
    Part("table-2", (*COMPARATORS.values(), SINGLE), comparison, draw_comparison),
)
