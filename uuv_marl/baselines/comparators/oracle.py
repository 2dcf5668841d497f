"""``oracle``: follows the given path of a task with the channel ``path``; shows that every map can be passed.

Its desired velocity leads to a point ahead on the given path (the channel ``path``), and off near neighbours. It takes
the nearest velocity that approaches no wall and no neighbour too fast. Of two neighbours, the one nearer to that point
has right of way: it is pushed less and keeps less distance, so that neither is blocked at a gap.
"""

import math
from typing import NamedTuple

import numpy as np

from uuv_marl.baselines.controller import Controller
from uuv_marl.baselines.policy import Limits
from uuv_marl.baselines.requirements import PolicyRequirements
from uuv_marl.baselines.safety.halfplanes import nearest_velocity
from uuv_marl.baselines.steering import full_speed, steer
from uuv_marl.percept import Fields, Percept, Starts
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.views import fields
from uuv_marl.types import Float32, Float64


class OracleGains(NamedTuple):
    """Free parameters, found by hand on seeds from 10,000 on."""

    speed: float = 4.2  # along the path [m/s]
    slow: float = 0.25  # largest speed over the length of the remaining path [1/s]
    wall: float = 2.6  # least distance to walls [m]
    wall_rate: float = 0.8  # largest speed towards a wall, over the distance above that [1/s]
    apart: float = 4.5  # least distance to a neighbour with right of way [m]
    apart_behind: float = 3.5  # least distance to the others [m]
    apart_rate: float = 0.5  # largest speed towards a neighbour at rest, over the distance above that [1/s]
    follow: float = 0.9  # share of a neighbour's speed away that is added to it [1]
    push: float = 2.5  # speed away from a neighbour with right of way, at distance 0 [m/s]
    push_behind: float = 1.25  # the same for the others [m/s]
    push_range: float = 9.0  # distance at which both end [m]


class Oracle(Controller):
    """Follows the shortest path that the task knows: shows that each map can be passed."""

    requirements = PolicyRequirements(("path", "link"), yaw_damping_nms=600.0, outputs_force=True)
    Gains = OracleGains

    def _write(self, percept: Percept, action: Float32) -> None:
        flat = self.flat(percept)
        path, walls = percept["path"], percept["path_walls"]
        length = percept["path_length"] * (percept["right_of_way"] if "right_of_way" in self.layout.starts else 1.0)
        planes = np.zeros((walls.shape[2] + self.scenario.sonar.num_sectors, 3))
        _act(flat, self.at, path, length, walls, self.gains, self.limits, self._gain, planes, action)


@compiled
def _act(
    flat: Float32, at: Starts, path: Float32, length: Float32, walls: Float32, g: OracleGains, limits: Limits,
    gain: float, planes: Float64, action: Float32,
) -> None:  # fmt: skip
    see, most = fields(flat, at), full_speed(limits)
    for w in range(flat.shape[0]):
        for i in range(flat.shape[1]):
            x, y = float(path[w, i, 0]), float(path[w, i, 1])
            pace = min(g.speed, g.slow * length[w, i, 0]) / max(math.hypot(x, y), 1e-6)
            firm = _keep_off_walls(walls[w, i], most, g, planes)
            p_x, p_y, num = _keep_apart(w, i, see, x, y, most, g, planes, firm)
            v_x, v_y, _ = nearest_velocity(pace * x + p_x, pace * y + p_y, planes, num, firm, most)
            steer(v_x, v_y, see.velocity[w, i, 0], see.velocity[w, i, 1], gain, limits, action[w, i])


@compiled
def _keep_off_walls(walls: Float32, most: float, g: OracleGains, planes: Float64) -> int:
    """Write half-planes of walls at these vectors [m], shape (wall, 2); returns how many bind below ``most`` [m/s]."""
    num = 0
    for k in range(walls.shape[0]):
        x, y = float(walls[k, 0]), float(walls[k, 1])
        gap = math.hypot(x, y)
        bound = g.wall_rate * (gap - g.wall)
        if gap > 0.0 and bound < most:
            planes[num, 0], planes[num, 1], planes[num, 2] = x / gap, y / gap, bound
            num += 1
    return num


@compiled
def _keep_apart(
    w: int, i: int, see: Fields, x: float, y: float, most: float, g: OracleGains, planes: Float64, num: int
) -> tuple[float, float, int]:
    """Write the half-planes of neighbours from row ``num`` on; (x, y) is the point ahead [m].

    Returns the push away from them [m/s] and the number of planes.
    """
    p_x, p_y, ahead = 0.0, 0.0, math.hypot(x, y)
    for k in range(see.detected.shape[2]):
        n_x, n_y = float(see.neighbour[w, i, k, 0]), float(see.neighbour[w, i, k, 1])
        away = math.hypot(n_x, n_y)
        if see.detected[w, i, k] == 0.0 or away == 0.0:
            continue
        first = math.hypot(x - n_x, y - n_y) < ahead
        n_x, n_y = n_x / away, n_y / away
        push = (g.push if first else g.push_behind) * max(1.0 - away / g.push_range, 0.0)
        p_x, p_y = p_x - push * n_x, p_y - push * n_y
        goes = max(n_x * see.link_velocity[w, i, k, 0] + n_y * see.link_velocity[w, i, k, 1], 0.0)
        bound = g.follow * goes + g.apart_rate * (away - (g.apart if first else g.apart_behind))
        if bound < most:
            planes[num, 0], planes[num, 1], planes[num, 2] = n_x, n_y, bound
            num += 1
    return p_x, p_y, num
