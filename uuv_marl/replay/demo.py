"""The demo: a recording of three policies on one hard map."""

import json
from pathlib import Path

from uuv_marl.atomic import write_text
from uuv_marl.paths import UserPath, user_path
from uuv_marl.replay.html import html_of

SCENARIO, SEED = "hard_water", 10_210
POLICIES = ("bio_inspired", "tangent_bug", "mappo_hard_water")
"""The paper's controller, the best controller, and a network."""
RECORDED = Path(__file__).with_name("demo.json")


def write_demo(path: UserPath) -> None:
    """Write the recorded episodes as a page. Raises ResultsError where it can't be written."""
    write_text(user_path(path), html_of(json.loads(RECORDED.read_text(encoding="utf-8"))))
