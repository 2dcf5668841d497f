"""Constants of a scenario for the compiled functions."""

import math
from typing import NamedTuple

import numpy as np

from uuv_marl.percept import PerceptLayout, Starts
from uuv_marl.scenario import Scenario, growth
from uuv_marl.sim.sonar import SonarSuite, suite
from uuv_marl.sim.vehicle import Plant, plant
from uuv_marl.types import Float64, Int64

ARRIVAL_RADII_M = (1.0, 5.0, 10.0)
"""Arrival within these radii is recorded, too. The scenario's own (``arrival.radius_m``) ends the episode, often before
a smaller one is reached."""

_CELL_SPACINGS = 1.25
"""Side of a cell, in initial spacings (perf/, docs/speed.md)."""


class Rules(NamedTuple):
    """Time steps, thresholds and the schedule of losses; lengths in m."""

    control_step_s: float
    step_s: float
    control_steps: int  # control steps of a decision
    steps: int  # integration steps of a control step
    hull_radius: float  # radius of a hull [m]
    collision_ends: bool  # whether a vehicle that collides is lost
    collision_stops: bool  # whether it stops there
    passes: bool  # whether the swarm arrives by passing the end, and l(t) moves on beyond it (``arrival.criterion``)
    dwell_ticks: int  # control steps that the swarm must stay to have arrived; 0 in passage
    # Largest distance of a vehicle from the end at arrival; in passage, from the centre's projection onto the leg
    spread: float
    # Arrival radii of the swarm's centre, the scenario's own first (infinite in passage), shape (radius,)
    arrival_radii: Float64
    loss_ticks: Int64  # control step at whose end each loss happens, shape (loss,)
    cell_side: float


class Model(NamedTuple):
    """All constants of a scenario."""

    plant: Plant
    suite: SonarSuite
    rules: Rules
    at: Starts


def model(scenario: Scenario) -> Model:
    """Constants of a scenario; their types are the same for all scenarios, so that nothing is compiled twice."""
    return Model(plant(scenario), suite(scenario), rules(scenario), PerceptLayout.of(scenario).offsets)


def rules(scenario: Scenario) -> Rules:
    """Time steps, thresholds and losses of a scenario."""
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
