"""Obstacle terms that several controllers share."""

import math

from uuv_marl.percept import Fields
from uuv_marl.sim.compiled import compiled


@compiled
def bump(share: float) -> float:
    """A raised cosine: 1 at 0, falling smoothly to 0 at 1 and beyond."""
    if share >= 1.0:
        return 0.0
    return 0.5 * (1.0 + math.cos(math.pi * max(share, 0.0)))


@compiled
def obstacle_at(w: int, i: int, a: int, see: Fields, centres: bool) -> tuple[float, float, float, float]:
    """Unit vector towards the obstacle of an echo, the distance to its surface and its radius [m].

    The radius is 0 where echoes are points of surfaces, whose radius is unknown.
    """
    n_x, n_y = float(see.echo_position[w, i, a, 0]), float(see.echo_position[w, i, a, 1])
    reach, distance = float(see.echo_range[w, i, a]), math.hypot(n_x, n_y)
    n_x, n_y = (n_x / distance, n_y / distance) if distance > 0.0 else (1.0, 0.0)
    return n_x, n_y, reach, max(distance - reach, 0.0) if centres else 0.0


@compiled
def pass_obstacle(
    w: int, i: int, see: Fields, repulsion: float, repulsion_range: float, tangential: float, tangential_range: float
) -> tuple[float, float]:
    """Force [N] from the nearest echo: away from it, and sideways while the vehicle moves towards it.

    The nearest echo acts as a beta-agent (Olfati-Saber 2006). The sideways push is to the side on which the vehicle
    already passes, port if the echo is dead ahead. Strengths in N; the pushes vanish at their ranges from the surface
    [m].
    """
    nearest, reach = -1, math.inf
    for a in range(see.echo.shape[2]):
        if see.echo[w, i, a] > 0.0 and see.echo_range[w, i, a] < reach:
            nearest, reach = a, float(see.echo_range[w, i, a])
    if nearest < 0:
        return 0.0, 0.0
    n_x, n_y, _, _ = obstacle_at(w, i, nearest, see, False)
    g_x, g_y = float(see.velocity[w, i, 0]), float(see.velocity[w, i, 1])
    speed = math.hypot(g_x, g_y)
    g_x, g_y = (g_x / speed, g_y / speed) if speed > 0.1 else (1.0, 0.0)
    towards = max(g_x * n_x + g_y * n_y, 0.0)
    side = 1.0 if g_x * n_y - g_y * n_x >= 0.0 else -1.0
    away = repulsion * bump(reach / repulsion_range)
    push = tangential * towards * bump(reach / tangential_range) * side
    return -away * n_x + push * n_y, -away * n_y - push * n_x
