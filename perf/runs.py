"""A hash of every run that perf/versions.py compares; both versions of the package run this file: python runs.py OTHER.

Uses only what both versions have. Seeds are tuning seeds, so that no reported one is spent.
"""

import hashlib
import itertools
import json
import sys
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

import uuv_marl
from uuv_marl import load_scenario
from uuv_marl.baselines import POLICIES, make_policy, with_policy_requirements
from uuv_marl.benchmark import evaluate
from uuv_marl.benchmark.evaluate import Run
from uuv_marl.sim.swarm import Swarm
from uuv_marl.train.folder import Record
from uuv_marl.train.run import Trainer
from uuv_marl.train.training import Training

SIZES: dict[str, dict[str, object]] = {f"_n{n}": {"swarm.num_vehicles": n} for n in (10, 100, 200)}
SURFACE: dict[str, dict[str, object]] = {"_surface": {"sonar.echo_reports": "surface"}}
PERIODS: dict[str, dict[str, object]] = {f"_every_{t}_s": {"timing.decision_period_s": t} for t in (0.2, 0.5)}
SETS = {name: (name, {}) for name in ("tracking", "single_obstacle", "multi_obstacle", "lossy", "random_field")} | {
    f"{name}{end}": (name, changes)
    for name, all_changes in (
        ("random_field", SIZES | SURFACE | PERIODS), ("single_obstacle", SIZES | SURFACE),
    )
    for end, changes in all_changes.items()
}  # fmt: skip
"""Scenarios with changed fields, by name."""
REWARD: Any = "sparse"
SEED, MOST_AGENT_STEPS = 10_000, 30_000
"""The first of the tuning seeds, which end before 100,000; where an episode is cut off, in decisions times vehicles."""
SCENARIOS = ("tracking", "single_obstacle", "multi_obstacle", "lossy", "random_field")
METRICS = (
    "task_time_s", "time_within_1_m_s", "time_within_5_m_s", "time_within_10_m_s", "duration_s",
    "min_obstacle_distance_m", "min_spacing_m", "mean_min_spacing_m", "max_spacing_m", "centre_error_m",
    "order_parameter", "collisions", "constraint_share", "effort", "clamps", "saturation_share", "vehicles_lost",
)  # fmt: skip
"""Those that older checkouts also have."""
STATE = ("eta", "nu", "before", "alive", "tick", "dwell")
FACTS = (
    "time_s", "reference", "centre", "spacing", "min_spacing", "max_spacing", "clearance", "obstacle_clearance",
    "vehicle_collisions", "collisions", "lost", "effort", "saturated", "arrival_s",
)  # fmt: skip


def digest(*values: Any) -> str:
    """Hash of arrays or JSON data."""
    hashed = hashlib.sha256()
    for value in values:
        hashed.update(value.tobytes() if isinstance(value, np.ndarray) else json.dumps(value, sort_keys=True).encode())
    return hashed.hexdigest()[:16]


def episodes(scenario: Any, policy: str, first: int, most: int = MOST_AGENT_STEPS) -> str:
    """Two episodes stepped together: a hash of each over states, facts, percepts and actions."""
    scenario = with_policy_requirements(policy, scenario)
    swarm, actor = Swarm(scenario, 2), make_policy(policy, scenario, 2)
    percept, active, hashed = swarm.reset(first), np.ones(2, np.bool_), [hashlib.sha256(), hashlib.sha256()]
    actor.reset(first)
    for _ in range(most // swarm.num_vehicles):
        action = actor.act(percept)
        percept = swarm.step(action, active)
        arrays = [getattr(swarm.state, name) for name in STATE] + [getattr(swarm.facts, name) for name in FACTS]
        for w in np.flatnonzero(active):
            for array in (*arrays, swarm.detected_index, percept.flat, action, actor.clamps):
                hashed[w].update(array[w].tobytes())
        active &= ~(swarm.arrived | (swarm.facts.time_s >= swarm.time_limit_s - 1e-9) | ~swarm.state.alive.any(axis=1))
        actor.active[:] = active
        if not active.any():
            break
    return " ".join(each.hexdigest()[:16] for each in hashed)


def parallel(scenario: str, policy: str, reward: Any) -> str:
    """An episode, or its first thousand steps, through ``parallel_env``."""
    env = uuv_marl.parallel_env(with_policy_requirements(policy, load_scenario(scenario)), reward=reward)
    actor, hashed = make_policy(policy, env), list[str]()
    (observations, _), _ = env.reset(SEED), actor.reset(SEED)
    while env.agents and len(hashed) < 1000:
        observations, *outcome, _ = env.step(actor(observations))
        hashed.append(digest(*observations.values(), *outcome, env.state()))
    return digest(hashed)


def vector(scenario: str) -> str:
    """Four worlds through ``vector_env``, random actions, with resets in the same step."""
    envs, rng = uuv_marl.vector_env(4, scenario, max_cycles=40, reward=REWARD), np.random.default_rng(SEED)
    hashed = [digest(envs.reset(seed=SEED)[0])]
    for _ in range(100):
        *outcome, infos = envs.step(rng.uniform(-1.0, 1.0, envs.action_space.shape or ()).astype(np.float32))
        hashed.append(digest(*outcome, infos["agent_reward"]))
    return digest(hashed)


def reported(policy: str) -> str:
    """The benchmark's metrics, series and trajectories of two short episodes."""
    scenario = with_policy_requirements(policy, load_scenario("single_obstacle", num_vehicles=10))
    runs = [run for run in evaluate.episodes(scenario, policy, [SEED, SEED + 1]) if isinstance(run, Run)]
    metrics = [{key: value for key, value in run.metrics.items() if key in METRICS} for run in runs]
    return digest(metrics, *(a for run in runs for a in (*run.series.values(), *run.routes)))


def trained() -> str:
    """Weights and progress of five updates on small swarms."""
    training = Trainer(Training(sizes=[(5, 4), (10, 2)], ppo={"horizon": 16}, steps=3200, seed=3))
    records = [Record()]
    for _ in range(5):
        records.append(training.iterate(records[-1]))
    return digest(*training.learner.weights.values(), [[record.reward, record.kl] for record in records])


def cases(other: Path) -> Iterator[tuple[str, str, Callable[..., str], tuple[Any, ...]]]:
    """Kind, name, maker and its arguments of every hash."""
    for (kind, (base, changes)), policy in itertools.product(SETS.items(), POLICIES):
        if changes in PERIODS.values() and POLICIES[policy].requirements.decision_period_s:
            continue  # it has its own
        name = f"{kind} {policy}"
        scenario = load_scenario(base, overrides=changes)
        yield "episodes", name, episodes, (scenario, policy, SEED + zlib.crc32(name.encode()) % 80_000)
    for name in SCENARIOS:
        yield "parallel_env", f"{name} bio_inspired", parallel, (name, "bio_inspired", REWARD)
        yield "parallel_env", f"{name} random", parallel, (name, "random", REWARD)
        yield "vector_env", name, vector, (name,)
    for policy in POLICIES:
        yield "benchmark", policy, reported, (policy,)
    yield "5 updates", "starter", trained, ()
    for path in sorted(p for part in ("uuv_marl", "docs") for p in (other / part).rglob("*.safetensors")):
        small = load_scenario("random_field", num_vehicles=10)
        yield "checkpoints", str(path.relative_to(other)), episodes, (small, str(path), SEED, 1000)


def main(other: Path, only: list[str]) -> None:
    """Print a line for every hash: kind, name, hash or hashes."""
    for kind, name, make_hash, arguments in cases(other):
        if not only or kind in only:
            try:
                hashed = make_hash(*arguments)
            except Exception as error:  # a version that can't is a result
                hashed = f"failed: {type(error).__name__}: {error}"
            print(json.dumps([kind, name, hashed]), flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
