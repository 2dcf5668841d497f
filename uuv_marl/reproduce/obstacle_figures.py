"""Figures 11 to 15 and Table 2: obstacle avoidance (sections 5.2 and 5.3)."""

# pyright: reportUnknownMemberType=false
# Matplotlib leaves the types of its keyword arguments open.

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from uuv_marl.baselines.bio_inspired import Gains
from uuv_marl.benchmark.figures import COLOURS
from uuv_marl.benchmark.paper import PAPER
from uuv_marl.reproduce.cases import (
    COMPARATORS,
    DELTA_LARGE,
    DELTA_SMALL,
    MULTI,
    SINGLE,
    ZETA_LARGE,
    ZETA_SMALL,
    Case,
    Report,
    Study,
)
from uuv_marl.reproduce.columns import Columns, stack
from uuv_marl.reproduce.drawing import (
    BLACK,
    BLUE,
    GREEN,
    ORANGE,
    against_time,
    draw_routes,
    letter,
    panels,
    plan,
    route_table,
)
from uuv_marl.reproduce.parts import Part, Tables


def distances(study: Study, case: Case) -> Columns:
    """Smallest distance of any vehicle from each obstacle's surface over time."""
    trace = study.trace(case, 0)
    columns = {f"obstacle_{k + 1}_m": d for k, d in enumerate(trace["obstacle_distance_m"][::5].T)}
    return {"time_s": trace["time_s"][::5], **columns}


def draw_distances(ax: Axes, table: Columns, paper: tuple[float, ...] = ()) -> None:
    """All obstacles' curves."""
    names = [name for name in table if name != "time_s"]
    for k, name in enumerate(names):
        label = f"obstacle {k + 1}" if len(names) > 1 else "ours"
        ax.plot(
            table["time_s"], table[name], color=COLOURS[k], linestyle=("-", "--")[k % 2], label=label, linewidth=1.3
        )
    for value in paper:
        ax.axhline(value, color=BLACK, linestyle=":", linewidth=1.2, label=f"paper's smallest: {value:g} m")
    ax.axhline(0.0, color="0.45", linewidth=1.0)
    against_time(ax, "smallest distance to the obstacle's surface [m]")
    ax.legend(fontsize=8)


def single(study: Study, _report: Report) -> Tables:
    """Figure 11."""
    return {"figure-11a": route_table(study, SINGLE), "figure-11b": distances(study, SINGLE)}


def draw_single(made: Tables) -> Figure:
    """Routes, and the distance over time."""
    figure, (left, right) = panels(2)
    draw_routes(left, made["figure-11a"])
    plan(left, SINGLE)
    letter(left, "(a) routes; dots: end; colour: group at the start")
    draw_distances(right, made["figure-11b"], PAPER["single_obstacle", "bio_inspired"].min_obstacle_distance_m or ())
    letter(right, "(b) distance to the obstacle")
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
            letter(ax, f"({key}) {symbol} {words}: {_gain(case, symbol):g} (Table 1: {_gain(SINGLE, symbol):g})")
        return figure

    caption = f"{small.label(0)}; {large.label(0)}. The paper names no values: these are assumed"
    return Part(name, f"Effect of {symbol} on obstacle avoidance", (small, large, SINGLE), tables, draw, caption)


def _gain(case: Case, symbol: str) -> float:
    gains = case.parameters.get("gains", Gains())
    return float(getattr(gains, symbol))


def multiple(study: Study, _report: Report) -> Tables:
    """Figure 14."""
    return {"figure-14": route_table(study, MULTI)}


def draw_multiple(made: Tables) -> Figure:
    """Routes among four obstacles."""
    figure, (ax,) = panels(1, 7.0, 6.4)
    draw_routes(ax, made["figure-14"])
    plan(ax, MULTI)
    letter(ax, "routes; dots: end; colour: group at the start")
    return figure


def each_obstacle(study: Study, _report: Report) -> Tables:
    """Figure 15."""
    return {"figure-15": distances(study, MULTI)}


def draw_each_obstacle(made: Tables) -> Figure:
    """The whole range, and the part below 40 m."""
    figure, axes = panels(2)
    paper = PAPER["multi_obstacle", "bio_inspired"].min_obstacle_distance_m or ()
    for ax, words in zip(axes, ("smallest distance from each obstacle", "the same, below 40 m"), strict=True):
        draw_distances(ax, made["figure-15"], paper)
        letter(ax, words)
    axes[1].set_ylim(-2.0, 40.0)
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
    """Every seed, and the paper's value."""
    table = made["table-2"]
    policies = list(dict.fromkeys(table["policy"].tolist()))
    figure, axes = panels(2)
    heads = (("task_time_s", "task time [s]"), ("min_obstacle_distance_m", "smallest distance to the obstacle [m]"))
    for ax, (name, words) in zip(axes, heads, strict=True):
        for k, policy in enumerate(policies):
            own = table["policy"] == policy
            ax.plot(
                np.full(own.sum(), k), table[name][own], "o", color=BLUE, markersize=5, alpha=0.4, label="ours, a seed"
            )
            ax.plot(k, table[f"paper_{name}"][own][0], "D", color=ORANGE, markersize=7, label="paper, Table 2")
        if name.startswith("min"):
            stated = PAPER["single_obstacle", "bio_inspired"].min_obstacle_distance_m or (np.nan,)
            ax.plot(len(policies) - 1, stated[-1], "s", color=GREEN, markersize=7, label="paper, section 5.2.1")
        handles, labels = ax.get_legend_handles_labels()
        once = dict(zip(labels, handles, strict=True))
        ax.legend(once.values(), once.keys(), fontsize=8)
        ax.set_xticks(range(len(policies)), policies, rotation=20, ha="right")
        ax.set_ylabel(words)
    return figure


PARTS = (
    Part("figure-11", "Routes past a single obstacle", (SINGLE,), single, draw_single, SINGLE.label(0)),
    gains_part("figure-12", "zeta_o", ZETA_SMALL, ZETA_LARGE),
    gains_part("figure-13", "delta_o", DELTA_SMALL, DELTA_LARGE),
    Part("figure-14", "Routes past four obstacles", (MULTI,), multiple, draw_multiple, MULTI.label(0)),
    Part(
        "figure-15", "Distance from each of four obstacles", (MULTI,), each_obstacle, draw_each_obstacle, MULTI.label(0)
    ),
    Part(
        "table-2",
        "Task time and smallest distance of the three methods",
        (*COMPARATORS.values(), SINGLE),
        comparison,
        draw_comparison,
        "single_obstacle v1, n = 54, all seeds; SFF and SDC are reconstructions",
    ),
)
