"""Which assumption carries which of the paper's numbers: one at a time, everything else as it is."""

# pyright: reportUnknownMemberType=false
# Matplotlib leaves the types of its keyword arguments open.

import textwrap

import numpy as np
from matplotlib.figure import Figure

from research.columns import columns, groups
from research.paper.assumptions import READINGS
from research.paper.cases import SCENARIOS
from research.paper.ledger import CLOSE, NUMBERS, Number, difference
from research.part import Part, Share, Tables
from uuv_marl.benchmark.style import panels
from uuv_marl.benchmark.suite import Case, Suite
from uuv_marl.types import Float64

SEEDS = range(6)
OWN = [
    number
    for number in NUMBERS
    if number.case in SCENARIOS and (number.section, number.metric) != ("Table 2", "min_obstacle_distance_m")
]
"""The six numbers that the paper states for its own controller, once each."""


def tables(suite: Suite, _report: Share) -> Tables:
    """A row for each alternative and number; means over the seeds."""
    rows = [
        {"assumption": assumption, "alternative": alternative, **_measured(suite, cases[number.case.scenario], number)}
        for (assumption, alternative), cases in READINGS.items()
        for number in OWN
        if number.case.scenario in cases
    ]
    return {"sensitivity": columns(rows)}


def _measured(suite: Suite, case: Case, number: Number) -> dict[str, object]:
    values, before, collisions = (
        suite.metric(of._replace(seeds=SEEDS), metric)
        for of, metric in ((case, number.metric), (number.case, number.metric), (case, "collisions"))
    )
    mean = float(np.nanmean(values)) if np.isfinite(values).any() else np.nan
    taken = float(np.nanmean(before))
    return {
        "section": number.section,
        "quantity": number.quantity,
        "unit": number.unit,
        "paper": "-".join(f"{value:g}" for value in number.paper),
        "value": mean,
        "relative_change": (mean - taken) / taken,
        "relative_difference": difference(mean, number.paper) if np.isfinite(mean) else np.nan,
        "seeds_without": int(np.isnan(values).sum()),
        "collisions": float(collisions.sum()),
    }


def draw(computed: Tables) -> Figure:
    """A field for each alternative and number: the value, and by colour how far it moved."""
    rows = groups(computed["sensitivity"], "assumption", "alternative")
    heads = list(groups(computed["sensitivity"], "section", "quantity", "paper", "unit"))
    figure, (ax,) = panels(1, size=(11.5, 0.27 * len(rows) + 2.4))
    change: Float64 = np.full((len(rows), len(heads)), np.nan)
    for i, own in enumerate(rows.values()):
        for k, head in enumerate(groups(own, "section", "quantity", "paper", "unit")):
            j, value = heads.index(head), float(own["value"][k])
            change[i, j] = own["relative_change"][k]
            text = ("never" if np.isnan(value) else f"{value:.4g}") + (" *" if own["collisions"][k] > 0 else "")
            ax.text(j, i, text, ha="center", va="center", fontsize=8,
                    color="white" if abs(change[i, j]) > 0.28 else "black",
                    fontweight="bold" if abs(own["relative_difference"][k]) <= CLOSE else "normal")  # fmt: skip
    image = ax.imshow(np.clip(change, -0.5, 0.5), cmap="PuOr", vmin=-0.5, vmax=0.5, aspect="auto")
    ax.set_facecolor("0.93")
    ax.grid(visible=False)
    labels = [
        f"{section}\n{textwrap.fill(quantity, 15)}\npaper:\n{paper} {unit}" for section, quantity, paper, unit in heads
    ]
    ax.set_xticks(range(len(heads)), labels)
    ax.xaxis.tick_top()
    ax.set_yticks(range(len(rows)), [" = ".join(part for part in row if part) for row in rows])
    figure.colorbar(image, ax=ax, shrink=0.5, label="change against what we took (clipped at half)")
    return figure


CASES = tuple(case._replace(seeds=SEEDS) for cases in READINGS.values() for case in cases.values())
PART = Part("sensitivity", CASES, tables, draw)
