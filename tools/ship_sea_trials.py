"""Run the sea trials (``research.dynamics.sea_trials``) and keep their episodes for docs/sea-trials.md.

python tools/ship_sea_trials.py results/sea_trials; then python tools/write_tables.py
"""

import sys
from pathlib import Path

from research.dynamics import sea_trials

TARGET = Path(__file__).resolve().parent.parent / "docs" / "sea-trials.csv"


if __name__ == "__main__":
    sea_trials.run(Path(sys.argv[1]), TARGET, lambda what, share: print(f"{share:.3f} {what}", flush=True))
