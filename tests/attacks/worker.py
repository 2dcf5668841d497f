"""Runs cases of one kind, one after the other, and prints what became of each: a line of JSON."""

import json
import logging
import sys
import tempfile
import traceback
import warnings
from pathlib import Path

import numpy as np

from tests.attacks import inputs


def main(kind, seed, first, last):
    logging.getLogger("uuv_marl").setLevel(logging.ERROR)
    warnings.simplefilter("ignore")
    case = getattr(inputs, kind)
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        inputs.prepare(folder)
        print(json.dumps({"ready": True}), flush=True)
        for k in range(first, last):
            rng = np.random.default_rng([seed, sorted(f.__name__ for f in inputs.COUNTS).index(kind), k])
            told = ""
            try:
                outcome = case(rng, folder) or "accepted"
            except Exception as error:
                outcome = inputs.judge(error)
                told = "" if outcome == "refused" else "".join(traceback.format_exception(error)[-3:])
            print(json.dumps({"case": k, "outcome": outcome, "told": told[-1500:]}), flush=True)


if __name__ == "__main__":
    main(sys.argv[1], *map(int, sys.argv[2:5]))
