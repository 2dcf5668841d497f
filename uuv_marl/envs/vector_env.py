"""``vector_env``: many worlds as a Gymnasium vector environment; each row is a world."""

from collections.abc import Mapping
from typing import Any, Unpack

import numpy as np
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from uuv_marl.envs.changes import EnvOptions, ScenarioLike
from uuv_marl.envs.core import BatchedEnv, StepResult, make_batched_env
from uuv_marl.envs.drawing.options import RenderOptions
from uuv_marl.envs.ending import ending
from uuv_marl.envs.mixins import EnvMixin, SpecMixin
from uuv_marl.sim.arguments import SeedLike, world_seeds
from uuv_marl.types import Bool, Float32, Float64

Infos = dict[str, Any]


class SwarmVectorEnv(  # pyright: ignore[reportIncompatibleVariableOverride] - spec is a property
    SpecMixin, EnvMixin, VectorEnv[Float32, Float32, NDArray[Any]]
):
    """Worlds stepped together; ``vector_env`` makes them.

    Observations have shape (num_envs, vehicle, entry), actions (num_envs, vehicle, entry). A reward is the mean over a
    world's vehicles. An episode terminates when the task is done or all vehicles are lost; the time limit truncates it.
    Gymnasium's ``autoreset_mode`` then resets the world:

    * ``SAME_STEP``: in the same step. ``infos["final_obs"][world]`` is the last observation; ``infos["final_info"]``
      holds the ending (``uuv_marl.envs.ending.ending``) and the last ``state``.
    * ``NEXT_STEP``: in the next step, which ignores the world's actions and returns the reward 0.
    * ``DISABLED``: not at all; the world stays as it is, ``terminated`` and ``truncated`` too, until you reset it.

    In the last two modes the last step returns the episode's last observation, and ``infos`` itself holds the ending.
    ``infos`` has arrays of shape (num_envs, vehicle): ``agent_reward``, ``agent_terminated`` and ``agent_truncated`` of
    this step, and ``agent_mask``, the vehicles that act in the next step. Rows of lost vehicles are zero.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 - Gymnasium's own form
        "name": "uuv_swarm_v2",
        "autoreset_mode": AutoresetMode.SAME_STEP,
        "render_modes": ["rgb_array"],
    }
    closed = True  # until it is complete: Gymnasium closes what is deleted

    def __init__(
        self,
        batch: BatchedEnv,
        render_mode: str | None = None,
        info_terms: bool = False,
        autoreset_mode: AutoresetMode | str = AutoresetMode.SAME_STEP,
        render_options: RenderOptions | None = None,
    ) -> None:
        self._wrap(batch, render_mode, render_options)
        self._info_terms = info_terms
        self.autoreset_mode = self.metadata["autoreset_mode"] = _autoreset_mode(autoreset_mode)
        self.num_envs = batch.swarm.num_worlds
        self._due = np.zeros(self.num_envs, np.bool_)
        """Worlds that the next step resets."""
        n, layout = batch.swarm.num_vehicles, batch.layout
        self.single_observation_space = Box(np.tile(layout.low, (n, 1)), np.tile(layout.high, (n, 1)))
        self.single_action_space = Box(-1.0, 1.0, (n, self.scenario.action_size))
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self.state_space = Box(batch.state_layout.low, batch.state_layout.high)
        self.closed = False

    def reset(self, *, seed: SeedLike = None, options: dict[str, Any] | None = None) -> tuple[Float32, Infos]:
        """Start episodes.

        Args:
            seed: with a number, world w starts from ``seed + w``; a list has a seed or None for each world. A world
                without a seed continues its own random stream.
            options: ``{"reset_mask": bool array of shape (num_envs,)}`` resets these worlds only.
        """
        mask = self._mask(options)
        worlds = np.flatnonzero(mask).tolist()
        seeds = world_seeds(seed, range(self.num_envs))
        observation = self._batch.reset([seeds[world] for world in worlds], worlds)
        if seeds[0] is not None:
            super().reset(seed=seeds[0])
        self._due = self._due & ~mask
        self._renderer.update()
        return observation, _masked({"agent_mask": self.swarm.state.alive & ~self._batch.over[:, None]}, mask)

    def step(self, actions: ArrayLike) -> tuple[Float32, Float64, Bool, Bool, Infos]:
        """One decision of every vehicle of every world, shape (num_envs, vehicle, entry), and resets."""
        result, due = self._batch.step(actions), self._due
        if due.any():
            result = result._replace(
                terminated=result.terminated & ~due[:, None],
                truncated=result.truncated & ~due[:, None],
                world_terminated=result.world_terminated & ~due,
                world_truncated=result.world_truncated & ~due,
            )
        observation, over, infos = result.observation, result.over, self._infos(result)
        if over.any():
            infos |= self._endings(observation, over)
        resets = over if self.autoreset_mode is AutoresetMode.SAME_STEP else due
        if self.autoreset_mode is AutoresetMode.NEXT_STEP:
            self._due = over
        if resets.any():
            observation = self._batch.reset(worlds=np.flatnonzero(resets).tolist())
            infos["agent_mask"] = self.swarm.state.alive & (result.acting | resets[:, None])
        self._renderer.update()
        return observation, result.world_reward, result.world_terminated, result.world_truncated, infos

    def _infos(self, result: StepResult) -> Infos:
        infos: Infos = {
            "agent_reward": result.reward,
            "agent_terminated": result.terminated,
            "agent_truncated": result.truncated,
            "agent_mask": result.acting,
        }
        if self._info_terms:
            infos["reward_terms"] = dict(result.terms)
        return _masked(infos, np.ones(self.num_envs, np.bool_))

    def _endings(self, observation: Float32, over: Bool) -> Infos:
        """The endings of worlds, before their reset."""
        infos: Infos = {}
        same_step, state = self.autoreset_mode is AutoresetMode.SAME_STEP, self._batch.state()
        for world in np.flatnonzero(over).tolist():
            info = ending(self._batch, world)
            if same_step:
                info = {"final_obs": observation[world], "final_info": {**info, "state": state[world]}}
            infos = self._add_info(infos, info, world)
        return infos

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
        return self._batch.state()

    def render(self) -> tuple[Any, ...]:
        """A picture (height, width, 3) of every world."""
        self._batch.check_reset("render()")
        return tuple(self._renderer.draw(world) for world in range(self.num_envs))


def _autoreset_mode(mode_name: AutoresetMode | str) -> AutoresetMode:
    """The mode of this name or value."""
    match = next((mode for mode in AutoresetMode if mode_name in (mode, mode.value, mode.name)), None)
    if match is None:
        known = ", ".join(repr(mode.value) for mode in AutoresetMode)
        raise ValueError(f"autoreset_mode must be one of {known}, got {mode_name!r}")
    return match


def _masked(infos: Infos, mask: Bool) -> Infos:
    """The infos in Gymnasium's form: every key with a mask of the worlds that have it."""
    return infos | {f"_{key}": mask.copy() for key in infos}


def vector_env(
    num_envs: int = 1,
    scenario: ScenarioLike = "single_obstacle",
    *,
    render_mode: str | None = None,
    render_options: RenderOptions | None = None,
    info_terms: bool = False,
    autoreset_mode: AutoresetMode | str = AutoresetMode.SAME_STEP,
    **options: Unpack[EnvOptions],
) -> SwarmVectorEnv:
    """A Gymnasium vector environment of ``num_envs`` worlds.

    World w of ``reset(seed=s)`` is ``parallel_env().reset(seed=s + w)``, bit for bit, for any number of worlds.

    Args:
        num_envs: worlds stepped together.
        scenario: a name, a TOML file or a ``Scenario``.
        render_mode: ``rgb_array`` or None.
        render_options: as for ``uuv_marl.parallel_env``.
        info_terms: put the reward's terms into the infos.
        autoreset_mode: ``SAME_STEP``, ``NEXT_STEP`` or ``DISABLED`` of Gymnasium's ``AutoresetMode``, or its name; see
            ``SwarmVectorEnv``.
        options: the other arguments of ``uuv_marl.parallel_env``, such as ``for_policy``. ``infos["agent_reward"]`` is
            the ``reward`` of each vehicle; a row's is the mean over all vehicles, with ``team`` that of ``dense``.
    """
    batch = make_batched_env(scenario, num_envs, number="num_envs", keep_terms=info_terms, **options)
    return SwarmVectorEnv(batch, render_mode, info_terms, autoreset_mode, render_options)
