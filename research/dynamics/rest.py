"""At rest the swarm does not settle: how much it moves long after the reference point has stopped, and why."""

# pyright: reportUnknownMemberType=false
# Matplotlib leaves the types of its keyword arguments open.

import dataclasses

import numpy as np
from matplotlib.figure import Figure

from research.columns import Columns, groups
from research.dynamics.formation import straight_leg
from research.dynamics.softening import PAPER, Softened, Softening
from research.part import Part, Share, Tables
from uuv_marl.baselines.paper.bio_inspired import BioInspired, BioInspiredGains
from uuv_marl.baselines.policy import Policy
from uuv_marl.benchmark.style import BLACK, BLUE, legend, panels
from uuv_marl.benchmark.suite import Suite
from uuv_marl.scenario import Scenario, load_scenario
from uuv_marl.sim.swarm import Swarm

SEEDS = (0, 1, 2, 3)
"""Starts of every variant."""
SETTLE_S = 100.0
"""Time left to settle before anything is measured."""
MEASURE_S = 60.0
"""Time measured."""
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
    settle_s: float = SETTLE_S
    """Longer where surge damping makes the swarm creep to l(t), with a time constant of damping / zeta_l = 67 s."""

    def scenario(self) -> Scenario:
        """Open water; the reference point rests after a second."""
        return straight_leg(self.num_vehicles, self.yaw_damping_nms, self.control_step_s, leg_m=4.0)

    def policy(self, scenario: Scenario, num_worlds: int) -> Policy:
        """The controller for this scenario: the shipped one where nothing is softened."""
        undamped = load_scenario(scenario, overrides={"actuators.yaw_damping_nms": 0.0})
        if self.softening == PAPER:
            return BioInspired(undamped, num_worlds, gains=self.gains)
        return Softened(undamped, num_worlds, gains=self.gains, softening=self.softening)


SMOOTH = Softening(near_m=14.0, far_m=20.0)
"""Fades neighbours between the first shell (about 12 m) and the second (about 21 m), where most come and go."""
SURGE_DAMPED = Softening(surge_damping=2000.0)
"""Half of the largest stable value with a control step of 0.1 s, 2 (m - X_u') / t_r = 4300."""
SMOOTH_DAMPED = SMOOTH._replace(surge_damping=SURGE_DAMPED.surge_damping)
"""Both."""
VARIANTS = (
    Variant("Table 1"),
    Variant("Table 1", control_step_s=0.02),
    Variant("Table 1", yaw_damping_nms=600.0),
    Variant("smooth neighbours", softening=SMOOTH),
    Variant("smooth neighbours", yaw_damping_nms=600.0, softening=SMOOTH),
    Variant("surge damping", yaw_damping_nms=600.0, softening=SURGE_DAMPED, settle_s=300.0),
    Variant("smooth, surge damping", yaw_damping_nms=600.0, softening=SMOOTH_DAMPED, settle_s=300.0),
    Variant("one vehicle", num_vehicles=1),
    Variant("one vehicle, zeta_l = 1000 N/m", num_vehicles=1, gains=BioInspiredGains(zeta_l=1000.0)),
    Variant(
        "one vehicle, zeta_l = 1000 N/m", num_vehicles=1, gains=BioInspiredGains(zeta_l=1000.0), yaw_damping_nms=600.0
    ),
)
"""Rows of the table, in the order drawn."""
_SHOWN = {"yaw_rate_rms_rad_per_s": "yaw rate, rms [rad/s]", "speed_rms_mps": "speed, rms [m/s]"}


def measure(variant: Variant, seeds: tuple[int, ...] = SEEDS) -> Columns:
    """Rows of the table for one variant, one per seed: root mean squares over vehicles and time."""
    scenario, n = variant.scenario(), len(seeds)
    swarm, policy = Swarm(scenario, n), variant.policy(scenario, n)
    percept, yaw, speed = swarm.reset(list(seeds)), np.zeros(n), np.zeros(n)
    first, last = (round(time / variant.control_step_s) for time in (variant.settle_s, variant.settle_s + MEASURE_S))
    for k in range(last):
        percept = swarm.step(policy.act(percept))
        if k >= first:
            u, v, r = np.moveaxis(swarm.state.nu, -1, 0)
            yaw += (r**2).mean(axis=1)
            speed += (u**2 + v**2).mean(axis=1)
    return {
        "variant": np.full(n, variant.name),
        "t_r_s": np.full(n, variant.control_step_s),
        "yaw_damping_nms": np.full(n, variant.yaw_damping_nms),
        "seed": np.array(seeds),
        "yaw_rate_rms_rad_per_s": np.sqrt(yaw / (last - first)),
        "speed_rms_mps": np.sqrt(speed / (last - first)),
    }


def tables(_suite: Suite, report: Share) -> Tables:
    """``rest``: every variant and seed."""
    results: list[Columns] = []
    for k, variant in enumerate(VARIANTS):
        results.append(measure(variant))
        report((k + 1) / len(VARIANTS))
    return {"rest": {name: np.concatenate([table[name] for table in results]) for name in results[0]}}


def draw(computed: Tables) -> Figure:
    """Amplitudes by variant: all seeds as points, their mean as a bar; from the table alone."""
    rows = groups(computed["rest"], "variant", "t_r_s", "yaw_damping_nms")
    names = [f"{name}, $t_r$ = {step_s:g} s" + (f", yaw damping {c:g} N m s" if c else "") for name, step_s, c in rows]
    figure, axes = panels(2, size=(4.4, 0.36 * len(rows) + 1.6), sharey=True)
    for ax, (column, what) in zip(axes, _SHOWN.items(), strict=True):
        for row, own in enumerate(rows.values()):
            ax.plot(own[column], np.full(len(own[column]), row), "o", color=BLUE, alpha=0.7, label="one seed")
        means = [own[column].mean() for own in rows.values()]
        ax.plot(means, np.arange(len(rows)), "|", color=BLACK, ms=14, mew=1.2, label="mean of seeds 0 to 3")
        ax.axvline(0.0, color=BLACK, linewidth=0.8)
        ax.set_xlabel(what)
    axes[0].set_yticks(range(len(rows)), labels=names)
    axes[0].invert_yaxis()
    return legend(figure)


PART = Part("rest", (), tables, draw)
