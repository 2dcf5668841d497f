"""The page that tells the story, written from the files of a reproduction: ledger, tables and pictures."""

import json
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from string import Template

import numpy as np

from uuv_marl.atomic import write_text
from uuv_marl.benchmark.tables import estimate, markdown_table
from uuv_marl.reproduce import identify
from uuv_marl.reproduce.ledger import Entry, markdown, read_ledger
from uuv_marl.reproduce.study import Columns, Part, read_columns
from uuv_marl.reproduce.unknowns import OBJECTIVES

NEEDED = ("identification", "margins", "rest", "critical")
"""Tables that the text takes numbers from."""


def write_page(folder: Path, parts: Sequence[Part]) -> Path:
    """``report.md`` in the folder of a reproduction, from what lies there."""
    path = folder / "report.md"
    write_text(path, page(folder, parts))
    return path


def page(folder: Path, parts: Sequence[Part]) -> str:
    """The whole page: ``story.md`` with what was found."""
    entries = read_ledger(folder / "ledger.json")
    seeds = json.loads((folder / "ledger.json").read_text(encoding="utf-8"))["seeds"]
    tables = {name: read_columns(folder / "data" / f"{name}.csv") for name in NEEDED}
    story = Template(resources.files("uuv_marl.reproduce").joinpath("story.md").read_text(encoding="utf-8"))
    return story.substitute(
        {part.name.replace("-", "_"): picture(part) for part in parts},
        seeds=str(seeds),
        summary=summary(entries),
        **search_errors(),
        prediction=prediction(tables["identification"]),
        rest_table=rest_table(tables["rest"]),
        ledger="\n".join(markdown(entries, "###")).strip(),
        **growth_rates(tables["margins"], tables["critical"]),
    )


def picture(part: Part) -> str:
    """A part's picture with its caption, which does not say again what the picture's title says."""
    return f"![{part.title}](figures/{part.name}.png)\n\n*{part.caption}.*"


def summary(entries: Sequence[Entry]) -> str:
    """How many numbers and claims agree, and which do not."""
    numbers = [entry for entry in entries if entry.kind == "number"]
    claims = [entry for entry in entries if entry.kind == "claim"]
    lines = [
        f"- Of {len(numbers)} numbers, {_count(numbers, 'matches within 5 %')} match within 5 %, "
        f"{_count(numbers, 'matches within 15 %')} more match within 15 %, and {_count(numbers, 'differs')} differ:",
        *(
            f"  - {e.section}, {e.quantity}: paper {e.paper} {e.unit}, ours {e.ours:.4g} [{e.low:.4g}, {e.high:.4g}]"
            for e in numbers
            if e.verdict == "differs" and isinstance(e.ours, float)
        ),
        f"- Of {len(claims)} sentences, {_count(claims, 'holds')} hold in every seed. These do not:",
        *(f"  - {e.section}, {e.quantity.partition(':')[0]}: {e.verdict}" for e in claims if e.verdict != "holds"),
    ]
    return "\n".join(lines)


def _count(entries: Sequence[Entry], verdict: str) -> int:
    return sum(entry.verdict == verdict for entry in entries)


def search_errors() -> dict[str, str]:
    """Largest errors of the identification's chosen point and of the defaults."""
    table = identify.trials()
    _, chosen = identify.pareto(table)
    largest = np.max([table[name] for name in OBJECTIVES], axis=0)
    return {"largest_error": f"{100 * largest[chosen]:.1f} %", "default_error": f"{100 * largest[0]:.1f} %"}


def prediction(table: Columns) -> str:
    """Every set of parameters, scenario by scenario."""
    names = [name for name in table if name not in ("parameters", "scenario", "seed")]
    rows: list[tuple[str, ...]] = []
    for scenario in dict.fromkeys(table["scenario"].tolist()):
        for parameters in dict.fromkeys(table["parameters"].tolist()):
            own = (table["scenario"] == scenario) & (table["parameters"] == parameters)
            rows.append((scenario, parameters, *(_estimate(table[name][own].tolist()) for name in names)))
    return markdown_table(("scenario", "parameters", *names), rows).rstrip("\n")


def _estimate(values: Sequence[float]) -> str:
    found = [value for value in values if np.isfinite(value)]
    if not found:
        return "–"
    e = estimate(found)
    return f"{e.iqm:.4g} [{e.low:.4g}, {e.high:.4g}]" + ("" if len(found) == len(values) else f", {len(found)} seeds")


def growth_rates(margins: Columns, critical: Columns) -> dict[str, str]:
    """What the eigenvalues say."""

    def growth(parameter: str, value: float, hold: float) -> str:
        own = (margins["parameter"] == parameter) & (margins["value"] == value) & (margins["t_r_s"] == hold)
        return f"{margins['growth_per_s'][own].min():.2f} to {margins['growth_per_s'][own].max():.2f} /s"

    lone = critical["lone_critical_hold_s"]
    return {
        "lone": f"{lone[0]:.3f}",
        "damped": f"{lone[1]:.3f} s with a yaw damping of {critical['yaw_damping_nms'][1]:g} N m s",
        "continuous": growth("t_r", 0.0, 0.0),
        "held": growth("t_r", 0.1, 0.1),
        "buckling": growth("yaw_damping_nms", 600.0, 0.1),
        "residual": f"{margins['residual_n'][margins['parameter'] == 't_r'].max():.0f}",
    }


def rest_table(rest: Columns) -> str:
    """What the swarm does once l(t) rests: means over seeds."""
    headers = (
        "variant", "t_r [s]", "yaw damping [N m s]", "yaw rate rms [rad/s]", "speed rms [m/s]", "exponents [1/s]",
    )  # fmt: skip
    lines: list[tuple[str, ...]] = []
    rows = zip(rest["variant"].tolist(), rest["t_r_s"].tolist(), rest["yaw_damping_nms"].tolist(), strict=True)
    for variant, hold, damping in dict.fromkeys(rows):
        own = (rest["variant"] == variant) & (rest["t_r_s"] == hold) & (rest["yaw_damping_nms"] == damping)
        names = ("yaw_rate_rms_rad_per_s", "speed_rms_mps", "exponent_per_s", "small_exponent_per_s")
        yaw, speed, large, small = (f"{rest[name][own].mean():.2g}" for name in names)
        lines.append((variant, f"{hold:g}", f"{damping:g}", yaw, speed, f"{large}, {small}"))
    return markdown_table(headers, lines).rstrip("\n")
