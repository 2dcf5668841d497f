"""Copy a reproduction's page, ledger, pictures and the tables that the page reads into docs/paper."""

import shutil
import sys
from pathlib import Path

from research.paper.report import NEEDED, write_page
from research.paper.reproduce import PARTS

TARGET = Path(__file__).resolve().parent.parent / "docs" / "paper"


def ship(source: Path) -> None:
    """The page is written anew from the copies."""
    shutil.rmtree(TARGET, ignore_errors=True)
    for folder in ("figures", "data"):
        (TARGET / folder).mkdir(parents=True)
    for name in ("ledger.json", *(f"figures/{part.name}.png" for part in PARTS), *(f"data/{n}.csv" for n in NEEDED)):
        shutil.copyfile(source / name, TARGET / name)
    write_page(TARGET, PARTS)


if __name__ == "__main__":
    ship(Path(sys.argv[1]))
