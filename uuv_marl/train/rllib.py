"""PPO through Ray RLlib, one policy shared by all vehicles, on one machine or a cluster. Needs ``distributed``."""

import logging
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, field
from math import isfinite
from typing import Any, NamedTuple

import numpy as np

from uuv_marl.benchmark.distributed import connected
from uuv_marl.envs.rllib import SwarmMultiAgentEnv
from uuv_marl.errors import ClusterError
from uuv_marl.extras import extra, silenced
from uuv_marl.paths import UserPath, user_path
from uuv_marl.scenario import Scenario, load_scenario
from uuv_marl.train.env import TRAINING_SEEDS
from uuv_marl.train.folder import Say, opened, quiet
from uuv_marl.train.shaping import OVERRIDES, in_si_units

with extra("distributed", "training with RLlib"):
    import ray  # pyright: ignore[reportMissingImports]
    from ray.rllib.algorithms.ppo import PPOConfig  # pyright: ignore[reportMissingImports]
    from ray.rllib.core.rl_module.default_model_config import (  # pyright: ignore[reportMissingImports]
        DefaultModelConfig,
    )

POLICY = "shared"
"""RLlib's name of the one policy."""
_MOST_RUNNERS = 1000
"""Their worlds are counted on from the first one's, and must be training seeds too."""
_PATIENCE_S = 600.0
"""RLlib throws samples away that take longer; its 60 s are short where the first run compiles, or for large swarms."""
_LIBRARIES = ("ray", "torch", "gymnasium", "numpy", "numba")


@dataclass(frozen=True, kw_only=True)
class Settings:
    """What is trained, and how; RLlib's own defaults hold for the rest."""

    scenario: str = "single_obstacle"
    """Name or TOML file."""
    num_vehicles: int | None = None
    """Replaces the scenario's."""
    overrides: Mapping[str, object] = field(default_factory=lambda: dict(OVERRIDES))
    """Fields of the scenario."""
    seed: int = 0
    """Seed of the training, 0 or more. Different seeds start from different worlds and weights."""
    batch: int = 16_384
    """Agent-steps per iteration, at least: every environment ends with a whole decision."""
    minibatch: int = 512
    """Agent-steps per gradient step, fewer where the batch is smaller."""
    epochs: int = 10
    """Passes over a batch."""
    learning_rate: float = 1e-3
    gamma: float = 0.98
    """Discount per decision; with 0.5 s a horizon of 25 s, about the time that passing an obstacle takes."""
    gae_lambda: float = 0.95
    hidden: tuple[int, ...] = (64, 64)
    """Units of the actor's and of the critic's layers, tanh."""

    def load(self) -> Scenario:
        """The scenario that is trained on."""
        return in_si_units(load_scenario(self.scenario, num_vehicles=self.num_vehicles, overrides=self.overrides))


class Record(NamedTuple):
    """One iteration, a row of ``progress.csv``."""

    iteration: int = 0
    agent_steps: int = 0
    """Sampled so far; one is one decision of one vehicle."""
    episode_return: float | None = None
    """Mean over the episodes that ended in this iteration, and over vehicles; None where none ended."""
    episode_length: float | None = None
    """Decisions, mean over the same episodes."""
    seconds: float = 0.0
    """Spent on training so far."""


def ppo_config(settings: Settings, num_env_runners: int = 2, world_seed: int = TRAINING_SEEDS[0]) -> PPOConfig:
    """RLlib's configuration, ready for ``build_algo()``, for changes before it, or for Ray Tune.

    Args:
        settings: what to train.
        num_env_runners: processes that sample, a core each; 0 samples in the learner's process.
        world_seed: runner k starts from the world of ``world_seed + k``, k from 1 (0 where there are no runners).
    """
    return (
        PPOConfig()
        # RLlib's check of the environment would put all unseeded runners onto the same worlds (it resets with 42).
        .environment(SwarmMultiAgentEnv, env_config={"scenario": settings.load()}, disable_env_checking=True)
        # Two environments in a runner would share worlds with its neighbours: RLlib seeds by runner + environment.
        .env_runners(num_env_runners=num_env_runners, num_envs_per_env_runner=1, sample_timeout_s=_PATIENCE_S)
        .multi_agent(policies={POLICY}, policy_mapping_fn=_shared, count_steps_by="agent_steps")
        .rl_module(
            model_config=DefaultModelConfig(
                fcnet_hiddens=list(settings.hidden),
                fcnet_activation="tanh",
                free_log_std=True,
                vf_share_layers=False,
            )
        )
        .training(
            train_batch_size_per_learner=settings.batch,
            minibatch_size=min(settings.minibatch, settings.batch),
            num_epochs=settings.epochs,
            lr=settings.learning_rate,
            gamma=settings.gamma,
            lambda_=settings.gae_lambda,
            clip_param=0.2,
            use_kl_loss=False,
            vf_clip_param=float("inf"),  # RLlib's 10 would stop the critic's learning where returns are large
            grad_clip=0.5,
        )
        .debugging(seed=world_seed)
    )


def world_seed(seed: int, agent_steps: int) -> int:
    """Where worlds start, within the training seeds: anew for every seed, and whenever a training goes on."""
    low, high = TRAINING_SEEDS[0], TRAINING_SEEDS[1] - _MOST_RUNNERS
    return low + int(np.random.SeedSequence([seed, agent_steps]).generate_state(1)[0]) % (high - low)


def train(
    output: UserPath,
    steps: int,
    settings: Settings | None = None,
    *,
    num_env_runners: int = 2,
    address: str | None = None,
    resume: bool = False,
    say: Say = quiet,
    stop: Callable[[], bool] = lambda: False,
) -> Iterator[Record]:
    """Train, and keep a checkpoint after every iteration; a record for each.

    ``output`` gets ``config.json``, ``progress.csv`` and ``checkpoints/``. Closing the iterator, or an interrupt, ends
    the training with its last checkpoint.

    Args:
        output: a new or empty folder, or with ``resume`` that of an earlier training.
        steps: agent-steps after which to stop, those before a resume included.
        settings: the default ones if None; a resume needs the same.
        num_env_runners: processes that sample; may change at a resume.
        address: of a Ray cluster, see ``uuv_marl.benchmark.distributed.connected``; None for this machine.
        resume: go on from the last checkpoint.
        say: told from where a resume goes on.
        stop: asked after every iteration; where it says so, the training ends.

    Raises:
        ResultsError: the folder is used, by another process too, holds no training of these settings, or can't be
            written; the last checkpoint is whole.
        ClusterError: the cluster can't be joined, has fewer cores than runners, or lost all of them.
    """
    output, settings = user_path(output), settings or Settings()
    scenario = settings.load()
    described = {**asdict(settings), "scenario": scenario.model_dump(mode="json")}
    with opened(output, described, resume, Record(), say) as folder:
        if folder.record.agent_steps >= steps:
            return
        seed = world_seed(settings.seed, folder.record.agent_steps)
        with connected(address, max(1, num_env_runners)), silenced("ray.rllib", logging.ERROR):
            _need_cores(num_env_runners)
            algorithm = _algorithm(ppo_config(settings, num_env_runners, seed), on_cluster=address is not None)
            try:
                if folder.checkpoint:
                    algorithm.restore_from_path(str(folder.checkpoint.resolve()))
                folder.begin({"world_seed": seed, "env_runners": num_env_runners}, _LIBRARIES)
                stopped = False
                while folder.record.agent_steps < steps and not stopped:
                    record = _iterate(algorithm, folder.record, scenario.swarm.num_vehicles)
                    folder.note(record)
                    folder.keep(record, lambda path: algorithm.save_to_path(str(path)))
                    stopped = stop()
                    yield record
            finally:
                algorithm.stop()


def _shared(*_: Any, **__: Any) -> str:
    return POLICY


def _need_cores(num_env_runners: int) -> None:
    cores = int(ray.cluster_resources().get("CPU", 0))
    if cores < num_env_runners:
        raise ClusterError(
            f"{num_env_runners} env runners need as many cores, and the Ray cluster has {cores}; give --env-runners "
            f"{cores}"
        )


def _algorithm(config: PPOConfig, on_cluster: bool) -> Any:
    # A node of a cluster may go away; a process that dies on one machine would only die again.
    config.fault_tolerance(restart_failed_env_runners=on_cluster)
    return config.build_algo()


def _iterate(algorithm: Any, before: Record, num_vehicles: int) -> Record:
    start = time.perf_counter()
    sampled: Mapping[str, Any] = algorithm.train().get("env_runners", {})
    if not sampled.get("num_agent_steps_sampled"):
        raise ClusterError("no env runner is left that samples; give --resume to go on from the last checkpoint")
    team_return, length = (_number(sampled.get(key)) for key in ("episode_return_mean", "episode_len_mean"))
    return Record(
        iteration=before.iteration + 1,
        agent_steps=before.agent_steps + int(sum(sampled["num_agent_steps_sampled"].values())),
        episode_return=None if team_return is None else team_return / num_vehicles,
        episode_length=length,
        seconds=before.seconds + time.perf_counter() - start,
    )


def _number(value: Any) -> float | None:
    return float(value) if value is not None and isfinite(value) else None
