"""Recording an episode while the benchmark's evaluation simulates it."""

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from uuv_marl.baselines import with_policy_requirements
from uuv_marl.benchmark.evaluate import Run, blaming, episodes
from uuv_marl.envs.drawing.scene import Scene, SceneHistory
from uuv_marl.errors import ReplayError
from uuv_marl.replay.events import events_of
from uuv_marl.replay.recording import Inspection, Recording
from uuv_marl.scenario import Scenario
from uuv_marl.sim.swarm import Swarm
from uuv_marl.types import Bool, Float32

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

    def __init__(self, inspect: list[int]) -> None:
        self._inspect = inspect
        self._samples: dict[str, list[NDArray[Any]]] = {}
        self._scenes: list[Scene] = []
        self._history: SceneHistory

    def __call__(self, swarm: Swarm, action: Float32 | None) -> None:
        """Record world 0; a ``watch`` of the evaluation."""
        facts, seen = swarm.facts, self._inspect
        if action is None:
            self._history = SceneHistory(swarm)
        self._history.note()
        self._scenes.append(self._history.scene())
        now: dict[str, ArrayLike] = {
            "speed": np.hypot(*swarm.velocity[0].T),
            "force": np.sqrt(facts.effort[0]),
            "spacing": facts.spacing[0],
            "clearance": facts.clearance[0],
            "collisions": facts.vehicle_collisions[0],
            "detected_index": swarm.detected_index[0, seen],
            "action": np.full((len(seen), 2), np.nan) if action is None else action[0, seen, :2],
            **{name: swarm.percept[name][0, seen] for name in ("neighbour", "echo", "echo_range", "echo_position")},
        }
        for name, values in now.items():
            kind = np.int32 if name in ("collisions", "detected_index") else np.float32
            self._samples.setdefault(name, []).append(np.array(values, kind))

    def recording(self, scenario: Scenario, policy: str, run: Run) -> Recording:
        """The recording of the run."""
        scenes, tape = self._scenes, {name: np.array(values) for name, values in self._samples.items()}
        time_s, alive = np.array([scene.time_s for scene in scenes], np.float32), np.array([s.alive for s in scenes])
        return Recording(
            scenario=scenario,
            policy=policy,
            seed=run.seed,
            metrics=run.metrics,
            scenes=scenes,
            time_s=time_s,
            position=_where(alive, np.array([scene.position for scene in scenes], np.float32)),
            heading=_where(alive, np.array([scene.heading for scene in scenes], np.float32)),
            speed=_where(alive, tape["speed"]),
            series={
                "min_spacing_m": _finite(run.series["min_spacing_m"]),
                "obstacle_clearance_m": _finite(run.series["obstacle_distance_m"].min(axis=1, initial=np.inf)),
                "centre_error_m": run.series["centre_error_m"],
                "collisions": np.array([scene.collisions for scene in scenes], np.float32),
            },
            events=events_of(
                scenario, time_s, alive, tape["collisions"], tape["spacing"], tape["clearance"],
                run.metrics["task_time_s"],
            ),
            force=_where(alive, tape["force"]),
            spacing=_finite(tape["spacing"]),
            inspections=self._inspections(tape, alive),
        )  # fmt: skip

    def _inspections(self, tape: dict[str, NDArray[Any]], alive: Bool) -> dict[int, Inspection]:
        detected, echo = tape["detected_index"], tape["echo"] > 0
        neighbour = _where(detected >= 0, tape["neighbour"])
        reach, place = _where(echo, tape["echo_range"]), _where(echo, tape["echo_position"])
        asked = _where(alive[:, self._inspect], np.roll(tape["action"], -1, axis=0))
        return {
            i: Inspection(detected[:, k], neighbour[:, k], reach[:, k], place[:, k], asked[:, k])
            for k, i in enumerate(self._inspect)
        }


def _where(valid: Bool, values: NDArray[Any]) -> Float32:
    """The values, NaN where ``valid`` is False; its axes are the first axes of the values."""
    return np.where(valid.reshape(valid.shape + (1,) * (values.ndim - valid.ndim)), values, np.float32(np.nan))


def _finite(values: Float32) -> Float32:
    """The values, NaN where they are infinite."""
    return np.where(np.isfinite(values), values, np.float32(np.nan))
