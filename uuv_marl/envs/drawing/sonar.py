"""Paints the sonar of one vehicle: its arrays below everything, its detections and echoes above."""

import math
from itertools import pairwise

import numpy as np

from uuv_marl.envs.drawing import ink
from uuv_marl.envs.drawing.camera import Camera
from uuv_marl.envs.drawing.scene import Float, Scene, SonarView
from uuv_marl.extras import extra

with extra("render", "rendering"):
    import pygame


def paint_arrays(surface: pygame.Surface, scene: Scene, sonar: SonarView, view: Camera) -> None:
    """Each array as a fan with the edges of its sub-sectors, active ones on top."""
    pose, heading = scene.position[sonar.vehicle], scene.heading[sonar.vehicle]
    middle, far = view.pixels(pose).tolist(), 3.0 * math.hypot(*view.reach)
    for array in sorted(scene.scenario.sonar.arrays, key=lambda array: array.kind == "active"):
        active, bounds = array.kind == "active", array.bounds_rad
        radius = min(array.range_m, far)
        arc = view.pixels(pose + radius * unit(heading + np.linspace(bounds[0], bounds[-1], 48)))
        pygame.draw.polygon(surface, ink.ACTIVE if active else ink.PASSIVE, [middle, *arc.tolist()])
        for edge in view.pixels(pose + radius * unit(heading + bounds)).tolist():
            pygame.draw.line(surface, ink.EDGE, middle, edge)


def paint_detections(surface: pygame.Surface, scene: Scene, sonar: SonarView, view: Camera, line_px: float) -> None:
    """Lines to detected vehicles, and echoes as arcs across their sub-sectors."""
    pose, heading = scene.position[sonar.vehicle], scene.heading[sonar.vehicle]
    ahead, aside = unit(heading), unit(heading + math.pi / 2)
    middle = view.pixels(pose).tolist()
    for place in view.pixels(pose + sonar.neighbour[:, :1] * ahead + sonar.neighbour[:, 1:] * aside).tolist():
        pygame.draw.line(surface, ink.PINK, middle, place, round(1.2 * line_px))
    active = [array.bounds_rad for array in scene.scenario.sonar.arrays if array.kind == "active"]
    sectors = [(low, high) for bounds in active for low, high in pairwise(bounds)]
    for (low, high), radius in zip(sectors, sonar.echo_range, strict=True):
        if radius > 0.0:
            arc = view.pixels(pose + radius * unit(heading + np.linspace(low, high, 8)))
            pygame.draw.lines(surface, ink.PINK, False, arc.tolist(), round(4.0 * line_px))


def unit(angle: float | Float) -> Float:
    """North and east of a direction [rad], shape (..., 2)."""
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)
