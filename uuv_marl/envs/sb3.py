"""``SwarmVecEnv``: worlds as a Stable-Baselines3 ``VecEnv``, a row per vehicle, for one policy that all share."""

import time
from collections.abc import Iterable, Sequence
from typing import Any, Unpack

import numpy as np
from gymnasium.spaces import Box
from numpy.typing import NDArray

from uuv_marl.envs.changes import EnvOptions, ScenarioLike
from uuv_marl.envs.core import StepResult, make_batched_env, refuse_losses
from uuv_marl.envs.drawing.options import RenderOptions
from uuv_marl.envs.ending import ending, succeeded
from uuv_marl.envs.mixins import EnvMixin
from uuv_marl.extras import extra
from uuv_marl.sim.arguments import action_array, rounding, whole_number
from uuv_marl.types import Bool, Float32

with extra("sb3", "SwarmVecEnv"):
    from stable_baselines3.common.monitor import Monitor
    from stable_baselines3.common.vec_env.base_vec_env import VecEnv

Indices = None | int | Iterable[int]

WORLDS = 8
"""Worlds by default: SB3's default PPO, which updates every 2,048 steps, learns ``starter`` in 12 updates."""


class SwarmVecEnv(EnvMixin, VecEnv):
    """``num_worlds`` x vehicles rows; row ``world * vehicles + i`` is vehicle i of a world.

    Observation and action are those of an agent of ``parallel_env``, rewards float32. When an episode ends, all rows of
    its world are reset in the same step, and ``infos[row]`` holds ``terminal_observation``, ``TimeLimit.truncated``,
    ``episode`` (return ``r``, length ``l``, seconds ``t``) and the ending (``uuv_marl.envs.ending.ending``). A scenario
    in which a vehicle can be lost is an error: SB3 has no row that ends before its world.

    Args:
        scenario: a name, a TOML file or a ``Scenario``.
        num_worlds: worlds stepped together.
        render_mode: ``rgb_array`` or None; the picture tiles all worlds.
        render_options: as for ``uuv_marl.parallel_env``.
        options: the other arguments of ``uuv_marl.parallel_env``, such as ``reward`` and ``for_policy``.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"]}  # noqa: RUF012 - SB3's own form

    def __init__(
        self,
        scenario: ScenarioLike = "single_obstacle",
        num_worlds: int = WORLDS,
        *,
        render_mode: str | None = None,
        render_options: RenderOptions | None = None,
        **options: Unpack[EnvOptions],
    ) -> None:
        batch = make_batched_env(scenario, num_worlds, keep_terms=False, **options)
        self._wrap(batch, render_mode, render_options)
        refuse_losses(self.scenario, "SwarmVecEnv")
        self._shape = (num_worlds, self.swarm.num_vehicles)
        layout, acts = batch.layout, Box(-1.0, 1.0, (self.scenario.action_size,), np.float32)
        super().__init__(num_worlds * self.swarm.num_vehicles, Box(layout.low, layout.high), acts)
        self.metadata = {**self.metadata, "render_fps": self._renderer.fps}  # SB3 has just written its own
        self._seed: int | None = None
        self._actions: Float32 | None = None
        self._returns = np.zeros(self._shape)
        self._lengths = np.zeros(num_worlds, np.int64)
        self._starts = np.full(num_worlds, time.perf_counter())

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Set the seeds of the next reset, ``seed + w`` for world w; returns the seed of every row's world."""
        drawn = int(np.random.default_rng().integers(2**31)) if seed is None else whole_number("seed", seed, 0)
        self._seed = drawn
        return [drawn + world for world in range(self._shape[0]) for _ in range(self._shape[1])]

    def reset(self) -> Float32:
        """Start all worlds; returns observations (row, entry). Without ``seed`` their random streams continue."""
        observation = self._batch.reset(self._seed)
        self._seed = self._actions = None
        self._forget(np.ones(self._shape[0], np.bool_))
        self._renderer.update()
        self.reset_infos = [{} for _ in range(self.num_envs)]
        return observation.reshape(self.num_envs, -1)

    def step_async(self, actions: NDArray[Any]) -> None:
        """Keep the actions, shape (row, entry), for ``step_wait``."""
        rows = action_array(actions, (self.num_envs, self.scenario.action_size), "actions, a row per vehicle,")
        self._actions = rows.reshape(*self._shape, -1)

    def step_wait(self) -> tuple[Float32, Float32, Bool, list[dict[str, Any]]]:
        """Observations, rewards, dones and infos of every row."""
        if self._actions is None:
            raise RuntimeError("step_wait was called before step_async; call step(actions)")
        actions, self._actions = self._actions, None
        result = self._batch.step(actions)
        self._returns += result.reward
        self._lengths += 1
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        observation, over = result.observation, result.over
        if over.any():
            worlds = np.flatnonzero(over).tolist()
            for world in worlds:
                self._end(world, result, infos)
            observation = self._batch.reset(worlds=worlds)
            self._forget(over)
        self._renderer.update()
        with rounding():
            reward = result.reward.astype(np.float32).reshape(-1)
        return (observation.reshape(self.num_envs, -1), reward, np.repeat(over, self._shape[1]), infos)

    def _end(self, world: int, result: StepResult, infos: list[dict[str, Any]]) -> None:
        """Write SB3's entries for a world whose episode ended into the infos of its rows."""
        seconds = round(time.perf_counter() - self._starts[world], 6)
        shared = {**ending(self._batch, world), "TimeLimit.truncated": bool(result.world_truncated[world])}
        for i in range(self._shape[1]):
            infos[world * self._shape[1] + i] = {
                "terminal_observation": result.observation[world, i],
                **shared,
                "is_success": succeeded(self._batch, world, i),
                "episode": {"r": float(self._returns[world, i]), "l": int(self._lengths[world]), "t": seconds},
            }

    def _forget(self, worlds: Bool) -> None:
        self._returns[worlds], self._lengths[worlds], self._starts[worlds] = 0.0, 0, time.perf_counter()

    def get_attr(self, attr_name: str, indices: Indices = None) -> list[Any]:
        """The attribute of this object, once per row."""
        return [getattr(self, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Indices = None) -> None:
        """Not possible: a row has no environment of its own."""
        raise NotImplementedError(f"rows share worlds; set {attr_name!r} when you make the environment")

    def set_options(self, options: list[dict[str, Any]] | dict[str, Any] | None = None) -> None:
        """Not possible: a reset has no options."""
        if options:
            raise NotImplementedError(f"a reset has no options, got {options}; set them when you make the environment")

    def env_method(
        self, method_name: str, *method_args: Any, indices: Indices = None, **method_kwargs: Any
    ) -> list[Any]:
        """Not possible: a row has no environment of its own."""
        raise NotImplementedError(f"rows share worlds; call {method_name!r} of the environment itself")

    def env_is_wrapped(self, wrapper_class: type[Any], indices: Indices = None) -> list[bool]:
        """True for SB3's ``Monitor``, whose entry ``episode`` the infos have."""
        return [wrapper_class is Monitor for _ in self._get_indices(indices)]

    def get_images(self) -> Sequence[NDArray[np.uint8] | None]:
        """A picture of every world."""
        self._batch.check_reset("render()")
        return [self._renderer.draw(world) for world in range(self._shape[0])]

    def close(self) -> None:
        """Nothing to close."""
