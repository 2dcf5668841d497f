"""Write a policy's episodes as a data set, which can be stopped and continued. Needs ``data``."""

import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple, cast

import gymnasium
from gymnasium.envs.registration import EnvSpec

from uuv_marl.atomic import locked
from uuv_marl.baselines import with_policy_requirements
from uuv_marl.benchmark.results import file_name, policy_info, source_fingerprint
from uuv_marl.data.episodes import worlds
from uuv_marl.data.minari import write_minari
from uuv_marl.data.parquet import num_rows, read_description, write_world
from uuv_marl.envs.changes import ScenarioLike
from uuv_marl.envs.solo import SoloEnv
from uuv_marl.errors import ResultsError
from uuv_marl.paths import UserPath, user_path
from uuv_marl.scenario import load_scenario
from uuv_marl.sim.arguments import whole_number
from uuv_marl.sim.observation import Observe, observation_layout

FIRST_SEED = 100_000
"""First of training's seeds, which no table, tuning or validation uses."""
_DECISION, _EPISODE = 32, 24_000
"""Bytes in Minari's file of a decision, beside observation and action, and of an episode's tables."""


class DataSet(NamedTuple):
    """A data set on disk."""

    name: str
    """Its id in Minari."""
    folder: Path
    """Holds ``data``, Minari's, and ``worlds``, a Parquet file for each world."""
    decisions: int
    """Decisions of all vehicles."""
    size: int
    """About its size [byte]."""


def write_data_set(
    root: UserPath, policy: str, scenario: ScenarioLike, seeds: Iterable[int], *, observe: Observe = "closeness",
    max_gb: float = 5.0, report: Callable[[float], object] = lambda _: None,
) -> DataSet:  # fmt: skip
    """Write a policy's episodes as Parquet and for Minari. Finished worlds of an earlier, stopped call are kept.

    Args:
        root: folder of data sets; Minari finds them with the variable ``MINARI_DATASETS_PATH``.
        policy: its name, see ``uuv_marl.make_policy``. The scenario gets what it requires.
        scenario: a name, a TOML file or a ``Scenario``.
        seeds: one for each world.
        observe: the observations, ``closeness`` or ``positions``, as for ``uuv_marl.parallel_env``.
        max_gb: limit of the size [GB].
        report: called with the finished share.

    Raises:
        ResultsError: the data set would exceed ``max_gb``, its folder holds other episodes, or it can't be written.
    """
    chosen = sorted({whole_number("seed", seed, 0) for seed in seeds})
    env, about = _environment(policy, scenario, observe)
    name = data_set_name(env.scenario.name, policy)
    folder = user_path(root) / name
    files = {seed: folder / "worlds" / f"seed_{seed:06}.parquet" for seed in chosen}
    with locked(folder):
        (folder / "worlds").mkdir(exist_ok=True)
        sizes = {seed: _size(file, env) for seed, file in files.items() if _is_written(file, about)}
        missing = [seed for seed in chosen if seed not in sizes]
        _check_size(sizes, len(chosen), max_gb, folder)
        for episodes in worlds(env.scenario, policy, missing, observe):
            seed = episodes[0].seed
            write_world(files[seed], episodes, env.scenario.timing.decision_period_s, about)
            sizes[seed] = _size(files[seed], env)
            _check_size(sizes, len(chosen), max_gb, folder)
            report(len(sizes) / len(chosen))
        decisions = write_minari(folder / "data", name, env, about, list(files.values()))
    return DataSet(name, folder, decisions, sum(sizes.values()))


def data_set_name(scenario: str, policy: str) -> str:
    """The id of a data set in Minari, ``uuv_marl/SCENARIO/POLICY-v0``, with plain characters alone."""
    words = (re.sub(r"[^\w-]", "_", file_name(part), flags=re.ASCII) for part in (scenario, policy))
    return "uuv_marl/{}/{}-v0".format(*words)


def _environment(policy: str, scenario: ScenarioLike, observe: Observe) -> tuple[SoloEnv, dict[str, Any]]:
    """The environment of one vehicle among others that run the policy, and the description of its data."""
    suited = with_policy_requirements(policy, load_scenario(scenario))
    made = gymnasium.make("uuv_marl/Solo-v2", scenario=suited, others=policy, observe=observe)
    env = cast(SoloEnv, made.unwrapped)
    table = observation_layout(suited, observe).table
    return env, {
        "policy": policy,
        "policy_file": policy_info(policy)["source"],
        "observe": observe,
        "scenario": suited.name,
        "task": suited.task.name,
        "channels": [*suited.sonar.channels],
        "observation": [[field.name, field.size, field.quantity.unit, field.quantity.scale] for field in table],
        "environment": cast(EnvSpec, env.spec).to_json(),
        "code": source_fingerprint(),
    }


def _is_written(file: Path, about: Mapping[str, Any]) -> bool:
    """Whether a world's file exists. Raises ResultsError if it holds something else."""
    held = read_description(file) if file.exists() else about
    if other := next((key for key, value in about.items() if held.get(key) != value), None):
        raise ResultsError(
            f"{file} was written with another {other}; move {file.parent.parent} away, or give another output"
        )
    return file.exists()


def _size(file: Path, env: SoloEnv) -> int:
    """About the size of a world in both forms [byte]."""
    row = 4 * (sum(env.observation_space.shape or ()) + env.scenario.action_size) + _DECISION
    return file.stat().st_size + num_rows(file) * row + env.swarm.num_vehicles * _EPISODE


def _check_size(sizes: Mapping[int, int], num_worlds: int, max_gb: float, folder: Path) -> None:
    """Raise ResultsError if so many worlds of the mean of these sizes [byte] exceed the limit [GB]."""
    mean = sum(sizes.values()) / max(len(sizes), 1)
    if mean * num_worlds > max_gb * 1e9:
        raise ResultsError(
            f"--max-gb {max_gb:g} is too small for {num_worlds} worlds of about {mean / 1e6:.1f} MB each; give a "
            f"larger one, or --seeds {int(max_gb * 1e9 / mean)}. {folder} keeps the finished worlds ({len(sizes)})"
        )
