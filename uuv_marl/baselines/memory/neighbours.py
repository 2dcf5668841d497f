"""Tracks of detected neighbours with velocities: an alpha-beta filter whose gains follow from observed errors."""

import math

from uuv_marl.baselines.memory.pose import to_map
from uuv_marl.baselines.memory.table import Surroundings
from uuv_marl.percept import Fields
from uuv_marl.sim.compiled import compiled

GATE_M, GATE_SHARE = 2.0, 0.1
"""Distance from a predicted position within which a reading is associated [m], plus a share of its range. Assumed."""
ACCELERATION = 2.0
"""Typical acceleration of neighbours [m/s2]. Assumed: a seventh of the default vehicle's at full force."""
MANOEUVRES = 0.005
"""Mean error over range that neighbours' manoeuvres cause; the rest is attributed to the sonar [1]. Assumed."""
LEAST_ERROR = 0.0002  # smallest assumed error of the sonar over range [1]
MEMORY_S = 1.0  # default time for which an undetected neighbour is remembered [s]
_FRESH_S = 1.0  # neighbours undetected for longer do not count in the mean age of readings [s]
_SAME_M = 1e-3  # a reading that moved less is a repetition, from a sonar that is slower than decisions [m]
_STALE_S = 2.0  # a repeated reading counts as new after this time [s]
_FAR_M = 64.0
"""Neighbours farther away count in the mean position as if they were at this distance. Assumed: about twice the radius
in which 54 vehicles move."""
_LEARNS = 0.05  # weight of the newest error in the running mean [1]


@compiled
def alpha_beta(period: float, deviation: float) -> tuple[float, float]:
    """Alpha and beta [1] for the tracking index ACCELERATION period^2 / deviation. Kalata 1984.

    ``period``: since the previous reading [s]; ``deviation``: of position errors [m].
    """
    index = ACCELERATION * period * period / deviation
    r = 0.25 * (4.0 + index - math.sqrt(index * (8.0 + index)))
    alpha = 1.0 - r * r
    return alpha, min(2.0 * (2.0 - alpha) - 4.0 * math.sqrt(1.0 - alpha), 1.0)


@compiled
def noise_of(w: int, i: int, memory: Surroundings) -> float:
    """Mean position error of the sonar over range, as observed [1]; 0 where manoeuvres explain it."""
    return max(memory.error[w, i] - MANOEUVRES, 0.0)


@compiled
def age_of(w: int, i: int, memory: Surroundings) -> float:
    """Mean time since the latest new reading of each recently detected neighbour [s], 0 without any."""
    total, num = 0.0, 0
    for k in range(memory.known.shape[2]):
        if memory.known[w, i, k] > 0.0 and memory.since[w, i, k] <= _FRESH_S:
            total, num = total + memory.since[w, i, k], num + 1
    return total / max(num, 1)


@compiled
def middle(w: int, i: int, memory: Surroundings) -> tuple[float, float, int]:
    """Mean position of known neighbours from the vehicle [m], far ones drawn in, and their number.

    A vehicle in the middle of a swarm has neighbours all around; one at the edge has them on one side.
    """
    x, y, num, pose = 0.0, 0.0, 0, memory.pose[w, i]
    for k in range(memory.known.shape[2]):
        if memory.known[w, i, k] > 0.0:
            d_x, d_y = memory.place[w, i, k, 0] - pose[0], memory.place[w, i, k, 1] - pose[1]
            near = _FAR_M / max(_FAR_M, memory.away[w, i, k])
            x, y, num = x + near * d_x, y + near * d_y, num + 1
    return x / max(num, 1), y / max(num, 1), num


@compiled
def update_neighbours(w: int, i: int, see: Fields, period: float, memory_s: float, memory: Surroundings) -> None:
    """Update a vehicle's tracks with its detections."""
    known, since, place, velocity = memory.known[w, i], memory.since[w, i], memory.place[w, i], memory.velocity[w, i]
    for k in range(known.shape[0]):
        if known[k] > 0.0:
            since[k] += period
            place[k, 0] += period * velocity[k, 0]
            place[k, 1] += period * velocity[k, 1]
            known[k] = -known[k]  # not detected yet
    for s in range(see.detected.shape[2]):
        if see.detected[w, i, s] > 0.0:
            p_x, p_y = float(see.neighbour[w, i, s, 0]), float(see.neighbour[w, i, s, 1])
            x, y = to_map(p_x, p_y, memory.pose[w, i])
            reach = math.hypot(p_x, p_y)
            k = _associated_track(x, y, reach, w, i, memory)
            if k >= 0:
                _correct_track(w, i, k, x, y, reach, memory)
            elif not _is_repeated(x, y, w, i, memory):
                _begin_track(w, i, x, y, memory)
    for k in range(known.shape[0]):
        if known[k] < 0.0:
            known[k] = 0.0 if since[k] > memory_s else -known[k]


@compiled
def _associated_track(x: float, y: float, reach: float, w: int, i: int, memory: Surroundings) -> int:
    """Index of the track predicted nearest to a detection, -1 for none within the gate.

    x and y are the detection in the map [m], ``reach`` is its range [m].
    """
    gate = GATE_M + GATE_SHARE * reach
    best, least, known, place = -1, gate * gate, memory.known[w, i], memory.place[w, i]
    for k in range(known.shape[0]):
        dx, dy = x - place[k, 0], y - place[k, 1]
        squared = dx * dx + dy * dy
        if squared < least and known[k] < 0.0:
            best, least = k, squared
    return best


@compiled
def _is_repeated(x: float, y: float, w: int, i: int, memory: Surroundings) -> bool:
    """Whether an overlapping sub-sector has detected the same vehicle at this decision."""
    for k in range(memory.known.shape[2]):
        dx, dy = x - memory.reading[w, i, k, 0], y - memory.reading[w, i, k, 1]
        if dx * dx + dy * dy < _SAME_M * _SAME_M and memory.known[w, i, k] > 0.0:
            return True
    return False


@compiled
def _correct_track(w: int, i: int, k: int, x: float, y: float, reach: float, memory: Surroundings) -> None:
    """Correct a track by a reading. x, y and ``reach`` as for ``_associated_track``."""
    place, velocity, last = memory.place[w, i, k], memory.velocity[w, i, k], memory.reading[w, i, k]
    memory.known[w, i, k] = 1.0 - memory.known[w, i, k]
    since = memory.since[w, i, k]
    if math.hypot(x - last[0], y - last[1]) < _SAME_M and since < _STALE_S:
        return
    dx, dy = x - place[0], y - place[1]
    error = math.hypot(dx, dy) / max(reach, 1.0)
    memory.error[w, i] += _LEARNS * (error - memory.error[w, i])
    alpha, beta = alpha_beta(since, max(noise_of(w, i, memory), LEAST_ERROR) * max(reach, 1.0))
    place[0], place[1] = place[0] + alpha * dx, place[1] + alpha * dy
    velocity[0], velocity[1] = velocity[0] + beta * dx / since, velocity[1] + beta * dy / since
    last[0], last[1] = x, y
    memory.since[w, i, k] = 0.0


@compiled
def _begin_track(w: int, i: int, x: float, y: float, memory: Surroundings) -> None:
    """Begin a track that moves as l(t) does; without a free row, it replaces the one undetected for longest."""
    best, most = 0, -1.0
    for k in range(memory.known.shape[2]):
        if memory.known[w, i, k] == 0.0:
            best = k
            break
        if memory.known[w, i, k] < 0.0 and memory.since[w, i, k] > most:
            best, most = k, memory.since[w, i, k]
    speed = memory.reference_speed[w, i]
    memory.place[w, i, best, 0], memory.place[w, i, best, 1] = x, y
    memory.reading[w, i, best, 0], memory.reading[w, i, best, 1] = x, y
    memory.velocity[w, i, best, 0] = speed * memory.reference[w, i, 2]
    memory.velocity[w, i, best, 1] = speed * memory.reference[w, i, 3]
    memory.known[w, i, best], memory.since[w, i, best] = 1.0, 0.0
