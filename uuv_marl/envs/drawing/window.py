"""The window of ``render_mode="human"``, with keys to pause and step, and for speed, camera and sonar."""

import math
import os
import warnings
from collections.abc import Callable
from weakref import WeakSet

from uuv_marl.envs.drawing import ink
from uuv_marl.envs.drawing.camera import CAMERAS
from uuv_marl.envs.drawing.frame import Panel, draw_frame
from uuv_marl.envs.drawing.options import Look
from uuv_marl.envs.drawing.scene import Scene
from uuv_marl.extras import extra
from uuv_marl.scenario import Scenario

with extra("render", "rendering"):
    import pygame

_KEYS_PX = 26
_MOST_FPS = 40
"""Most frames per second; at higher rates some steps are not drawn."""
_SPEEDS = (0.125, 64.0)
_FACTORS = dict.fromkeys((pygame.K_PLUS, pygame.K_KP_PLUS, pygame.K_EQUALS), 2.0)
_FACTORS |= dict.fromkeys((pygame.K_MINUS, pygame.K_KP_MINUS), 0.5)
"""Change of the speed by each key."""


class Window:
    """A window on one world.

    Args:
        scenario: the scenario that is simulated.
        look: size, camera and inspected vehicle at the start.
        fps: steps per second in real time, speed 1.

    Raises:
        RuntimeError: there is no display.
    """

    def __init__(self, scenario: Scenario, look: Look, fps: int) -> None:
        self._shown: pygame.Surface | None = _open(look.size, scenario.name)
        self._name, self._vehicles = scenario.name, scenario.swarm.num_vehicles
        self._camera, self._sonar_of = look.camera, look.sonar_of
        self._fps, self._speed, self._clock = fps, 1.0, pygame.time.Clock()
        self._paused, self._once, self._left_out = False, False, 0
        _OPEN.add(self)

    def show(self, scene: Callable[[int | None], Scene], *, wait: bool) -> None:
        """Draw a step, and ``wait`` for its duration or while the window is paused; do nothing once it is closed."""
        while self._shown is not None:
            touched = [self._act_on(event) for event in pygame.event.get()]
            if self._shown is None:
                warnings.warn("the window was closed; the run continues without it", stacklevel=4)
                return
            self._left_out += 1
            rate = self._fps * self._speed
            every = math.ceil(rate / _MOST_FPS)
            if any(touched) or self._paused or not wait or self._left_out >= every:
                self._draw(self._shown, scene(self._sonar_of))
                self._left_out = 0
                self._clock.tick(0 if not wait else _MOST_FPS if self._paused else rate / every)
            if not wait or self._once or not self._paused:
                self._once = False
                return

    def close(self) -> None:
        """Close the window."""
        if self._shown is None:
            return
        self._shown = None
        _OPEN.discard(self)
        if not _OPEN:
            pygame.display.quit()

    def _act_on(self, event: pygame.Event) -> bool:
        """Whether a key was pressed or the window closed."""
        if event.type == pygame.QUIT:
            self.close()
        if event.type != pygame.KEYDOWN:
            return event.type == pygame.QUIT
        if event.key == pygame.K_SPACE:
            self._paused = not self._paused
        elif event.key == pygame.K_RIGHT:
            self._paused = self._once = True
        elif factor := _FACTORS.get(event.key):
            self._speed = min(max(self._speed * factor, _SPEEDS[0]), _SPEEDS[1])
        elif event.key == pygame.K_c:
            self._camera = CAMERAS[(CAMERAS.index(self._camera) + 1) % len(CAMERAS)]
        elif event.key == pygame.K_TAB:
            step = -1 if getattr(event, "mod", 0) & pygame.KMOD_SHIFT else 1
            choices = [None, *range(self._vehicles)]
            self._sonar_of = choices[(choices.index(self._sonar_of) + step) % len(choices)]
        return True

    def _draw(self, shown: pygame.Surface, scene: Scene) -> None:
        width, height = shown.get_size()
        shown.blit(draw_frame([Panel(self._name, scene)], (width, height - _KEYS_PX), self._camera), (0, 0))
        shown.fill(ink.TEXT, (0, height - _KEYS_PX, width, _KEYS_PX))
        inspected = "no vehicle" if self._sonar_of is None else f"vehicle {self._sonar_of}"
        keys = (
            f"space: {'continue' if self._paused else 'pause'}    →: one step    + −: speed ×{self._speed:g}    "
            f"c: camera ({self._camera})    tab: sonar ({inspected})"
        )
        ink.write(shown, keys, (8, height - _KEYS_PX + 5), 12 if width >= 560 else 8, ink.WHITE)
        pygame.display.flip()


_OPEN: WeakSet[Window] = WeakSet()
"""Open windows: pygame has one display per process, which the last one closes."""


def _open(size: tuple[int, int], name: str) -> pygame.Surface:
    """A window. Raises RuntimeError without a display: SDL would draw into memory without an error."""
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
            "set the environment variable SDL_VIDEODRIVER=dummy to draw into memory"
        )
    pygame.display.set_caption(f"uuv_marl: {name}")
    return pygame.display.set_mode(size)
