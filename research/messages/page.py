"""``messages.md``: the main metric over bits, times of a round and losses, written from the rows of the episodes."""

# pyright: reportUnknownMemberType=false
# Matplotlib leaves the types of its keyword arguments open.

from collections.abc import Sequence
from pathlib import Path
from string import Template

import numpy as np
from matplotlib.axes import Axes

from research.data import read_text
from research.episodes import Row, measured, select, short, write_rows
from research.messages.sets import (
    BITS,
    CONTROLLER,
    EXPERT,
    LOSSES,
    METRIC,
    NETWORK,
    PERIODS_S,
    SILENT,
    TASK,
    USUAL,
    USUAL_LOSSES,
    name,
    usual_name,
)
from uuv_marl.atomic import write_text
from uuv_marl.benchmark.style import house_style, panels, save
from uuv_marl.benchmark.tables import NOTHING, markdown_table


def write_page(folder: Path, rows: Sequence[Row]) -> list[Path]:
    """Write ``messages.md`` with its picture and rows; return the paths."""
    page, table = folder / "messages.md", folder / "messages.csv.gz"
    write_rows(table, rows)
    write_text(page, report(rows))
    with house_style():
        return [page, table, draw(rows, folder / "figures" / "messages.png")]


def report(rows: Sequence[Row]) -> str:
    """The page's text."""
    grid = [
        (f"{bits} bits", *(_cell(rows, name(bits, period_s, 0.0), CONTROLLER) for period_s in PERIODS_S))
        for bits in BITS
    ]
    losses = [(CONTROLLER, *(_cell(rows, name(*USUAL, loss), CONTROLLER) for loss in LOSSES))]
    networks = [
        (policy, *(_cell(rows, usual_name(loss), policy) for loss in USUAL_LOSSES)) for policy in (NETWORK, EXPERT)
    ]
    return Template(read_text("messages", "story.md")).substitute(
        episodes=f"{len(rows):,}", silent=_cell(rows, TASK, SILENT),
        bits=markdown_table(("", *(f"{period_s:g} s" for period_s in PERIODS_S)), grid),
        losses=markdown_table(("lost", *(f"{loss:.0%}" for loss in LOSSES)), losses),
        networks=markdown_table(("lost", *(f"{loss:.0%}" for loss in USUAL_LOSSES)), networks),
    )  # fmt: skip


def _mean(rows: Sequence[Row], each: str, policy: str) -> tuple[float, float]:
    """Mean of the main metric in a set, and half of its 95 % interval over episodes; NaN without any."""
    values = measured(select(rows, set=each, policy=policy), METRIC)
    return (float(np.mean(values)), 1.96 * float(np.std(values)) / len(values) ** 0.5) if values else (np.nan, np.nan)


def _cell(rows: Sequence[Row], each: str, policy: str) -> str:
    mean, half = _mean(rows, each, policy)
    return (
        NOTHING if np.isnan(mean) else f"{short(mean)} [{short(max(mean - half, 0.0))}, {short(min(mean + half, 1.0))}]"
    )


def draw(rows: Sequence[Row], path: Path) -> Path:
    """Draw the main metric over the time of a round, a line for each number of bits, and over the share of losses."""
    figure, (over_period, over_loss) = panels(2, 2, (4.2, 3.0))
    for k, bits in enumerate(BITS):
        names = [name(bits, period_s, 0.0) for period_s in PERIODS_S]
        _line(over_period, rows, PERIODS_S, names, f"C{k}", f"{bits} bits a number")
    over_period.set(xlabel="time of a round [s]", title="no message lost")
    names = [name(*USUAL, loss) for loss in LOSSES]
    _line(over_loss, rows, LOSSES, names, f"C{BITS.index(USUAL[0])}", f"{USUAL[0]} bits")
    over_loss.set(xlabel="share of lost messages", title=f"a round in {USUAL[1]:g} s")
    for ax in (over_period, over_loss):
        ax.axhline(_mean(rows, TASK, SILENT)[0], color="0.4", linestyle="--", label=f"{SILENT}, silent")
        ax.set(ylabel=METRIC.replace("_", " "), ylim=(-0.02, 1.05))
        ax.legend(fontsize="x-small")
    return save(figure, path)


def _line(ax: Axes, rows: Sequence[Row], at: Sequence[float], names: Sequence[str], colour: str, label: str) -> None:
    """Means of the sets with 95 % intervals."""
    means, halves = zip(*(_mean(rows, each, CONTROLLER) for each in names), strict=True)
    ax.errorbar(at, means, yerr=halves, color=colour, marker="o", ms=3, label=label)
