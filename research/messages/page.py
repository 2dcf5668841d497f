"""``messages.md``: the main metric over bits, period and losses, written from the rows of the episodes."""

# pyright: reportUnknownMemberType=false
# Matplotlib leaves the types of its keyword arguments open.

from collections.abc import Sequence
from pathlib import Path
from string import Template

import numpy as np
from matplotlib.axes import Axes

from research.data import read_text
from research.episodes import Row, measured, select, short, write_rows
from research.messages.sets import BITS, LOSSES, PERIODS_S, TASKS, USUAL, Talk
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
    tables = {f"{task.task}_{what}": text for task in TASKS for what, text in _tables(rows, task).items()}
    return Template(read_text("messages", "story.md")).substitute(episodes=f"{len(rows):,}", **tables)


def _tables(rows: Sequence[Row], task: Talk) -> dict[str, str]:
    """A row for each number of bits with a column for each period, and a row for each policy over losses."""
    grid = [
        (f"{each} bits", *(_cell(rows, task.name(each, period_s, 0.0), task.policy) for period_s in PERIODS_S))
        for each in BITS
    ]
    losses = [
        (policy, *(_cell(rows, task.name(*USUAL, loss), policy) for loss in LOSSES))
        for policy in (task.policy, *task.networks)
    ]
    return {
        "silent": _cell(rows, task.task, task.silent),
        "bits": markdown_table(("", *(f"{period_s:g} s" for period_s in PERIODS_S)), grid),
        "losses": markdown_table(("lost", *(f"{loss:.0%}" for loss in LOSSES)), losses),
    }


def _cell(rows: Sequence[Row], name: str, policy: str) -> str:
    """Mean of the main metric with its 95 % interval over episodes."""
    values = measured(select(rows, set=name, policy=policy), "share")
    if not values:
        return NOTHING
    half = 1.96 * float(np.std(values)) / len(values) ** 0.5
    mean = float(np.mean(values))
    return f"{short(mean)} [{short(max(mean - half, 0.0))}, {short(min(mean + half, 1.0))}]"


def draw(rows: Sequence[Row], path: Path) -> Path:
    """Draw the main metric over the period, a line for each number of bits, and over the share of lost messages."""
    figure, axes = panels(2 * len(TASKS), 2, (4.2, 2.9))
    for k, task in enumerate(TASKS):
        over_period, over_loss = axes[2 * k], axes[2 * k + 1]
        for colour, bits in enumerate(BITS):
            names = [task.name(bits, period_s, 0.0) for period_s in PERIODS_S]
            _line(over_period, rows, task, PERIODS_S, names, f"C{colour}", f"{bits} bits a number")
        over_period.set(xlabel="time of a round [s]", title=f"{task.policy} on {task.task}")
        names = [task.name(*USUAL, loss) for loss in LOSSES]
        _line(over_loss, rows, task, LOSSES, names, f"C{BITS.index(USUAL[0])}", f"{USUAL[0]} bits, {USUAL[1]:g} s")
        over_loss.set(xlabel="share of lost messages", title=f"{task.policy} on {task.task}")
        for ax in (over_period, over_loss):
            silent = measured(select(rows, set=task.task, policy=task.silent), "share")
            ax.axhline(float(np.mean(silent)), color="0.4", linestyle="--", label=f"{task.silent}, silent")
            ax.set(ylabel=task.metric.replace("_", " "), ylim=(-0.02, 1.02))
            ax.legend(fontsize="x-small")
    return save(figure, path)


def _line(
    ax: Axes, rows: Sequence[Row], task: Talk, at: Sequence[float], names: Sequence[str], colour: str, label: str
) -> None:
    """Means of the sets with 95 % intervals."""
    values = [measured(select(rows, set=name, policy=task.policy), "share") for name in names]
    half = [1.96 * float(np.std(each)) / len(each) ** 0.5 for each in values]
    ax.errorbar(at, [float(np.mean(each)) for each in values], yerr=half, color=colour, marker="o", ms=3, label=label)
