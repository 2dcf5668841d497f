"""``SwarmEnv``: worlds as a batched TorchRL environment with one group of agents, ``uuv``."""

from collections.abc import Mapping
from typing import Any, Unpack

import numpy as np
from numpy.typing import NDArray

from uuv_marl.envs.changes import EnvOptions, ScenarioLike
from uuv_marl.envs.core import make_batched_env
from uuv_marl.envs.mixins import EnvMixin
from uuv_marl.extras import extra
from uuv_marl.percept import PerceptLayout
from uuv_marl.sim.arguments import rounding, world_seeds
from uuv_marl.types import Bool

with extra("torchrl", "SwarmEnv"):
    import torch
    from tensordict import TensorDict, TensorDictBase
    from torchrl.data import Bounded, Categorical, Composite, Unbounded
    from torchrl.envs import EnvBase

GROUP = "uuv"


class SwarmEnv(EnvMixin, EnvBase):
    """Worlds with batch size (num_worlds,), in float32 and bool, on the CPU by default.

    Under ``uuv``: ``observation`` (vehicle, entry), ``mask`` (vehicle,), ``action`` (vehicle, entry), ``reward``
    (vehicle, 1), and ``done``, ``terminated``, ``truncated`` (vehicle, 1). At the root: ``state`` (entry,) for
    centralised critics, and ``done``, ``terminated``, ``truncated`` (1,) of the world, by which collectors and
    ``rollout`` reset it. A lost vehicle stays ``terminated``, its ``mask`` False, its observation and reward 0, until
    its world ends; mask it out of the loss.

    Args:
        num_worlds: worlds stepped together.
        scenario: a name, a TOML file or a ``Scenario``.
        seed: of the first reset, ``seed + w`` for world w; as ``set_seed``.
        device: of the tensors; the simulation runs on the CPU.
        options: the other arguments of ``uuv_marl.parallel_env``, such as ``reward`` and ``for_policy``.
    """

    def __init__(
        self,
        num_worlds: int = 1,
        scenario: ScenarioLike = "single_obstacle",
        *,
        seed: int | None = None,
        device: torch.device | str = "cpu",
        **options: Unpack[EnvOptions],
    ) -> None:
        batch = make_batched_env(scenario, num_worlds, keep_terms=False, **options)
        super().__init__(device=device, batch_size=torch.Size([num_worlds]))
        self._batch = batch
        self._pending: list[int | None]
        self._set_seed(seed)
        self.group_map = {GROUP: [f"uuv_{i}" for i in range(self.swarm.num_vehicles)]}
        self._make_specs()

    def _make_specs(self) -> None:
        batch = self._batch
        worlds, group = (self.swarm.num_worlds,), (self.swarm.num_worlds, self.swarm.num_vehicles)

        def boxed(layout: PerceptLayout, shape: tuple[int, ...]) -> Bounded:
            low, high = (torch.from_numpy(bound).expand(*shape, layout.size) for bound in (layout.low, layout.high))
            return Bounded(low, high, device=self.device, dtype=torch.float32)

        def flags(*shape: int) -> Categorical:
            return Categorical(2, torch.Size(shape), self.device, torch.bool)

        def endings(*shape: int) -> dict[str, Categorical]:
            return {name: flags(*shape, 1) for name in ("done", "terminated", "truncated")}

        def nested(entries: Mapping[str, Any], root: Mapping[str, Any] | None = None) -> Composite:
            return Composite({GROUP: Composite(entries, shape=group), **(root or {})}, shape=worlds, device=self.device)

        observation = {"observation": boxed(batch.layout, group), "mask": flags(*group)}
        self.observation_spec = nested(observation, {"state": boxed(self._batch.state_layout, worlds)})
        acts = torch.Size((*group, self.scenario.action_size))
        self.action_spec = nested({"action": Bounded(-1.0, 1.0, acts, self.device, torch.float32)})
        self.reward_spec = nested({"reward": Unbounded(torch.Size((*group, 1)), self.device, torch.float32)})
        self.done_spec = nested(endings(*group), endings(*worlds))

    def _set_seed(self, seed: int | None) -> None:
        """Set the seeds of the worlds' next reset."""
        self._pending = world_seeds(seed, range(self.swarm.num_worlds))

    def _reset(
        self, tensordict: TensorDictBase | None = None, seed: int | None = None, **_kwargs: Any
    ) -> TensorDictBase:
        """Start the worlds that ``_reset`` marks, by default all; TorchRL uses only these rows of the result."""
        if seed is not None:
            self._set_seed(seed)
        marked = None if tensordict is None else tensordict.get("_reset", None)
        every = range(self.swarm.num_worlds)
        worlds = list(every) if marked is None else torch.where(marked.reshape(-1))[0].tolist()
        observation = self._batch.reset([self._pending[world] for world in worlds], worlds)
        for world in worlds:
            self._pending[world] = None
        alive = self.swarm.state.alive
        none = np.zeros(len(every), np.bool_)
        group = {"observation": observation, "mask": alive.copy()}
        return self._tensordict(group, ~alive, np.zeros_like(alive), none, none.copy())

    def _step(self, tensordict: TensorDictBase) -> TensorDictBase:
        """One decision of every vehicle of every world."""
        result = self._batch.step(tensordict.get((GROUP, "action")).detach().cpu().numpy())
        alive = self.swarm.state.alive
        with rounding():
            reward = result.reward.astype(np.float32)[:, :, None]
        group = {"observation": result.observation, "mask": alive.copy(), "reward": reward}
        return self._tensordict(
            group, result.terminated | ~alive, result.truncated, result.world_terminated, result.world_truncated
        )

    def _tensordict(
        self, group: dict[str, NDArray[Any]], terminated: Bool, truncated: Bool, world_terminated: Bool,
        world_truncated: Bool,
    ) -> TensorDictBase:  # fmt: skip
        """The entries of ``uuv`` as a tensordict, with the endings of vehicles (world, vehicle) and worlds."""
        group |= _endings(terminated, truncated)
        root = {"state": self._batch.state(), **_endings(world_terminated, world_truncated)}
        batch = self.batch_size
        tensordict = TensorDict({key: torch.from_numpy(array) for key, array in root.items()}, batch)
        inner = {key: torch.from_numpy(array) for key, array in group.items()}
        tensordict.set(GROUP, TensorDict(inner, (*batch, self.swarm.num_vehicles)))
        return tensordict.to(self.device)


def _endings(terminated: Bool, truncated: Bool) -> dict[str, Bool]:
    """TorchRL's three flags, with a trailing axis of one."""
    flags = {"done": terminated | truncated, "terminated": terminated, "truncated": truncated}
    return {name: flag[..., None] for name, flag in flags.items()}
