"""The pilot's findings beside ours: each claim is confirmed or corrected. The claims: ``pilot.toml``."""

import tomllib
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from uuv_marl.atomic import write_text
from uuv_marl.benchmark.evaluate import evaluate
from uuv_marl.benchmark.runner import Evaluate
from uuv_marl.benchmark.tables import counted, markdown_table
from uuv_marl.scenario import load_scenario
from uuv_marl.studies.columns import columns, write_columns
from uuv_marl.studies.robustness.axes import AXES
from uuv_marl.studies.suite import Case, Report, Suite

_TOLD = tomllib.loads(resources.files("uuv_marl.studies.robustness").joinpath("pilot.toml").read_text(encoding="utf-8"))
CLAIMED_SEEDS: int = _TOLD["seeds"]
NEAR = 1.0 / CLAIMED_SEEDS
"""A share this near confirms: one seed of the pilot's."""
_SLACK = 1e-9
_HEAD = """# The pilot's findings, confirmed or corrected

<!-- Written by uuv-marl robustness --pilot. -->

Before the package had currents, late sonar or faults, a pilot corrupted percepts and actions from outside, on 5 seeds.
Here the simulation itself does it, on {seeds}. **Success** in this table is the pilot's: the swarm arrives and nobody
touches anything. A cell shows the pilot's seeds that succeed, then ours. Where the two shares differ by at most
{near:.0%}, one seed of the pilot's, a claim is confirmed; else it is corrected, and bold. {confirmed} of {claims} are
confirmed. Scenario: `single_obstacle` as it is, unless the row says otherwise.

"""


class Claim(NamedTuple):
    """One policy in one row of the pilot's table."""

    what: str
    note: str
    claimed: int
    """Seeds of ``CLAIMED_SEEDS`` that succeeded."""
    case: Case


def claims(seeds: int) -> list[Claim]:
    """All claims, to be run on seeds 0 to ``seeds - 1``."""
    return [
        Claim(row["what"], row.get("note", ""), claimed, Case(
            _slug(row["what"]), row.get("scenario", "single_obstacle"), policy, _overrides(row), seeds=range(seeds),
            shared=True,
        ))
        for row in _TOLD["rows"]
        for policy, claimed in zip(_TOLD["policies"], row["claims"], strict=True)
        if claimed != "-"
    ]  # fmt: skip


def _overrides(row: dict[str, Any]) -> dict[str, object]:
    """The row's own fields, or those of a level of an axis; then with the paper's endings, arrival within 20 m."""
    if "axis" not in row:
        return row.get("set", {})
    axis, _, level = row["axis"].partition(".")
    speed = load_scenario(row.get("scenario", "single_obstacle")).trajectory.speed_mps
    return AXES[axis].overrides(int(level), speed) | {"arrival.radius_m": 20.0}


def _slug(what: str) -> str:
    return "".join(c if c.isalnum() else "_" for c in what)


def run(folder: Path, seeds: int, report: Report, evaluator: Evaluate = evaluate) -> list[Path]:
    """Run what is missing of all claims; ``pilot.md`` and ``pilot.csv``.

    Args:
        folder: holds a benchmark's results of each row, in ``pilot``.
        seeds: so many of each.
        report: called as it goes on.
        evaluator: runs a policy over seeds, here or elsewhere.
    """
    suite, every = Suite(folder / "pilot", traces=False), claims(seeds)
    suite.run([claim.case for claim in every], report, evaluator)
    rows = [_row(suite, claim) for claim in every]
    page, table = folder / "pilot.md", folder / "pilot.csv"
    write_columns(table, columns(rows))
    write_text(page, text(rows, seeds))
    return [page, table]


def _row(suite: Suite, claim: Claim) -> dict[str, Any]:
    times, collisions = (suite.metric(claim.case, name) for name in ("task_time_s", "collisions"))
    ours = int((~np.isnan(times) & (collisions == 0)).sum())
    return {
        "what": claim.what, "policy": claim.case.policy, "claimed": claim.claimed, "ours": ours, "seeds": len(times),
        "verdict": verdict(claim.claimed, ours, len(times)), "note": claim.note,
    }  # fmt: skip


def verdict(claimed: int, ours: int, seeds: int) -> str:
    """Whether our share of the seeds is near the pilot's."""
    return "confirmed" if abs(claimed / CLAIMED_SEEDS - ours / seeds) <= NEAR + _SLACK else "corrected"


def text(rows: list[dict[str, Any]], seeds: int) -> str:
    """The page: a row for what is wrong, a cell for each policy."""
    confirmed = sum(row["verdict"] == "confirmed" for row in rows)
    head = _HEAD.format(seeds=counted(seeds, "seed"), near=NEAR, confirmed=confirmed, claims=len(rows))
    cells = {(row["what"], row["policy"]): _cell(row) for row in rows}
    notes, policies = {row["what"]: row["note"] for row in rows}, list(dict.fromkeys(row["policy"] for row in rows))
    table = [(what, *(cells.get((what, policy), "–") for policy in policies), note) for what, note in notes.items()]
    return head + markdown_table(("what is wrong", *policies, "note"), table)


def _cell(row: dict[str, Any]) -> str:
    shares = f"{row['claimed']}/{CLAIMED_SEEDS}; {row['ours']}/{row['seeds']}"
    return shares if row["verdict"] == "confirmed" else f"**{shares}**"
