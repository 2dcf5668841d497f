"""``vector_env``: many worlds as a Gymnasium vector environment, a row per world."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from uuv_marl.envs.task import Bool, Float32, Float64, Outcome, Reward, ScenarioLike, Task, TaskBased, make_task
from uuv_marl.envs.view import View

Infos = dict[str, Any]


class SwarmVectorEnv(TaskBased, VectorEnv[Float32, Float32, NDArray[Any]]):
    """Worlds stepped together. See ``vector_env`` for the arguments.

    Observation of shape (num_envs, vehicle, entry), action of shape (num_envs, vehicle, 2), reward the mean over a
    world's vehicles. A world terminates when its swarm arrived or is lost as a whole, is truncated by the time limit,
    and is reset in the same step (``AutoresetMode.SAME_STEP``): its last observation is ``infos["final_obs"][world]``.

    ``infos``, arrays of shape (num_envs, vehicle): ``agent_reward``, ``agent_terminated`` and ``agent_truncated`` of
    this step, and ``agent_mask``, the vehicles that act in the next one. Rows of vehicles lost before are zero.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 - Gymnasium's own form
        "name": "uuv_swarm_v0",
        "autoreset_mode": AutoresetMode.SAME_STEP,
        "render_modes": ["rgb_array"],
        "render_fps": 10,
    }

    def __init__(self, task: Task, render_mode: str | None = None, info_terms: bool = False) -> None:
        self._task = task
        self._view = View(render_mode, self.metadata["render_modes"], self.scenario)
        self._info_terms = info_terms
        self.render_mode = render_mode
        self.metadata = {**self.metadata, "render_fps": self._view.fps}
        self.num_envs = task.swarm.num_worlds
        n, layout = task.swarm.num_vehicles, task.swarm.layout
        self.single_observation_space = Box(np.tile(layout.low, (n, 1)), np.tile(layout.high, (n, 1)))
        self.single_action_space = Box(-1.0, 1.0, (n, 2))
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self.state_space = Box(task.state_layout.low, task.state_layout.high)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Float32, Infos]:
        """Start episodes.

        Args:
            seed: world w starts from ``seed + w``; or a seed (or None) per world; without a seed every world's own
                random stream goes on.
            options: ``{"reset_mask": bool array of shape (num_envs,)}`` resets these worlds only.
        """
        seeds, mask = self._seeds(seed), self._mask(options)
        for chosen, seeded in ((mask & (seeds >= 0), True), (mask & (seeds < 0), False)):
            worlds = np.flatnonzero(chosen).tolist()
            if worlds:
                self._task.reset(seeds[chosen].tolist() if seeded else None, worlds)
        observation = self.swarm.percept.to_observation()
        return observation, _masked({"agent_mask": self.swarm.state.alive.copy()}, mask)

    def step(self, actions: ArrayLike) -> tuple[Float32, Float64, Bool, Bool, Infos]:
        """One decision of every vehicle of every world; worlds that end are reset."""
        outcome = self._task.step(actions)
        infos = self._infos(outcome)
        observation = outcome.observation
        if outcome.over.any():
            infos |= self._final_infos(outcome)
            observation = self._task.reset(worlds=np.flatnonzero(outcome.over).tolist())
            infos["agent_mask"] = self.swarm.state.alive & (outcome.acting | outcome.over[:, None])
        return observation, outcome.world_reward, outcome.world_terminated, outcome.world_truncated, infos

    def _infos(self, outcome: Outcome) -> Infos:
        infos: Infos = {
            "agent_reward": outcome.reward,
            "agent_terminated": outcome.terminated,
            "agent_truncated": outcome.truncated,
            "agent_mask": outcome.acting,
        }
        if self._info_terms:
            infos["reward_terms"] = dict(outcome.terms)
        return _masked(infos, np.ones(self.num_envs, np.bool_))

    def _final_infos(self, outcome: Outcome) -> Infos:
        """What a world ended with, before its reset."""
        over = outcome.over
        final = np.full(self.num_envs, None, dtype=object)
        for world in np.flatnonzero(over):
            final[world] = outcome.observation[world]
        facts = {
            "arrived": self.swarm.arrived & over,
            "time_s": np.where(over, self.swarm.facts.time_s, 0.0),
            "state": self._task.state() * over[:, None],
        }
        return _masked({"final_obs": final, "final_info": _masked(facts, over)}, over)

    def _seeds(self, seed: int | Sequence[int | None] | None) -> NDArray[np.int64]:
        """A seed per world, -1 for none."""
        if seed is None or isinstance(seed, int | np.integer):
            return np.full(self.num_envs, -1) if seed is None else int(seed) + np.arange(self.num_envs)
        if len(seed) != self.num_envs:
            raise ValueError(f"seed must hold one seed for each of {self.num_envs} worlds, got {len(seed)}")
        if any(value is not None and value < 0 for value in seed):
            raise ValueError(f"seed must not be negative, got {list(seed)}")
        return np.array([-1 if value is None else value for value in seed])

    def _mask(self, options: Mapping[str, Any] | None) -> Bool:
        mask = np.asarray((options or {}).get("reset_mask", np.ones(self.num_envs, np.bool_)))
        if mask.shape != (self.num_envs,) or mask.dtype != np.bool_ or not mask.any():
            raise ValueError(
                f"options['reset_mask'] must be a bool array of shape ({self.num_envs},) with at least one True, "
                f"got {mask.dtype} of shape {mask.shape}"
            )
        return mask

    def state(self) -> Float32:
        """The global state for centralised critics, shape (num_envs, entry), see ``uuv_marl.envs.state``."""
        return self._task.state()

    def render(self) -> tuple[Any, ...]:
        """A picture (height, width, 3) of every world."""
        return tuple(self._view.draw(self.swarm, world) for world in range(self.num_envs))

    def close_extras(self, **kwargs: Any) -> None:  # noqa: ARG002 - Gymnasium's signature
        """Nothing shows a window here; frees the canvas."""
        self._view.close()


def _masked(infos: Infos, mask: Bool) -> Infos:
    """Gymnasium's form: every key with a mask of the worlds that have it."""
    return infos | {f"_{key}": mask for key in infos}


def vector_env(
    num_envs: int = 1,
    scenario: ScenarioLike = "single_obstacle",
    num_vehicles: int | None = None,
    max_cycles: int | None = None,
    render_mode: str | None = None,
    *,
    reward: Reward = "individual",
    info_terms: bool = False,
    decision_period: float | None = None,
    overrides: Mapping[str, object] | None = None,
) -> SwarmVectorEnv:
    """A Gymnasium vector environment of ``num_envs`` worlds; the other arguments are those of ``parallel_env``.

    World w of ``reset(seed=s)`` is ``parallel_env().reset(seed=s + w)``, bit for bit, whatever the number of worlds and
    threads. ``reward`` shapes ``infos["agent_reward"]``; the row's own reward is the mean over all vehicles.
    """
    task = make_task(
        scenario,
        num_envs,
        num_vehicles,
        max_cycles,
        reward=reward,
        decision_period=decision_period,
        overrides=overrides,
    )
    return SwarmVectorEnv(task, render_mode, info_terms)
