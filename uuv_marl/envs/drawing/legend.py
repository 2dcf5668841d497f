"""The legend of a frame: a sign and words for everything that is drawn."""

from collections.abc import Callable

import numpy as np

from uuv_marl.envs.drawing import ink
from uuv_marl.envs.drawing.camera import shown_speed
from uuv_marl.envs.drawing.current import ARROW, arrow
from uuv_marl.envs.drawing.painter import DART, FINE, diagonal_cross, star
from uuv_marl.envs.drawing.scene import TRAIL_S, Scene
from uuv_marl.extras import extra
from uuv_marl.scenario import conditions, disturbances

with extra("render", "rendering"):
    import pygame

Sign = Callable[[pygame.Surface, float], object]
"""Draws into a fine surface of 24 x 16 units, each of so many pixels."""
WIDE, HIGH = 24, 16


def signs_of(scene: Scene) -> list[tuple[str, Sign]]:
    """Words and sign of everything in a scene."""
    limits = scene.scenario.constraints
    teams, all_know = np.unique(scene.groups.team).tolist(), scene.groups.informed.all()
    alone = "vehicle" if all_know else "perceives l(t)"
    signs = [(f"group {k + 1}" if len(teams) > 1 else alone, _dart(ink.TEAMS[k])) for k in teams]
    if not all_know:
        signs.append(("does not perceive l(t)", _all(_dart(ink.BLUE), _dart(ink.WHITE, 7.5))))
    task = scene.scenario.task_class
    moving = _all(_circle(ink.GREEN, width=2.0), _circle(ink.GREEN, 2.0))
    signs.append((task.reference_label, moving if scene.followed_paths else _goal))
    if len(scene.marks):
        signs.append((task.mark_label or "of the task", _circle(ink.AMBER, width=1.0)))
    if scene.trail:
        signs.append((f"last {TRAIL_S:g} s", _trail))
    near = f"nearer than {limits.s_u_m:g} m"
    if scene.obstacles.size:
        disc = _all(_circle(ink.KEEP_OUT, width=0.5), _circle(ink.DISC, 5.0))
        signs.append((f"obstacle, s_o = {limits.s_o_m:g} m", disc))
        near += "" if limits.s_o_m == limits.s_u_m else f", obstacle {limits.s_o_m:g} m"
    signs += [(near, _dart(ink.AMBER)), ("collision", _all(_cross(ink.ORANGE, 3.0), _circle(ink.ORANGE, width=1.5)))]
    if scene.scenario.loses_vehicles:
        signs.append(("lost", _cross(ink.LOST, 3.5)))
    if scene.scenario.modem.message_entries:
        signs.append(("sends a message", _all(_circle(ink.PINK, 4.0, 1.0), _circle(ink.PINK, width=1.0))))
    if scene.water is not None:
        signs.append((f"current, {shown_speed(scene.scenario):g} m/s", _current))
    if scene.sonar is not None:
        signs += [("active sonar", _patch(ink.ACTIVE)), ("passive sonar", _patch(ink.PASSIVE)), ("detection", _line)]
        signs += [("echo", _echo)] if scene.obstacles.size else []
    return signs


def legend_rows(width: int, scene: Scene, height: int) -> int:
    """Rows of a scene's legend in this width, with letters of this height [px]."""
    return 1 + max(row for row, *_ in _flow(width, scene, height))


def draw_legend(surface: pygame.Surface, area: pygame.Rect, scene: Scene, height: int) -> None:
    """Draw a scene's legend in an area that holds its ``legend_rows`` [px]."""
    unit = height / 12.0
    for row, x, words, sign in _flow(area.width, scene, height):
        y = area.top + (3 + 20 * row) * unit
        if sign is not None:
            surface.blit(_drawn(sign, unit), (area.left + round(x), round(y)))
        after = (WIDE + 4) * unit if sign is not None else 0.0
        ink.write(surface, words, (area.left + x + after, y), height)


def _flow(width: int, scene: Scene, height: int) -> list[tuple[int, float, str, Sign | None]]:
    """Row, left end, word and sign; disturbances follow below, as text."""
    unit, row, flown = height / 12.0, 0, list[tuple[int, float, str, Sign | None]]()
    x = 8 * unit
    for words, sign in signs_of(scene):
        wide = (WIDE + 18) * unit + ink.text(words, height).get_width()
        if x > 8 * unit and x + wide > width:
            row, x = row + 1, 8 * unit
        flown.append((row, x, words, sign))
        x += wide
    if disturbances(scene.scenario):
        words = f"disturbances: {conditions(scene.scenario)}"
        flown.append((row + 1, 8 * unit, ink.fitting(words, width - 16 * unit, height, start=True), None))
    return flown


def _drawn(sign: Sign, unit: float) -> pygame.Surface:
    fine = pygame.Surface((round(WIDE * unit) * FINE, round(HIGH * unit) * FINE), depth=32)
    fine.fill(ink.WHITE)
    sign(fine, unit * FINE)
    return pygame.transform.smoothscale(fine, (round(WIDE * unit), round(HIGH * unit)))


def _dart(colour: ink.Colour, size: float = 15.0) -> Sign:
    return lambda fine, unit: pygame.draw.polygon(fine, colour, (([10.0, 8.0] + size * DART) * unit).tolist())


def _goal(fine: pygame.Surface, unit: float) -> None:
    star(fine, np.array([12.0, 8.0]) * unit, 6.0 * unit, ink.QUIET)


def _trail(fine: pygame.Surface, unit: float) -> None:
    for k, colour in enumerate(ink.TRAILS):
        pygame.draw.line(fine, colour, (5.0 * k * unit, 8.0 * unit), (5.0 * (k + 1) * unit, 8.0 * unit), round(unit))


def _circle(colour: ink.Colour, radius: float = 7.5, width: float = 0.0) -> Sign:
    """A circle, filled if it has no width."""
    return lambda fine, unit: pygame.draw.circle(
        fine, colour, (12.0 * unit, 8.0 * unit), radius * unit, round(width * unit)
    )


def _cross(colour: ink.Colour, size: float) -> Sign:
    return lambda fine, unit: diagonal_cross(
        fine, np.array([12.0, 8.0]) * unit, size * unit, colour, round(0.8 * unit) * 2
    )


def _all(*signs: Sign) -> Sign:
    """Signs on top of each other."""
    return lambda fine, unit: [sign(fine, unit) for sign in signs]


def _current(fine: pygame.Surface, unit: float) -> None:
    arrow(fine, np.array([2.0, 8.0]) * unit, np.array([ARROW, 0.0]) * unit, unit)


def _line(fine: pygame.Surface, unit: float) -> None:
    pygame.draw.line(fine, ink.PINK, (2.0 * unit, 8.0 * unit), (22.0 * unit, 8.0 * unit), round(unit))


def _echo(fine: pygame.Surface, unit: float) -> None:
    angles = np.linspace(-0.9, 0.9, 12)
    arc = np.stack([4.0 + 9.0 * np.cos(angles), 8.0 + 9.0 * np.sin(angles)], axis=1) * unit
    pygame.draw.lines(fine, ink.PINK, False, arc.tolist(), round(3.0 * unit))


def _patch(colour: ink.Colour) -> Sign:
    return lambda fine, unit: (fine.fill(colour), pygame.draw.rect(fine, ink.EDGE, fine.get_rect(), round(unit)))
