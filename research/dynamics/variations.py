"""Beyond the paper: control step and integration step, swarm size, lost vehicles. One picture and table each."""

# pyright: reportUnknownMemberType=false
# Matplotlib leaves the types of its keyword arguments open.

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from research.columns import Columns, columns, where
from research.part import Part, Share, Tables
from uuv_marl.benchmark.paper import PAPER
from uuv_marl.benchmark.style import BLACK, BLUE, ORANGE, legend, panels
from uuv_marl.benchmark.suite import Case, Suite

SEEDS = range(6)


class Quantity(NamedTuple):
    """One panel."""

    scenario: str
    metric: str
    words: str


OWN = (
    Quantity("tracking", "min_spacing_m", "tracking: smallest spacing [m]"),
    Quantity("tracking", "mean_min_spacing_m", "tracking: its time mean [m]"),
    Quantity("tracking", "order_parameter", "tracking: order parameter, time mean [1]"),
    Quantity("single_obstacle", "min_obstacle_distance_m", "single obstacle: smallest distance [m]"),
    Quantity("single_obstacle", "task_time_s", "single obstacle: task time [s]"),
    Quantity("multi_obstacle", "min_obstacle_distance_m", "four obstacles: smallest distance [m]"),
    Quantity("multi_obstacle", "task_time_s", "four obstacles: task time [s]"),
    Quantity("multi_obstacle", "collisions", "four obstacles: collisions [1]"),
)
LOSSES = (
    Quantity("single_obstacle", "task_time_s", "task time [s]"),
    Quantity("single_obstacle", "min_obstacle_distance_m", "smallest distance to the obstacle [m]"),
    Quantity("single_obstacle", "min_spacing_m", "smallest spacing [m]"),
    Quantity("single_obstacle", "collisions", "collisions [1]"),
)


def variation(
    name: str, axis: str, variants: Mapping[str, Mapping[str, object]], quantities: Sequence[Quantity]
) -> Part:
    """A part that runs the paper's controller on every variant, and shows every seed.

    Args:
        name: name of the part and of its table.
        axis: label of the picture's axis: the field that the variants change.
        variants: changed fields of the scenario, by the label on the axis.
        quantities: shown quantities, a panel for each.
    """
    cases = {
        (label, quantity.scenario): Case(
            f"{name} {label} {quantity.scenario}", quantity.scenario, overrides=overrides, seeds=SEEDS
        )
        for label, overrides in variants.items()
        for quantity in quantities
    }

    def tables(suite: Suite, _report: Share) -> Tables:
        rows = [
            {"variant": label, "scenario": scenario, "metric": metric, "seed": seed, "value": value}
            for label in variants
            for scenario, metric, _ in quantities
            for seed, value in zip(SEEDS, suite.metric(cases[label, scenario], metric), strict=True)
        ]
        return {name: columns(rows)}

    def draw(computed: Tables) -> Figure:
        figure, axes = panels(len(quantities), size=(3.6, 3.1))
        for ax, quantity in zip(axes, quantities, strict=True):
            _panel(ax, computed[name], quantity, list(variants))
            ax.set_xlabel(axis)
        return legend(figure)

    return Part(name, tuple(cases.values()), tables, draw)


def _panel(ax: Axes, table: Columns, quantity: Quantity, labels: Sequence[str]) -> None:
    """Draw every seed's value by variant, their mean and the paper's number.

    Args:
        ax: axes to draw on.
        table: rows with variant, scenario, metric, seed and value.
        quantity: quantity to show.
        labels: the variants in the order of the axis.
    """
    ax.set_title(quantity.words)
    ax.set_xticks(range(len(labels)), labels)
    ax.margins(x=0.1, y=0.15)
    own = where(table, scenario=quantity.scenario, metric=quantity.metric)
    if quantity.metric == "collisions" and not own["value"].any():
        ax.text(0.5, 0.5, "none in any run", ha="center", transform=ax.transAxes)
        ax.set(yticks=[], xlim=(-0.5, len(labels) - 0.5))
        return
    by_label = [where(own, variant=label)["value"].astype(np.float64) for label in labels]
    for k, values in enumerate(by_label):
        ax.plot(np.full(len(values), k), values, "o", color=BLUE, alpha=0.5, label="one seed")
        if missing := int(np.isnan(values).sum()):
            ax.annotate(f"{missing} none", (k, 1.0), xycoords=("data", "axes fraction"), ha="center",
                        va="top", fontsize=8, color=ORANGE)  # fmt: skip
    means = [float(np.nanmean(values)) if np.isfinite(values).any() else np.nan for values in by_label]
    ax.plot(range(len(labels)), means, "-", color=BLUE, linewidth=1.0, label="mean of the seeds that have a value")
    for value in PAPER[quantity.scenario, "bio_inspired"].values(quantity.metric):
        ax.axhline(value, color=BLACK, linestyle="--", linewidth=1.0, label="paper")


_CLOCKS = ((0.1, 0.1), (0.1, 0.05), (0.1, 0.02), (0.05, 0.05), (0.02, 0.02))
CLOCKS: dict[str, dict[str, object]] = {
    f"{control:g}\n{integration:g}": {
        "timing.control_step_s": control, "timing.decision_period_s": control, "timing.integration_step_s": integration
    }
    for control, integration in _CLOCKS
}  # fmt: skip
"""A control step and an integration step [s]; the policy decides at every control step."""
SIZES = {f"{n}": {"swarm.num_vehicles": n} for n in (10, 20, 54, 100, 200)}
LOST = {
    f"{n}": {"losses.times_s": [round(float(t), 1) for t in np.linspace(30.0, 105.0, n)]} for n in (0, 6, 12, 24, 36)
}
"""Numbers of vehicles that are lost one after another, between 30 and 105 s: before, at and after the obstacle."""
PARTS = (
    variation("time-steps", "control step [s] over integration step [s]", CLOCKS, OWN),
    variation("swarm-size", "vehicles", SIZES, OWN),
    variation("losses", "vehicles lost of 54", LOST, LOSSES),
)
