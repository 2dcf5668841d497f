"""Paints how the water moves: arrows at fixed places, as long as it is fast."""

import numpy as np

from uuv_marl.envs.drawing import ink
from uuv_marl.envs.drawing.camera import Camera, shown_speed
from uuv_marl.envs.drawing.scene import Float, Scene
from uuv_marl.extras import extra

with extra("render", "rendering"):
    import pygame

ARROW = 20.0
"""Length of an arrow at ``shown_speed`` in a picture of the usual size [px]."""
_MOST, _LEAST = 1.6, 0.08
"""Longest arrow, and the shortest one that is drawn, relative to ``ARROW``."""


def paint_current(surface: pygame.Surface, scene: Scene, view: Camera, cell: float, unit: float) -> None:
    """Four arrows in every cell of the grid, with this side [m], fixed to the map."""
    if scene.water is None:
        return
    apart = cell / 2.0
    low, high = (view.centre - view.reach) / apart, (view.centre + view.reach) / apart
    rows = [(np.arange(np.floor(low[axis]), np.ceil(high[axis])) + 0.5) * apart for axis in (0, 1)]
    places = np.stack(np.meshgrid(*rows, indexing="ij"), axis=-1).reshape(-1, 2)
    flow = scene.water.at(places) / shown_speed(scene.scenario)
    share = np.hypot(flow[:, 0], flow[:, 1])
    drawn = share > _LEAST
    flow *= np.minimum(1.0, _MOST / np.maximum(share, 1e-9))[:, None]
    along = np.stack([flow[:, 1], -flow[:, 0]], axis=-1) * ARROW * unit
    for middle, vector in zip(view.pixels(places)[drawn], along[drawn], strict=True):
        arrow(surface, middle - vector / 2.0, vector, unit)


def arrow(surface: pygame.Surface, start: Float, vector: Float, unit: float) -> None:
    """An arrow from a point along a vector [px], longer than 0."""
    tip, length = start + vector, float(np.hypot(*vector))
    ahead = vector / length
    aside, wing = np.array([-ahead[1], ahead[0]]), min(5.0 * unit, 0.5 * length)
    pygame.draw.line(surface, ink.CURRENT, start.tolist(), tip.tolist(), max(1, round(0.9 * unit)))
    wings = [(tip - wing * (ahead + side * aside)).tolist() for side in (0.6, -0.6)]
    pygame.draw.lines(surface, ink.CURRENT, False, [wings[0], tip.tolist(), wings[1]], max(1, round(0.9 * unit)))
