"""PPO with one actor for all vehicles (Yu et al. 2022): MAPPO or IPPO, depending on the critic's input.

The actor (``uuv_marl.train.network``) also runs without torch. With a memory, a minibatch is the whole horizon of some
of the vehicles, and gradients flow through time from the recorded state at its start. Action noise is annealed, not
learned. Training uses one thread, so a seed determines it bit for bit. Needs ``train``.
"""

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from uuv_marl.baselines.learned.layers import Architecture, Sizes
from uuv_marl.extras import extra
from uuv_marl.train.network import TorchActor, started
from uuv_marl.train.rows import Rows
from uuv_marl.train.training import Ppo
from uuv_marl.types import Bool, Float32

with extra("train", "training"):
    import torch
    from torch import Tensor, nn

_CRITIC = (64, 64)
"""Units of the critic's layers, tanh."""
_IMITATION_EPOCHS = 2
"""Passes over a batch during imitation."""
_ADAM = ("step", "exp_avg", "exp_avg_sq")
"""State of the optimiser for each tensor."""


class Rollout(NamedTuple):
    """Samples of a horizon, shape (time, row, ...)."""

    observation: Tensor
    action: Tensor
    mean: Tensor
    """Mean action of the policy that sampled."""
    expert_action: Tensor
    """The expert's actions, where it is queried."""
    advantage: Tensor
    returns: Tensor
    continues: Tensor
    """0 where an episode begins, else 1."""
    acted: Tensor
    """1 for vehicles that acted, 0 for those that were lost before."""
    used: Tensor
    """1 for entries of the action that have an effect: forces, and messages in the vehicle's own slot; else 0. In
    PPO's ratio a message counts by the inverse of its noise's variance, over that of forces."""
    part: Tensor
    """Index of the row's part of the training."""
    state: Tensor
    """Recurrent state before the first decision, shape (row, unit)."""


class Learner:
    """Actor, critic, their optimiser, the scale of returns in each part, and the recurrent state of each row.

    Args:
        architecture: of the actor's network.
        sizes: fields of the actor's observation.
        size: number of the critic's inputs, of which the first are the actor's.
        part: index of each vehicle's part of the training, shape (row,). Returns and advantages are normalised in each
            part, and the critic has an output for each.
        config: hyperparameters.
        rng: for initial weights, noise, and the order of samples.
        outputs: entries of an action.
    """

    def __init__(
        self, architecture: Architecture, sizes: Sizes, size: int, part: NDArray[np.int64], config: Ppo,
        rng: np.random.Generator, outputs: int = 2,
    ) -> None:  # fmt: skip
        self.config, self._rng, self._features = config, rng, sum(size for _, size in sizes)
        self.actor, self._outputs = TorchActor(architecture, sizes, rng, outputs), outputs
        self._part, num_parts = torch.from_numpy(part), int(part.max()) + 1
        wide = (size + self.actor.units, *_CRITIC, num_parts)
        layers = zip(itertools.pairwise(wide), [math.sqrt(2.0)] * len(_CRITIC) + [1.0], strict=True)
        self.critic = [started(shape, rng, gain) for (a, b), gain in layers for shape in ((a, b), (b,))]
        self._parts = (list(self.actor.tensors.values()), self.critic)
        self._optimiser = self._adam()
        self._moments = np.zeros((3, num_parts))  # running weight, sum and sum of squares of returns
        self.state = torch.zeros(len(part), self.actor.units)
        self.imitating = False
        """Whether the actor imitates an expert instead of maximising reward."""
        self.imitation_weight = 0.0
        """Weight in PPO's loss of the squared distance from the expert's action [1]."""

    def _adam(self) -> torch.optim.Adam:
        return torch.optim.Adam([*self._parts[0], *self._parts[1]], eps=1e-5, fused=True)

    def set_imitation(self, imitating: bool, imitation_weight: float = 0.0) -> None:
        """Switch imitation on or off, and set ``imitation_weight`` of PPO's loss."""
        if self.imitating and not imitating:  # the old moments would double the first updates' divergence
            self._optimiser = self._adam()
        self.imitating, self.imitation_weight = imitating, imitation_weight

    def _critic_output(self, x: Tensor, state: Tensor, part: Tensor) -> Tensor:
        """Normalised values (row,) of the critic's inputs (row, entry), recurrent states and parts of the training."""
        x = torch.cat([x, state], 1)
        for k in range(0, len(self.critic), 2):
            x = torch.addmm(self.critic[k + 1], x, self.critic[k])
            x = x if k == len(self.critic) - 2 else torch.tanh(x)
        return x.gather(1, part[:, None])[:, 0]

    @torch.no_grad()
    def value(self, seen: Tensor, state: Tensor, part: Tensor) -> Float32:
        """Expected returns, shape (row,)."""
        mean, std = self._scale()
        return (self._critic_output(seen, state, part) * std[part] + mean[part]).numpy()

    @torch.no_grad()
    def act(self, seen: Tensor, state: Tensor) -> tuple[Tensor, Tensor]:
        """Mean actions (row, entry) and the next recurrent state, from the critic's inputs (row, entry)."""
        return self.actor.act(seen[:, : self._features], state)

    def sample(self, env: Rows, noise: float, message_noise: float) -> tuple[Rollout, float]:
        """Samples of ``horizon`` decisions with noisy forces and messages, and the mean reward."""
        config, shape = self.config, (self.config.horizon, env.rows)
        observation = torch.empty((config.horizon + 1, env.rows, env.size))
        action, mean, expert_action = torch.empty((3, *shape, self._outputs))
        states = torch.empty((config.horizon + 1, env.rows, self.actor.units))
        reward, ended = np.empty(shape, np.float32), np.zeros((config.horizon + 1, env.rows), np.bool_)
        acted, used = torch.empty(shape), torch.ones((*shape, self._outputs))
        mean_reward, first = 0.0, self.state
        for t in range(config.horizon):
            observation[t] = torch.from_numpy(env.observation)
            mean[t], states[t] = self.act(observation[t], self.state)
            drawn, acts = self._rng.standard_normal((env.rows, self._outputs), np.float32), mean[t]
            if self._outputs > 2:
                used[t, :, 2:] = torch.from_numpy(env.sends[:, None])
            if self.imitating or self.imitation_weight:
                expert_action[t], done = map(torch.from_numpy, env.query_expert(acts.numpy()))
                acts = done if self.imitating else acts
            drawn[:, 2:] *= message_noise / noise
            action[t] = acts + noise * torch.from_numpy(drawn)
            transition = env.step(action[t].numpy())
            mean_reward += float(transition.reward[transition.acted].mean()) / config.horizon
            reward[t], ended[t + 1] = transition.reward, transition.terminated | transition.truncated
            acted[t] = torch.from_numpy(transition.acted)
            if len(transition.final):
                seen, cut = torch.from_numpy(transition.final), torch.from_numpy(transition.truncated)
                value = self.value(seen, self.act(seen, states[t][cut])[1], self._part[cut])
                reward[t][transition.truncated] += np.float32(config.gamma) * value
            self.state = states[t] * torch.from_numpy(~ended[t + 1, :, None])
        observation[-1] = torch.from_numpy(env.observation)
        states[-1] = self.act(observation[-1], self.state)[1]
        part = self._part.expand(config.horizon + 1, -1)
        rows = observation.flatten(0, 1), states.flatten(0, 1), part.flatten()
        value = self.value(*rows).reshape(config.horizon + 1, -1)
        advantage = gae(reward, value, ended[1:], config.gamma, config.gae_lambda)
        continues = torch.from_numpy(~ended[:-1]).float()
        learned = torch.from_numpy(advantage), torch.from_numpy(advantage + value[:-1]), continues
        arrays = observation[:-1], action, mean, expert_action, *learned, acted, used, part[:-1], first
        return Rollout(*arrays), mean_reward

    def update(self, batch: Rollout, noise: float, message_noise: float, learning_rate: float) -> tuple[float, float]:
        """Train actor and critic on a batch, by PPO or by imitation of the expert; ``Record.kl`` and ``explained``."""
        self._optimiser.param_groups[0]["lr"] = learning_rate
        if not self.imitating:
            batch.used[..., 2:] *= (noise / message_noise) ** 2
        acted = batch.acted > 0.0
        error = (batch.advantage[acted].var() / batch.returns[acted].var().clamp(min=1e-12)).item()
        chosen = [acted & (batch.part == k) for k in range(len(self._moments[0]))]
        self._follow([batch.returns[rows].double() for rows in chosen])
        advantage = torch.zeros_like(batch.advantage)
        for rows in chosen:
            own = batch.advantage[rows]
            advantage[rows] = (own - own.mean()) / (own.std(correction=0) + 1e-8)
        mean, std = self._scale()
        batch = batch._replace(advantage=advantage, returns=(batch.returns - mean[batch.part]) / std[batch.part])
        if not self.actor.units:  # without a memory, samples of all times are shuffled
            mixed = {name: x[acted][None] for name, x in batch._asdict().items() if name != "state"}
            batch = Rollout(**mixed, state=torch.zeros(int(acted.sum()), 0))
        kl = 0.0
        for _ in range(_IMITATION_EPOCHS if self.imitating else self.config.epochs):
            order = torch.from_numpy(self._rng.permutation(batch.action.shape[1]))
            divergences = [self._descend(batch, rows, noise) for rows in order.chunk(self.config.minibatches)]
            kl = sum(divergences) / len(divergences)
            if kl > self.config.kl_stop and not self.imitating:
                break
        return kl, 1.0 - error

    def _descend(self, batch: Rollout, rows: Tensor, noise: float) -> float:
        """One gradient step on some rows; the divergence from the policy that sampled, or from the expert."""
        x, action, old, expert_action, advantage, returns, continues, acted, used, part = (
            array.index_select(1, rows) for array in batch[:10]
        )
        new, states = self.actor.through(x[:, :, : self._features], batch.state[rows], continues)
        action, old, expert_action, used = (
            array.reshape(-1, self._outputs) for array in (action, old, expert_action, used)
        )
        weight = acted.reshape(-1) / acted.sum().clamp(min=1.0)  # in a minibatch all vehicles may be lost
        advantage, part = advantage.reshape(-1), part.reshape(-1)
        double = 2.0 * noise * noise
        ratio = ((used * ((action - old).square() - (action - new).square())).sum(-1) / double).exp()
        clipped = ratio.clamp(1.0 - self.config.clip, 1.0 + self.config.clip)
        imitated = (new - expert_action).square().sum(-1)
        apart = weight @ (imitated if self.imitating else (used * (new - old).square()).sum(-1))
        loss = apart if self.imitating else -weight @ torch.minimum(ratio * advantage, clipped * advantage)
        if self.imitation_weight:
            loss = loss + self.imitation_weight * (weight @ imitated)
        prediction = self._critic_output(x.reshape(-1, x.shape[2]), states.detach(), part)
        self._optimiser.zero_grad()
        (loss + weight @ (prediction - returns.reshape(-1)).square()).backward()
        for tensors in self._parts:
            nn.utils.clip_grad_norm_(tensors, self.config.max_gradient)
        self._optimiser.step()
        return apart.item() / double

    def _scale(self) -> tuple[Tensor, Tensor]:
        """Running mean and standard deviation of returns in each part, shape (part,); 0 and 1 at first."""
        weight, total, squares = self._moments
        begun = np.maximum(weight, 1e-12)
        mean = total / begun
        std = np.where(weight > 0.0, np.sqrt(np.maximum(squares / begun - mean * mean, 1e-4)), 1.0)
        return torch.from_numpy(mean).float(), torch.from_numpy(std).float()

    @torch.no_grad()
    def _follow(self, returns: Sequence[Tensor]) -> None:
        """Update the scale of each part's returns, and preserve the critic's values (PopArt, Hessel et al. 2019)."""
        first, (mean, std), decay = not self._moments.any(), self._scale(), self.config.value_decay
        for k, own in enumerate(returns):
            if len(own):
                fresh = np.array([1.0, own.mean().item(), own.square().mean().item()])
                self._moments[:, k] = decay * self._moments[:, k] + (1.0 - decay) * fresh
        new_mean, new_std = self._scale()
        if not first:
            self.critic[-2].mul_(std / new_std)
            self.critic[-1].mul_(std).add_(mean - new_mean).div_(new_std)

    @property
    def weights(self) -> dict[str, NDArray[Any]]:
        """The actor's weights, for a checkpoint."""
        return {name: x.detach().numpy().copy() for name, x in self.actor.tensors.items()}

    def _tensors(self) -> dict[str, Tensor]:
        """Recurrent state and parameters by name."""
        actor = {f"actor.{name}": x for name, x in self.actor.tensors.items()}
        return {"state": self.state, **actor, **{f"critic.{k}": x for k, x in enumerate(self.critic)}}

    def arrays(self) -> dict[str, NDArray[Any]]:
        """The complete state, for ``restore``."""
        tensors = self._tensors()
        for k, moments in self._optimiser.state_dict()["state"].items():
            tensors |= {f"adam.{k}.{name}": x for name, x in moments.items()}
        arrays = {"moments": self._moments.copy(), "imitating": np.array([self.imitating])}
        return arrays | {name: x.detach().numpy().copy() for name, x in tensors.items()}

    @torch.no_grad()
    def restore(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Restore the ``arrays`` of a learner of the same sizes. Raises KeyError or ValueError for others."""
        tensors = {name: torch.from_numpy(np.array(array)) for name, array in arrays.items()}
        self._moments, self.imitating = np.array(arrays["moments"]), bool(arrays["imitating"][0])
        for name, x in self._tensors().items():
            if tensors[name].shape != x.shape:
                raise ValueError(f"{name} must have shape {tuple(x.shape)}, got {tuple(tensors[name].shape)}")
            x.copy_(tensors[name])
        updated = range(sum(map(len, self._parts))) if self._moments.any() else ()  # the first update starts both
        state = {k: {name: tensors[f"adam.{k}.{name}"] for name in _ADAM} for k in updated}
        self._optimiser.load_state_dict({**self._optimiser.state_dict(), "state": state})


def gae(reward: Float32, value: Float32, ended: Bool, gamma: float, lam: float) -> Float32:
    """Generalised advantages (Schulman et al. 2016, Eq. 16), shape (time, row).

    Args:
        reward: shape (time, row); plus gamma times the value of the next state where an episode is truncated.
        value: shape (time + 1, row).
        ended: whether the episode ended at this step, shape (time, row).
        gamma: discount factor.
        lam: weight of longer returns.
    """
    advantage = np.zeros_like(reward)
    ahead = np.zeros_like(reward[0])
    for t in reversed(range(len(reward))):
        continues = np.float32(gamma) * ~ended[t]
        ahead = reward[t] + continues * value[t + 1] - value[t] + np.float32(lam) * continues * ahead
        advantage[t] = ahead
    return advantage


def annealed(ends: tuple[float, float], share: float) -> float:
    """Geometric interpolation between ``ends`` as ``share`` goes from 0 to 1; linear if one end is 0."""
    if min(ends) == 0.0:
        return ends[0] + (ends[1] - ends[0]) * min(share, 1.0)
    return ends[0] * (ends[1] / ends[0]) ** min(share, 1.0)
