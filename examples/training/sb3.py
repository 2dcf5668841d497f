"""Train one policy for all vehicles with Stable-Baselines3's PPO, and write a checkpoint for the benchmark.

python examples/training/sb3.py --scenario starter --steps 300000 --output runs/sb3
uuv-marl benchmark --scenario starter --policy bio_inspired_plus --policy runs/sb3
"""

import argparse
from pathlib import Path

from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecNormalize

from uuv_marl.envs.sb3 import SwarmVecEnv
from uuv_marl.paths import user_path
from uuv_marl.train.sb3 import save_sb3

TRAINING_SEEDS = 100_000  # the benchmark and the tuning use smaller ones


def make_env(scenario: str, num_worlds: int) -> VecNormalize:
    """Worlds in which every vehicle is a row."""
    # Checkpoints read closeness instead of positions. Rewards are normalised; observations already are.
    return VecNormalize(SwarmVecEnv(scenario, num_worlds, observe="closeness"), norm_obs=False)


def train(scenario: str, steps: int, num_worlds: int, seed: int) -> PPO:
    """A model trained for a number of agent-steps: decisions times vehicles."""
    model = PPO(
        "MlpPolicy",
        make_env(scenario, num_worlds),
        learning_rate=lambda left: 1e-3 * (0.1 + 0.9 * left),  # small steps at the end
        n_steps=48,
        batch_size=960,
        n_epochs=4,
        policy_kwargs={"net_arch": [64, 64], "log_std_init": -1.0},  # noise of 0.37 of the full force at first
        seed=TRAINING_SEEDS + seed,
        device="cpu",
        verbose=1,
    )
    return model.learn(steps, log_interval=10)


def main() -> None:
    """Train with the options of the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenario", default="starter", help="name or TOML file; then try training_field")
    parser.add_argument("--steps", type=int, default=300_000, help="decisions times vehicles")
    parser.add_argument("--worlds", type=int, default=32)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--output", type=user_path, default=Path("runs/sb3"))
    arguments = parser.parse_args()
    model = train(arguments.scenario, arguments.steps, arguments.worlds, arguments.seed)
    arguments.output.mkdir(parents=True, exist_ok=True)
    model.save(arguments.output / "model")  # for PPO.load, to train on
    save_sb3(model, arguments.output / "policy.safetensors")
    command = f"uuv-marl benchmark --scenario {arguments.scenario} --policy {arguments.output}"
    print(f"The policy is in {arguments.output}: {command}")


if __name__ == "__main__":
    main()
