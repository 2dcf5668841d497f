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
    With ``AutoresetMode.DISABLED`` it stays as it is until you reset it.

    ``infos``, arrays of shape (num_envs, vehicle): ``agent_reward``, ``agent_terminated`` and ``agent_truncated`` of
    this step, and ``agent_mask``, the vehicles that act in the next one. Rows of vehicles lost before are zero.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 - Gymnasium's own form
        "name": "uuv_swarm_v0",
        "autoreset_mode": AutoresetMode.SAME_STEP,
        "render_modes": ["rgb_array"],
        "render_fps": 10,
    }
    closed = True  # until it is complete: Gymnasium closes what is dropped

    def __init__(
        self,
        task: Task,
        render_mode: str | None = None,
        info_terms: bool = False,
        autoreset_mode: AutoresetMode | str = AutoresetMode.SAME_STEP,
    ) -> None:
        self._resets = AutoresetMode(autoreset_mode)
        if self._resets is AutoresetMode.NEXT_STEP:
            raise ValueError("autoreset_mode must be SAME_STEP or DISABLED, got NEXT_STEP: it would waste a step")
        self._task = task
        self._view = View(render_mode, self.metadata["render_modes"], self.scenario)
        self._info_terms = info_terms
        self.render_mode = render_mode
        self.metadata = {**self.metadata, "render_fps": self._view.fps, "autoreset_mode": self._resets}
        self.num_envs = task.swarm.num_worlds
        n, layout = task.swarm.num_vehicles, task.swarm.layout
        self.single_observation_space = Box(np.tile(layout.low, (n, 1)), np.tile(layout.high, (n, 1)))
        self.single_action_space = Box(-1.0, 1.0, (n, 2))
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self.state_space = Box(task.state_layout.low, task.state_layout.high)
        self.closed = False

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
        mask = self._mask(options)
        worlds = np.flatnonzero(mask).tolist()
        if seed is None or isinstance(seed, int | np.integer):
            observation = self._task.reset(seed, worlds)
            super().reset(seed=None if seed is None else int(seed))
        elif len(seed) != self.num_envs:
            raise ValueError(f"seed must hold one seed for each of {self.num_envs} worlds, got {len(seed)}")
        else:
            observation = self._task.reset([seed[world] for world in worlds], worlds)
        return observation, _masked({"agent_mask": self.swarm.state.alive.copy()}, mask)

    def step(self, actions: ArrayLike) -> tuple[Float32, Float64, Bool, Bool, Infos]:
        """One decision of every vehicle of every world; worlds that end are reset."""
        outcome = self._task.step(actions)
        infos = self._infos(outcome)
        observation = outcome.observation
        if outcome.over.any() and self._resets is AutoresetMode.SAME_STEP:
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
        self._task.need_reset("render()")
        return tuple(self._view.draw(self.swarm, world) for world in range(self.num_envs))

    def close_extras(self, **kwargs: Any) -> None:  # noqa: ARG002 - Gymnasium's signature
        """Nothing shows a window here; frees the canvas."""
        self._view.close()


def _masked(infos: Infos, mask: Bool) -> Infos:
    """Gymnasium's form: every key with a mask of the worlds that have it."""
    return infos | {f"_{key}": mask.copy() for key in infos}


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
    autoreset_mode: AutoresetMode | str = AutoresetMode.SAME_STEP,
) -> SwarmVectorEnv:
    """A Gymnasium vector environment of ``num_envs`` worlds; the other arguments are those of ``parallel_env``.

    World w of ``reset(seed=s)`` is ``parallel_env().reset(seed=s + w)``, bit for bit, whatever the number of worlds and
    threads. ``reward`` shapes ``infos["agent_reward"]``; the row's own reward is the mean over all vehicles.
    ``autoreset_mode`` is ``SAME_STEP``, or ``DISABLED`` for those who reset by ``options={"reset_mask": ...}``.
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
    return SwarmVectorEnv(task, render_mode, info_terms, autoreset_mode)
