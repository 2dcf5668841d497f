"""Frames: one or more scenes side by side, each below its numbers, above a common legend."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uuv_marl.envs.drawing import ink
from uuv_marl.envs.drawing.camera import aim
from uuv_marl.envs.drawing.legend import draw_legend, legend_rows
from uuv_marl.envs.drawing.painter import Painter
from uuv_marl.envs.drawing.scene import Scene
from uuv_marl.extras import extra

with extra("render", "rendering"):
    import pygame

_PAD = 8


class Panel(NamedTuple):
    """A scene under its title."""

    title: str
    scene: Scene
    clock: float = 0.0
    """Panels with the same clock share a view."""


def draw_frame(
    panels: Sequence[Panel], size: tuple[int, int], camera: str, heading: str = "", *,
    columns: int = 1, grid: bool = True,
) -> pygame.Surface:  # fmt: skip
    """A picture of this size [px]: panels by row, below a heading if there is one, above the legend if it is small."""
    unit = max(1.0, min(size[0] / columns, size[1]) / 800.0)
    small, header = round(12 * unit), round(94 * unit)
    above, below = (
        round(24 * unit) if heading else 0,
        round(20 * unit) * legend_rows(size[0], panels[0].scene, small) + 4,
    )
    has_legend = below < 0.15 * size[1]
    wide, high = size[0] // columns, (size[1] - above - below * has_legend) // -(-len(panels) // columns)
    painter = Painter((wide - (2 if columns > 1 else 0), high - header), grid=grid)
    small_map = Painter((header - _PAD, header - _PAD))
    surface = pygame.Surface(size, depth=32)
    surface.fill(ink.WHITE)
    ink.write(surface, heading, (_PAD, 5 * unit), round(13 * unit), ink.QUIET)
    clocks = {panel.clock: [other.scene for other in panels if other.clock == panel.clock] for panel in panels}
    views = {clock: aim(camera, scenes, painter.size) for clock, scenes in clocks.items()}
    for k, (title, scene, clock) in enumerate(panels):
        row, column = divmod(k, columns)
        x, y, width = column * wide, above + row * high, wide - _PAD
        surface.blit(painter.paint(scene, views[clock]), (x, y + header))
        if camera == "follow":
            width -= header
            glimpse = small_map.glimpse(scene, aim("map", [scene], small_map.size), views[clock])
            surface.blit(glimpse, (x + width + _PAD, y + _PAD // 2))
        _head(surface, title, scene, (x + _PAD, y), width, unit, round((17 if wide >= 480 else 14) * unit))
    if has_legend:
        draw_legend(surface, pygame.Rect(0, size[1] - below, size[0], below), panels[0].scene, small)
    return surface


def _head(
    surface: pygame.Surface, title: str, scene: Scene, at: tuple[int, int], width: int, unit: float, height: int
) -> None:
    """The title with letters of this height, and the numbers in two rows."""
    x, y = at
    title, small = ink.fitting(title, width, height, bold=True), round(12 * unit)
    ink.write(surface, title, (x, y + 4 * unit), height, bold=True)
    roomy = width > 480 * unit
    if roomy:
        after = x + ink.text(title, height, bold=True).get_width() + small
        ink.write(surface, scene.scenario.title, (after, y + 8 * unit), small, ink.QUIET)
    for k, (label, short, value, colour) in enumerate(_numbers(scene)):
        row, column = divmod(k, 3)
        left, top = x + column * min(width // 3, 190 * unit), y + (28 + 32 * row) * unit
        ink.write(surface, label if roomy else short, (left, top), round(11 * unit), ink.QUIET)
        ink.write(surface, value, (left, top + 12 * unit), round((13 if roomy else 12) * unit), colour, bold=True)


def pixels(surface: pygame.Surface) -> NDArray[np.uint8]:
    """A copy of a picture as an array, shape (height, width, 3)."""
    width, height = surface.get_size()
    return np.frombuffer(bytearray(pygame.image.tobytes(surface, "RGB")), np.uint8).reshape(height, width, 3)


def _numbers(scene: Scene) -> list[tuple[str, str, str, ink.Colour]]:
    """Label, short label, value and colour of each number in a header."""
    limits, hull_m = scene.scenario.constraints, scene.scenario.collision.hull_radius_m

    def distance(value: float, least: float, touching: float) -> tuple[str, ink.Colour]:
        colour = ink.ORANGE if value < touching else ink.AMBER if value < least else ink.TEXT
        return ("–", ink.TEXT) if not math.isfinite(value) else (_metres(value), colour)

    alive, n, arrived = int(scene.alive.sum()), len(scene.alive), scene.arrival_s is not None
    return [
        ("arrived after", "arrived", f"{scene.arrival_s:.1f} s", ink.GREEN)
        if arrived
        else ("time", "time", f"{scene.time_s:.1f} s", ink.TEXT),
        ("smallest spacing", "spacing", *distance(scene.min_spacing_m, limits.s_u_m, 2.0 * hull_m)),
        ("smallest obstacle distance", "clearance", *distance(scene.clearance_m, limits.s_o_m, hull_m)),
        ("vehicles", "vehicles", f"{alive}" if alive == n else f"{alive} of {n}", ink.TEXT),
        ("collisions", "collisions", f"{scene.collisions}", ink.ORANGE if scene.collisions else ink.TEXT),
        (f"swarm's centre to {scene.place}", f"to {scene.place}", _metres(scene.centre_error_m), ink.TEXT),
    ][: 6 if scene.followed_paths else 5]


def _metres(value: float) -> str:
    return f"{value:.1f} m" if value < 100.0 else f"{value:.0f} m"
