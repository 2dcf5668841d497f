"""Train one policy for all vehicles with RLlib's PPO, on this machine.

python examples/training/rllib.py --scenario starter --steps 1000000 --output runs/rllib
"""

import argparse
import os
from pathlib import Path
from typing import Any

# Read at Ray's import: Ray then listens on 127.0.0.1 alone and reports no usage. A process has one core.
os.environ.update(
    {"RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER": "0", "RAY_USAGE_STATS_ENABLED": "0", "NUMBA_NUM_THREADS": "1"} | os.environ
)

import ray  # pyright: ignore[reportMissingImports]
from ray.rllib.algorithms.ppo import PPOConfig  # pyright: ignore[reportMissingImports]
from ray.rllib.core.rl_module.default_model_config import (  # pyright: ignore[reportMissingImports]
    DefaultModelConfig,
)

from uuv_marl.envs.rllib import SwarmMultiAgentEnv
from uuv_marl.paths import user_path

TRAINING_SEEDS = 100_000  # the benchmark and the tuning use smaller ones


def start_ray(runners: int) -> None:
    """Start Ray on this machine, with a core for each runner."""
    ray.init("local", num_cpus=max(1, runners), include_dashboard=False, log_to_driver=False, logging_level="error")


def ppo_config(scenario: str, vehicles: int | None, runners: int, seed: int) -> PPOConfig:
    """RLlib's configuration, ready for ``build_algo()``; runner k, from 1 on, starts from world ``seed + k``."""
    env = {"scenario": scenario, "num_vehicles": vehicles}
    return (
        PPOConfig()
        # RLlib's check of the environment would put all unseeded runners onto the same worlds (it resets with 42).
        .environment(SwarmMultiAgentEnv, env_config=env, disable_env_checking=True)
        # Two environments in a runner would share worlds with its neighbours: RLlib seeds by runner + environment.
        # It throws samples away that take longer than the timeout: the first run compiles.
        .env_runners(num_env_runners=runners, num_envs_per_env_runner=1, sample_timeout_s=600.0)
        .multi_agent(policies={"shared"}, policy_mapping_fn=shared, count_steps_by="agent_steps")
        .rl_module(
            model_config=DefaultModelConfig(
                fcnet_hiddens=[64, 64], fcnet_activation="tanh", free_log_std=True, vf_share_layers=False
            )
        )
        .training(
            train_batch_size_per_learner=16_384,
            minibatch_size=512,
            num_epochs=10,
            lr=1e-3,
            gamma=0.99,  # rewards fade over 50 s
            lambda_=0.95,
            clip_param=0.2,
            use_kl_loss=False,
            vf_clip_param=float("inf"),  # RLlib's 10 would stop the critic's learning where returns are large
            grad_clip=0.5,
        )
        .debugging(seed=seed)
    )


def shared(*_: Any, **__: Any) -> str:
    """All vehicles have one policy."""
    return "shared"


def train(algorithm: Any, steps: int, output: Path) -> None:
    """Train for a number of agent-steps, and write a checkpoint after every iteration."""
    done = 0
    while done < steps:
        sampled = algorithm.train()["env_runners"]
        done += int(sum(sampled["num_agent_steps_sampled"].values()))
        algorithm.save_to_path(str(output.resolve()))
        print(f"{done:,} agent-steps, return of all vehicles {sampled.get('episode_return_mean', float('nan')):.1f}")


def main() -> None:
    """Train with the options of the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenario", default="starter", help="name or TOML file; then try training_field")
    parser.add_argument("--vehicles", type=int, help="size of the swarm; by default the scenario's")
    parser.add_argument("--steps", type=int, default=1_000_000, help="decisions times vehicles")
    parser.add_argument("--runners", type=int, default=2, help="processes that sample, a core each")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--output", type=user_path, default=Path("runs/rllib"), help="folder of the checkpoint")
    parser.add_argument("--resume", action="store_true", help="continue from the checkpoint")
    arguments = parser.parse_args()
    start_ray(arguments.runners)
    config = ppo_config(arguments.scenario, arguments.vehicles, arguments.runners, TRAINING_SEEDS + arguments.seed)
    algorithm = config.build_algo()
    if arguments.resume:
        algorithm.restore_from_path(str(arguments.output.resolve()))
    train(algorithm, arguments.steps, arguments.output)
    algorithm.stop()
    ray.shutdown()
    print(f"The checkpoint is in {arguments.output}.")


if __name__ == "__main__":
    main()
