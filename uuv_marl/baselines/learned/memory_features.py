"""The features of a vehicle's memory that an actor sees: bounded numbers in the vehicle's own frame."""

import math

from uuv_marl.baselines.learned.percept_features import L_X, L_Y, LED_X, LED_Y, SURGE, SWAY, TO_X, TO_Y, YAW, put
from uuv_marl.baselines.memory import Surroundings
from uuv_marl.baselines.memory.discs import CONFIRMED
from uuv_marl.baselines.memory.doubt import doubt
from uuv_marl.baselines.memory.neighbours import age_of, middle, noise_of
from uuv_marl.baselines.memory.pose import to_body, to_body_axes
from uuv_marl.baselines.memory.response import remains
from uuv_marl.baselines.policy import Limits
from uuv_marl.baselines.safety.barrier import Barrier, margin, planes_of
from uuv_marl.baselines.safety.halfplanes import nearest_velocity
from uuv_marl.baselines.scout.gains import ScoutGains
from uuv_marl.baselines.scout.law import modulated, wished
from uuv_marl.baselines.steering import full_speed
from uuv_marl.scenario.sections import NOMINAL_VEHICLES
from uuv_marl.sim.compiled import compiled
from uuv_marl.types import Bool, Float32, Float64

NEIGHBOURS, SURFACES = 6, 4
"""How many of the nearest neighbours and obstacles an actor sees."""
(
    WISH_X, WISH_Y,  # the velocity that the law wishes
    BENT_X, BENT_Y,  # the same, bent round obstacles
    SAFE_X, SAFE_Y, BROKEN,  # the same, made safe [4 m/s], and by how much it breaks what the filter demands
    AT_REST, PERIOD, NOISE,  # whether l(t) rests; between decisions [0.5 s]; the sonar's error over range [0.1]
    MIDDLE_X, MIDDLE_Y, HEARD,  # middle of the neighbours that are heard [32 m], and their share
    LEFT_THRUST, LEFT_TORQUE,  # shares of the difference between old and asked actions that remain: actuators' lag
    AGE, DOUBT, CROWD,  # of what is heard [s]; of the own motion; half the root of the swarm's size over the paper's
    _OWN,
) = range(9, 28)  # fmt: skip
"""Features after the first nine, which are those of ``percept_features``, all in the body frame; then how many."""
_REL_X, _REL_Y, _NEIGHBOUR = range(4, 7)
"""Features of a neighbour after the four of its place (``put``): velocity beside the vehicle's own; then how many."""
TOWARDS_X, TOWARDS_Y, CLEARANCE, RADIUS, MARGIN, _SURFACE = range(6)
"""Features of an obstacle: direction, longer where near; clearance [64 m], radius [30 m], margin [13.5 m]; how many."""
NUM_MEMORY_FEATURES = _OWN + _NEIGHBOUR * NEIGHBOURS + _SURFACE * SURFACES
"""Features of a vehicle."""


@compiled
def fill_memory_features(
    rows: Bool, num_vehicles: int, period: float, g: ScoutGains, barrier: Barrier, limits: Limits, kept: Surroundings,
    planes: Float64, features: Float32,
) -> None:  # fmt: skip
    """Fill the features of vehicles: their motion, l(t), the hand-made law's wish, who and what is near.

    Shape (world, vehicle, ``NUM_MEMORY_FEATURES``); zero for vehicles outside ``rows``, shape (world, vehicle).
    """
    for w in range(features.shape[0]):
        for i in range(features.shape[1]):
            if rows[w, i]:
                features[w, i, :] = 0.0
                if kept.begun[w, i] > 0.0:
                    features[w, i, CROWD] = 0.5 * math.sqrt(num_vehicles / NOMINAL_VEHICLES)
                    _own(w, i, period, g, barrier, limits, kept, planes, features[w, i])
                    _neighbours(w, i, kept, features[w, i])
                    _surfaces(w, i, barrier, kept, planes[:, 0], features[w, i])


@compiled
def _own(
    w: int, i: int, period: float, g: ScoutGains, barrier: Barrier, limits: Limits, kept: Surroundings, planes: Float64,
    out: Float32,
) -> None:  # fmt: skip
    """A vehicle's motion, l(t), and what the hand-made law wishes and the filter leaves of it.

    The first of ``out`` are filled.
    """
    pose, reference = kept.pose[w, i], kept.reference[w, i]
    motion, speed = kept.motion[w, i], kept.reference_speed[w, i]
    out[SURGE], out[SWAY], out[YAW] = motion[0] / 4.0, motion[1] / 2.0, motion[2]
    out[LED_X], out[LED_Y] = to_body_axes(speed * reference[2] / 4.0, speed * reference[3] / 4.0, pose)
    l_x, l_y = to_body(reference[0], reference[1], pose)
    away = math.hypot(l_x, l_y)
    out[L_X], out[L_Y] = l_x / max(64.0, 0.5 * away), l_y / max(64.0, 0.5 * away)
    out[TO_X], out[TO_Y] = l_x / (away + 8.0), l_y / (away + 8.0)
    w_x, w_y = wished(w, i, g, kept)
    b_x, b_y = modulated(w_x, w_y, w, i, barrier, kept)
    num = planes_of(w, i, period, barrier, kept, planes)
    s_x, s_y, broken = nearest_velocity(b_x, b_y, planes, num, 0, full_speed(limits))
    bound = 1.0 / max(4.0, 0.5 * math.hypot(w_x, w_y))
    out[WISH_X], out[WISH_Y] = to_body_axes(w_x * bound, w_y * bound, pose)
    bound = 1.0 / max(4.0, 0.5 * math.hypot(b_x, b_y))
    out[BENT_X], out[BENT_Y] = to_body_axes(b_x * bound, b_y * bound, pose)
    out[SAFE_X], out[SAFE_Y] = to_body_axes(s_x / 4.0, s_y / 4.0, pose)
    out[BROKEN] = min(broken, 4.0) / 4.0
    out[AT_REST] = 1.0 if reference[2] == 0.0 and reference[3] == 0.0 else 0.0
    out[PERIOD] = 2.0 * period
    out[NOISE] = min(10.0 * noise_of(w, i, kept), 2.0)
    c_x, c_y, heard = middle(w, i, kept)
    out[MIDDLE_X], out[MIDDLE_Y] = to_body_axes(c_x / 32.0, c_y / 32.0, pose)
    out[HEARD] = heard / kept.known.shape[2]
    out[LEFT_THRUST], out[LEFT_TORQUE] = remains(w, i, 0, kept), remains(w, i, 1, kept)
    out[AGE] = min(age_of(w, i, kept), 2.0)
    _, out[DOUBT] = doubt(w, i, kept)


@compiled
def _nearest(away: Float64, num: int, least: float) -> int:
    """Index of the smallest of the first entries that is larger than a bound, -1 for none."""
    best, found = -1, math.inf
    for k in range(num):
        if least < away[k] < found:
            best, found = k, away[k]
    return best


@compiled
def _neighbours(w: int, i: int, kept: Surroundings, out: Float32) -> None:
    """The nearest neighbours, in order: where they are, and how they move beside the vehicle."""
    away, place, velocity, pose = kept.away[w, i], kept.place[w, i], kept.velocity[w, i], kept.pose[w, i]
    least = -1.0
    for rank in range(NEIGHBOURS):
        k = _nearest(away, away.shape[0], least)
        if k < 0:
            break
        least, first = away[k], _OWN + _NEIGHBOUR * rank
        p_x, p_y = to_body(place[k, 0], place[k, 1], pose)
        put(p_x, p_y, 10.0, out, first)
        v_x, v_y = to_body_axes(velocity[k, 0], velocity[k, 1], pose)
        v_x, v_y = v_x - kept.motion[w, i, 0], v_y - kept.motion[w, i, 1]
        near = 20.0 / (20.0 + least) / max(4.0, 0.5 * math.hypot(v_x, v_y))
        out[first + _REL_X], out[first + _REL_Y] = near * v_x, near * v_y


@compiled
def _surfaces(w: int, i: int, barrier: Barrier, kept: Surroundings, left: Float64, out: Float32) -> None:
    """The obstacles whose surfaces are nearest, in order: direction, distance, size, and the distance to keep.

    ``left`` is room for distances.
    """
    score, disc, pose = kept.score[w, i], kept.disc[w, i], kept.pose[w, i]
    for d in range(score.shape[0]):
        gone = score[d] < CONFIRMED
        left[d] = math.inf if gone else kept.disc_away[w, i, d] - disc[d, 2]
    least = -math.inf
    for rank in range(SURFACES):
        d = _nearest(left, score.shape[0], least)
        if d < 0:
            break
        least, first = left[d], _OWN + _NEIGHBOUR * NEIGHBOURS + _SURFACE * rank
        x, y = to_body(disc[d, 0], disc[d, 1], pose)
        away = max(math.hypot(x, y), 1e-6)
        near = 20.0 / (max(least, 0.0) + 10.0)
        out[first + TOWARDS_X], out[first + TOWARDS_Y] = near * x / away, near * y / away
        out[first + CLEARANCE] = min(max(least, -16.0), 128.0) / 64.0
        out[first + RADIUS] = disc[d, 2] / 30.0
        out[first + MARGIN] = margin(w, i, d, barrier, kept) / 13.5
