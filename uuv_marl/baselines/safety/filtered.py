"""Base class of policies with a memory of their surroundings and the safety filter."""

from typing import Any, ClassVar

import numpy as np

from uuv_marl.baselines.memory import OwnModel, Surroundings, update_memory
from uuv_marl.baselines.memory.neighbours import MEMORY_S
from uuv_marl.baselines.policy import Policy
from uuv_marl.baselines.requirements import PolicyRequirements
from uuv_marl.baselines.safety.barrier import Barrier
from uuv_marl.baselines.steering import velocity_gain
from uuv_marl.percept import Percept
from uuv_marl.scenario import Scenario
from uuv_marl.scenario.turning import turning_radius
from uuv_marl.types import Bool, Float64

TURNS = 8.0
"""Least number of turning radii at l(t)'s speed in which a vehicle with a rudder closes a distance. By hand."""


def turnable(barrier: Barrier, scenario: Scenario) -> Barrier:
    """A filter with rates of at most speed over ``TURNS`` turning radii, for vehicles with a rudder."""
    speed = scenario.trajectory.speed_mps
    radius = turning_radius(scenario.vehicle, scenario.actuators, speed)  # pyright: ignore[reportArgumentType] - frozen models have a hash
    if radius == 0.0:
        return barrier
    most = speed / (TURNS * radius)
    return barrier._replace(
        obstacle_rate=min(barrier.obstacle_rate, most), neighbour_rate=min(barrier.neighbour_rate, most)
    )


class Filtered(Policy):
    """A policy with a memory, whose velocities pass the safety filter. A subclass defines ``decide``."""

    requirements = PolicyRequirements(yaw_damping_nms=600.0, outputs_force=True)
    Memory: ClassVar[type[Any] | None] = Surroundings

    def __init__(self, scenario: Scenario, num_worlds: int, barrier: Barrier) -> None:
        super().__init__(scenario, num_worlds)
        self.barrier = turnable(Barrier(*map(float, barrier)), scenario)
        self.model = OwnModel.of(scenario)
        """Model of the vehicle's motion and sonar."""
        self.gain = velocity_gain(scenario)
        """Force per velocity error [N s/m]."""
        self.planes: Float64 = np.zeros((self.memory.disc.shape[2] + scenario.sonar.num_sectors, 3))
        """Work array for half-planes, shape (disc + sector, 3)."""

    @property
    def memory_s(self) -> float:
        """Time for which an undetected neighbour is remembered [s]: a gain, if there is one."""
        return float(getattr(getattr(self, "gains", None), "memory_s", MEMORY_S))

    def remember(self, percept: Percept, worlds: Bool) -> None:
        """Update the memory from the percept."""
        update_memory(self.flat(percept), self.layout.offsets, worlds, self.model, self.memory_s, self.memory)
