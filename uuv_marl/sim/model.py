"""A scenario's numbers, as the compiled functions take them: made once, and never changed."""

import math
from typing import NamedTuple

import numpy as np

from uuv_marl.percept import PerceptLayout, Starts
from uuv_marl.scenario import Scenario, growth
from uuv_marl.sim.sonar import SonarSuite, suite
from uuv_marl.sim.vehicle import Plant, plant
from uuv_marl.types import Float64, Int64

ARRIVAL_RADII_M = (1.0, 5.0, 10.0)
"""Arrival within these radii is recorded beside the scenario's own (``arrival.radius_m``), while an episode lasts: it
ends on the scenario's own, so that the time within a smaller radius is often missing."""

_CELL_SPACINGS = 1.25
"""Side of a cell, in spacings of the start, for swarms that are searched by cells (perf/, docs/speed.md)."""


class Rules(NamedTuple):
    """Clocks, thresholds, and the schedule of losses. Lengths in m."""

    control_step_s: float
    step_s: float
    control_steps: int
    """Control holds of a decision."""
    steps: int
    """Integration steps of a control hold."""
    hull_radius: float
    """Radius of a hull."""
    collision_ends: bool
    """Whether a vehicle that touches something is lost."""
    collision_stops: bool
    """Whether it stands still there."""
    passes: bool
    """Whether the swarm arrives in passage, and l(t) goes on beyond the end (``arrival.criterion``)."""
    dwell_ticks: int
    """Control holds that the swarm must rest to have arrived; 0 in passage."""
    spread: float
    """Largest distance of a vehicle from the end for arrival; in passage, from where the centre is along the leg."""
    arrival_radii: Float64
    """Radii for the swarm's centre, the scenario's own first, which is infinite in passage, shape (radius,)."""
    loss_ticks: Int64
    """Control hold at whose end each loss happens, shape (loss,)."""
    cell_side: float


class Model(NamedTuple):
    """All numbers of a scenario."""

    plant: Plant
    suite: SonarSuite
    rules: Rules
    at: Starts


def model(scenario: Scenario) -> Model:
    """The numbers of a scenario. Their types never depend on it, so that nothing is compiled twice."""
    return Model(plant(scenario), suite(scenario), rules(scenario), PerceptLayout.of(scenario).offsets)


def rules(scenario: Scenario) -> Rules:
    """Clocks, thresholds and losses of a scenario."""
    timing, arrival = scenario.timing, scenario.arrival
    passes, losses_s = arrival.criterion == "passage", np.array(scenario.losses.times_s, np.float64)
    return Rules(
        control_step_s=timing.control_step_s,
        step_s=timing.integration_step_s,
        control_steps=timing.control_steps_per_decision,
        steps=timing.integration_steps_per_control_step,
        hull_radius=scenario.collision.hull_radius_m,
        collision_ends=scenario.collision.ends_vehicle,
        collision_stops=scenario.collision.stops,
        passes=passes,
        dwell_ticks=0 if passes else round(arrival.dwell_s / timing.control_step_s),
        spread=arrival.spread_m * growth(scenario.swarm.num_vehicles),
        arrival_radii=np.array([math.inf if passes else arrival.radius_m, *ARRIVAL_RADII_M]),
        loss_ticks=np.maximum(np.ceil(losses_s / timing.control_step_s - 1e-9), 1).astype(np.int64),
        cell_side=_CELL_SPACINGS * scenario.start.spacing_m,
    )
