"""``oracle``: sees the map of ``hard_water`` and follows its way; the proof that every map can be passed, no contender.

Its wished velocity leads to a point ahead on the way, and away from near neighbours. Of the velocities by which no wall
and no neighbour comes near too fast, it takes the nearest to that.
"""

import math
from typing import ClassVar, NamedTuple

import numpy as np

from uuv_marl.baselines.policy import Limits, Policy
from uuv_marl.baselines.safety.halfplanes import nearest_velocity
from uuv_marl.baselines.steering import steer, velocity_gain
from uuv_marl.percept import Percept, Starts
from uuv_marl.scenario import Scenario
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.views import Fields, fields, pairs, part
from uuv_marl.tasks.maps.lead import NUM_WALLS
from uuv_marl.types import Float32, Float64


class OracleGains(NamedTuple):
    """Free parameters, found by hand on seeds from 10,000 on."""

    speed: float = 4.2
    """Along the way [m/s]."""
    slow: float = 0.25
    """Largest speed over the length of the way left [1/s]."""
    wall: float = 2.6
    """Least distance to walls [m]."""
    wall_rate: float = 0.8
    """Largest speed towards a wall over what the distance is above that [1/s]."""
    apart: float = 4.5
    """Least distance to neighbours [m]."""
    apart_rate: float = 0.5
    """The same for neighbours [1/s]."""
    follow: float = 0.9
    """Plus this share of the speed at which the neighbour goes away [1]."""
    push: float = 2.5
    """Speed away from a neighbour that is touched [m/s]."""
    behind: float = 0.5
    """Share of it from a neighbour farther [1]."""
    apart_behind: float = 3.5
    """m"""
    push_range: float = 9.0
    """Distance at which that ends [m]."""


class Oracle(Policy):
    """Follows the way that it is told through walls that it is told: for ``hard_water`` alone."""

    channels: ClassVar[tuple[str, ...]] = ("way", "link")
    wishes_force: ClassVar[bool] = True
    yaw_damping_nms: ClassVar[float] = 600.0

    def __init__(self, scenario: Scenario, num_worlds: int = 1, *, gains: OracleGains | None = None) -> None:
        super().__init__(scenario, num_worlds)
        self.gains = gains or OracleGains()
        self._gain = velocity_gain(scenario)
        self._planes = np.zeros((NUM_WALLS + scenario.sonar.num_sectors, 3))

    def decide(self, percept: Percept) -> Float32:
        """Actions of shape (world, vehicle, 2)."""
        flat, starts = self.flat(percept), self.layout.starts
        own = starts["way"], starts["way_length"], starts["way_walls"], starts.get("way_turn", -1)
        action = np.empty((*flat.shape[:2], 2), np.float32)
        _act(flat, self.at, own, self.gains, self.limits, self._gain, self._planes, action)
        return action


@compiled
def _act(
    flat: Float32, at: Starts, own: tuple[int, int, int, int], g: OracleGains, limits: Limits, gain: float,
    planes: Float64, action: Float32,
) -> None:  # fmt: skip
    """The law for every vehicle."""
    see, way = fields(flat, at), part(flat, own[0], 2)[0]
    length, walls = part(flat, own[1], 1)[0], pairs(flat, own[2], NUM_WALLS)[0]
    for w in range(flat.shape[0]):
        for i in range(flat.shape[1]):
            w_x, w_y = float(way[w, i, 0]), float(way[w, i, 1])
            pace = min(g.speed, g.slow * length[w, i, 0]) / max(math.hypot(w_x, w_y), 1e-6)
            if own[3] >= 0:
                pace *= flat[w, i, own[3]]
            num = _wall_planes(walls[w, i], g, planes)
            p_x, p_y, all_ = _neighbour_planes(w, i, see, w_x, w_y, g, planes, num)
            v_x, v_y, _ = nearest_velocity(pace * w_x + p_x, pace * w_y + p_y, planes, all_, num, 5.0)
            steer(v_x, v_y, see.velocity[w, i, 0], see.velocity[w, i, 1], gain, limits, action[w, i])


@compiled
def _wall_planes(walls: Float32, g: OracleGains, planes: Float64) -> int:
    """Fill ``planes`` with what walls, shape (wall, 2) [m], let the velocity be; how many they are."""
    num = 0
    for k in range(walls.shape[0]):
        x, y = float(walls[k, 0]), float(walls[k, 1])
        gap = math.hypot(x, y)
        if 0.0 < gap < 25.0:
            planes[num, 0], planes[num, 1], planes[num, 2] = x / gap, y / gap, g.wall_rate * (gap - g.wall)
            num += 1
    return num


@compiled
def _neighbour_planes(
    w: int, i: int, see: Fields, w_x: float, w_y: float, g: OracleGains, planes: Float64, num: int
) -> tuple[float, float, int]:
    """Likewise for neighbours, from row ``num`` on; the push [m/s], and how many planes there are then."""
    p_x, p_y = 0.0, 0.0
    for k in range(see.heard.shape[2]):
        x, y = float(see.neighbour[w, i, k, 0]), float(see.neighbour[w, i, k, 1])
        away = math.hypot(x, y)
        if see.heard[w, i, k] > 0.0 and 0.0 < away < 25.0:
            first = math.hypot(w_x - x, w_y - y) < math.hypot(w_x, w_y)
            push = (1.0 if first else g.behind) * g.push * max(1.0 - away / g.push_range, 0.0)
            x, y = x / away, y / away
            p_x, p_y = p_x - push * x, p_y - push * y
            goes = max(x * see.link_velocity[w, i, k, 0] + y * see.link_velocity[w, i, k, 1], 0.0)
            planes[num, 0], planes[num, 1] = x, y
            planes[num, 2] = g.follow * goes + g.apart_rate * (away - (g.apart if first else g.apart_behind))
            num += 1
    return p_x, p_y, num
