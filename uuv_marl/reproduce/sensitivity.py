"""Which assumption carries which of the paper's numbers: one at a time, everything else as it is."""

# pyright: reportUnknownMemberType=false
# Matplotlib leaves the types of its keyword arguments open.

import textwrap

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from uuv_marl.benchmark.style import panels
from uuv_marl.reproduce.assumptions import ASSUMPTIONS, case_of
from uuv_marl.reproduce.ledger import CLOSE, Number, difference, numbers
from uuv_marl.reproduce.study import MULTI, SINGLE, TRACKING, Case, Columns, Part, Report, Study, Tables

SEEDS = range(6)
_NAMES = {"tracking": TRACKING, "single_obstacle": SINGLE, "multi_obstacle": MULTI}
OWN = tuple(
    number
    for number in numbers()
    if number.case in _NAMES.values() and (number.section, number.metric) != ("Table 2", "min_obstacle_distance_m")
)
"""The six numbers that the paper states for its own controller, once each."""


def cases() -> tuple[Case, ...]:
    """All of them, after the defaults."""
    return (
        *_NAMES.values(),
        *(
            case_of(a.name, other, scenario)
            for a in ASSUMPTIONS
            for other in a.alternatives
            for scenario in other.scenarios
        ),
    )


def tables(study: Study, _report: Report) -> Tables:
    """A row for each alternative and number; means over the seeds."""
    rows = [
        {"assumption": "as taken", "alternative": "", **_measured(study, number.case, number.case, number)}
        for number in OWN
    ]
    for assumption in ASSUMPTIONS:
        for other in assumption.alternatives:
            for number in OWN:
                if number.case.scenario in other.scenarios:
                    case = case_of(assumption.name, other, number.case.scenario)
                    row = _measured(study, case, number.case, number)
                    rows.append({"assumption": assumption.name, "alternative": other.label, **row})
    return {"sensitivity": {name: np.array([row[name] for row in rows]) for name in rows[0]}}


def _measured(study: Study, case: Case, default: Case, number: Number) -> dict[str, object]:
    values, before = (study.metric(c, number.metric, SEEDS) for c in (case, default))
    mean = float(np.nanmean(values)) if np.isfinite(values).any() else np.nan
    taken = float(np.nanmean(before))
    return {
        "section": number.section,
        "quantity": number.quantity,
        "unit": number.unit,
        "paper": _stated(number),
        "value": mean,
        "relative_change": (mean - taken) / taken,
        "relative_difference": difference(mean, number.paper) if np.isfinite(mean) else np.nan,
        "seeds_without": int(np.isnan(values).sum()),
        "collisions": float(study.metric(case, "collisions", SEEDS).sum()),
    }


def draw(made: Tables) -> Figure:
    """A field for each alternative and number: the value, and by colour how far it moved."""
    table = made["sensitivity"]
    rows = list(dict.fromkeys(zip(table["assumption"].tolist(), table["alternative"].tolist(), strict=True)))
    heads = list(dict.fromkeys(zip(table["section"].tolist(), table["quantity"].tolist(), strict=True)))
    figure, (ax,) = panels(1, size=(11.5, 0.27 * len(rows) + 2.4))
    change: NDArray[np.float64] = np.full((len(rows), len(heads)), np.nan)
    for k in range(len(table["value"])):
        i = rows.index((str(table["assumption"][k]), str(table["alternative"][k])))
        j = heads.index((str(table["section"][k]), str(table["quantity"][k])))
        change[i, j] = table["relative_change"][k]
        ax.text(j, i, _cell(table, k), ha="center", va="center", fontsize=8,
                color="white" if abs(change[i, j]) > 0.28 else "black",
                fontweight="bold" if abs(table["relative_difference"][k]) <= CLOSE else "normal")  # fmt: skip
    image = ax.imshow(np.clip(change, -0.5, 0.5), cmap="PuOr", vmin=-0.5, vmax=0.5, aspect="auto")
    ax.set_facecolor("0.93")
    ax.grid(visible=False)
    papers = [_paper(head) for head in heads]
    labels = [
        f"{section}\n{textwrap.fill(quantity, 15)}\npaper:\n{paper}"
        for (section, quantity), paper in zip(heads, papers, strict=True)
    ]
    ax.set_xticks(range(len(heads)), labels)
    ax.xaxis.tick_top()
    ax.set_yticks(range(len(rows)), [" = ".join(part for part in row if part) for row in rows])
    figure.colorbar(image, ax=ax, shrink=0.5, label="change against what we took (clipped at half)")
    return figure


def _cell(table: Columns, k: int) -> str:
    value = float(table["value"][k])
    collided = " *" if table["collisions"][k] > 0 else ""
    return ("never" if np.isnan(value) else f"{value:.4g}") + collided


def _paper(head: tuple[str, str]) -> str:
    for number in OWN:
        if (number.section, number.quantity) == head:
            return f"{_stated(number)} {number.unit}"
    return ""


def _stated(number: Number) -> str:
    return "-".join(f"{value:g}" for value in number.paper)


PART = Part("sensitivity", cases(), tables, draw, seeds=SEEDS)
