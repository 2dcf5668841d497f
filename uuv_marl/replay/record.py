"""Recording an episode while the benchmark's evaluation simulates it."""

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from uuv_marl.baselines import with_policy_requirements
from uuv_marl.benchmark.evaluate import Run, blaming, episodes
from uuv_marl.errors import ReplayError
from uuv_marl.replay.events import arrival, collisions, losses, near_misses
from uuv_marl.replay.recording import Event, Inspection, Recording, Water
from uuv_marl.scenario import Scenario
from uuv_marl.sim.swarm import Swarm
from uuv_marl.tasks.groups import Groups, groups_of
from uuv_marl.types import Float32

MOST_INSPECTED = 8
"""Most vehicles with recorded sonar."""
_KINDS: dict[str, DTypeLike] = {
    "alive": np.bool_, **dict.fromkeys(("vehicle_collisions", "collisions", "detected_index"), np.int32)
}  # fmt: skip
"""Types of samples that are not float32."""


def record(
    scenario: Scenario,
    policy: str,
    seed: int,
    inspect: Iterable[int] = (),
    report: Callable[[float], object] | None = None,
) -> Recording:
    """Run an episode as the benchmark does, and record all vehicles at every decision.

    Args:
        scenario: scenario without the policy's requirements.
        policy: its name, checkpoint, or ``module:Class``.
        seed: seed of the episode.
        inspect: indices of up to ``MOST_INSPECTED`` vehicles whose sonar and actions are recorded.
        report: called with the finished share of the longest possible episode.

    Raises:
        ReplayError: a vehicle to inspect does not exist, or there are too many.
        PolicyError: the policy is unknown, or can't run on this scenario.
        DivergenceError: the integration diverged.
    """
    watched = checked(inspect, scenario)
    scenario = with_policy_requirements(policy, scenario)
    tape = _Tape(watched)
    with blaming(policy):
        (run,) = episodes(scenario, policy, [seed], tape, report)
    return tape.recording(scenario, policy, run)


def checked(inspect: Iterable[int], scenario: Scenario) -> list[int]:
    """The distinct vehicles to inspect. Raises ReplayError for too many or unknown ones."""
    chosen, n = list(dict.fromkeys(inspect)), scenario.swarm.num_vehicles
    for i in chosen:
        if not 0 <= i < n:
            raise ReplayError(f"vehicle {i} can't be inspected: {scenario.name} has vehicles 0 to {n - 1}; give those")
    if len(chosen) > MOST_INSPECTED:
        raise ReplayError(
            f"at most {MOST_INSPECTED} vehicles can be inspected, got {len(chosen)}; give fewer, or make two replays"
        )
    return chosen


class _Tape:
    """Copies of the state of a swarm of one world after its reset and after every step."""

    def __init__(self, inspect: list[int]) -> None:
        self._inspect = inspect
        self._samples: dict[str, list[NDArray[Any]]] = {}
        self._swarm: Swarm
        self._groups: Groups

    def __call__(self, swarm: Swarm, action: Float32 | None) -> None:
        """Record world 0; a ``watch`` of the evaluation."""
        self._swarm, facts, seen = swarm, swarm.facts, self._inspect
        if action is None:
            self._groups = groups_of(swarm)
        now: dict[str, ArrayLike] = {
            "time_s": facts.time_s[0],
            "references": facts.reference[0, :, :2],
            "marks": swarm.task.marks(0),
            "traffic": swarm.world_map.obstacles[0, : swarm.world_map.num_obstacles[0], :2],
            "drift": swarm.flow_field().drift,
            "position": swarm.state.eta[0, :, :2],
            "heading": swarm.state.eta[0, :, 2],
            "speed": np.hypot(*swarm.velocity[0].T),
            "force": np.sqrt(facts.effort[0]),
            "spacing": facts.spacing[0],
            "clearance": facts.clearance[0],
            "alive": swarm.state.alive[0],
            "vehicle_collisions": facts.vehicle_collisions[0],
            "collisions": facts.collisions[0],
            "detected_index": swarm.detected_index[0, seen],
            "action": np.full((len(seen), 2), np.nan) if action is None else action[0, seen],
            **{name: swarm.percept[name][0, seen] for name in ("neighbour", "echo", "echo_range", "echo_position")},
        }
        for name, values in now.items():
            self._samples.setdefault(name, []).append(np.array(values, _KINDS.get(name, np.float32)))

    def recording(self, scenario: Scenario, policy: str, run: Run) -> Recording:
        """The recording of the run."""
        marks = self._samples.pop("marks")
        most = max(map(len, marks))
        tape = {name: np.array(values) for name, values in self._samples.items()}
        alive = tape["alive"]
        return Recording(
            scenario=scenario,
            policy=policy,
            seed=run.seed,
            metrics=run.metrics,
            waypoints=run.waypoints,
            obstacles=run.obstacles,
            traffic=tape["traffic"] if np.ptp(tape["traffic"], axis=0).any() else None,
            groups=self._groups,
            marks=np.array([np.pad(circles, ((0, most - len(circles)), (0, 0))) for circles in marks]),
            time_s=tape["time_s"],
            references=tape["references"],
            position=_where(alive, tape["position"]),
            heading=_where(alive, tape["heading"]),
            speed=_where(alive, tape["speed"]),
            series={
                "min_spacing_m": _finite(run.series["min_spacing_m"]),
                "obstacle_clearance_m": _finite(run.series["obstacle_distance_m"].min(axis=1, initial=np.inf)),
                "centre_error_m": run.series["centre_error_m"],
                "collisions": np.cumsum(tape["collisions"]).astype(np.float32),
            },
            events=_events(scenario, tape, run),
            force=_where(alive, tape["force"]),
            spacing=_finite(tape["spacing"]),
            clearance=tape["clearance"],
            inspections=self._inspections(tape),
            water=Water(tape["drift"], self._swarm.flow_field().eddies) if scenario.current.flows else None,
        )

    def _inspections(self, tape: dict[str, NDArray[Any]]) -> dict[int, Inspection]:
        detected, echo = tape["detected_index"], tape["echo"] > 0
        neighbour = _where(detected >= 0, tape["neighbour"])
        reach, place = _where(echo, tape["echo_range"]), _where(echo, tape["echo_position"])
        asked = _where(tape["alive"][:, self._inspect], np.roll(tape["action"], -1, axis=0))
        return {
            i: Inspection(detected[:, k], neighbour[:, k], reach[:, k], place[:, k], asked[:, k])
            for k, i in enumerate(self._inspect)
        }


def _events(scenario: Scenario, tape: dict[str, NDArray[Any]], run: Run) -> list[Event]:
    """All events, sorted by time."""
    time, limits = tape["time_s"], scenario.constraints
    events = [
        *collisions(
            time, tape["vehicle_collisions"], tape["clearance"], tape["position"], scenario.collision.hull_radius_m
        ),
        *near_misses("near", time, tape["spacing"] < limits.s_u_m),
        *near_misses("near_obstacle", time, tape["clearance"] < limits.s_o_m),
        *losses(time, tape["alive"]),
        *arrival(run.metrics["task_time_s"]),
    ]
    return sorted(events, key=lambda event: event.time_s)


def _where(valid: NDArray[Any], values: NDArray[Any]) -> Float32:
    """The values, NaN where ``valid`` is False; its axes are the first axes of the values."""
    return np.where(valid.reshape(valid.shape + (1,) * (values.ndim - valid.ndim)), values, np.float32(np.nan))


def _finite(values: Float32) -> Float32:
    """The values, NaN where they are infinite."""
    return np.where(np.isfinite(values), values, np.float32(np.nan))
