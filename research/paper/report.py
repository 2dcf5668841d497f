"""The page that tells the story, written from the files of a reproduction: ledger, tables and pictures."""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from string import Template

import numpy as np

from research.columns import Columns, groups, read_columns, where
from research.data import read_text
from research.dynamics.identify import METRICS, pareto, trials
from research.dynamics.unknowns import OBJECTIVES
from research.paper.ledger import Entry, markdown, read_ledger
from research.part import Part
from uuv_marl.atomic import write_text
from uuv_marl.benchmark.tables import estimate, markdown_table
from uuv_marl.types import Float64

NEEDED = ("identification", "margins", "rest", "critical")
"""Tables that the text takes numbers from."""


def write_page(folder: Path, parts: Sequence[Part]) -> Path:
    """Write ``report.md`` into the folder of a reproduction, from the files there."""
    path = folder / "report.md"
    write_text(path, page(folder, parts))
    return path


def page(folder: Path, parts: Sequence[Part]) -> str:
    """The whole page: ``story.md`` filled with the results."""
    entries = read_ledger(folder / "ledger.json")
    seeds = json.loads((folder / "ledger.json").read_text(encoding="utf-8"))["seeds"]
    tables = {name: read_columns(folder / "data" / f"{name}.csv") for name in NEEDED}
    return Template(read_text("paper", "story.md")).substitute(
        # A caption does not say again what the picture's title says.
        {p.name.replace("-", "_"): f"![{p.title}](figures/{p.name}.png)\n\n*{p.caption}.*" for p in parts},
        seeds=str(seeds),
        summary="\n".join(summary(entries)),
        **search_errors(),
        prediction=prediction(tables["identification"]),
        rest_table=rest_table(tables["rest"]),
        ledger="\n".join(markdown(entries, "###")).strip(),
        **growth_rates(tables["margins"], tables["critical"]),
    )


def summary(entries: Sequence[Entry]) -> Iterator[str]:
    """How many numbers and claims agree, and which do not."""
    numbers, claims = ([entry for entry in entries if entry.kind == kind] for kind in ("number", "claim"))
    verdicts = [entry.verdict for entry in (*numbers, *claims)]
    yield (
        f"- Of {len(numbers)} numbers, {verdicts.count('matches within 5 %')} match within 5 %, "
        f"{verdicts.count('matches within 15 %')} more match within 15 %, and {verdicts.count('differs')} differ:"
    )
    for e in numbers:
        if e.verdict == "differs" and e.ours is not None:
            yield f"  - {e.section}, {e.quantity}: paper {e.paper} {e.unit}, ours {e.estimate}"
    yield f"- Of {len(claims)} sentences, {verdicts.count('holds')} hold in every seed. These do not:"
    for e in claims:
        if e.verdict != "holds":
            yield f"  - {e.section}, {e.quantity.partition(':')[0]}: {e.verdict}"


def search_errors() -> dict[str, str]:
    """Largest errors of the identification's chosen point and of the defaults."""
    table = trials()
    _, chosen = pareto(table)
    largest = np.max([table[name] for name in OBJECTIVES], axis=0)
    return {"largest_error": f"{100 * largest[chosen]:.1f} %", "default_error": f"{100 * largest[0]:.1f} %"}


def prediction(table: Columns) -> str:
    """Every set of parameters, scenario by scenario."""
    rows = [
        (*names, *(_estimate(own[metric]) for metric in METRICS))
        for names, own in groups(table, "scenario", "parameters").items()
    ]
    return markdown_table(("scenario", "parameters", *METRICS), rows).rstrip("\n")


def _estimate(values: Float64) -> str:
    found = values[np.isfinite(values)].tolist()
    if not found:
        return "–"
    return f"{estimate(found):.4g}" + ("" if len(found) == len(values) else f", {len(found)} seeds")


def growth_rates(margins: Columns, critical: Columns) -> dict[str, str]:
    """Texts of the growth rates, from the eigenvalues."""

    def growth(parameter: str, value: float, hold: float) -> str:
        found = where(margins, parameter=parameter, value=value, t_r_s=hold)["growth_per_s"]
        return f"{found.min():.2f} to {found.max():.2f} /s"

    lone = critical["lone_critical_hold_s"]
    return {
        "lone": f"{lone[0]:.3f}",
        "damped": f"{lone[1]:.3f} s with a yaw damping of {critical['yaw_damping_nms'][1]:g} N m s",
        "continuous": growth("t_r", 0.0, 0.0),
        "held": growth("t_r", 0.1, 0.1),
        "buckling": growth("yaw_damping_nms", 600.0, 0.1),
        "residual": f"{where(margins, parameter='t_r')['residual_n'].max():.0f}",
    }


def rest_table(rest: Columns) -> str:
    """Table of the swarm's motion once l(t) rests: means over seeds."""
    headers = (
        "variant", "t_r [s]", "yaw damping [N m s]", "yaw rate rms [rad/s]", "speed rms [m/s]", "exponents [1/s]",
    )  # fmt: skip
    lines: list[tuple[str, ...]] = []
    for (variant, hold, damping), own in groups(rest, "variant", "t_r_s", "yaw_damping_nms").items():
        names = ("yaw_rate_rms_rad_per_s", "speed_rms_mps", "exponent_per_s", "small_exponent_per_s")
        yaw, speed, large, small = (f"{own[name].mean():.2g}" for name in names)
        lines.append((variant, f"{hold:g}", f"{damping:g}", yaw, speed, f"{large}, {small}"))
    return markdown_table(headers, lines).rstrip("\n")
