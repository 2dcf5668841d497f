"""MAPPO (Yu et al. 2022): PPO for all vehicles at once, with one actor that they share and a critic that sees all.

The actor is local and small, so that it runs without torch (``uuv_marl.baselines.learned``). The critic's input adds
means and extremes over the world (``uuv_marl.train.critic``), so that neither depends on how many vehicles
there are. Action noise is not learned but annealed. Actor and critic learn side by side, each on one thread:
one seed gives one training, bit for bit. Needs ``train``.
"""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from uuv_marl.baselines.learned.checkpoint import Layer
from uuv_marl.extras import extra
from uuv_marl.train.env import TRAINING_SEEDS, TrainingEnv, Transition
from uuv_marl.train.exploration import exploration
from uuv_marl.train.training import Hyperparameters, Training
from uuv_marl.types import Bool, Float32, Int64

with extra("train", "training with MAPPO"):
    import torch
    from torch import Tensor, nn


class Update(NamedTuple):
    """How an update went."""

    kl: float
    explained: float


class Environment(Protocol):
    """What sampling needs: a ``TrainingEnv``, or a problem with a known answer."""

    features: int
    size: int
    outputs: int
    rows: int
    world: Int64
    observation: Float32

    def step(self, action: Float32) -> Transition:
        """One decision of every row."""
        ...


class Rollout(NamedTuple):
    """Samples as rows."""

    observation: Tensor
    action: Tensor
    mean: Tensor
    """Mean output of the policy that sampled."""
    advantage: Tensor
    returns: Tensor


def gae(reward: Float32, value: Float32, ended: Bool, gamma: float, lam: float) -> Float32:
    """Generalised advantages (Schulman et al. 2016, Eq. 16), shape (time, row).

    Args:
        reward: shape (time, row); where an episode was cut off, plus gamma times the value of where it would go on.
        value: shape (time + 1, row).
        ended: the episode ended by this step, and the next value is another episode's; shape (time, row).
        gamma: discount.
        lam: weight of longer returns.
    """
    advantage = np.zeros_like(reward)
    ahead = np.zeros_like(reward[0])
    for t in reversed(range(len(reward))):
        goes_on = np.float32(gamma) * ~ended[t]
        ahead = reward[t] + goes_on * value[t + 1] - value[t] + np.float32(lam) * goes_on * ahead
        advantage[t] = ahead
    return advantage


class Learner:
    """Actor, critic, their optimisers, and the scale of returns.

    Args:
        features: the actor's inputs, the first of what the critic sees.
        size: the critic's inputs.
        outputs: the actor's.
        by: the algorithm's numbers.
        rng: draws the first weights, and the order of samples.
        device: where networks and batches are.
    """

    def __init__(
        self, features: int, size: int, outputs: int, by: Hyperparameters, rng: np.random.Generator, device: str = "cpu"
    ) -> None:
        self.by, self._rng, self._features, self._device = by, rng, features, device
        self.actor = network((features, *by.hidden, outputs), 0.01, rng, by.first_outputs).to(device)
        self.critic = network((size, *by.hidden, 1), 1.0, rng).to(device)
        self._optimisers = [torch.optim.Adam(net.parameters(), eps=1e-5) for net in (self.actor, self.critic)]
        self._moments = np.zeros(3)  # running weight, sum and sum of squares of returns
        self._average = [x.detach().clone() for x in self.actor.parameters()]
        self._updates = 0

    @property
    def layers(self) -> list[Layer]:
        """The averaged actor's, for a checkpoint."""
        weights, biases = self._average[::2], self._average[1::2]
        return [Layer(w.cpu().numpy().T.copy(), b.cpu().numpy().copy()) for w, b in zip(weights, biases, strict=True)]

    @torch.no_grad()
    def act(self, observation: Float32) -> Float32:
        """Mean action of every row."""
        return self.actor(torch.from_numpy(observation)[:, : self._features].to(self._device)).cpu().numpy()

    @torch.no_grad()
    def value(self, observation: Float32) -> Float32:
        """Expected return of every row, shape (..., row) for inputs (..., row, size)."""
        mean, std = self._scale()
        value = self.critic(torch.from_numpy(observation).to(self._device)).squeeze(-1).cpu().numpy()
        return value * np.float32(std) + np.float32(mean)

    def sample(self, env: Environment, noise: float) -> tuple[Rollout, float]:
        """``horizon`` decisions of an environment with noisy actions, and the mean reward."""
        by, shape = self.by, (self.by.horizon, env.rows)
        observation = np.empty((by.horizon + 1, env.rows, env.size), np.float32)
        action, mean = np.empty((2, *shape, env.outputs), np.float32)
        reward, paid, ended = np.empty(shape, np.float32), 0.0, np.empty(shape, np.bool_)
        tried = exploration(self._rng, env.world, env.outputs, by.shared_noise, by.noise_kept)
        for t, drawn in zip(range(by.horizon), tried, strict=False):
            observation[t] = env.observation
            mean[t] = self.act(observation[t])
            action[t] = mean[t] + np.float32(noise) * drawn
            transition = env.step(action[t])
            paid += float(transition.reward.mean()) / by.horizon
            reward[t], ended[t] = transition.reward, transition.terminated | transition.truncated
            if len(transition.final_obs):
                reward[t][transition.truncated] += np.float32(by.gamma) * self.value(transition.final_obs)
        observation[-1] = env.observation
        value = self.value(observation)
        advantage = gae(reward, value, ended, by.gamma, by.gae_lambda)
        arrays = (observation[:-1], action, mean, advantage, advantage + value[:-1])
        rows = (torch.from_numpy(array.reshape(-1, *array.shape[2:])) for array in arrays)
        return Rollout(*(array.to(self._device) for array in rows)), paid

    def update(self, batch: Rollout, noise: float, learning_rate: float, actor_learns: bool = True) -> Update:
        """Some epochs of PPO on a batch, if the actor learns, and of regression to its returns, side by side."""
        by = self.by
        for optimiser, rate in zip(self._optimisers, (1.0, by.critic_rate), strict=True):
            for group in optimiser.param_groups:
                group["lr"] = rate * learning_rate
        error = (batch.advantage.var() / batch.returns.var().clamp(min=1e-12)).item()
        self._follow(batch.returns.double())
        rows = len(batch.observation)  # orders are drawn before the threads part: a seed fixes a training
        actors, critics = (self._orders(rows, epochs) for epochs in (by.actor_epochs * actor_learns, by.critic_epochs))
        with ThreadPoolExecutor(1) as beside:
            regression = beside.submit(self._regress, batch.observation, batch.returns, critics)
            standard = batch._replace(advantage=_standard(batch.advantage))
            kl = self._improve(standard, noise, actors) if actor_learns else 0.0
            regression.result()
        self._updates += 1
        fresh = max(1.0 - by.average, 10.0 / (9.0 + self._updates))  # about the last tenth at first
        for mean, now in zip(self._average, self.actor.parameters(), strict=True):
            mean.lerp_(now.detach(), fresh)
        return Update(kl, 1.0 - error)

    def _improve(self, batch: Rollout, noise: float, orders: Sequence[Tensor]) -> float:
        """PPO's clipped objective; the last divergence measured."""
        by, kl = self.by, 0.0
        features = batch.observation[:, : self._features].contiguous()
        for rows in self._minibatches(orders):
            old, action = batch.mean[rows], batch.action[rows]
            new = self.actor(features.index_select(0, rows))
            log_ratio = ((action - old).square() - (action - new).square()).sum(-1) / (2.0 * noise * noise)
            kl = (new.detach() - old).square().sum(-1).mean().item() / (2.0 * noise * noise)
            if kl > by.kl_stop:
                break
            ratio, advantage = log_ratio.exp(), batch.advantage[rows]
            clipped = ratio.clamp(1.0 - by.clip, 1.0 + by.clip)
            self._descend(0, self.actor, -torch.minimum(ratio * advantage, clipped * advantage).mean())
        return kl

    def _regress(self, observation: Tensor, returns: Tensor, orders: Sequence[Tensor]) -> None:
        mean, std = self._scale()
        target = (returns - mean) / std
        for rows in self._minibatches(orders):
            loss = (self.critic(observation.index_select(0, rows)).squeeze(-1) - target[rows]).square().mean()
            self._descend(1, self.critic, loss)

    def _descend(self, k: int, net: nn.Sequential, loss: Tensor) -> None:
        self._optimisers[k].zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(net.parameters(), self.by.max_gradient)
        self._optimisers[k].step()

    def _orders(self, rows: int, epochs: int) -> list[Tensor]:
        """The order of rows in each epoch."""
        return [torch.from_numpy(self._rng.permutation(rows)).to(self._device) for _ in range(epochs)]

    def _minibatches(self, orders: Sequence[Tensor]) -> Iterator[Tensor]:
        for order in orders:
            yield from order.split(self.by.minibatch)

    def _scale(self) -> tuple[float, float]:
        """Mean and standard deviation of returns; 0 and 1 before the first."""
        weight, total, squares = self._moments
        if weight == 0.0:
            return 0.0, 1.0
        mean = total / weight
        return float(mean), math.sqrt(max(squares / weight - mean * mean, 1e-4))

    @torch.no_grad()
    def _follow(self, returns: Tensor) -> None:
        """Note these returns, and keep the critic's values where their scale moves (PopArt, Hessel et al. 2019)."""
        first, (mean, std), decay = not self._moments.any(), self._scale(), self.by.value_decay
        fresh = np.array([1.0, returns.mean().item(), returns.square().mean().item()])
        self._moments = decay * self._moments + (1.0 - decay) * fresh
        new_mean, new_std = self._scale()
        last = self.critic[-1]
        if not first and isinstance(last, nn.Linear):
            last.weight.mul_(std / new_std)
            last.bias.mul_(std).add_(mean - new_mean).div_(new_std)

    def arrays(self) -> dict[str, NDArray[Any]]:
        """All of it, for ``restore``."""
        arrays: dict[str, NDArray[Any]] = {"moments": self._moments.copy(), "updates": np.array(self._updates)}
        arrays |= {f"average.{k}": value.cpu().numpy().copy() for k, value in enumerate(self._average)}
        for name, net, optimiser in self._parts():
            arrays |= {f"{name}.{key}": value.cpu().numpy().copy() for key, value in net.state_dict().items()}
            arrays |= adam_arrays(optimiser, f"{name}_adam")
        return arrays

    def restore(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Go on with the ``arrays`` of a learner of the same sizes."""
        tensors = {name: torch.from_numpy(np.array(array)) for name, array in arrays.items()}
        self._moments, self._updates = np.array(arrays["moments"]), int(arrays["updates"])
        self._average = [tensors[f"average.{k}"].to(self._device) for k in range(len(self._average))]
        for name, net, optimiser in self._parts():
            net.load_state_dict({key: tensors[f"{name}.{key}"] for key in net.state_dict()})
            restore_adam(optimiser, f"{name}_adam", tensors)

    def start_from(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Begin with what another learner of the same sizes had learned: its policy, the averaged actor."""
        self.restore(arrays)
        self._updates = 0
        with torch.no_grad():
            for now, mean in zip(self.actor.parameters(), self._average, strict=True):
                now.copy_(mean)

    def _parts(self) -> list[tuple[str, nn.Sequential, torch.optim.Adam]]:
        return [("actor", self.actor, self._optimisers[0]), ("critic", self.critic, self._optimisers[1])]


class Mappo:
    """A learner with its environment, taken an iteration at a time."""

    def __init__(self, training: Training) -> None:
        self._by = training.mappo
        self._rng = np.random.default_rng(training.seed)
        self.env = TrainingEnv(training, lambda num: self._rng.integers(*TRAINING_SEEDS, num))
        self.learner = Learner(
            self.env.features, self.env.size, self.env.outputs, self._by, self._rng, training.device
        )  # fmt: skip
        self.agent_steps = self._by.horizon * self.env.rows
        """Agent-steps of an iteration."""

    def iterate(self, share: float) -> tuple[float, Update]:
        """Sample and update once, ``share`` of the training done: mean reward, and how the update went."""
        noise = annealed(self._by.noise, share)
        batch, reward = self.learner.sample(self.env, noise)
        learns = share >= self._by.critic_first
        return reward, self.learner.update(batch, noise, annealed(self._by.learning_rate, share), learns)

    @property
    def random(self) -> Any:
        """State of the random numbers, as JSON can hold it."""
        return self._rng.bit_generator.state

    @random.setter
    def random(self, state: Any) -> None:
        self._rng.bit_generator.state = state


def network(
    sizes: Sequence[int], last_gain: float, rng: np.random.Generator, last_biases: Sequence[float] = ()
) -> nn.Sequential:
    """Linear layers with tanh between them, orthogonal weights, zero biases but for the last layer's, if given."""
    generator = torch.Generator().manual_seed(int(rng.integers(2**62)))
    layers: list[nn.Module] = []
    for k, (inputs, outputs) in enumerate(itertools.pairwise(sizes)):
        linear = cast(nn.Linear, nn.utils.skip_init(nn.Linear, inputs, outputs))  # no draw from the global generator
        is_last = k == len(sizes) - 2
        nn.init.orthogonal_(linear.weight, last_gain if is_last else math.sqrt(2.0), generator=generator)
        nn.init.zeros_(linear.bias)
        if is_last and last_biases:
            linear.bias.data.copy_(torch.tensor(last_biases))
        layers += [linear] if is_last else [linear, nn.Tanh()]
    return nn.Sequential(*layers)


def _standard(x: Tensor) -> Tensor:
    return (x - x.mean()) / (x.std() + 1e-8)


def adam_arrays(optimiser: torch.optim.Optimizer, name: str) -> dict[str, NDArray[Any]]:
    """Moments and counters of an optimiser, as ``name.parameter.key``."""
    states = optimiser.state_dict()["state"].items()
    return {f"{name}.{k}.{key}": value.cpu().numpy().copy() for k, state in states for key, value in state.items()}


def restore_adam(optimiser: torch.optim.Optimizer, name: str, tensors: Mapping[str, Tensor]) -> None:
    """Go on with what ``adam_arrays`` gave."""
    state: dict[int, dict[str, Tensor]] = {}
    for path in (path for path in tensors if path.startswith(f"{name}.")):
        _, k, key = path.split(".")
        state.setdefault(int(k), {})[key] = tensors[path]
    optimiser.load_state_dict({**optimiser.state_dict(), "state": state})


def annealed(ends: tuple[float, float], share: float) -> float:
    """A number that goes from the first to the second in equal ratios, as ``share`` goes from 0 to 1."""
    return ends[0] * (ends[1] / ends[0]) ** min(share, 1.0)
