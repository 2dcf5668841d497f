"""The numbers of the scouts' law: what they are, and the sets of them that ship."""

from typing import NamedTuple

from uuv_marl.baselines.memory.neighbours import KEPT_S


class Gains(NamedTuple):
    """Gains of the wished velocity and of memory, for all scenarios, swarm sizes, echoes and decision periods."""

    pull: float = 0.05
    """To l(t) [1/s], for up to 54 vehicles; divided by g = sqrt(n / 54) for more, which are spread farther."""
    push: float = 10.0
    """Away from a neighbour at no distance [m/s], falling linearly to none at ``push_range``."""
    push_range: float = 12.0
    """Where pushes end [m]: so near, hearing is mutual, and pushes cancel over the swarm."""
    pull_at_rest: float = 4.0
    """Factor of the pull while l(t) rests [1]; times sqrt(g) for larger swarms."""
    push_at_rest: float = 2.0
    """Factor of the push while l(t) rests [1]; times g for larger swarms: those outside press the others together."""
    together: float = 0.0
    """While l(t) moves, to l(t) from the mean place of the neighbours that a vehicle hears [1/s]; divided by g^3, as in
    a large swarm they are a small part of it. All go the same way, and the swarm is not pressed together."""
    behind_m: float = 0.0
    """How far behind a moving l(t) to go [m]: a swarm coasts on for about 2 m where l(t) stops."""
    steering: float = 1.0
    """Factor of the force that follows the wished velocity [1]. Less is calmer, and bears actuators that lag."""
    kept_s: float = KEPT_S
    """For how long a neighbour is remembered that is heard no more [s]."""
    lead: float = 0.0
    """Share of its actuators' lag and weakness that a vehicle makes up for, as it sees them (``memory.actuators``) [1].
    Not with a rudder, whose angle is chosen later."""
    pull_in_doubt: float = 0.0
    """While l(t) moves, added to the logarithm of the pull of a vehicle that doubts in full (``memory.doubt``); less in
    proportion [1]."""
    push_in_doubt: float = 0.0
    """The same for its push [1]: who knows less where the others are keeps farther from them."""


PLUS = Gains(
    pull=0.04, push_range=15.0, pull_at_rest=10.0, push_at_rest=6.0, together=0.04, behind_m=1.0, kept_s=2.0
)  # fmt: skip
"""Gains of ``ScoutPlus``, found by hand, a gain at a time, on tuning seeds of random fields and ``single_obstacle``."""
LEAD = PLUS._replace(pull_at_rest=6.0, push_at_rest=3.0, kept_s=3.0, lead=1.0)
"""Gains of ``ScoutLead``, found in the same way, in a disturbed sea too."""
WARY = LEAD._replace(pull_in_doubt=-0.7, push_in_doubt=1.1)
"""Gains of ``ScoutWary``: those two were chosen on 8 tuning fields at hard levels of disturbances."""
