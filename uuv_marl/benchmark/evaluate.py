"""Run a policy on a scenario over seeds."""

import math
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple, Unpack

import numpy as np

from uuv_marl.baselines import POLICIES, make_policy
from uuv_marl.baselines.team_names import PolicyLike, policy_name
from uuv_marl.benchmark.metrics import Metrics, MetricsRecorder
from uuv_marl.envs.changes import Changes, ScenarioLike, changed
from uuv_marl.errors import USER_ERRORS, DivergenceError, PolicyError
from uuv_marl.scenario import Scenario
from uuv_marl.sim.arguments import whole_number
from uuv_marl.sim.swarm import Swarm
from uuv_marl.types import Float32

_FEWEST, _VEHICLES = 8, 320
"""Seeds stepped together, and vehicles: enough for all cores, and few episodes to repeat after a stop."""
ROUTE_PERIOD_S = 0.5
"""Time between two samples of the trajectories [s]."""
MOST_SAMPLES = 1_500_000
"""Most samples (times x vehicles) of a run's trajectories; larger runs are sampled less often."""


class Routes(NamedTuple):
    """Trajectories of all vehicles, from start to end, in the frame north, east; NaN once a vehicle is lost."""

    time_s: Float32
    """Shape (time,): every ``ROUTE_PERIOD_S`` (see ``MOST_SAMPLES``), and the end."""
    position: Float32
    """Shape (time, vehicle, 2) [m]."""
    heading: Float32
    """Shape (time, vehicle) [rad], in [-pi, pi), clockwise from north."""
    velocity: Float32
    """Velocity over ground, shape (time, vehicle, 2) [m/s]."""


class Run(NamedTuple):
    """One episode."""

    seed: int
    metrics: Metrics
    series: dict[str, Float32]
    """Samples over time, see ``MetricsRecorder.series``."""
    routes: Routes
    """Trajectories of all vehicles."""
    obstacles: Float32
    """Centre north, east and radius at the end [m], shape (obstacle, 3)."""
    waypoints: Float32
    """Corners of the reference trajectory [m], shape (point, 2)."""


Watch = Callable[[Swarm, Float32 | None], None]
"""Called with the swarm after its reset and after every step, and with the preceding actions (world, vehicle, 2), None
after the reset. It must not change the arrays, and must copy those that it keeps."""


def episodes(
    scenario: Scenario, policy: str, seeds: Sequence[int], watch: Watch | None = None,
    report: Callable[[float], object] | None = None, /, **parameters: object,
) -> Iterator[Run]:  # fmt: skip
    """Run a policy on a scenario; yields each episode as soon as it ends.

    A run depends on its seed alone, not on the other seeds.

    Args:
        scenario: must have what the policy requires (``uuv_marl.with_policy_requirements``).
        policy: the policy's name, see ``uuv_marl.baselines.make_policy``.
        seeds: one seed for each episode.
        watch: called after the reset and after every step.
        report: called with the finished share of the largest possible simulated time of all seeds.
        parameters: keyword arguments of the policy.

    Raises:
        DivergenceError: the integration step was too long for a vehicle. This run has no metrics; those of the other
            seeds that were stepped with it are yielded first.
    """
    seeds = [whole_number("seed", seed, 0) for seed in seeds]
    num = batch_size(scenario.swarm.num_vehicles)
    for first in range(0, len(seeds), num):
        batch = seeds[first : first + num]

        def note(share: float, first: int = first, size: int = len(batch)) -> None:
            if report:
                report((first + share * size) / len(seeds))

        yield from _batch(scenario, policy, batch, watch, note, parameters)


def evaluate(
    policy: PolicyLike,
    scenario: ScenarioLike = "single_obstacle",
    seeds: Iterable[int] = range(20),
    **changes: Unpack[Changes],
) -> list[dict[str, Any]]:
    """Run a policy on a scenario with the policy's requirements; the metrics of every episode.

    Args:
        policy: a name, the path of a checkpoint, ``module:Class`` or a team, see ``uuv_marl.make_policy``.
        scenario: a name, a TOML file or a ``Scenario``.
        seeds: one seed for each episode.
        changes: ``num_vehicles``, ``decision_period``, ``task`` and ``overrides``, as for ``uuv_marl.parallel_env``.

    Returns:
        A dictionary for each seed, in their order: ``seed`` and the metrics that docs/benchmark.md defines.

    Raises:
        ScenarioError: a change contradicts a requirement of the policy.
        DivergenceError: the integration step is too long for a vehicle.
    """
    given = [whole_number("seed", seed, 0) for seed in seeds]
    name = policy_name(policy)
    with blaming(name):
        runs = [*episodes(changed(scenario, name, **changes), name, given)]
    return [{"seed": run.seed, **run.metrics} for run in sorted(runs, key=lambda run: given.index(run.seed))]


def batch_size(num_vehicles: int) -> int:
    """Number of swarms of ``num_vehicles`` that are stepped together; it changes no bit of an episode."""
    return max(_FEWEST, _VEHICLES // num_vehicles)


@contextmanager
def blaming(policy: str) -> Generator[None]:
    """Turn an error caused by a user's own policy into a PolicyError that names it."""
    try:
        yield
    except (TypeError, ValueError) as error:
        if policy in POLICIES or isinstance(error, USER_ERRORS):
            raise
        raise PolicyError(f"policy {policy!r}: {error}") from error


def _batch(
    scenario: Scenario, policy: str, seeds: Sequence[int], watch: Watch | None, report: Callable[[float], object],
    parameters: dict[str, object],
) -> Iterator[Run]:  # fmt: skip
    """Episodes of seeds that are stepped together."""
    swarm = Swarm(scenario, len(seeds))
    actor = make_policy(policy, scenario, len(seeds), **parameters)
    percept = swarm.reset(list(seeds))
    actor.reset(list(seeds))
    recorder = MetricsRecorder(swarm)
    active = np.ones(len(seeds), np.bool_)
    recorder.update(active)
    limits, period = swarm.time_limit_s, scenario.timing.decision_period_s
    steps, step = math.ceil(limits.max() / period) + 1, 0
    every = max(round(ROUTE_PERIOD_S / period), math.ceil(steps * swarm.num_vehicles / MOST_SAMPLES), 1)
    samples = [_sample(swarm)]
    if watch:
        watch(swarm, None)
    diverged: list[str] = []
    share = lambda: float(np.where(active, swarm.facts.time_s, limits).sum() / limits.sum())  # noqa: E731
    while active.any():
        action = actor.act(percept)
        percept = swarm.step(action, active)
        recorder.update(active)
        if watch:
            watch(swarm, action)
        step += 1
        ended = active & swarm.ended
        for w in (int(index) for index in np.flatnonzero(ended)):
            if swarm.facts.diverged[w] >= 0:
                diverged.append(f"seed {seeds[w]}: {swarm.divergence(w)}")
                continue
            world_map, discs = swarm.world_map, int(swarm.world_map.num_obstacles[w])
            yield Run(
                seed=seeds[w],
                metrics=recorder.metrics(w, int(actor.clamps[w])),
                series=recorder.series(w),
                routes=_routes(swarm, samples, w),
                obstacles=world_map.obstacles[w, :discs].astype(np.float32),
                waypoints=world_map.waypoints[w, 0, : int(world_map.last[w, 0]) + 1].astype(np.float32),
            )
            report(share())
        active &= ~ended
        actor.active[:] = active
        if step % every == 0:
            samples.append(_sample(swarm))
            report(share())
    if diverged:
        raise DivergenceError("; ".join(diverged))


def _sample(swarm: Swarm) -> tuple[Float32, Float32]:
    """Time (world,), and position, heading and velocity of all vehicles (world, vehicle, 5)."""
    eta, (u, v) = swarm.state.eta, np.moveaxis(swarm.velocity, -1, 0)
    cos, sin = np.moveaxis(swarm.heading, -1, 0)
    motion = np.stack([eta[:, :, 0], eta[:, :, 1], eta[:, :, 2], cos * u - sin * v, sin * u + cos * v], axis=2)
    motion[~swarm.state.alive] = np.nan
    return swarm.facts.time_s.astype(np.float32), motion.astype(np.float32)


def _routes(swarm: Swarm, samples: Sequence[tuple[Float32, Float32]], w: int) -> Routes:
    """The trajectories of a world that ends now."""
    time, motion = zip(*((t[w], m[w]) for t, m in [*samples, _sample(swarm)]), strict=True)
    moved = np.array(motion, np.float32)
    return Routes(np.array(time, np.float32), moved[:, :, :2], moved[:, :, 2], moved[:, :, 3:])
