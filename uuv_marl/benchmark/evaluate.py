"""Run a policy on a scenario over seeds."""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uuv_marl.baselines import make
from uuv_marl.benchmark.metrics import Meter, Metrics
from uuv_marl.scenario import Scenario
from uuv_marl.sim.swarm import Swarm

Float32 = NDArray[np.float32]

BATCH = 32
"""Seeds stepped together."""
MOST_POSITIONS = 4_000_000
"""Positions kept of a run; with more vehicles and steps than this, routes are thinned in time."""


class Run(NamedTuple):
    """One episode."""

    seed: int
    metrics: Metrics
    series: dict[str, Float32]
    """Samples over time, see ``Meter.series``."""
    routes: Float32
    """Positions [m] from start to end, shape (time, vehicle, 2); NaN once a vehicle is lost. See ``MOST_POSITIONS``."""
    obstacles: Float32
    """Centre north, east and radius [m], shape (obstacle, 3)."""
    waypoints: Float32
    """Corners of the trajectory [m], shape (point, 2)."""


class Progress(NamedTuple):
    """How far an evaluation is."""

    share: float
    """Of the simulated time that all its seeds need at most."""


def evaluate(scenario: Scenario, policy: str, seeds: Sequence[int], **parameters: object) -> Iterator[Run | Progress]:
    """Episodes of a policy on a scenario, each as soon as it ends, with progress in between.

    The scenario must grant what the policy declares (``uuv_marl.baselines.granted``). A run depends on its seed
    alone, not on the seeds beside it. ``parameters`` go to the policy.
    """
    for first in range(0, len(seeds), BATCH):
        batch = seeds[first : first + BATCH]
        for event in _batch(scenario, policy, batch, parameters):
            if isinstance(event, Progress):
                yield Progress((first + event.share * len(batch)) / len(seeds))
            else:
                yield event


def _batch(
    scenario: Scenario, policy: str, seeds: Sequence[int], parameters: dict[str, object]
) -> Iterator[Run | Progress]:
    swarm = Swarm(scenario, len(seeds))
    actor = make(policy, scenario, len(seeds), **parameters)
    percept = swarm.reset(list(seeds))
    actor.reset(list(seeds))
    meter = Meter(swarm)
    active = np.ones(len(seeds), np.bool_)
    meter.update(active)
    limits, period = swarm.time_limit_s, scenario.timing.decision_period_s
    steps, step = math.ceil(limits.max() / period) + 1, 0
    every = math.ceil(steps * swarm.num_vehicles / MOST_POSITIONS)
    # Room for the longest episode, of which the system only hands out what is written.
    routes = np.empty((len(seeds), steps // every + 2, swarm.num_vehicles, 2), np.float32)
    routes[:, 0], num = _positions(swarm), 1
    report_every = max(1, round(2.0 / period))
    while active.any():
        percept = swarm.step(actor.act(percept), active)
        meter.update(active)
        step += 1
        routes[:, num] = _positions(swarm)
        ended = active & (swarm.arrived | swarm.timed_out | ~swarm.state.alive.any(axis=1))
        for w in (int(index) for index in np.flatnonzero(ended)):
            course, discs = swarm.course, int(swarm.course.num_obstacles[w])
            yield Run(
                seed=seeds[w],
                metrics=meter.metrics(w, int(actor.clamps[w])),
                series=meter.series(w),
                routes=routes[w, : num + 1],
                obstacles=course.obstacles[w, :discs].astype(np.float32),
                waypoints=course.waypoints[w, : int(course.last[w]) + 1].astype(np.float32),
            )
        active &= ~ended
        num += int(step % every == 0)
        if step % report_every == 0:
            done = np.where(active, swarm.facts.time_s, limits)
            yield Progress(float(done.sum() / limits.sum()))


def _positions(swarm: Swarm) -> Float32:
    return np.where(swarm.state.alive[:, :, None], swarm.state.eta[:, :, :2], np.nan).astype(np.float32)
