"""Paints a scene from above: map, vehicles, trails, collisions and the sonar of one vehicle.

Everything but text is drawn at twice the size and scaled down, so that edges are smooth.
"""

import math
from itertools import pairwise

import numpy as np

from uuv_marl.envs.drawing import ink
from uuv_marl.envs.drawing.camera import Camera, nice
from uuv_marl.envs.drawing.current import paint_current
from uuv_marl.envs.drawing.scene import Float, Scene
from uuv_marl.envs.drawing.sonar import paint_arrays, paint_detections
from uuv_marl.extras import extra

with extra("render", "rendering"):
    import pygame

FINE = 2
"""Pixels drawn for each that is shown, in both directions."""
FRESH_S = 3.0
"""Age of a collision up to which it has a ring around it [s]."""
_GRID_PX, _CHEVRON_PX = 70, 110
DART = np.array([[0.6, 0.0], [-0.4, 0.34], [-0.2, 0.0], [-0.4, -0.34]])
"""A vehicle of length 1, the bow at the front."""


class Painter:
    """Paints pictures of this size [px], with or without a grid of lines."""

    def __init__(self, size: tuple[int, int], *, grid: bool = True) -> None:
        self.size, self._lines = size, grid
        self._fine = pygame.Surface((size[0] * FINE, size[1] * FINE), depth=32)
        self._shown = pygame.Surface(size, depth=32)
        self._unit = FINE * max(1.0, min(size) / 800.0)
        """Fine pixels per pixel of a picture of the usual size."""

    def paint(self, scene: Scene, camera: Camera) -> pygame.Surface:
        """The picture; the next call overwrites it."""
        view = camera.magnified(FINE)
        self._fine.fill(ink.WATER)
        if scene.sonar:
            paint_arrays(self._fine, scene, scene.sonar, view)
        cell = nice(_GRID_PX / camera.scale * self._unit / FINE)
        if self._lines:
            self._grid(view, cell)
        paint_current(self._fine, scene, view, cell, self._unit)
        self._draw_paths(scene, view)
        self._trails(scene, view)
        if scene.sonar:
            paint_detections(self._fine, scene, scene.sonar, view, self._unit)
        self._vehicles(scene, view)
        self._hits(scene, view)
        self._references(scene, view)
        self._bar(view, cell)
        pygame.transform.smoothscale(self._fine, self.size, self._shown)
        self._words(scene, camera, cell)
        return self._shown

    def glimpse(self, scene: Scene, camera: Camera, seen: Camera) -> pygame.Surface:
        """The map in small, with the rectangle that another camera shows."""
        view = camera.magnified(FINE)
        self._fine.fill(ink.WATER)
        self._discs(scene, view)
        for team, path, _ in scene.followed_paths:
            pygame.draw.lines(self._fine, ink.TEAMS.get(team, ink.TRACK), False, view.pixels(path).tolist(), FINE)
        for i in np.flatnonzero(scene.alive):
            at, colour = view.pixels(scene.position[i]).tolist(), ink.TEAMS[scene.groups.team[i]]
            pygame.draw.circle(self._fine, colour, at, FINE)
        self._goals(scene, view, 5.0 * FINE)
        for team, _, at in scene.followed_paths:
            pygame.draw.circle(self._fine, ink.TEAMS.get(team, ink.GREEN), view.pixels(at).tolist(), 2.5 * FINE)
        high, low = view.pixels(seen.centre + seen.reach), view.pixels(seen.centre - seen.reach)
        rectangle = pygame.Rect(low[0], high[1], high[0] - low[0], low[1] - high[1])
        pygame.draw.rect(self._fine, ink.TEXT, rectangle, FINE)
        pygame.draw.rect(self._fine, ink.KEEP_OUT, self._fine.get_rect(), FINE)
        return pygame.transform.smoothscale(self._fine, self.size, self._shown)

    def _grid(self, view: Camera, cell: float) -> None:
        """Lines one shown pixel wide, which stay sharp when scaled down."""
        low, high = view.centre - view.reach, view.centre + view.reach
        width, height = view.size
        for axis in (0, 1):
            lines = np.arange(math.ceil(low[axis] / cell), high[axis] / cell) * cell
            for at in view.pixels(np.repeat(lines[:, None], 2, axis=1))[:, 1 - axis] // FINE * FINE:
                self._fine.fill(ink.GRID, (0, at, width, FINE) if axis == 0 else (at, 0, FINE, height))

    def _draw_paths(self, scene: Scene, view: Camera) -> None:
        """Obstacles, each group's trajectory with its direction and start, and goals."""
        self._discs(scene, view)
        unit = self._unit
        spacing = nice(_CHEVRON_PX * unit / view.scale) * view.scale
        for team, path, _ in scene.followed_paths:
            points, colour, passed = view.pixels(path), ink.TEAMS.get(team, ink.TRACK), 0.0
            pygame.draw.lines(self._fine, colour, False, points.tolist(), round(1.8 * unit))
            for start, end in pairwise(points):
                length = math.hypot(*(end - start))
                along = (end - start) / length
                across = np.array([-along[1], along[0]])
                for at in np.arange(spacing / 2 - passed % spacing, length, spacing):
                    tip = start + max(at, 0.0) * along
                    wings = [tip - 8.0 * unit * (along - side * across) for side in (0.6, -0.6)]
                    pygame.draw.polygon(self._fine, colour, [tip.tolist(), *(wing.tolist() for wing in wings)])
                passed += length
            pygame.draw.circle(self._fine, ink.WHITE, points[0].tolist(), 5.0 * unit)
            pygame.draw.circle(self._fine, colour, points[0].tolist(), 5.0 * unit, round(1.5 * unit))
        self._goals(scene, view, 11.0 * unit)

    def _discs(self, scene: Scene, view: Camera) -> None:
        for middle, radius in zip(view.pixels(scene.obstacles[:, :2]).tolist(), scene.obstacles[:, 2], strict=True):
            around = (float(radius) + scene.scenario.constraints.s_o_m) * view.scale
            pygame.draw.circle(self._fine, ink.KEEP_OUT, middle, around, FINE)
            pygame.draw.circle(self._fine, ink.DISC, middle, float(radius) * view.scale)
        for middle, radius in zip(view.pixels(scene.marks[:, :2]).tolist(), scene.marks[:, 2], strict=True):
            pygame.draw.circle(self._fine, ink.AMBER, middle, float(radius) * view.scale, FINE)

    def _goals(self, scene: Scene, view: Camera, size: float) -> None:
        for team, path in scene.groups.paths.values():
            radius = size if len(path) > 1 else size / 2.0
            star(self._fine, view.pixels(path[-1]), radius, ink.TEAMS.get(team, ink.AMBER))

    def _trails(self, scene: Scene, view: Camera) -> None:
        places = view.pixels(np.array([*scene.trail, scene.position])[:, scene.alive])
        for k, part in enumerate(np.array_split(np.arange(len(places) - 1), len(ink.TRAILS))):
            lines = places[part[0] : part[-1] + 2].swapaxes(0, 1).tolist() if part.size else []
            for line, team in zip(lines, scene.groups.team[scene.alive], strict=False):
                pygame.draw.lines(self._fine, ink.TEAM_TRAILS[team][k], False, line, FINE)

    def _vehicles(self, scene: Scene, view: Camera) -> None:
        """Darts of length s_u, so that two that overlap are too near, longer in large views; hollow if uninformed."""
        unit, apart = self._unit, scene.scenario.start.spacing_m * view.scale
        least = max(min(6.0 * unit, 0.75 * apart), 3.0 * unit)
        length = min(max(scene.scenario.constraints.s_u_m * view.scale, least), 22.0 * unit)
        turned = np.stack([np.sin(scene.heading), -np.cos(scene.heading)], axis=-1)
        ahead, aside = turned, np.stack([-turned[:, 1], turned[:, 0]], axis=-1)
        places = view.pixels(scene.position)
        darts = places[:, None] + length * (DART[:, :1] * ahead[:, None] + DART[:, 1:] * aside[:, None])
        colours = np.where(scene.near[:, None], ink.AMBER, [ink.TEAMS[k] for k in scene.groups.team]).tolist()
        for i in np.flatnonzero(~scene.alive):
            diagonal_cross(self._fine, places[i], 3.5 * unit, ink.LOST, round(1.6 * unit))
        for i in np.flatnonzero(scene.alive):
            pygame.draw.polygon(self._fine, colours[i], darts[i].tolist())
        for i in np.flatnonzero(scene.alive & ~scene.groups.informed):
            pygame.draw.polygon(self._fine, ink.WHITE, ((darts[i] + places[i]) / 2.0).tolist())
        for i in np.flatnonzero(scene.sending):
            for radius in (0.9 * length + 4 * unit, 1.5 * length + 8 * unit):
                pygame.draw.circle(self._fine, ink.PINK, places[i].tolist(), radius, round(1.5 * unit))
        if scene.sonar:
            i = scene.sonar.vehicle
            pygame.draw.polygon(self._fine, ink.PINK, darts[i].tolist())
            pygame.draw.circle(self._fine, ink.PINK, places[i].tolist(), 0.8 * length + 3 * unit, round(1.5 * unit))

    def _hits(self, scene: Scene, view: Camera) -> None:
        """A cross at every collision, with a ring while it is new."""
        unit = self._unit
        for place, when in zip(view.pixels(scene.hits[:, :2]), scene.hits[:, 2], strict=True):
            diagonal_cross(self._fine, place, 4.0 * unit, ink.ORANGE, round(2.0 * unit))
            if scene.time_s - when < FRESH_S:
                pygame.draw.circle(self._fine, ink.ORANGE, place.tolist(), 13.0 * unit, round(2.5 * unit))

    def _references(self, scene: Scene, view: Camera) -> None:
        unit = self._unit
        for team, _, reference in scene.followed_paths:
            at = view.pixels(reference).tolist()
            for colour, wider in ((ink.WHITE, 1.2), (ink.TEAMS.get(team, ink.GREEN), 0.0)):
                pygame.draw.circle(self._fine, colour, at, (12.0 + wider) * unit, round((2.6 + 2.0 * wider) * unit))
                pygame.draw.circle(self._fine, colour, at, (2.4 + wider) * unit)

    def _bar(self, view: Camera, cell: float) -> None:
        """The scale bar, as long as a cell of the grid, and the north arrow."""
        unit = self._unit
        right, low, long = view.size[0] - 34.0 * unit, view.size[1] - 10.0 * unit, cell * view.scale
        ticks = [(right - long, low - 5 * unit), (right - long, low), (right, low), (right, low - 5 * unit)]
        pygame.draw.lines(self._fine, ink.TEXT, False, ticks, round(1.5 * unit))
        x, y = view.size[0] - 15.0 * unit, low - 13 * unit
        arrow = [(x, y - 14 * unit), (x - 5 * unit, y), (x, y - 3 * unit), (x + 5 * unit, y)]
        pygame.draw.polygon(self._fine, ink.TEXT, arrow)

    def _words(self, scene: Scene, camera: Camera, cell: float) -> None:
        unit = self._unit / FINE
        height = round(12 * unit)
        for team, path, reference in scene.followed_paths:
            for words, point in (("start", path[0]), ("goal", path[-1])):
                x, y = camera.pixels(point).tolist()
                left = x - ink.text(words, height, bold=True).get_width() / 2
                ink.write(self._shown, words, (left, y + 13 * unit), height, bold=True, halo=True)
            if scene.place != "goal":
                (x, y), colour = camera.pixels(reference).tolist(), ink.TEAMS.get(team, ink.GREEN)
                ink.write(self._shown, scene.place, (x + 15 * unit, y - 7 * unit), height, colour, bold=True, halo=True)
        right, low = self.size[0], self.size[1] - 9 * unit - height
        words = f"{cell:g} m"
        left = right - 34 * unit - (cell * camera.scale + ink.text(words, height).get_width()) / 2
        ink.write(self._shown, words, (left, low - 5 * unit), height, halo=True)
        ink.write(self._shown, "N", (right - 19 * unit, low), height, bold=True, halo=True)


def star(surface: pygame.Surface, at: Float, size: float, colour: ink.Colour) -> None:
    """A star of this radius [px], with an edge if it is amber."""
    angles = np.arange(10) * math.pi / 5.0
    radii = np.where(np.arange(10) % 2, 0.42, 1.0)[:, None] * size
    points = (at + radii * np.stack([np.sin(angles), -np.cos(angles)], axis=1)).tolist()
    pygame.draw.polygon(surface, colour, points)
    pygame.draw.polygon(surface, ink.TEXT if colour == ink.AMBER else colour, points, max(1, round(size / 12)))


def diagonal_cross(surface: pygame.Surface, at: Float, size: float, colour: ink.Colour, width: int) -> None:
    """A diagonal cross of half width ``size``, with lines of this ``width`` [px]."""
    for slope in (1.0, -1.0):
        start, end = (at + size * np.array([[-1.0, -slope], [1.0, slope]])).tolist()
        pygame.draw.line(surface, colour, start, end, width)
