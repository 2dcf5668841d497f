"""The ledger: every number and claim of sections 5.1-5.3, with ours and their difference."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from research.paper.assumptions import ASSUMPTIONS
from research.paper.cases import BY_NAME, SCENARIOS
from research.paper.claims import CLAIMS, Claim, stated
from uuv_marl.atomic import write_text
from uuv_marl.baselines.paper.bio_inspired import BioInspiredGains
from uuv_marl.benchmark.estimates import Estimate, estimate
from uuv_marl.benchmark.paper import PAPER
from uuv_marl.benchmark.suite import Case, Suite
from uuv_marl.benchmark.tables import markdown_table
from uuv_marl.types import Float64

CLOSE, NEAR = 0.05, 0.15
"""Relative differences that are called a match."""


class Number(NamedTuple):
    """A result that the paper states."""

    section: str
    quantity: str
    case: Case
    metric: str
    """Ends in its unit."""
    why: str = ""
    """The reason for a difference."""

    @property
    def unit(self) -> str:
        """Unit of the metric."""
        return self.metric.rpartition("_")[2]

    @property
    def paper(self) -> tuple[float, ...]:
        """The paper's value; two where the paper gives two for the same case, with a match between them."""
        return PAPER[self.case.scenario, self.case.policy].values(self.metric)


NUMBERS = tuple(Number(case=BY_NAME[table.pop("case")], **table) for table in stated("number"))
"""The paper's results, in its order."""


class Entry(NamedTuple):
    """A row of the ledger."""

    section: str
    kind: str
    """``number``, ``claim``, ``given`` (values of the paper) or ``assumption`` (values that it does not give)."""
    quantity: str
    unit: str
    paper: str
    ours: float | str | None = None
    """Interquartile mean over seeds, or the given value as the scenario has it."""
    low: float | None = None
    high: float | None = None
    """95 % bootstrap interval."""
    worst: float | None = None
    """Value of the worst of all seeds."""
    relative_difference: float | None = None
    verdict: str = ""
    why: str = ""

    @property
    def estimate(self) -> str:
        """Ours with its interval."""
        if isinstance(self.ours, float) and self.low is not None and self.high is not None:
            numbers = (round(number, 6) for number in (self.ours, self.low, self.high))  # sums differ in the last bit
            return f"{Estimate(*numbers):.4g}"
        return self.ours if isinstance(self.ours, str) else "–"


def difference(ours: float, paper: Sequence[float]) -> float:
    """Relative difference from the nearest value between the paper's smallest and largest."""
    nearest = min(max(ours, min(paper)), max(paper))
    return (ours - nearest) / nearest


def verdict(relative: float) -> str:
    """The verdict in words."""
    if abs(relative) <= CLOSE:
        return "matches within 5 %"
    return "matches within 15 %" if abs(relative) <= NEAR else "differs"


def number_entry(number: Number, values: Float64) -> Entry:
    """A number's row, from its values by seed."""
    row = Entry(
        number.section, "number", number.quantity, number.unit, " and ".join(f"{value:g}" for value in number.paper)
    )
    finite = values[np.isfinite(values)]
    if not finite.size:
        return row._replace(verdict="differs", why="no seed has a value")
    e = estimate(finite.tolist())
    relative, worst = difference(e.value, number.paper), finite.max() if number.unit == "s" else finite.min()
    why = "" if abs(relative) <= CLOSE else number.why
    if finite.size < values.size:
        why = f"{values.size - finite.size} of {values.size} seeds never arrive; {why}"
    return Entry(*row[:5], *e, float(worst), relative, verdict(relative), why)


def claim_entry(claim: Claim, values: Float64) -> Entry:
    """A claim's row, from its measure by seed; a seed without a value does not hold."""
    held, of = int(claim.holds(values).sum()), len(values)
    words = {of: "holds", 0: "does not hold"}.get(held, f"holds in {held} of {of} seeds")
    row = Entry(
        claim.section, "claim", f"{claim.says}: {claim.measured}", claim.unit, f"holds {_limits(claim)}",
        verdict=words, why="" if held == of else claim.why,
    )  # fmt: skip
    finite = values[np.isfinite(values)]
    if not finite.size:
        return row
    e, worst = estimate(finite.tolist()), finite[np.argmin(np.minimum(finite - claim.least, claim.most - finite))]
    return row._replace(ours=e.value, low=e.low, high=e.high, worst=float(worst))


def _limits(claim: Claim) -> str:
    if claim.least == claim.most:
        return f"at {claim.least:g}"
    if np.isinf(claim.most):
        return f"from {claim.least:g}"
    return f"up to {claim.most:g}" if np.isinf(claim.least) else f"from {claim.least:g} to {claim.most:g}"


def stated_entries() -> list[Entry]:
    """Values that the paper gives, compared with the scenarios and gains that are run."""
    tracking, single, multi = (case.load() for case in SCENARIOS)
    arrays = {array.kind: array for array in tracking.sonar.arrays}
    start, gains = tracking.start, BioInspiredGains()
    pairs: list[tuple[str, str, str, object, object]] = [
        ("Table 1", "zeta_l", "N/m", 30, gains.zeta_l),
        ("Table 1", "zeta_n", "N/m", 0.8, gains.zeta_n),
        ("Table 1", "delta_n", "m", 60, gains.delta_n),
        ("Table 1", "zeta_o", "N/m", 8, gains.zeta_o),
        ("Table 1", "delta_o", "m", 80, gains.delta_o),
        ("Table 1", "t_r", "s", 0.1, tracking.timing.control_step_s),
        ("Table 1", "phi_i", "deg", 120, arrays["passive"].aperture_deg),
        ("Table 1", "theta_i", "deg", 120, arrays["active"].aperture_deg),
        ("Table 1", "R_i", "m", 500, arrays["passive"].range_m),
        ("Table 1", "D_i", "m", 100, arrays["active"].range_m),
        ("5.1", "start area", "m", [100, 200], [start.length_m, 2 * start.width_m + start.gap_m]),
        ("5.1", "initial speeds", "m/s", [0, 4], [start.speed_min_mps, start.speed_max_mps]),
        ("5.1", "expected speed", "m/s", 4, tracking.trajectory.speed_mps),
        ("5.1", "trajectory", "m", [[180, 180], [800, 100], [500, 600], [1000, 1000]], tracking.trajectory.waypoints_m),
        ("5.2.1", "trajectory", "m", [[150, 150], [600, 600]], single.trajectory.waypoints_m),
        ("5.2.1", "number of UUVs", "1", 54, single.swarm.num_vehicles),
        ("5.2.1", "obstacle's centre", "m", [350, 350], single.obstacles[0].centre_m),
        ("5.2.1", "obstacle's diameter", "m", 50, 2 * single.obstacles[0].radius_m),
        ("5.2.2", "trajectory", "m", [[200, 200], [800, 100], [500, 600], [1000, 1000]], multi.trajectory.waypoints_m),
        ("5.2.2", "obstacles' centres", "m", [[600, 100], [400, 200], [700, 850], [700, 700]],
         [obstacle.centre_m for obstacle in multi.obstacles]),
        ("5.2.2", "obstacles' diameter", "m", [50] * 4, [2 * obstacle.radius_m for obstacle in multi.obstacles]),
    ]  # fmt: skip
    entries: list[Entry] = []
    for section, name, unit, *values in pairs:
        paper, ours = (json.dumps(value).replace(".0", "") for value in values)
        judged = "as given" if paper == ours else "differs"
        entries.append(Entry(section, "given", name, unit, paper, ours, verdict=judged))
    return entries


def assumption_entries() -> list[Entry]:
    """Assumptions, with the numbers of the paper that were known when they were chosen."""
    searched = "5.1 both, 5.2.1, Table 2"
    rows = [
        *((one.name, one.taken, one.in_view) for one in ASSUMPTIONS),
        ("the identified parameters, beside these", "research/dynamics/identified", searched),
    ]
    return [
        Entry("", "assumption", what, "", "silent", taken, verdict=f"in view: {seen}") for what, taken, seen in rows
    ]


def ledger(suite: Suite) -> list[Entry]:
    """All rows, from the runs of a suite: numbers, claims, given values, assumptions."""
    return [
        *(number_entry(number, suite.metric(number.case, number.metric)) for number in NUMBERS),
        *(claim_entry(claim, claim.values(suite)) for claim in CLAIMS),
        *stated_entries(),
        *assumption_entries(),
    ]


def write_ledger(folder: Path, entries: Sequence[Entry], seeds: int) -> list[Path]:
    """``ledger.json`` and ``ledger.md``."""
    data, page = folder / "ledger.json", folder / "ledger.md"
    rows = [entry._asdict() for entry in entries]
    write_text(data, json.dumps({"seeds": seeds, "entries": rows}, indent=1, allow_nan=False) + "\n")
    lines = ["# Ledger", "", f"Wang et al. 2024, sections 5.1 to 5.3, and ours over {seeds} seeds.", ""]
    write_text(page, "\n".join([*lines, *markdown(entries)]))
    return [data, page]


_KINDS = {
    "number": ("Numbers", "section, quantity, unit, paper, ours, worst, difference, verdict"),
    "claim": ("Claims", "no., section, the paper says, holds, ours, worst, verdict"),
    "given": ("Values that the paper gives", "section, quantity, unit, paper, ours, verdict"),
    "assumption": ("Assumptions", "quantity, our choice, the paper's numbers that were known"),
}
"""Title and headers of each kind's table."""


def _cells(k: int, e: Entry) -> dict[str, str]:
    """The cells of a row by header."""
    without = "–" if e.ours is None else ""
    return {
        "no.": f"{k}",
        "section": e.section,
        "quantity": e.quantity,
        "the paper says": e.quantity.rpartition(": ")[0],
        "unit": e.unit,
        "paper": e.paper,
        "holds": e.paper.removeprefix("holds "),
        "ours": e.estimate,
        "our choice": e.estimate,
        "worst": "–" if e.worst is None else f"{e.worst:.4g}",
        "difference": without if e.relative_difference is None else f"{e.relative_difference:+.1%}",
        "verdict": e.verdict,
        "the paper's numbers that were known": e.verdict.removeprefix("in view: "),
    }


def markdown(entries: Sequence[Entry]) -> list[str]:
    """A table for each kind of row, with notes as a list below."""
    lines: list[str] = []
    for kind, (title, words) in _KINDS.items():
        chosen, headers = [entry for entry in entries if entry.kind == kind], words.split(", ")
        rows = [[_cells(k, entry)[header] for header in headers] for k, entry in enumerate(chosen, start=1)]
        lines += [f"## {title}", "", markdown_table(headers, rows), *_notes(kind, chosen)]
    return lines


def _notes(kind: str, entries: Sequence[Entry]) -> list[str]:
    """The measure of each claim, and the reasons for differences."""
    if kind == "claim":
        notes = [
            f"{k}. Measured: {e.quantity.rpartition(': ')[2]} [{e.unit}]." + (f" *Reason*: {e.why}." if e.why else "")
            for k, e in enumerate(entries, start=1)
        ]
    else:
        whys = {e.why: [f"{o.section}, {o.quantity}" for o in entries if o.why == e.why] for e in entries if e.why}
        notes = [f"- **{'; '.join(names)}**: {why}." for why, names in whys.items()]
    return [*notes, ""] if notes else []
