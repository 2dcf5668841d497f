"""At rest the swarm does not settle: how much it moves, how chaotically, and what removes it.

Each variant of the paper's law runs long after the reference point has stopped, with a displaced copy beside it:
amplitudes, and the largest Lyapunov exponent after Benettin, Galgani, Giorgilli and Strelcyn (1980).
"""

# pyright: reportUnknownMemberType=false
# Matplotlib leaves the types of its keyword arguments open.

import dataclasses
import math
from collections.abc import Callable

import numpy as np
from matplotlib.figure import Figure

from research.columns import Columns, groups
from research.dynamics.formation import straight_leg
from research.dynamics.softening import PAPER, Softened, Softening
from research.part import Part, Share, Tables
from uuv_marl.baselines.paper.bio_inspired import BioInspired, BioInspiredGains
from uuv_marl.baselines.policy import Policy
from uuv_marl.benchmark.style import BLACK, BLUE, ORANGE, SKY, legend, panels
from uuv_marl.benchmark.suite import Suite
from uuv_marl.scenario import Scenario, load_scenario
from uuv_marl.sim.swarm import Swarm
from uuv_marl.types import Float64

SEEDS = (0, 1, 2, 3)
"""Starts of every variant."""
SETTLE_S = 100.0
"""Time left to settle before anything is measured."""
MEASURE_S = 60.0
"""Time measured; a displacement that grows with time alone and not exponentially shows as up to ln(60) / 60 = 0.07."""
RENORMALISE_S = 0.5
"""Time between two renormalisations of the displaced copy."""
DISPLACEMENT = 1e-2
"""Length of the displacement over all states [m, rad, m/s, rad/s]: 5e-4 each, far above the percept's rounding."""
SMALL_DISPLACEMENT = 3e-5
"""A second one, just above the rounding. The exponents agree where the law is smooth. Where neighbours come and go
with a jump, the larger one is that of displacements that can be measured: copies that switch a step apart part."""


TABLE_1 = BioInspiredGains()
"""Its gains."""


@dataclasses.dataclass(frozen=True)
class Variant:
    """One case of the table."""

    name: str
    control_step_s: float = 0.1
    yaw_damping_nms: float = 0.0
    softening: Softening = PAPER
    gains: BioInspiredGains = TABLE_1
    num_vehicles: int = 54
    tracking: bool = False
    """Measured on a long straight leg instead of at rest."""
    settle_s: float = SETTLE_S
    """Longer where surge damping makes the swarm creep to l(t), with a time constant of damping / zeta_l = 67 s."""

    def scenario(self) -> Scenario:
        """Open water; the reference point rests after a second, or never in the time measured."""
        leg_m = 4.0 * (self.settle_s + 2.5 * MEASURE_S) if self.tracking else 4.0
        return straight_leg(self.num_vehicles, self.yaw_damping_nms, self.control_step_s, leg_m)

    def policy(self, scenario: Scenario, num_worlds: int) -> Policy:
        """The law for this scenario: the paper's own code where nothing is softened."""
        undamped = load_scenario(scenario, overrides={"actuators.yaw_damping_nms": 0.0})  # as the law was made
        if self.softening == PAPER:
            return BioInspired(undamped, num_worlds, gains=self.gains)
        return Softened(undamped, num_worlds, gains=self.gains, softening=self.softening)


SMOOTH = Softening(near_m=14.0, far_m=20.0)
"""Fades neighbours between the first shell (about 12 m) and the second (about 21 m), where most come and go."""
SURGE_DAMPED = Softening(surge_damping=2000.0)
"""Half of what a hold of 0.1 s bears, 2 (m - X_u') / t_r = 4300."""
SMOOTH_DAMPED = SMOOTH._replace(surge_damping=SURGE_DAMPED.surge_damping)
"""Both."""
VARIANTS = (
    Variant("Table 1, while tracking", tracking=True),
    Variant("Table 1"),
    Variant("Table 1", control_step_s=0.05),
    Variant("Table 1", control_step_s=0.02),
    Variant("Table 1", yaw_damping_nms=60.0),
    Variant("Table 1", yaw_damping_nms=200.0),
    Variant("Table 1", yaw_damping_nms=600.0),
    Variant("smooth neighbours", softening=SMOOTH),
    Variant("smooth neighbours", yaw_damping_nms=600.0, softening=SMOOTH),
    Variant("surge damping", yaw_damping_nms=600.0, softening=SURGE_DAMPED, settle_s=300.0),
    Variant("smooth, surge damping", yaw_damping_nms=600.0, softening=SMOOTH_DAMPED, settle_s=300.0),
    Variant("torque gate 300 N", softening=Softening(torque_gate_n=300.0)),
    Variant("dead zone 300 N", softening=Softening(dead_zone_n=300.0)),
    Variant("dead zone 600 N", softening=Softening(dead_zone_n=600.0)),
    Variant("dead zone 600 N", control_step_s=0.05, softening=Softening(dead_zone_n=600.0)),
    Variant("one vehicle", num_vehicles=1),
    Variant("one vehicle, zeta_l = 1000 N/m", num_vehicles=1, gains=BioInspiredGains(zeta_l=1000.0)),
    Variant(
        "one vehicle, zeta_l = 1000 N/m", num_vehicles=1, gains=BioInspiredGains(zeta_l=1000.0), yaw_damping_nms=600.0
    ),
)
"""Rows of the table, in the order drawn."""


def largest_exponent(
    advance: Callable[[Float64], Float64], start: Float64, size: float, rounds: int, interval_s: float
) -> Float64:
    """Largest Lyapunov exponent of every row of ``start`` [1/s], shape (row,). Benettin et al. 1980.

    Args:
        advance: states (2 rows, entry), the second half displaced, one interval later.
        start: states, shape (row, entry).
        size: length to which the displacement is brought back after each interval.
        rounds: how many intervals; the first tenth turns the displacement into the direction that grows, uncounted.
        interval_s: their length.
    """
    now, rows = start, len(start)
    away: Float64 = np.zeros_like(start) + np.random.default_rng(0).normal(size=(1, start.shape[1]))
    growth, skipped = np.zeros(rows), rounds // 10
    for k in range(rounds):
        away *= size / np.linalg.norm(away, axis=1, keepdims=True)
        after = advance(np.concatenate([now, now + away]))
        now, away = after[:rows], after[rows:] - after[:rows]
        if k >= skipped:
            growth += np.log(np.maximum(np.linalg.norm(away, axis=1), 1e-300) / size)
    return growth / ((rounds - skipped) * interval_s)


class Pairs:
    """Worlds with a displaced copy each, and sums over what the first of each pair does."""

    def __init__(self, variant: Variant, seeds: tuple[int, ...]) -> None:
        scenario = variant.scenario()
        self._swarm = Swarm(scenario, 2 * len(seeds))
        self._policy = variant.policy(scenario, 2 * len(seeds))
        self._rows, self._hold_s = len(seeds), variant.control_step_s
        self._percept = self._swarm.reset([*seeds, *seeds])
        self.restart()

    def restart(self) -> None:
        """Forget what was measured."""
        self._ticks, self.min_spacing_m = 0, np.full(self._rows, np.inf)
        self._yaw, self._speed = np.zeros(self._rows), np.zeros(self._rows)

    def run(self, duration_s: float) -> None:
        """Step all worlds and measure the first of each pair."""
        swarm, rows = self._swarm, slice(self._rows)
        for _ in range(round(duration_s / self._hold_s)):
            self._percept = swarm.step(self._policy.act(self._percept))
            u, v, r = np.moveaxis(swarm.state.nu[rows], -1, 0)
            c, s = np.moveaxis(swarm.heading[rows], -1, 0)
            north, east = swarm.facts.reference[rows, 0, 2, None], swarm.facts.reference[rows, 0, 3, None]
            self._yaw += (r**2).mean(axis=1)
            self._speed += ((c * u - s * v - north) ** 2 + (s * u + c * v - east) ** 2).mean(axis=1)
            self.min_spacing_m = np.minimum(self.min_spacing_m, swarm.facts.min_spacing[rows])
            self._ticks += 1

    @property
    def yaw_rate_rms(self) -> Float64:
        """Root mean square over vehicles and time [rad/s], shape (row,)."""
        return np.sqrt(self._yaw / self._ticks)

    @property
    def speed_rms(self) -> Float64:
        """The same of the velocity relative to the reference's [m/s]."""
        return np.sqrt(self._speed / self._ticks)

    def states(self) -> Float64:
        """Poses and velocities of all worlds, shape (2 rows, 6 vehicle); a copy's heading next to its original's."""
        eta, nu = self._swarm.state.eta.copy(), self._swarm.state.nu
        turn = eta[self._rows :, :, 2] - eta[: self._rows, :, 2]
        eta[self._rows :, :, 2] -= 2.0 * math.pi * np.round(turn / (2.0 * math.pi))
        return np.concatenate([eta, nu], axis=2).reshape(2 * self._rows, -1)

    def advance(self, states: Float64, duration_s: float) -> Float64:
        """Run from these states."""
        each = states.reshape(2 * self._rows, -1, 6)
        self._swarm.state.eta[:], self._swarm.state.nu[:] = each[..., :3], each[..., 3:]
        self._swarm.state.before[:] = each[..., :2]
        self._percept = self._swarm.observe()
        self.run(duration_s)
        return self.states()


def exponents(pairs: Pairs, size: float) -> Float64:
    """Largest exponent of each pair's first world, run on from where it is [1/s], shape (row,)."""
    states = pairs.states()
    rounds = round(MEASURE_S / RENORMALISE_S)
    return largest_exponent(
        lambda now: pairs.advance(now, RENORMALISE_S), states[: len(states) // 2], size, rounds, RENORMALISE_S
    )


def measure(variant: Variant, seeds: tuple[int, ...] = SEEDS) -> Columns:
    """Rows of the table for one variant, one per seed."""
    pairs = Pairs(variant, seeds)
    pairs.run(variant.settle_s)
    pairs.restart()
    exponent = exponents(pairs, DISPLACEMENT)
    n, spacing = len(seeds), pairs.min_spacing_m
    return {
        "variant": np.full(n, variant.name),
        "t_r_s": np.full(n, variant.control_step_s),
        "yaw_damping_nms": np.full(n, variant.yaw_damping_nms),
        "seed": np.array(seeds),
        "yaw_rate_rms_rad_per_s": pairs.yaw_rate_rms,
        "speed_rms_mps": pairs.speed_rms,
        "min_spacing_m": np.where(np.isfinite(spacing), spacing, np.nan),
        "exponent_per_s": exponent,
        "small_exponent_per_s": exponents(pairs, SMALL_DISPLACEMENT),
    }


def tables(_suite: Suite, report: Share) -> Tables:
    """``rest``: every variant and seed."""
    results: list[Columns] = []
    for k, variant in enumerate(VARIANTS):
        results.append(measure(variant))
        report((k + 1) / len(VARIANTS))
    return {"rest": {name: np.concatenate([table[name] for table in results]) for name in results[0]}}


def draw(computed: Tables) -> Figure:
    """Amplitudes and exponents by variant: all seeds as points, their mean as a bar; from the table alone."""
    rows = groups(computed["rest"], "variant", "t_r_s", "yaw_damping_nms")
    names = [f"{name}, $t_r$ = {hold:g} s" + (f", yaw damping {c:g} N m s" if c else "") for name, hold, c in rows]
    figure, axes = panels(3, size=(4.4, 0.36 * len(rows) + 1.6), sharey=True)
    for ax, column, shift, mark, colour, label in (
        (axes[0], "yaw_rate_rms_rad_per_s", 0.0, "o", BLUE, "one seed"),
        (axes[1], "speed_rms_mps", 0.0, "o", BLUE, "one seed"),
        (axes[2], "exponent_per_s", -0.15, "o", ORANGE, f"one seed, copy displaced by {DISPLACEMENT:g}"),
        (axes[2], "small_exponent_per_s", 0.15, "s", SKY, f"one seed, copy displaced by {SMALL_DISPLACEMENT:g}"),
    ):
        for row, own in enumerate(rows.values()):
            place = np.full(len(own[column]), row + shift)
            ax.plot(own[column], place, mark, color=colour, alpha=0.7, label=label)
        means = [own[column].mean() for own in rows.values()]
        ax.plot(means, np.arange(len(rows)) + shift, "|", color=BLACK, ms=14, mew=1.2, label="mean of seeds 0 to 3")
        ax.axvline(0.0, color=BLACK, linewidth=0.8)
    axes[0].set_yticks(range(len(rows)), labels=names)
    axes[0].invert_yaxis()
    axes[0].set_xlabel("yaw rate, rms [rad/s]")
    axes[1].set_xlabel("speed relative to the reference, rms [m/s]")
    axes[2].set_xlabel("largest Lyapunov exponent [1/s]")
    return legend(figure)


PART = Part("rest", (), tables, draw)
