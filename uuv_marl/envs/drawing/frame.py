"""Whole frames: the water of one or more scenes side by side, each under its numbers, above a common legend."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uuv_marl.envs.drawing import ink
from uuv_marl.envs.drawing.camera import aim
from uuv_marl.envs.drawing.legend import draw_legend, rows
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


class Frame:
    """Draws panels into a picture of this size [px], so many of them side by side."""

    def __init__(self, size: tuple[int, int], columns: int = 1) -> None:
        self.size, self._columns = size, columns
        self._surface = pygame.Surface(size, depth=32)
        self._unit = unit = max(1.0, min(size[0] / columns, size[1]) / 800.0)
        self._text = round(12 * unit)
        self._laid = (0, 0)

    def draw(self, panels: Sequence[Panel], camera: str) -> pygame.Surface:
        """The picture, by row; the next call draws over it."""
        self._lay_out(panels)
        self._surface.fill(ink.WHITE)
        scenes = [panel.scene for panel in panels]
        view = aim(camera, scenes, self._painter.size)
        wide, high = self._cell
        for k, panel in enumerate(panels):
            row, column = divmod(k, self._columns)
            x, y, room = column * wide, row * high, wide
            self._surface.blit(self._painter.paint(panel.scene, view), (x, y + self._header))
            if camera == "follow":
                room -= self._header
                whole = aim("map", [panel.scene], self._glimpse.size)
                self._surface.blit(self._glimpse.glimpse(panel.scene, whole, view), (x + room, y + _PAD // 2))
            self._head(panel, (x + _PAD, y), room - _PAD)
        area = pygame.Rect(0, self.size[1] - self._below, self.size[0], self._below)
        draw_legend(self._surface, area, scenes[0], self._text)
        return self._surface

    def _lay_out(self, panels: Sequence[Panel]) -> None:
        """Cells for the panels, and below them room for the legend."""
        below = rows(self.size[0], panels[0].scene, self._text)
        if self._laid == (len(panels), below):
            return
        self._laid = len(panels), below
        self._below = round(1.6 * self._text) * below + 4
        self._cell = (self.size[0] // self._columns, (self.size[1] - self._below) // -(-len(panels) // self._columns))
        roomy = self._cell[0] >= 480
        self._title, self._header = round((17 if roomy else 14) * self._unit), round(94 * self._unit)
        self._glimpse = Painter((self._header - _PAD,) * 2)
        self._painter = Painter((self._cell[0] - (2 if self._columns > 1 else 0), self._cell[1] - self._header))

    def _head(self, panel: Panel, at: tuple[int, int], room: int) -> None:
        """The title, and the numbers in two or three rows."""
        x, y = at
        ink.write(self._surface, panel.title, (x, y + 4 * self._unit), self._title, bold=True)
        numbers = _numbers(panel.scene)
        columns = 3
        for k, (label, value, colour) in enumerate(numbers):
            row, column = divmod(k, columns)
            left = x + column * min(room // columns, 170 * self._unit)
            top = y + 1.7 * self._title + row * 2.6 * self._text
            ink.write(self._surface, label, (left, top), round(0.9 * self._text), ink.QUIET)
            ink.write(self._surface, value, (left, top + 1.05 * self._text), round(1.1 * self._text), colour, bold=True)


def pixels(surface: pygame.Surface) -> NDArray[np.uint8]:
    """A picture as an array of its own, shape (height, width, 3)."""
    width, height = surface.get_size()
    return np.frombuffer(bytearray(pygame.image.tobytes(surface, "RGB")), np.uint8).reshape(height, width, 3)


def _numbers(scene: Scene) -> list[tuple[str, str, ink.Colour]]:
    """Label, value and colour of what a header tells."""
    limits, contact = scene.scenario.constraints, scene.scenario.contact.hull_radius_m

    def distance(value: float, least: float, touching: float) -> tuple[str, ink.Colour]:
        colour = ink.ORANGE if value < touching else ink.AMBER if value < least else ink.TEXT
        return ("-", ink.TEXT) if not math.isfinite(value) else (f"{value:.1f} m", colour)

    alive, n = int(scene.alive.sum()), len(scene.alive)
    arrived = scene.arrival_s is not None
    return [
        ("arrived", f"{scene.arrival_s:.1f} s", ink.GREEN) if arrived else ("time", f"{scene.time_s:.1f} s", ink.TEXT),
        ("spacing", *distance(scene.min_spacing_m, limits.s_u_m, 2.0 * contact)),
        ("clearance", *distance(scene.clearance_m, limits.s_o_m, contact)),
        ("vehicles", f"{alive}" if alive == n else f"{alive} of {n}", ink.TEXT),
        ("collisions", f"{scene.collisions}", ink.ORANGE if scene.collisions else ink.TEXT),
        ("to l(t)", f"{scene.centre_error_m:.1f} m", ink.TEXT),
    ]
