"""What sections 5.1-5.3 say in words, each with a measure that can fail."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uuv_marl.studies.columns import Float64
from uuv_marl.studies.paper import measures
from uuv_marl.studies.paper.cases import (
    COMPARATORS,
    DELTA_LARGE,
    DELTA_SMALL,
    MULTI,
    SINGLE,
    TRACKING,
    ZETA_LARGE,
    ZETA_SMALL,
)  # fmt: skip
from uuv_marl.studies.suite import Case, Suite, Trace

Values = Callable[[Suite], Float64]
INF = float("inf")
FASTER = (
    "our reconstruction was tuned for time, the paper's law has Table 1's gains: it trails l(t) by drag / zeta_l, "
    "which costs it 16 s, and slows down towards the end"
)
SAFER = "our reconstruction keeps more distance than the paper states for its own; it was tuned to keep s_o"
GROUP = 0.05
"""Smallest share of the swarm that counts as a group: three vehicles of 54."""


class Claim(NamedTuple):
    """A sentence of the paper, and what is measured in its stead."""

    section: str
    says: str
    """In our words."""
    measure: str
    unit: str
    values: Values
    """By seed."""
    least: float
    """The claim holds from here ..."""
    most: float
    """... to here."""
    why: str = ""
    """Why it does not hold."""

    def holds(self, values: Float64) -> NDArray[np.bool_]:
        """By seed."""
        return (values >= self.least) & (values <= self.most)


def each(case: Case, value: Callable[[Trace], float]) -> Values:
    """A number from every seed's trace."""
    return lambda suite: np.array([value(trace) for trace in suite.traces(case)])


def metric(case: Case, name: str) -> Values:
    """A metric of every seed."""
    return lambda suite: suite.metric(case, name)


def ratio(case: Case, to: Case, value: Callable[[Trace], float]) -> Values:
    """The same number of two cases, seed by seed, as the first over the second."""

    def values(suite: Suite) -> Float64:
        with np.errstate(divide="ignore", invalid="ignore"):
            return each(case, value)(suite) / each(to, value)(suite)

    return values


def minus(case: Case, to: Case, name: str) -> Values:
    """A metric of two cases, seed by seed, as the first minus the second."""
    return lambda suite: suite.metric(case, name) - suite.metric(to, name)


def clearance_order(small: Case, large: Case) -> Values:
    """The smaller of the two gains in clearance: from ``small`` to Table 1, and on to ``large`` [m]."""
    name = "min_obstacle_distance_m"
    return lambda suite: np.minimum(minus(SINGLE, small, name)(suite), minus(large, SINGLE, name)(suite))


CLAIMS: tuple[Claim, ...] = (
    Claim("5.1", "the swarm's headings become consistent", "mean order parameter in the last 60 s on the last leg",
          "1", each(TRACKING, measures.order_on_last_leg), 0.9, 1.0),
    Claim("5.1", "at the end the formation is stable, with stable distances between vehicles",
          "rms over pairs of the standard deviation of their distance in the last 10 s; at most a tenth of the spacing",
          "m", each(TRACKING, measures.unrest_at_end), -INF, 1.2),
    Claim("5.1", "vehicles gather from two groups into one",
          "groups linked below 20 m after 60 s", "1", each(TRACKING, lambda t: measures.groups_at(t, 60.0)), 1.0, 1.0),
    Claim("5.1", "the swarm's centre coincides with the trajectory",
          "distance of the centre from the path in the last 10 s of each leg, largest",
          "m", each(TRACKING, measures.off_path_at_leg_ends), -INF, 1.0),
    Claim("5.1", "the centre's deviation rises at a turning point",
          "rise of the centre's distance from the path within 40 s of each corner, smallest",
          "m", each(TRACKING, measures.rise_after_corners), 1.0, INF),
    Claim("5.1", "the centre's deviation rises at a turning point, read as the distance from l(t)",
          "rise of the centre's distance from l(t) within 40 s of each corner, smallest",
          "m", each(TRACKING, measures.rise_from_l), 1.0, INF,
          "the swarm trails l(t) by drag over zeta_l, so that at a corner l(t) comes nearer to it: the sentence holds "
          "for the distance from the path only"),
    Claim("5.1", "after a turning point the deviation falls again",
          "what is left of that rise at the next corner, largest share",
          "1", each(TRACKING, measures.left_at_next_corner), -INF, 0.2),
    Claim("5.1", "the heading changes significantly near a turning point",
          "turn of the mean heading within 40 s after a corner over that in the 40 s before, smallest",
          "1", each(TRACKING, measures.turn_near_corner), 5.0, INF),
    Claim("5.1", "at [800, 100] vehicles expand towards the swarm's edge",
          "largest spacing within 40 s after that corner over its mean in the 40 s before",
          "1", each(TRACKING, measures.extent_at_first_corner), 1.05, INF,
          "the swarm turns as a whole and keeps its extent"),
    Claim("5.1", "the largest distance stays within a range",
          "range that holds 90 % of the time over its mean, after 60 s",
          "1", each(TRACKING, measures.spread_of("max_spacing_m")), -INF, 0.1),
    Claim("5.1", "the smallest distance stays within a range",
          "range that holds 90 % of the time over its mean, after 60 s",
          "1", each(TRACKING, measures.spread_of("min_spacing_m")), -INF, 0.2),
    Claim("5.1", "the smallest distance hardly changes near a turning point",
          "change of its mean from 40 s before to 40 s after a corner, largest",
          "1", each(TRACKING, measures.spacing_change_at_corners), -INF, 0.1),
    Claim("5.2.1", "near the obstacle the swarm disperses",
          "largest spacing over that before the obstacle is heard", "1", each(SINGLE, measures.dispersal), 1.2, INF),
    Claim("5.2.1", "the swarm splits around the obstacle",
          "share of vehicles that pass on the less used side, none through it",
          "1", each(SINGLE, measures.sides), GROUP, 0.5),
    Claim("5.2.1", "behind it the swarm gathers again",
          "largest spacing at the end over that before the obstacle is heard",
          "1", each(SINGLE, measures.regathered), -INF, 1.1),
    Claim("5.2.1", "zeta_o too small fails to avoid",
          "smallest distance with zeta_o = 0.8; a hull's radius or less is a collision",
          "m", metric(ZETA_SMALL, "min_obstacle_distance_m"), -INF, 1.0),
    Claim("5.2.1", "zeta_o too large overshoots: the motion is no longer smooth",
          "distance travelled with zeta_o = 40 over that with 8",
          "1", ratio(ZETA_LARGE, SINGLE, measures.distance_travelled), 1.05, INF),
    Claim("5.2.1", "zeta_o moves the clearance",
          "smaller gain in distance of the two steps zeta_o = 0.8, 8, 40",
          "m", clearance_order(ZETA_SMALL, ZETA_LARGE), 1.0, INF),
    Claim("5.2.1", "delta_o too small comes too close",
          "smallest distance with delta_o = 40, against s_o", "m",
          metric(DELTA_SMALL, "min_obstacle_distance_m"), -INF, 5.0),
    Claim("5.2.1", "delta_o too large still passes",
          "task time with delta_o = 160", "s", metric(DELTA_LARGE, "task_time_s"), 0.0, INF),
    Claim("5.2.1", "delta_o too large wastes energy",
          "effort over time with delta_o = 160 over that with 80",
          "1", ratio(DELTA_LARGE, SINGLE, measures.energy), 1.05, INF),
    Claim("5.2.1", "delta_o moves the clearance",
          "smaller gain in distance of the two steps delta_o = 40, 80, 160", "m",
          clearance_order(DELTA_SMALL, DELTA_LARGE), 1.0, INF),
    Claim("5.2.2", "the swarm splits into groups around obstacles",
          "share of vehicles on the less used side, of the most evenly split obstacle",
          "1", each(MULTI, measures.sides), GROUP, 0.5),
    Claim("5.2.2", "and groups again under the attraction of trajectory and swarm",
          "groups linked below 20 m at the end",
          "1", each(MULTI, lambda t: measures.groups_at(t, np.inf)), 1.0, 1.0),
    Claim("5.2.2", "the distance between vehicles stays above a safe distance",
          "smallest spacing, against s_u", "m", metric(MULTI, "min_spacing_m"), 5.0, INF),
    *(
        claim
        for case in COMPARATORS
        for name in [case.name[:3].upper() + (", all vehicles informed" if "_" in case.name else "")]
        for claim in (
            Claim("5.3", f"the proposed method is faster than {name}",
                  f"task time of {case.policy} less that of bio_inspired, seed by seed",
                  "s", minus(case, SINGLE, "task_time_s"), 0.0, INF, FASTER),
            Claim("5.3", f"the proposed method is safer than {name}",
                  f"smallest obstacle distance of bio_inspired less that of {case.policy}, seed by seed",
                  "m", minus(SINGLE, case, "min_obstacle_distance_m"), 0.0, INF, SAFER),
        )
    ),
)  # fmt: skip
"""In the paper's order; the last for both forms of the comparators."""
