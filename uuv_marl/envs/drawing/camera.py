"""The camera: from metres to pixels, north up, east right."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from uuv_marl.envs.drawing.scene import Float, Scene
from uuv_marl.scenario import Scenario

CAMERAS = ("follow", "map")
"""``follow`` keeps the swarm and l(t) in view, ``map`` the whole map."""
_MARGIN = 0.12
"""Margin on each side, as a share of the picture."""
_LEAST_M = 80.0
"""Least extent of the view of a camera that follows."""
_STRAY = 3.0
"""Distance from l(t) and from the swarm's middle, in s_l, beyond which a camera that follows ignores vehicles."""


class Camera(NamedTuple):
    """A view."""

    centre: Float
    """Middle of the picture: north, east [m], shape (2,)."""
    scale: float
    """Pixels per metre."""
    size: tuple[int, int]
    """Width and height [px]."""

    def pixels(self, points: Float) -> Float:
        """Points (..., north and east [m]) on the picture, (..., right and down [px])."""
        offset = (points - self.centre) * self.scale
        return np.stack([self.size[0] / 2 + offset[..., 1], self.size[1] / 2 - offset[..., 0]], axis=-1)

    @property
    def reach(self) -> Float:
        """Distances from the middle to the edges: north, east [m], shape (2,)."""
        return np.array([self.size[1], self.size[0]]) / (2.0 * self.scale)

    def magnified(self, factor: int) -> "Camera":
        """The same view on a larger picture."""
        return Camera(self.centre, self.scale * factor, (self.size[0] * factor, self.size[1] * factor))


def aim(kind: str, scenes: Sequence[Scene], size: tuple[int, int]) -> Camera:
    """One of ``CAMERAS`` for a picture of this size [px], the same for all scenes."""
    if kind == "map":
        return _around(np.concatenate([_map_bounds(scene) for scene in scenes]), size)
    return _around(np.concatenate([_swarm(scene) for scene in scenes]), size, _LEAST_M)


def nice(length: float) -> float:
    """The smallest of 1, 2, 5, 10, 20, ... from this length on."""
    power = 10.0 ** math.floor(math.log10(length))
    return next(step * power for step in (1.0, 2.0, 5.0, 10.0) if step * power >= length * (1.0 - 1e-9))


def shown_speed(scenario: Scenario) -> float:
    """A round speed [m/s] for the scale of the current's arrows."""
    current = scenario.current
    return nice(max(current.speed_mps, current.variation_mps, current.eddy_speed_mps if current.eddies else 0.0))


def _around(points: Float, size: tuple[int, int], least_m: float = 1.0) -> Camera:
    low, high = points.min(axis=0), points.max(axis=0)
    north, east = np.maximum(high - low, least_m) / (1.0 - 2.0 * _MARGIN)
    return Camera((low + high) / 2.0, float(min(size[0] / east, size[1] / north)), size)


def _swarm(scene: Scene) -> Float:
    living = scene.position[scene.alive]
    references = scene.references[list(scene.groups.paths)]
    centres = [*references, np.median(living, axis=0) if len(living) else references[0]]
    away = np.min([np.hypot(*(living - centre).T) for centre in centres], axis=0)
    shown = living[away < _STRAY * scene.scenario.constraints.s_l_m]
    return np.concatenate([shown, references])


def _map_bounds(scene: Scene) -> Float:
    """Corners of trajectory, obstacles and start, with a margin for the swarm, shape (corner, 2)."""
    start, n = scene.scenario.start, scene.scenario.swarm.num_vehicles
    length, width = start.sides(n)
    ahead = scene.waypoints[1] - scene.waypoints[0]
    ahead = ahead / np.hypot(*ahead)
    behind, aside = -length * ahead, (start.gap_m / 2.0 + width) * np.array([-ahead[1], ahead[0]])
    corners = scene.waypoints[0] + np.array([behind + aside, behind - aside, aside, -aside])
    margin = 0.3 * start.spacing_m * math.sqrt(n)
    discs, radius = scene.obstacles[:, :2], scene.obstacles[:, 2:]
    edges = np.concatenate([path + side for _, path in scene.groups.paths.values() for side in (-margin, margin)])
    return np.concatenate([corners, edges, discs - radius, discs + radius])
