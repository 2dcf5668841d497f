"""The features of a vehicle's memory that an actor sees: bounded numbers in the vehicle's own frame."""

import math

from uuv_marl.baselines.learned.percept_features import put
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
_OWN = 27
NUM_MEMORY_FEATURES = _OWN + 6 * NEIGHBOURS + 5 * SURFACES
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
                    features[w, i, _OWN - 1] = 0.5 * math.sqrt(num_vehicles / NOMINAL_VEHICLES)
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
    out[0], out[1], out[2] = motion[0] / 4.0, motion[1] / 2.0, motion[2]
    out[3], out[4] = to_body_axes(speed * reference[2] / 4.0, speed * reference[3] / 4.0, pose)
    l_x, l_y = to_body(reference[0], reference[1], pose)
    away = math.hypot(l_x, l_y)
    out[5], out[6] = l_x / max(64.0, 0.5 * away), l_y / max(64.0, 0.5 * away)
    out[7], out[8] = l_x / (away + 8.0), l_y / (away + 8.0)
    w_x, w_y = wished(w, i, g, kept)
    b_x, b_y = modulated(w_x, w_y, w, i, barrier, kept)
    num = planes_of(w, i, period, barrier, kept, planes)
    s_x, s_y, broken = nearest_velocity(b_x, b_y, planes, num, 0, full_speed(limits))
    bound = 1.0 / max(4.0, 0.5 * math.hypot(w_x, w_y))
    out[9], out[10] = to_body_axes(w_x * bound, w_y * bound, pose)
    bound = 1.0 / max(4.0, 0.5 * math.hypot(b_x, b_y))
    out[11], out[12] = to_body_axes(b_x * bound, b_y * bound, pose)
    out[13], out[14] = to_body_axes(s_x / 4.0, s_y / 4.0, pose)
    out[15] = min(broken, 4.0) / 4.0
    out[16] = 1.0 if reference[2] == 0.0 and reference[3] == 0.0 else 0.0
    out[17] = 2.0 * period
    out[18] = min(10.0 * noise_of(w, i, kept), 2.0)
    c_x, c_y, heard = middle(w, i, kept)
    out[19], out[20] = to_body_axes(c_x / 32.0, c_y / 32.0, pose)
    out[21] = heard / kept.known.shape[2]
    out[22], out[23] = remains(w, i, 0, kept), remains(w, i, 1, kept)
    out[24] = min(age_of(w, i, kept), 2.0)
    _, out[25] = doubt(w, i, kept)


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
    """The nearest neighbours, in order: where they are, and how they move beside the vehicle.

    Six for each are filled.
    """
    away, place, velocity, pose = kept.away[w, i], kept.place[w, i], kept.velocity[w, i], kept.pose[w, i]
    least = -1.0
    for rank in range(NEIGHBOURS):
        k = _nearest(away, away.shape[0], least)
        if k < 0:
            break
        least, first = away[k], _OWN + 6 * rank
        p_x, p_y = to_body(place[k, 0], place[k, 1], pose)
        put(p_x, p_y, 10.0, out, first)
        v_x, v_y = to_body_axes(velocity[k, 0], velocity[k, 1], pose)
        v_x, v_y = v_x - kept.motion[w, i, 0], v_y - kept.motion[w, i, 1]
        near = 20.0 / (20.0 + least) / max(4.0, 0.5 * math.hypot(v_x, v_y))
        out[first + 4], out[first + 5] = near * v_x, near * v_y


@compiled
def _surfaces(w: int, i: int, barrier: Barrier, kept: Surroundings, left: Float64, out: Float32) -> None:
    """The obstacles whose surfaces are nearest, in order: direction, distance, size, and the distance to keep.

    Five for each are filled; ``left`` is room for distances.
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
        least, first = left[d], _OWN + 6 * NEIGHBOURS + 5 * rank
        x, y = to_body(disc[d, 0], disc[d, 1], pose)
        away = max(math.hypot(x, y), 1e-6)
        near = 20.0 / (max(least, 0.0) + 10.0)
        out[first], out[first + 1] = near * x / away, near * y / away
        out[first + 2] = min(max(least, -16.0), 128.0) / 64.0
        out[first + 3] = disc[d, 2] / 30.0
        out[first + 4] = margin(w, i, d, barrier, kept) / 13.5
