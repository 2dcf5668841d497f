"""Recording an episode while the benchmark's evaluation simulates it."""

from collections.abc import Callable, Iterable, Sequence
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

    def __init__(self, inspect: Sequence[int]) -> None:
        self._inspect = inspect
        self._eddies = np.zeros((0, 3))
        self._samples: dict[str, list[NDArray[Any]]] = {}
        self._actions: list[Float32] = []
        self._groups: Groups

    def __call__(self, swarm: Swarm, action: Float32 | None) -> None:
        """Record world 0; a ``watch`` of the evaluation."""
        eta, velocity, facts = swarm.state.eta[0], swarm.velocity[0], swarm.facts
        seen = list(self._inspect)
        percept = swarm.percept
        self._add("time_s", facts.time_s[0])
        if action is None:
            self._groups = groups_of(swarm)
        self._add("references", facts.reference[0, :, :2])
        self._add("marks", swarm.task.marks(0))
        self._add("traffic", swarm.world_map.obstacles[0, : swarm.world_map.num_obstacles[0], :2])
        self._add("drift", swarm.flow_field().drift)
        self._eddies = swarm.flow_field().eddies
        self._add("position", eta[:, :2])
        self._add("heading", eta[:, 2])
        self._add("speed", np.hypot(velocity[:, 0], velocity[:, 1]))
        self._add("force", np.sqrt(facts.effort[0]))
        self._add("spacing", facts.spacing[0])
        self._add("clearance", facts.clearance[0])
        self._add("alive", swarm.state.alive[0], np.bool_)
        self._add("vehicle_collisions", facts.vehicle_collisions[0], np.int32)
        self._add("collisions", facts.collisions[0], np.int32)
        self._add("detected_index", swarm.detected_index[0, seen], np.int32)
        for name in ("neighbour", "echo", "echo_range", "echo_position"):
            self._add(name, percept[name][0, seen])
        if action is not None:
            self._actions.append(np.array(action[0, seen], np.float32))

    def _add(self, name: str, values: ArrayLike, kind: DTypeLike = np.float32) -> None:
        copy: NDArray[Any] = np.array(values, kind)
        self._samples.setdefault(name, []).append(copy)

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
                "min_spacing_m": finite(run.series["min_spacing_m"]),
                "obstacle_clearance_m": finite(run.series["obstacle_distance_m"].min(axis=1, initial=np.inf)),
                "centre_error_m": run.series["centre_error_m"],
                "collisions": np.cumsum(tape["collisions"]).astype(np.float32),
            },
            events=_events(scenario, tape, run),
            force=_where(alive, tape["force"]),
            spacing=finite(tape["spacing"]),
            inspections=self._inspections(tape),
            water=Water(tape["drift"], self._eddies) if scenario.current.flows else None,
        )

    def _inspections(self, tape: dict[str, NDArray[Any]]) -> dict[int, Inspection]:
        steps = len(self._actions)
        asked = np.full((steps + 1, len(self._inspect), 2), np.nan, np.float32)
        asked[:steps] = self._actions
        asked = _where(tape["alive"][:, list(self._inspect)], asked)
        echo = tape["echo"] > 0
        neighbour = _where(tape["detected_index"] >= 0, tape["neighbour"])
        reach, place = _where(echo, tape["echo_range"]), _where(echo, tape["echo_position"])
        return {
            i: Inspection(tape["detected_index"][:, k], neighbour[:, k], reach[:, k], place[:, k], asked[:, k])
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


def finite(values: Float32) -> Float32:
    """The values, NaN where they are infinite."""
    return np.where(np.isfinite(values), values, np.float32(np.nan))
