"""``SwarmVecEnv``: worlds as a Stable-Baselines3 ``VecEnv``, a row per vehicle, for one policy that all share."""

import time
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium.spaces import Box
from numpy.typing import NDArray

from uuv_marl.envs.task import Float32, Outcome, Reward, ScenarioLike, TaskBased, make_task, refuse_losses
from uuv_marl.envs.view import View
from uuv_marl.extras import extra

with extra("train", "SwarmVecEnv"):
    from stable_baselines3.common.vec_env.base_vec_env import VecEnv

Indices = None | int | Iterable[int]


class SwarmVecEnv(TaskBased, VecEnv):
    """``num_worlds`` x vehicles rows; row ``world * vehicles + i`` is vehicle i of a world.

    Observation and action are those of an agent of ``parallel_env``, rewards float32. When a world's episode ends it is
    reset in the same step, all its rows at once: ``infos[row]`` then holds ``terminal_observation``,
    ``TimeLimit.truncated``, ``is_success`` (the swarm arrived) and ``episode`` (return ``r``, length ``l``, its own
    seconds ``t``). Scenarios in which a vehicle can be lost are refused: SB3 has no row that ends and waits.

    Args:
        num_worlds: worlds stepped together.
        render_mode: ``rgb_array`` or None; the picture tiles all worlds.
        scenario, num_vehicles, max_cycles, reward, decision_period, overrides: as for ``uuv_marl.parallel_env``.
    """

    def __init__(
        self,
        num_worlds: int = 1,
        scenario: ScenarioLike = "single_obstacle",
        num_vehicles: int | None = None,
        max_cycles: int | None = None,
        render_mode: str | None = None,
        *,
        reward: Reward = "individual",
        decision_period: float | None = None,
        overrides: Mapping[str, object] | None = None,
    ) -> None:
        self._task = make_task(
            scenario, num_worlds, num_vehicles, max_cycles, reward=reward, decision_period=decision_period,
            overrides=overrides,
        )  # fmt: skip
        refuse_losses(self.scenario, "SwarmVecEnv")
        self._view = View(render_mode, ["rgb_array"], self.scenario)
        self.render_mode = render_mode
        self._shape = (num_worlds, self.swarm.num_vehicles)
        layout = self.swarm.layout
        super().__init__(
            num_worlds * self.swarm.num_vehicles, Box(layout.low, layout.high), Box(-1.0, 1.0, (2,), np.float32)
        )
        self.metadata: dict[str, Any] = {**self.metadata, "render_fps": self._view.fps}
        self._seed: int | None = None
        self._returns = np.zeros(self._shape)
        self._lengths = np.zeros(num_worlds, np.int64)
        self._starts = np.full(num_worlds, time.perf_counter())

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """For the next reset: world w starts from ``seed + w``. Returns the seed of every row's world."""
        drawn = int(np.random.default_rng().integers(2**31)) if seed is None else int(seed)
        self._seed = drawn
        return [drawn + world for world in range(self._shape[0]) for _ in range(self._shape[1])]

    def reset(self) -> Float32:
        """Start all worlds; without ``seed`` before it their random streams go on. Shape (row, entry)."""
        observation = self._task.reset(self._seed)
        self._seed = None
        self._forget(np.ones(self._shape[0], np.bool_))
        self.reset_infos = [{} for _ in range(self.num_envs)]
        return observation.reshape(self.num_envs, -1)

    def step_async(self, actions: NDArray[Any]) -> None:
        """Keep the actions, shape (row, 2), for ``step_wait``."""
        rows = np.asarray(actions, np.float32)
        if rows.shape != (self.num_envs, 2):
            raise ValueError(f"actions must have shape {(self.num_envs, 2)}, a row per vehicle, got {rows.shape}")
        self._actions = rows.reshape(*self._shape, 2)

    def step_wait(self) -> tuple[Float32, Float32, NDArray[np.bool_], list[dict[str, Any]]]:
        """Observations, rewards, dones and infos of every row."""
        outcome = self._task.step(self._actions)
        self._returns += outcome.reward
        self._lengths += 1
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        observation, over = outcome.observation, outcome.over
        if over.any():
            worlds = np.flatnonzero(over).tolist()
            for world in worlds:
                self._end(world, outcome, infos)
            observation = self._task.reset(worlds=worlds)
            self._forget(over)
        return (
            observation.reshape(self.num_envs, -1),
            outcome.reward.astype(np.float32).reshape(-1),
            np.repeat(over, self._shape[1]),
            infos,
        )

    def _end(self, world: int, outcome: Outcome, infos: list[dict[str, Any]]) -> None:
        """Write what SB3 wants to know of an ended world into the infos of its rows."""
        seconds = round(time.perf_counter() - self._starts[world], 6)
        for i in range(self._shape[1]):
            infos[world * self._shape[1] + i] = {
                "terminal_observation": outcome.observation[world, i],
                "TimeLimit.truncated": bool(outcome.world_truncated[world]),
                "is_success": bool(outcome.world_terminated[world]),
                "episode": {"r": float(self._returns[world, i]), "l": int(self._lengths[world]), "t": seconds},
            }

    def _forget(self, worlds: NDArray[np.bool_]) -> None:
        self._returns[worlds], self._lengths[worlds], self._starts[worlds] = 0.0, 0, time.perf_counter()

    def snapshot(self) -> dict[str, NDArray[Any]]:
        """All that later steps depend on, random streams too, copied, for ``restore``."""
        kept = {"returns": self._returns.copy(), "lengths": self._lengths.copy()}
        return kept | self.swarm.snapshot()

    def restore(self, snapshot: Mapping[str, NDArray[Any]]) -> Float32:
        """Go on from a snapshot of an environment made alike; the observations of all rows."""
        self._task.reset()  # ready, and no world at its end: those are reset in the step in which they end
        self.swarm.restore(snapshot)
        self._returns[...], self._lengths[...] = snapshot["returns"], snapshot["lengths"]
        return self.swarm.percept.to_observation().reshape(self.num_envs, -1)

    def get_images(self) -> Sequence[NDArray[np.uint8] | None]:
        """A picture of every world."""
        self._task.need_reset("render()")
        return [self._view.draw(self.swarm, world) for world in range(self._shape[0])]

    def close(self) -> None:
        """Free the canvas."""
        self._view.close()

    def get_attr(self, attr_name: str, indices: Indices = None) -> list[Any]:
        """The attribute of this object, once per row: rows share it."""
        return [getattr(self, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Indices = None) -> None:
        """Not possible: a row has no environment of its own."""
        raise NotImplementedError(f"rows are vehicles of shared worlds; set {attr_name!r} when you make SwarmVecEnv")

    def env_method(
        self,
        method_name: str,
        *method_args: Any,
        indices: Indices = None,
        **method_kwargs: Any,
    ) -> list[Any]:
        """Not possible: a row has no environment of its own."""
        raise NotImplementedError(f"rows are vehicles of shared worlds; call {method_name!r} of SwarmVecEnv's swarm")

    def env_is_wrapped(self, wrapper_class: type[Any], indices: Indices = None) -> list[bool]:  # noqa: ARG002
        """False for every row."""
        return [False for _ in self._get_indices(indices)]
