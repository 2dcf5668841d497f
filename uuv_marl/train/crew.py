"""``Crew``: swarms of different sizes as one Stable-Baselines3 ``VecEnv``, seen through the learned policies' eyes."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium.spaces import Box
from numpy.typing import NDArray
from stable_baselines3.common.vec_env.base_vec_env import VecEnv

from uuv_marl.baselines.learned import BARRIER, MOST_BARRIER, Eyes
from uuv_marl.envs.sb3 import Indices, SwarmVecEnv
from uuv_marl.envs.task import RewardFunction
from uuv_marl.percept import Percept
from uuv_marl.scenario import Scenario
from uuv_marl.sim.swarm import Swarm
from uuv_marl.train.fleet import Episodes

Float32 = NDArray[np.float32]
Float64 = NDArray[np.float64]


class Crew(VecEnv):
    """Rows of several ``SwarmVecEnv``, one after the other.

    A row sees the actor's features, and its action is what is added to the barrier [full force], as in
    ``uuv_marl.train.fleet``.

    Args:
        scenario: what to simulate.
        sizes: number of vehicles and of worlds of each.
        reward: from a swarm after a step.
    """

    def __init__(self, scenario: Scenario, sizes: Sequence[tuple[int, int]], reward: RewardFunction) -> None:
        self._reward = reward
        self._envs = [SwarmVecEnv(worlds, scenario, num_vehicles=n, reward=self._pay) for n, worlds in sizes]
        self._eyes = Eyes(scenario, BARRIER)
        self._ends = np.cumsum([env.num_envs for env in self._envs])
        rows = int(self._ends[-1])
        self._barrier = np.zeros((rows, 2), np.float32)
        self.seen = np.zeros((rows, self._eyes.size), np.float32)
        """What every row sees now."""
        self.episodes = Episodes()
        self.paid = 0.0
        """Mean reward of the rows, summed over the steps so far."""
        self.render_mode = None
        size = (self._eyes.size,)
        super().__init__(rows, Box(-np.inf, np.inf, size), Box(-MOST_BARRIER, MOST_BARRIER, (2,), np.float32))

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """For the next reset: worlds are counted on through all swarms, and world w starts from ``seed + w``."""
        seeds: list[int | None] = []
        first = int(np.random.default_rng().integers(2**31)) if seed is None else seed
        for env in self._envs:
            seeds += env.seed(first)
            first += env.swarm.num_worlds
        return seeds

    def reset(self) -> Float32:
        """Start all worlds; shape (row, feature)."""
        for k, env in enumerate(self._envs):
            self._look(k, env.reset())
        self.reset_infos = [{} for _ in range(self.num_envs)]
        return self.seen.copy()

    def step_async(self, actions: NDArray[Any]) -> None:
        """Keep the actions, shape (row, 2), for ``step_wait``."""
        for k, env in enumerate(self._envs):
            rows = self._rows(k)
            env.step_async(np.asarray(actions[rows], np.float32) + self._barrier[rows])

    def step_wait(self) -> tuple[Float32, Float32, NDArray[np.bool_], list[dict[str, Any]]]:
        """Features, rewards, dones and infos of every row."""
        rewards, dones, infos = np.zeros(self.num_envs, np.float32), np.zeros(self.num_envs, np.bool_), []
        for k, env in enumerate(self._envs):
            rows = self._rows(k)
            observation, rewards[rows], dones[rows], told = env.step_wait()
            self._look(k, observation)
            self._finish(env, np.flatnonzero(dones[rows]), told)
            infos += told
        self.paid += float(rewards.mean())
        return self.seen.copy(), rewards, dones, infos

    def _pay(self, swarm: Swarm) -> Float64:
        self.episodes = self.episodes._replace(collisions=self.episodes.collisions + int(swarm.facts.collisions.sum()))
        return self._reward(swarm)

    def _rows(self, k: int) -> slice:
        return slice(int(self._ends[k - 1]) if k else 0, int(self._ends[k]))

    def _look(self, k: int, observation: Float32) -> None:
        rows = self._rows(k)
        self._features(self._envs[k], observation, self.seen[rows], self._barrier[rows])

    def _features(self, env: SwarmVecEnv, observation: Float32, seen: Float32, barrier: Float32) -> None:
        percept = Percept.from_observation(observation[None], env.swarm.layout)
        self._eyes.look(percept.flat, seen[None], barrier[None], np.zeros(1, np.int64))

    def _finish(self, env: SwarmVecEnv, rows: NDArray[np.integer], infos: Sequence[dict[str, Any]]) -> None:
        """Translate the last observations of the rows whose episodes ended, and count these."""
        if not len(rows):
            return
        last = np.stack([infos[row]["terminal_observation"] for row in rows])
        seen, barrier = np.empty((len(rows), self._eyes.size), np.float32), np.empty((len(rows), 2), np.float32)
        self._features(env, last, seen, barrier)
        for row, features in zip(rows, seen, strict=True):
            infos[row]["terminal_observation"] = features
        n = env.swarm.num_vehicles
        firsts = [infos[row] for row in rows[::n]]
        returns = sum(infos[row]["episode"]["r"] for row in rows) / n
        self.episodes = Episodes(
            self.episodes.number + len(firsts),
            self.episodes.arrived + sum(info["is_success"] for info in firsts),
            self.episodes.collisions,
            self.episodes.returns + returns,
            self.episodes.decisions + sum(info["episode"]["l"] for info in firsts),
        )

    def snapshot(self) -> dict[str, NDArray[Any]]:
        """All that later steps depend on, for ``restore``."""
        kept: dict[str, NDArray[Any]] = {"episodes": np.array(self.episodes, np.float64)}
        return kept | {f"{k}.{key}": v for k, env in enumerate(self._envs) for key, v in env.snapshot().items()}

    def restore(self, snapshot: Mapping[str, NDArray[Any]]) -> None:
        """Go on from a snapshot of a crew of the same sizes."""
        for k, env in enumerate(self._envs):
            own = {name.split(".")[1]: array for name, array in snapshot.items() if name.startswith(f"{k}.")}
            self._look(k, env.restore(own))
        self.episodes = Episodes.unpacked(snapshot["episodes"])

    def close(self) -> None:
        """Nothing is open."""

    def get_attr(self, attr_name: str, indices: Indices = None) -> list[Any]:
        """The attribute of this object, once per row: rows share it."""
        return [getattr(self, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Indices = None) -> None:
        """Not possible: a row has no environment of its own."""
        raise NotImplementedError

    def env_method(
        self, method_name: str, *method_args: Any, indices: Indices = None, **method_kwargs: Any
    ) -> list[Any]:
        """Not possible: a row has no environment of its own."""
        raise NotImplementedError

    def env_is_wrapped(self, wrapper_class: type[Any], indices: Indices = None) -> list[bool]:  # noqa: ARG002
        """False for every row."""
        return [False for _ in self._get_indices(indices)]
