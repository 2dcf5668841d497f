"""``reach``: every vehicle goes to a goal at rest, the end of its trajectory, without a collision."""

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np

from uuv_marl.scenario.fields import Positive, Section
from uuv_marl.sim.episode_setup import EpisodeSetup
from uuv_marl.sim.swarm import Swarm
from uuv_marl.tasks.reward import Terms
from uuv_marl.tasks.task import Task
from uuv_marl.types import Bool, Float64


class ReachNumbers(Section):
    """Numbers of ``reach``."""

    near_m: Positive = 60.0
    """A vehicle is at its goal within this distance. Assumed: about the radius of 54 vehicles at rest."""


class ReachMemory(NamedTuple):
    """Memory of ``reach``."""

    first_at_goal_s: Annotated[Float64, "world vehicle", "When the vehicle was first at its goal [s]; 0 before."]


_COSTS = {
    "obstacle": "-w · dt · clip(1 - d/s_o, 0, 1); d: distance to the nearest obstacle's surface",
    "spacing": "-w · dt · clip(1 - d/s_u, 0, 1); d: distance to the nearest vehicle",
    "effort": "-w · dt · a²; a²: mean squared length of the action, 1 at full force",
    "collision": "-w for every collision that begins",
    "loss": "once, for a lost vehicle: -(w_collision + w_arrival + (D - min(d, D))/c + "
    "(w_obstacle + w_spacing + w_effort) · T), T: time left until the limit",
}
_PROGRESS = {
    "progress": "Phi now - Phi before, Phi = -min(d, D)/c; d: distance to the goal, D: progress_far_m, c: progress_m",
}


class Reach(Task):
    """Be within ``near_m`` of a goal at rest; the episode ends when all living vehicles are.

    The weights are those of ``follow``. Progress sums to the reduction of the distance; no term depends on the number
    of vehicles. ``dense`` rewards staying at the goal, which the observation shows; ``first_arrival`` rewards the first
    arrival alone, so that a value depends on whether it has been: a policy without memory learns to leave again.
    """

    Numbers = ReachNumbers
    Memory: ClassVar[type[Any] | None] = ReachMemory
    reference_label: ClassVar[str] = "goal"
    rewards: ClassVar[Mapping[str, Mapping[str, str]]] = {
        "dense": {
            **_COSTS,
            "stay": "+w_arrival · dt/T while the vehicle is within near_m of its goal, and when all are, for the time "
            "that is left until the limit T",
            **_PROGRESS,
        },
        "first_arrival": {
            **_COSTS, "arrival": "+w once, when the vehicle is first within near_m of its goal", **_PROGRESS
        },
    }  # fmt: skip

    def __init__(self, swarm: Swarm) -> None:
        super().__init__(swarm)
        self._weight, self._limits = swarm.scenario.reward, swarm.scenario.constraints

    def draw(self, world: int, rng: np.random.Generator) -> EpisodeSetup:
        """The scenario's own, but l(t) rests at its end from the start."""
        drawn = super().draw(world, rng)
        return drawn._replace(times=tuple(np.zeros_like(times) for times in drawn.times))

    def update(self, running: Bool) -> None:
        """Note when vehicles are first at their goals."""
        first = running[:, None] & self.at_goal() & self.swarm.state.alive & (self.memory.first_at_goal_s == 0.0)
        self.memory.first_at_goal_s[first] = np.broadcast_to(self.swarm.facts.time_s[:, None], first.shape)[first]

    def reward(self, running: Bool) -> Terms:  # noqa: ARG002
        """The weighted terms of the latest step, of those in use."""
        facts, weight, limits = self.swarm.facts, self._weight, self._limits
        dt, far = self.swarm.scenario.timing.decision_period_s, weight.progress_far_m
        now, before = (np.minimum(left, far) for left in self.remaining_m())
        left_s = np.maximum(self.swarm.time_limit_s - facts.time_s, 0.0)[:, None]
        worst = weight.collision + weight.arrival + (weight.obstacle + weight.spacing + weight.effort) * left_s
        goal = {"stay": self._stay, "arrival": self._arrival}
        return {
            "obstacle": -weight.obstacle * dt * np.clip(1.0 - facts.clearance / limits.s_o_m, 0.0, 1.0),
            "spacing": -weight.spacing * dt * np.clip(1.0 - facts.spacing / limits.s_u_m, 0.0, 1.0),
            "effort": -weight.effort * dt * facts.effort,
            "collision": -weight.collision * facts.vehicle_collisions,
            "loss": np.where(facts.lost, -1.0, 0.0) * (worst + (far - now) / weight.progress_m),
            **{name: weight.arrival * share() for name, share in goal.items() if name in self.terms},
            "progress": (before - now) / weight.progress_m,
        }

    def _stay(self) -> Float64:
        """Shares of the time limit that are rewarded, shape (world, vehicle)."""
        swarm, period = self.swarm, self.swarm.scenario.timing.decision_period_s
        left_s = swarm.time_limit_s - swarm.facts.time_s
        share = np.where(self.done(), left_s + period, period) / swarm.time_limit_s
        return share[:, None] * (self.at_goal() & swarm.state.alive)

    def _arrival(self) -> Float64:
        """1 for vehicles that are at their goals for the first time, shape (world, vehicle)."""
        first_s = self.memory.first_at_goal_s
        return np.where((first_s > 0.0) & (first_s == self.swarm.facts.time_s[:, None]), 1.0, 0.0)

    def remaining_m(self) -> tuple[Float64, Float64]:
        """Distance to the goal that progress uses, now and before the step [m], shape (world, vehicle)."""
        return self.swarm.facts.away, self.swarm.facts.away_before

    def arrived_before(self) -> Bool:
        """Vehicles that have been at their goals."""
        return self.memory.first_at_goal_s > 0.0

    def done(self) -> Bool:
        """Worlds in which all living vehicles are at their goals."""
        alive = self.swarm.state.alive
        return np.logical_and((self.at_goal() | ~alive).all(axis=1), alive.any(axis=1))

    def at_goal(self) -> Bool:
        """Vehicles within ``near_m`` of their goals."""
        return self.swarm.facts.away <= self.numbers.near_m
