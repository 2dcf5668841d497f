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


class Frame:
    """Draws panels into a picture of this size [px], in so many columns."""

    def __init__(self, size: tuple[int, int], columns: int = 1, *, grid: bool = True) -> None:
        self.size, self._columns, self._grid = size, columns, grid
        self._surface = pygame.Surface(size, depth=32)
        self._unit = max(1.0, min(size[0] / columns, size[1]) / 800.0)
        self._text = round(12 * self._unit)
        self._laid: tuple[int, ...] = ()

    def draw(self, panels: Sequence[Panel], camera: str, heading: str = "") -> pygame.Surface:
        """The picture, panels by row, below the heading if there is one; the next call overwrites it."""
        self._lay_out(panels, heading)
        self._surface.fill(ink.WHITE)
        ink.write(self._surface, heading, (_PAD, 5 * self._unit), round(13 * self._unit), ink.QUIET)
        clocks = {panel.clock: [other.scene for other in panels if other.clock == panel.clock] for panel in panels}
        views = {clock: aim(camera, scenes, self._painter.size) for clock, scenes in clocks.items()}
        wide, high = self._cell
        for k, panel in enumerate(panels):
            row, column = divmod(k, self._columns)
            x, y, panel_width = column * wide, self._above + row * high, wide
            self._surface.blit(self._painter.paint(panel.scene, views[panel.clock]), (x, y + self._header))
            if camera == "follow":
                panel_width -= self._header
                glimpse = self._glimpse.glimpse(
                    panel.scene, aim("map", [panel.scene], self._glimpse.size), views[panel.clock]
                )
                self._surface.blit(glimpse, (x + panel_width, y + _PAD // 2))
            self._head(panel, (x + _PAD, y), panel_width - _PAD)
        if self._below:
            area = pygame.Rect(0, self.size[1] - self._below, self.size[0], self._below)
            draw_legend(self._surface, area, panels[0].scene, self._text)
        return self._surface

    def _lay_out(self, panels: Sequence[Panel], heading: str) -> None:
        """Cells for the panels, space for the heading above, and for the legend below if it is small."""
        below = round(20 * self._unit) * legend_rows(self.size[0], panels[0].scene, self._text) + 4
        laid = len(panels), below, len(heading) > 0
        if self._laid == laid:
            return
        self._laid = laid
        self._above = round(24 * self._unit) if heading else 0
        self._below = below if below < 0.15 * self.size[1] else 0
        high = (self.size[1] - self._above - self._below) // -(-len(panels) // self._columns)
        self._cell = (self.size[0] // self._columns, high)
        self._title, self._header = round((17 if self._cell[0] >= 480 else 14) * self._unit), round(94 * self._unit)
        self._glimpse = Painter((self._header - _PAD, self._header - _PAD))
        self._painter = Painter((self._cell[0] - (2 if self._columns > 1 else 0), high - self._header), grid=self._grid)

    def _head(self, panel: Panel, at: tuple[int, int], width: int) -> None:
        """The title, and the numbers in two rows."""
        x, y = at
        title = ink.fitting(panel.title, width, self._title, bold=True)
        ink.write(self._surface, title, (x, y + 4 * self._unit), self._title, bold=True)
        roomy = width > 480 * self._unit
        if roomy:
            after = x + ink.text(title, self._title, bold=True).get_width() + self._text
            ink.write(self._surface, panel.scene.scenario.title, (after, y + 8 * self._unit), self._text, ink.QUIET)
        for k, (label, short, value, colour) in enumerate(_numbers(panel.scene)):
            row, column = divmod(k, 3)
            left, top = x + column * min(width // 3, 190 * self._unit), y + (28 + 32 * row) * self._unit
            ink.write(self._surface, label if roomy else short, (left, top), round(11 * self._unit), ink.QUIET)
            high = round((13 if roomy else 12) * self._unit)
            ink.write(self._surface, value, (left, top + 12 * self._unit), high, colour, bold=True)


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
