"""The reproduction as a job: run what is missing, write every part's data, draw it from the data, then the ledger."""

import hashlib
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from uuv_marl.atomic import write_text
from uuv_marl.benchmark.results import ResultsError, source_fingerprint
from uuv_marl.benchmark.style import house_style, save
from uuv_marl.reproduce import identify, literal, obstacle_figures, rest, sensitivity, stability, variations
from uuv_marl.reproduce.ledger import CASES, ledger, write_ledger
from uuv_marl.reproduce.page import write_page
from uuv_marl.reproduce.study import Part, Report, Study, Tables, read_columns, write_columns
from uuv_marl.reproduce.tracking_figures import PARTS as TRACKING_PARTS

Progress = Callable[[str, float], None]
"""Called with what is being done, and the share of the whole job that is done."""
LEDGER = "ledger"
PARTS: tuple[Part, ...] = (
    *TRACKING_PARTS,
    *obstacle_figures.PARTS,
    literal.PART,
    sensitivity.PART,
    identify.PART,
    stability.PART,
    rest.PART,
    *variations.PARTS,
)
"""In the order of the page."""
_HERE = Path(__file__).resolve().parent
_PER_VEHICLE_STEP = 1.5e-6
"""Seconds that a step of a vehicle takes: for the progress bar only."""


def names() -> list[str]:
    """What ``--only`` knows."""
    return [*(part.name for part in PARTS), LEDGER]


def reproduce(folder: Path, seeds: int, only: Sequence[str], progress: Progress) -> list[Path]:
    """Make these parts (default all, the ledger and the page); what is done already is kept.

    Returns:
        What was made for people to read: pictures, and the ledger and the page.

    Raises:
        ResultsError: an unknown part, or a folder that other code has used.
    """
    for name in only:
        if name not in names():
            raise ResultsError(f"--only {name} is unknown; there are {', '.join(names())}")
    parts = [part for part in PARTS if not only or part.name in only]
    study = Study(folder / "runs", seeds)
    costs = _costs(parts, seeds)
    total, done = sum(costs), 0.0
    made: list[Path] = []
    for part, cost in zip(parts, costs, strict=True):

        def report(share: float, part: Part = part, cost: float = cost, done: float = done) -> None:
            progress(f"{part.name}: {part.title}", (done + share * cost) / total)

        report(0.0)
        made.append(make(part, study, folder, report))
        done += cost
    if not only or LEDGER in only:
        study.run(CASES, lambda share: progress(LEDGER, share))
        made += write_ledger(folder, ledger(study), seeds)
    if not only:
        made.append(write_page(folder, PARTS))
    return made


def make(part: Part, study: Study, folder: Path, report: Report) -> Path:
    """A part's data and picture; the picture is drawn from the data as they are on disk."""
    stamp = folder / "runs" / f"{part.name}.json"
    paths = _kept(part, stamp, folder)
    if not paths:
        study.run(part.cases, report, part.seeds)
        for name, table in part.tables(study, report).items():
            paths.append(folder / "data" / f"{name}.csv")
            write_columns(paths[-1], table)
        if not part.cases:
            kept = {"code": _code(), "tables": [path.stem for path in paths]}
            write_text(stamp, json.dumps(kept))
    return draw(part, {path.stem: read_columns(path) for path in paths}, folder / "figures" / f"{part.name}.png")


def draw(part: Part, tables: Tables, path: Path) -> Path:
    """A part's picture with its title."""
    kind, _, number = part.name.rpartition("-")
    again = f"{kind.capitalize()} {number}: " if number.isdigit() else ""
    with house_style():
        figure = part.draw(tables)
        figure.suptitle(again + part.title)  # pyright: ignore[reportUnknownMemberType]
        return save(figure, path)


def _kept(part: Part, stamp: Path, folder: Path) -> list[Path]:
    """Tables of a part that takes long to compute and is done; parts made of runs are cheap once these are there."""
    if part.cases or not stamp.exists():
        return []
    found: dict[str, Any] = json.loads(stamp.read_text(encoding="utf-8"))
    paths = [folder / "data" / f"{name}.csv" for name in found["tables"]]
    return paths if found["code"] == _code() and all(path.exists() for path in paths) else []


def _code() -> str:
    """Hash of the code that parts come from."""
    digest = hashlib.sha256(source_fingerprint().encode())
    for path in sorted([*_HERE.glob("*.py"), *_HERE.glob("identified/*")]):
        digest.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()[:16]


def _costs(parts: Sequence[Part], seeds: int) -> list[float]:
    """Seconds that each part takes, roughly; a case that an earlier part has run costs nothing."""
    costs, ran = list[float](), set[str]()
    for part in parts:
        fresh = [case.load() for case in part.cases if case.name not in ran]
        ran |= {case.name for case in part.cases}
        steps = [s.trajectory.duration_s / s.timing.decision_period_s * s.swarm.num_vehicles for s in fresh]
        costs.append(part.seconds + _PER_VEHICLE_STEP * sum(steps) * (seeds if part.seeds is None else len(part.seeds)))
    return costs
