"""The demo: a recording of three policies on one hard map."""

from pathlib import Path

SCENARIO, SEED = "hard_water", 10_246
POLICIES = ("bio_inspired", "tangent_bug", "mappo_hard_water")
"""The paper's controller, the best controller, and a network."""
RECORDED = Path(__file__).with_name("demo.json")
