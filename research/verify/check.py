"""Rows drawn at random, run again and compared, digit by digit."""

import secrets
from collections.abc import Callable, Collection, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.stats import binomtest

from research.blind import BLIND
from research.verify.rows import NoEpisodesError, Row, rows_of
from uuv_marl.baselines import with_policy_requirements
from uuv_marl.baselines.learned.checkpoint import is_checkpoint
from uuv_marl.baselines.names import parse_name
from uuv_marl.baselines.team_names import members_of
from uuv_marl.benchmark.evaluate import Run, blaming, episodes
from uuv_marl.benchmark.results import FILE
from uuv_marl.errors import USER_ERRORS, DivergenceError, PolicyError, ResultsError

Report = Callable[[int, Row, float], None]
"""Called with the number of rows that were run, the row that runs now, and its finished share."""
_HOME = "heldout.csv.gz"
_DRAWS = 20


class Difference(NamedTuple):
    """A number that differs today."""

    field: str
    shipped: str
    now: str


class Verdict(NamedTuple):
    """The outcome of a row."""

    row: Row
    differences: Sequence[Difference] = ()
    reason: str = ""
    """Why the row can't be made again here; empty where it was."""

    @property
    def agrees(self) -> bool:
        """Whether the episode was run again, and every number is the same."""
        return not self.reason and not self.differences


def find(paths: Sequence[Path]) -> tuple[list[Row], list[Path]]:
    """All rows of these files and of the files in these folders; and the folders' tables that hold no episodes.

    Raises:
        ResultsError: there are no episodes, or a file is broken.
    """
    rows: list[Row] = []
    others: list[Path] = []
    for path in paths or [_docs()]:
        if not path.is_dir():
            rows += rows_of(path)
            continue
        for file in sorted([*path.rglob("*.csv"), *path.rglob("*.csv.gz"), *path.rglob(FILE)]):
            try:
                rows += rows_of(file)
            except NoEpisodesError:
                others.append(file)
    if not rows:
        raise ResultsError(f"{', '.join(map(str, paths))} holds no episodes; give a file such as docs/{_HOME}")
    return rows, others


def _docs() -> Path:
    """Folder docs of this checkout."""
    return Path(__file__).resolve().parents[2] / "docs"


def only(rows: Sequence[Row], places: Collection[str], policies: Collection[str]) -> list[Row]:
    """The rows of these sets or scenarios and of these policies; empty means all. Raises ResultsError for none."""
    for what, wanted, existing in (
        ("set or scenario", places, {row.place for row in rows}),
        ("policy", policies, {policy_of(row) for row in rows}),
    ):
        for name in wanted:
            if name not in existing:
                raise ResultsError(f"no episode has the {what} {name!r}; there are {', '.join(sorted(existing))}")
    selected = [
        row for row in rows if row.place in (places or {row.place}) and policy_of(row) in (policies or {policy_of(row)})
    ]
    if not selected:
        raise ResultsError("no episode has both this set or scenario and this policy; leave one of the two out")
    return selected


def policy_of(row: Row) -> str:
    """The policy's name, or the learner's; a file of the paper's own policy names none."""
    return row.cells.get("policy") or row.cells.get("learner") or "bio_inspired"


def fresh_seed() -> int:
    """A random seed."""
    return secrets.randbelow(1_000_000)


def compare(rows: Sequence[Row], sample: int, seed: int, allowed: Collection[str], report: Report) -> Iterator[Verdict]:
    """Draw rows at random until ``sample`` of them could be run; of each row, its verdict.

    At most ``_DRAWS`` times as many are drawn.
    """
    compared, order = 0, list[int](np.random.default_rng(seed).permutation(len(rows)).tolist())
    for k in order[: _DRAWS * sample]:
        if compared == sample:
            return
        verdict = check(rows[k], allowed, partial(report, compared, rows[k]))
        compared += not verdict.reason
        yield verdict


def check(row: Row, allowed: Collection[str], report: Callable[[float], None]) -> Verdict:
    """Run a row's episode again and compare it."""
    try:
        _check_trust(policy_of(row), allowed)
        run = _rerun(row, report)
    except DivergenceError as error:
        return Verdict(row, [Difference("episode", "ended", f"diverged: {error}")])
    except (*USER_ERRORS, ModuleNotFoundError) as error:
        return Verdict(row, reason=str(error))
    now = dict(zip(row.kind.measured, row.kind.written(row.cells, run.metrics), strict=True))
    return Verdict(row, [Difference(f, row.cells[f], now[f]) for f in row.kind.measured if row.cells[f] != now[f]])


def _check_trust(policy: str, allowed: Collection[str]) -> None:
    plain = [parse_name(member).plain for member in members_of(policy.removeprefix(BLIND))]
    if any(":" in name or is_checkpoint(name) for name in plain) and policy not in allowed:
        raise PolicyError(f"policy {policy!r} is not part of the package; if you trust it, give --policy {policy}")


def _rerun(row: Row, report: Callable[[float], None]) -> Run:
    if not row.cells["seed"].isdecimal():
        raise ResultsError(f"seed must be a whole number, got {row.cells['seed']!r}")
    source, seed = row.kind.source(row.cells), int(row.cells["seed"])
    scenario = with_policy_requirements(source.policy, source.scenario)
    with blaming(source.policy):
        (run,) = episodes(scenario, source.policy, [seed], None, report)
    return run


def failed(verdicts: Sequence[Verdict]) -> bool:
    """Whether a row differs, or nothing could be compared."""
    return any(verdict.differences for verdict in verdicts) or all(verdict.reason for verdict in verdicts)


def _upper_bound(count: int, rows: int) -> float:
    """Upper 95 % confidence bound of a share, for ``count`` of ``rows`` (exact)."""
    return float(binomtest(count, rows).proportion_ci(confidence_level=0.9, method="exact").high)


def summary(verdicts: Sequence[Verdict], rows: int) -> str:
    """The number of a file's rows that agree, and a bound for all that can be run."""
    run = [verdict for verdict in verdicts if not verdict.reason]
    if not verdicts:
        return "No row was run."
    differ, left = sum(not verdict.agrees for verdict in run), len(verdicts) - len(run)
    words = [f"{len(run) - differ} of {len(run)} rows that were run agree in every digit, {differ} differ."]
    if left:
        words.append(f"{left} more can't be reproduced here and count as neither.")
    if run and len(run) < rows:
        which = "rows that can be run" if left else f"{rows:,} rows"
        words.append(f"Fewer than {_upper_bound(differ, len(run)):.1%} of the {which} differ (95 % confidence).")
    return " ".join(words)
