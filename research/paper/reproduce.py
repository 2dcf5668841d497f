"""The reproduction as a job: run what is missing, write every part's data, draw it from the data, then the ledger."""

import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from research.columns import read_columns, write_columns
from research.dynamics import identify, literal, rest, sensitivity, stability, variations
from research.paper import figures_7_to_10, figures_11_to_15, table_2
from research.paper.cases import ALL
from research.paper.ledger import ledger, write_ledger
from research.paper.report import write_page
from research.part import Part, Share, Tables
from uuv_marl.atomic import write_text
from uuv_marl.benchmark.results import ResultsError, source_fingerprint
from uuv_marl.benchmark.style import house_style, save
from uuv_marl.benchmark.suite import Report, Suite

LEDGER = "ledger"
PARTS: tuple[Part, ...] = (
    *figures_7_to_10.PARTS,
    *figures_11_to_15.PARTS,
    table_2.PART,
    literal.PART,
    sensitivity.PART,
    identify.PART,
    stability.PART,
    rest.PART,
    *variations.PARTS,
)
"""All parts in the order of the page."""
NAMES = (*(part.name for part in PARTS), LEDGER)
"""Names that ``--only`` accepts."""
_COMPUTED = 20
"""Work for tables that need no runs, in cases."""


def reproduce(folder: Path, seeds: int, only: Sequence[str], report: Report) -> list[Path]:
    """Make these parts (default: all, the ledger and the page); finished work is kept.

    Args:
        folder: for runs, data, figures, ledger and page.
        seeds: benchmark seeds 0 to ``seeds - 1``, for cases that name none.
        only: names of parts, or ``ledger``; nothing for all.
        report: is called with the current task, and the share of the work that is done.

    Returns:
        Paths of the pictures, the ledger and the page.

    Raises:
        ResultsError: an unknown part, or a folder that other code has used.
    """
    for name in only:
        if name not in NAMES:
            raise ResultsError(f"--only {name} is unknown; there are {', '.join(NAMES)}")
    parts = [part for part in PARTS if not only or part.name in only]
    suite, paths = Suite(folder / "runs", seeds), list[Path]()
    work = [len(part.cases) or _COMPUTED for part in parts]
    for k, part in enumerate(parts):

        def note(share: float, k: int = k, what: str = f"{part.name}: {part.title}") -> None:
            report(what, (sum(work[:k]) + share * work[k]) / sum(work))

        note(0.0)
        paths.append(make(part, suite, folder, note))
    if not only or LEDGER in only:
        suite.run(ALL, lambda _, share: report(LEDGER, share))
        paths += write_ledger(folder, ledger(suite), seeds)
        paths += write_page(folder, suite)
    return paths


def make(part: Part, suite: Suite, folder: Path, report: Share) -> Path:
    """A part's data and picture; the picture is drawn from the data as they are on disk."""
    stamp, code = folder / "runs" / f"{part.name}.json", _code()
    reusable: dict[str, Any] = json.loads(stamp.read_text(encoding="utf-8")) if stamp.exists() else {}
    paths = [folder / "data" / f"{name}.csv" for name in reusable.get("tables", ())]
    if reusable.get("code") != code or not all(path.exists() for path in paths):
        suite.run(part.cases, lambda _, share: report(share))
        tables = part.tables(suite, report)
        paths = [folder / "data" / f"{name}.csv" for name in tables]
        for path, table in zip(paths, tables.values(), strict=True):
            write_columns(path, table)
        if not part.cases:  # tables from existing runs are cheap
            stamp.parent.mkdir(parents=True, exist_ok=True)
            write_text(stamp, json.dumps({"code": code, "tables": list(tables)}))
    return draw(part, {path.stem: read_columns(path) for path in paths}, folder / "figures" / f"{part.name}.png")


def draw(part: Part, tables: Tables, path: Path) -> Path:
    """A part's picture with its title."""
    kind, _, number = part.name.rpartition("-")
    again = f"{kind.capitalize()} {number}: " if number.isdigit() else ""
    with house_style():
        figure = part.draw(tables)
        figure.suptitle(again + part.title)  # pyright: ignore[reportUnknownMemberType]
        return save(figure, path)


def _code() -> str:
    """Hash of the code and of the stated numbers that parts come from."""
    digest = hashlib.sha256(source_fingerprint().encode())
    for path in sorted(p for p in Path(__file__).parent.parent.rglob("*.*") if p.suffix in (".py", ".toml")):
        digest.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()[:16]
