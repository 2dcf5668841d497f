"""Pictures of a world: north up, east right. Drawn with pygame; only a window needs a display."""

import os
import warnings

import numpy as np
from numpy.typing import NDArray

from uuv_marl.extras import extra
from uuv_marl.scenario import growth
from uuv_marl.sim.swarm import Swarm

with extra("render", "rendering"):
    import pygame

SIZE_PX = 800
_MARGIN_M = 130.0
"""Around trajectory and obstacles; holds the start. The view stands still during an episode."""
_WATER, _TRACK, _OBSTACLE, _SAFE = (13, 43, 69), (120, 150, 175), (213, 94, 0), (150, 80, 40)
_VEHICLE, _LOST, _REFERENCE, _TEXT = (240, 228, 66), (90, 110, 125), (0, 200, 150), (235, 240, 245)


class Canvas:
    """Draws a world into an image, and into a window where asked.

    Args:
        window: show a window, at ``fps`` frames per second.
        fps: frames per second.
    """

    def __init__(self, *, window: bool, fps: int) -> None:
        pygame.font.init()
        self._font = pygame.font.Font(None, 24)
        self._surface = pygame.Surface((SIZE_PX, SIZE_PX))
        self._fps = fps
        self._clock = pygame.time.Clock()
        self._to_window = window
        self._window = _open_window() if window else None

    def draw(self, swarm: Swarm, world: int = 0) -> NDArray[np.uint8] | None:
        """The picture as (height, width, 3), or None where it goes to the window, also after the user has closed it."""
        if not self._to_window:
            self._paint(swarm, world)
            return np.ascontiguousarray(pygame.surfarray.array3d(self._surface).swapaxes(0, 1))
        if self._window is not None and any(event.type == pygame.QUIT for event in pygame.event.get()):
            self.close()
            warnings.warn("the window was closed; the run goes on without it", stacklevel=2)
        if self._window is not None:
            self._paint(swarm, world)
            self._window.blit(self._surface, (0, 0))
            pygame.display.flip()
            self._clock.tick(self._fps)
        return None

    def close(self) -> None:
        """Close the window."""
        if self._window is not None:
            pygame.display.quit()
            self._window = None

    def _paint(self, swarm: Swarm, world: int) -> None:
        course, state, facts = swarm.course, swarm.state, swarm.facts
        waypoints = course.waypoints[world, : course.last[world] + 1]
        obstacles = course.obstacles[world, : course.num_obstacles[world]]
        eta, alive = state.eta[world], state.alive[world]
        shown = np.concatenate([waypoints, obstacles[:, :2]])
        margin = _MARGIN_M * growth(len(eta))
        low, high = shown.min(axis=0) - margin, shown.max(axis=0) + margin
        scale = SIZE_PX / float((high - low).max())
        centre = (low + high) / 2

        def pixel(points: NDArray[np.float64]) -> NDArray[np.float64]:
            offset = (points - centre) * scale
            return np.stack([SIZE_PX / 2 + offset[..., 1], SIZE_PX / 2 - offset[..., 0]], axis=-1)

        surface = self._surface
        surface.fill(_WATER)
        pygame.draw.lines(surface, _TRACK, False, pixel(waypoints).tolist(), 2)
        for x, y, radius in obstacles:
            middle = pixel(np.array([x, y])).tolist()
            pygame.draw.circle(surface, _SAFE, middle, (radius + swarm.scenario.constraints.s_o_m) * scale, 1)
            pygame.draw.circle(surface, _OBSTACLE, middle, radius * scale)
        length = max(2.5 * scale, 7.0) / scale
        hull = length * np.array([[1.0, 0.0], [-0.6, 0.5], [-0.6, -0.5]])
        for i in range(len(eta)):
            c, s = np.cos(eta[i, 2]), np.sin(eta[i, 2])
            corners = eta[i, :2] + hull @ np.array([[c, s], [-s, c]])
            pygame.draw.polygon(surface, _VEHICLE if alive[i] else _LOST, pixel(corners).tolist())
        pygame.draw.circle(surface, _REFERENCE, pixel(facts.reference[world, :2]).tolist(), 6, 2)
        caption = f"{swarm.scenario.name}   t = {facts.time_s[world]:.1f} s   {int(alive.sum())} vehicles"
        surface.blit(self._font.render(caption, True, _TEXT), (12, 10))


def _open_window() -> pygame.Surface:
    """A window. Raises RuntimeError where nobody could see it: SDL then draws into memory without a word."""
    chosen = os.environ.get("SDL_VIDEODRIVER") or os.environ.get("SDL_VIDEO_DRIVER")
    try:
        pygame.display.init()
        unseen = not chosen and pygame.display.get_driver() in ("dummy", "offscreen")
    except pygame.error:
        unseen = True
    if unseen:
        pygame.display.quit()
        raise RuntimeError(
            "render_mode='human' found no display for its window; use render_mode='rgb_array', which needs none, or "
            "set the environment variable SDL_VIDEODRIVER=dummy to draw into nothing"
        )
    pygame.display.set_caption("uuv_marl")
    return pygame.display.set_mode((SIZE_PX, SIZE_PX))
