"""PPO of Stable-Baselines3 on the problem that MAPPO is given: same rows, features, barrier and reward.

What differs is the algorithm: the critic sees what the actor sees, and action noise is learned. Needs ``train``.
"""

import math
import random
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uuv_marl.baselines.learned.checkpoint import Layer
from uuv_marl.extras import extra
from uuv_marl.train.env import TRAINING_SEEDS, EpisodeStats
from uuv_marl.train.group import Problem
from uuv_marl.train.shared import Count, PPOHyperparameters, Update, adam_arrays, annealed, restore_adam
from uuv_marl.train.vec_env import TrainingVecEnv

with extra("train", "training with Stable-Baselines3"):
    import torch
    from stable_baselines3 import PPO
    from stable_baselines3.common.logger import Logger
    from stable_baselines3.common.vec_env import VecNormalize
    from torch import nn

Arrays = dict[str, NDArray[Any]]


@dataclass(frozen=True, kw_only=True)
class Hyperparameters(PPOHyperparameters):
    """Numbers of Stable-Baselines3's PPO; ``minibatch`` becomes the largest factor of the batch below it, for SB3."""

    name: str = "ppo"
    epochs: Count = 3
    noise: float = 0.4
    """Standard deviation of actions at the start [full force]; then it is learned."""

    def begin(self, problem: Problem, seed: int, device: str = "cpu") -> "Ppo":
        """A training that has not begun.

        Args:
            problem: what is trained on.
            seed: of weights, worlds and noise.
            device: where networks and batches are.
        """
        return Ppo(self, problem, seed, device)


class Ppo:
    """Stable-Baselines3's model with its environment, taken an iteration at a time.

    SB3 draws from the global generators of NumPy and torch, and seeds Python's. Their states are swapped in while it
    works, so that nothing outside is disturbed and a seed fixes a training.

    Args:
        by: the algorithm's numbers.
        problem: what is trained on.
        seed: of weights, worlds and noise.
        device: where networks and batches are.
    """

    def __init__(self, by: Hyperparameters, problem: Problem, seed: int, device: str = "cpu") -> None:
        self._by, self._share, self._device = by, 0.0, device
        self._vec_env = TrainingVecEnv(problem)
        self._env = VecNormalize(self._vec_env, norm_obs=False, gamma=by.gamma)
        first = int(np.random.default_rng(seed).integers(*TRAINING_SEEDS))
        self.agent_steps = by.horizon * self._vec_env.num_envs
        """Agent-steps of an iteration."""
        self._random = _global_random()
        with self._own_random():
            self.model = self._make(first)
            self.model.set_logger(Logger(None, []))

    def _make(self, seed: int) -> PPO:
        by = self._by
        return PPO(
            "MlpPolicy",
            self._env,
            learning_rate=lambda _: annealed(by.learning_rate, self._share),
            n_steps=by.horizon,
            batch_size=max(k for k in range(1, by.minibatch + 1) if self.agent_steps % k == 0),
            n_epochs=by.epochs,
            gamma=by.gamma,
            gae_lambda=by.gae_lambda,
            clip_range=by.clip,
            target_kl=by.kl_stop,
            policy_kwargs={"net_arch": list(by.hidden), "log_std_init": math.log(by.noise)},
            seed=seed,
            device=self._device,
        )

    def iterate(self, share: float) -> tuple[float, Update]:
        """Sample and update once, ``share`` of the training done: mean reward, and how the update went."""
        self._share, before = share, self._vec_env.reward_sum
        with self._own_random():
            self.model.learn(self.agent_steps, log_interval=10**9, reset_num_timesteps=False)
        told = self.model.logger.name_to_value
        update = Update(float(told["train/approx_kl"]), float(told["train/explained_variance"]))
        return (self._vec_env.reward_sum - before) / self._by.horizon, update

    @property
    def layers(self) -> list[Layer]:
        """The actor's, for a checkpoint."""
        policy: Any = self.model.policy
        linear = [layer for layer in policy.mlp_extractor.policy_net if isinstance(layer, nn.Linear)]
        weights = [
            (x.weight.detach().cpu().numpy(), x.bias.detach().cpu().numpy()) for x in (*linear, policy.action_net)
        ]
        return [Layer(weight.T.copy(), bias.copy()) for weight, bias in weights]

    def pop_episode_stats(self) -> EpisodeStats:
        """Sums over the episodes that ended since the last call."""
        return self._vec_env.env.pop_episode_stats()

    def arrays(self) -> Arrays:
        """Weights, optimiser and the scale of returns, for ``restore``."""
        scale: Any = self._env.ret_rms
        arrays: Arrays = {
            "counters": np.array([self.model.num_timesteps, self.model._n_updates]),
            "scale": np.array([scale.mean, scale.var, scale.count]),
        }
        arrays |= {f"policy.{key}": value.cpu().numpy().copy() for key, value in self.model.policy.state_dict().items()}
        return arrays | adam_arrays(self.model.policy.optimizer, "adam")

    def restore(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Go on with the ``arrays`` of a learner of the same sizes."""
        tensors = {name: torch.from_numpy(np.array(array)) for name, array in arrays.items()}
        policy, scale = self.model.policy, self._env.ret_rms
        policy.load_state_dict({key: tensors[f"policy.{key}"] for key in policy.state_dict()})
        restore_adam(policy.optimizer, "adam", tensors)
        self.model.num_timesteps, self.model._n_updates = map(int, arrays["counters"])
        scale.mean, scale.var, scale.count = arrays["scale"]

    start_from = restore

    def snapshot(self) -> Arrays:
        """The worlds, for ``put_back``."""
        starts = self.model._last_episode_starts
        assert starts is not None  # noqa: S101
        kept = {**self._vec_env.env.snapshot(), "starts": starts.copy(), "discounted": self._env.returns.copy()}
        following = self._vec_env.next_seed
        return kept if following is None else {**kept, "next_seed": np.array(following)}

    def put_back(self, snapshot: Mapping[str, NDArray[Any]]) -> None:
        """Go on from a ``snapshot``."""
        model: Any = self.model
        self._vec_env.env.restore(snapshot)
        following = snapshot.get("next_seed")  # not those of a new training
        self._vec_env.seed(None if following is None else int(following))
        self._env.returns[...] = snapshot["discounted"]
        model._last_obs, model._last_episode_starts = self._vec_env.observation.copy(), snapshot["starts"] > 0

    @property
    def random(self) -> Any:
        """State of the random numbers, as JSON can hold it."""
        (name, keys, *rest), generator = self._random
        return {"numpy": [name, keys.tolist(), *rest], "torch": generator.numpy().tobytes().hex()}

    @random.setter
    def random(self, state: Any) -> None:
        name, keys, *rest = state["numpy"]
        generator = torch.frombuffer(bytearray.fromhex(state["torch"]), dtype=torch.uint8)
        self._random = ((name, np.array(keys, np.uint32), *rest), generator)

    @contextmanager
    def _own_random(self) -> Iterator[None]:
        outside, pythons = _global_random(), random.getstate()
        _set_global_random(self._random)
        try:
            yield
        finally:
            self._random = _global_random()
            _set_global_random(outside)
            random.setstate(pythons)


def _global_random() -> Any:
    return np.random.get_state(), torch.get_rng_state()  # noqa: NPY002 - SB3 draws from these


def _set_global_random(state: Any) -> None:
    np.random.set_state(state[0])  # noqa: NPY002
    torch.set_rng_state(state[1])
