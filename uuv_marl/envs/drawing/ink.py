"""Colours and text of drawn frames."""

import functools
from pathlib import Path

import numpy as np

from uuv_marl.extras import extra, pictures

with pictures():
    import matplotlib as mpl
with extra("render", "rendering"):
    import pygame

Colour = tuple[int, int, int]

BLUE, ORANGE, GREEN, PINK, AMBER = (0, 114, 178), (213, 94, 0), (0, 158, 115), (204, 121, 167), (230, 159, 0)
"""Okabe and Ito's palette, as the figures have it (``uuv_marl.benchmark.style``)."""
WHITE, WATER, GRID = (255, 255, 255), (246, 250, 252), (222, 231, 236)
PASSIVE, ACTIVE, EDGE = (250, 243, 248), (246, 226, 238), (232, 210, 224)
TEXT, QUIET, TRACK = (33, 41, 48), (96, 108, 118), (70, 80, 88)
CURRENT = (146, 155, 163)
"""QUIET, mixed with a third of WATER, as in ``palette``."""
DISC, KEEP_OUT, LOST = (115, 115, 115), (165, 165, 165), (140, 140, 140)
TRAILS: tuple[Colour, ...] = ((222, 234, 243), (200, 221, 236), (174, 207, 228), (145, 190, 219))
"""Colours of trails, from the oldest to the newest part."""
TEAMS: dict[int | None, Colour] = {0: BLUE, 1: GREEN, 2: PINK, 3: TEXT}
_SHARES = np.array([0.11, 0.2, 0.31, 0.43])[:, None]
TEAM_TRAILS = [TRAILS, *(np.rint(WATER + _SHARES * np.subtract(TEAMS[k], WATER)).tolist() for k in (1, 2, 3))]
"""Colours of teams, and of their trails."""


def palette() -> list[Colour]:
    """Colours of a picture but those of trails, with steps of strong colours towards the water's."""
    strong = np.array((BLUE, ORANGE, GREEN, PINK, AMBER, TEXT, QUIET, DISC))
    faded = np.rint(strong[:, None] + (np.array(WATER) - strong)[:, None] * (np.arange(3) / 3)[:, None]).astype(int)
    return [WHITE, WATER, GRID, PASSIVE, ACTIVE, EDGE, KEEP_OUT, LOST, *map(tuple, faded.reshape(-1, 3).tolist())]


@functools.cache
def _font(height: int, bold: bool) -> pygame.font.Font:
    """DejaVu Sans from Matplotlib, as in the figures."""
    pygame.font.init()
    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    return pygame.font.Font(Path(mpl.get_data_path()) / "fonts" / "ttf" / name, height)


@functools.lru_cache(maxsize=1024)
def text(words: str, height: int, colour: Colour = TEXT, bold: bool = False) -> pygame.Surface:
    """Words as a picture."""
    if not pygame.font.get_init():  # the user called pygame.quit()
        _font.cache_clear()
    return _font(height, bold).render(words, True, colour)


def fitting(words: str, width: float, height: int, *, bold: bool = False, start: bool = False) -> str:
    """These words, or as much of their end (or ``start``) as fits into this width [px], with an ellipsis."""
    parts = [words, *(f"{words[:-k]}…" if start else f"…{words[k:]}" for k in range(1, len(words)))]
    return next((part for part in parts if text(part, height, bold=bold).get_width() <= width), "…")


def write(
    surface: pygame.Surface, words: str, at: tuple[float, float], height: int, colour: Colour = TEXT,
    *, bold: bool = False, halo: bool = False,
) -> None:  # fmt: skip
    """Put words on a surface."""
    x, y = round(at[0]), round(at[1])
    if halo:
        edge = text(words, height, WHITE, bold)
        surface.blits([(edge, (x + dx, y + dy)) for dx, dy in ((-1, 0), (1, 0), (0, -1), (0, 1))], doreturn=False)
    surface.blit(text(words, height, colour, bold), (x, y))
