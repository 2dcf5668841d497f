"""Base class of policies with a memory of their surroundings and the safety filter."""

from typing import Any, ClassVar

import numpy as np

from uuv_marl.baselines.controller import Controller
from uuv_marl.baselines.memory.discs import ActiveSectors
from uuv_marl.baselines.memory.neighbours import MEMORY_S
from uuv_marl.baselines.memory.pose import DeadReckoning
from uuv_marl.baselines.memory.surroundings import update_memory
from uuv_marl.baselines.memory.table import Surroundings
from uuv_marl.baselines.safety.barrier import Barrier, Steering, with_numbers
from uuv_marl.percept import Percept
from uuv_marl.scenario import Scenario
from uuv_marl.scenario.turning import turning_radius
from uuv_marl.types import Bool

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


class Filtered(Controller):
    """A controller with a memory, whose velocities pass the safety filter; ``barrier`` replaces the tuned one."""

    Memory: ClassVar[type[Any] | None] = Surroundings
    usual_barrier: ClassVar[Barrier] = Barrier()
    """The filter for what is not tuned."""

    def __init__(
        self, scenario: Scenario, num_worlds: int = 1, *, tuned_for: str = "", gains: Any = None,
        barrier: Barrier | None = None,
    ) -> None:  # fmt: skip
        usual, safe = with_numbers(self.tuned_numbers(tuned_for), self.Gains(), self.usual_barrier)
        super().__init__(scenario, num_worlds, gains=gains or usual)
        self.model, self.sectors = DeadReckoning.of(scenario), ActiveSectors.of(scenario)
        split, most = len(Surroundings._fields), max(array.shape[2] for array in self.memory if array.ndim == 4)
        self.surroundings, self.own = Surroundings(*self.memory[:split]), self.memory[split:]
        """Arrays of ``memory``: those of all such policies, and the policy's own."""
        self.barrier = turnable(Barrier(*map(float, barrier or safe)), scenario)
        planes = np.zeros((most + scenario.sonar.num_sectors, 3))
        self.safe = Steering(self.barrier, self.limits, scenario.timing.decision_period_s, self._gain, planes)

    @property
    def float_gains(self) -> Any:
        """The gains, all float: other types would compile the kernels again."""
        return self.Gains(*map(float, self.gains))

    def remember(self, percept: Percept, worlds: Bool) -> None:
        """Update the memory from the percept."""
        memory_s = float(getattr(self.gains, "memory_s", MEMORY_S))
        flat, at = self.flat(percept), self.layout.offsets
        update_memory(flat, at, worlds, self.model, self.sectors, memory_s, self.surroundings)
