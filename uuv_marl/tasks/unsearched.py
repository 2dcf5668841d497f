"""The channel ``unsearched``: where in a box a vehicle knows of no search, its own or a neighbour's."""

import math

from uuv_marl.percept import FLAG, PerceptField
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.trigonometry import cos_sin
from uuv_marl.types import Bool, Float32, Float64

PLOT_M = 50.0
"""Side of a plot of the map [m]. Assumed: half of the bow's range."""
RINGS_M = (150.0, 450.0)
"""Outer radii of the two rings [m]. Assumed: somewhat more than the bow's range, and a third of the medium box."""
FORGET_S = 200.0
"""Time after which a plot counts in full again [s]. Assumed: about that in which the swarm searches the medium box."""
NEIGHBOUR_M = 75.0
"""Distance from a detected neighbour within which plots count as searched [m]. Assumed: most of its bow's range."""
NUM_OCTANTS = 8
_MEANING = f"unsearched share of octants, clockwise from the bow, up to {RINGS_M[0]:g} m and on to {RINGS_M[1]:g} m"
UNSEARCHED = (PerceptField("unsearched", (len(RINGS_M), NUM_OCTANTS), FLAG, _MEANING),)
"""Fields of the channel."""


def num_plots(side_m: float) -> int:
    """Number of plots of a box with this side [m]."""
    return math.ceil(side_m / PLOT_M) ** 2


@compiled
def place_in_box(reference: Float32, box: Float32 | Float64) -> tuple[float, float]:
    """Position of a vehicle from the centre of its box [m].

    Args:
        reference: vector to the centre in the body frame [m], shape (2,).
        box: cosine and sine of the heading in the box, shape (2,).
    """
    c, s = float(box[0]), float(box[1])
    x, y = float(reference[0]), float(reference[1])
    return s * y - c * x, -s * x - c * y


@compiled
def octant_of(ahead: float, right: float) -> int:
    """Index of an octant, clockwise from the bow."""
    quadrant = (0 if ahead >= 0.0 else 1) if right >= 0.0 else (2 if ahead < 0.0 else 3)
    is_late = (abs(right) > abs(ahead)) == (quadrant % 2 == 0)
    return 2 * quadrant + (1 if is_late else 0)


@compiled
def mark(
    time_s: float, x: float, y: float, reach: float, middle: tuple[float, float], least: float, searched_s: Float64
) -> None:
    """Note the time at the plots in a fan.

    Those within ``reach`` of (x, y) [m] count whose direction has at least the cosine ``least`` with ``middle``;
    ``searched_s`` has shape (plot,).
    """
    side = round(math.sqrt(searched_s.shape[0]))
    for a in range(max(0, int((x - reach) / PLOT_M)), min(side, int((x + reach) / PLOT_M) + 1)):
        for b in range(max(0, int((y - reach) / PLOT_M)), min(side, int((y + reach) / PLOT_M) + 1)):
            d_x, d_y = (a + 0.5) * PLOT_M - x, (b + 0.5) * PLOT_M - y
            r = math.sqrt(d_x * d_x + d_y * d_y)
            if r <= reach and d_x * middle[0] + d_y * middle[1] >= least * r:
                searched_s[a * side + b] = time_s


@compiled
def fill_shares(
    time_s: float, x: float, y: float, heading: tuple[float, float], searched_s: Float64, shares: Float64
) -> None:
    """Fill the unsearched shares of octants around (x, y) [m], shape (ring, octant); nothing is outside the box."""
    side, near, far = round(math.sqrt(searched_s.shape[0])), RINGS_M[0], RINGS_M[1]
    shares[:] = 0.0
    for a in range(max(0, int((x - far) / PLOT_M)), min(side, int((x + far) / PLOT_M) + 1)):
        for b in range(max(0, int((y - far) / PLOT_M)), min(side, int((y + far) / PLOT_M) + 1)):
            d_x, d_y = (a + 0.5) * PLOT_M - x, (b + 0.5) * PLOT_M - y
            square = d_x * d_x + d_y * d_y
            if square <= far * far:
                octant = octant_of(heading[0] * d_x + heading[1] * d_y, heading[0] * d_y - heading[1] * d_x)
                ring = 0 if square <= near * near else 1
                area = math.pi * (near * near if ring == 0 else far * far - near * near) / NUM_OCTANTS
                age = min(time_s - searched_s[a * side + b], FORGET_S) / FORGET_S
                shares[ring, octant] = min(shares[ring, octant] + age * PLOT_M * PLOT_M / area, 1.0)


@compiled
def update_map(
    worlds: Bool, time_s: Float64, half: float, fan: Float64, reference: Float32, box: Float64, detected: Float32,
    neighbour: Float32, searched_s: Float64, shares: Float64,
) -> None:  # fmt: skip
    """Note in each vehicle's own map what is searched now, by the positions that it observes, and fill its shares.

    Args:
        worlds: to be updated, shape (world,).
        time_s: since the reset [s], shape (world,).
        half: of the box's side [m].
        fan: see ``search.fans``.
        reference: vector to the middle of the box in the body frame [m], shape (world, vehicle, 2).
        box: cosine and sine of the heading in the box, shape (world, vehicle, 2).
        detected: whether a neighbour is detected in the sub-sector, shape (world, vehicle, sub-sector).
        neighbour: its position in the body frame [m], shape (world, vehicle, sub-sector, 2).
        searched_s: when each plot was last searched [s], shape (world, vehicle, plot); changed.
        shares: shape (world, vehicle, ring, octant); changed.
    """
    for w in range(box.shape[0]):
        for i in range(box.shape[1] if worlds[w] else 0):
            own, c, s = searched_s[w, i], box[w, i, 0], box[w, i, 1]
            x, y = place_in_box(reference[w, i], box[w, i])
            x, y = x + half, y + half
            for k in range(fan.shape[0]):
                f_c, f_s = cos_sin(fan[k, 0])
                mark(time_s[w], x, y, fan[k, 1], (c * f_c - s * f_s, s * f_c + c * f_s), fan[k, 2], own)
            for k in range(detected.shape[2]):
                if detected[w, i, k] > 0.0:
                    ahead, right = float(neighbour[w, i, k, 0]), float(neighbour[w, i, k, 1])
                    n_x, n_y = x + c * ahead - s * right, y + s * ahead + c * right
                    mark(time_s[w], n_x, n_y, NEIGHBOUR_M, (1.0, 0.0), -1.0, own)
            fill_shares(time_s[w], x, y, (c, s), own, shares[w, i])
