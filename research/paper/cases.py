"""What the paper runs: its controller on its three scenarios, other obstacle gains, and the methods it names."""

from uuv_marl.baselines.paper.bio_inspired import BioInspiredGains
from uuv_marl.benchmark.suite import Case


def _gains(name: str, **gains: float) -> Case:
    """Figures 12 and 13: other obstacle gains on the single obstacle."""
    return Case(name, "single_obstacle", parameters={"gains": BioInspiredGains(**gains)}, routes=True)


TRACKING = Case("tracking", "tracking", routes=True)
SINGLE = Case("single_obstacle", "single_obstacle", routes=True)
MULTI = Case("multi_obstacle", "multi_obstacle", routes=True)
SCENARIOS = (TRACKING, SINGLE, MULTI)
# The paper names no values for figures 12 and 13. Assumed: a tenth and five times Table 1's zeta_o (ten times, and the
# swarm does not pass at all), half and twice its delta_o.
ZETA_SMALL = _gains("zeta_o-small", zeta_o=0.8)
ZETA_LARGE = _gains("zeta_o-large", zeta_o=40.0)
DELTA_SMALL = _gains("delta_o-small", delta_o=40.0)
DELTA_LARGE = _gains("delta_o-large", delta_o=160.0)
COMPARATORS = tuple(Case(policy, "single_obstacle", policy) for policy in ("sff", "sdc"))
ALL = (*SCENARIOS, ZETA_SMALL, ZETA_LARGE, DELTA_SMALL, DELTA_LARGE, *COMPARATORS)
"""What the paper's figures and the ledger are made of."""
BY_NAME = {case.name: case for case in ALL}
