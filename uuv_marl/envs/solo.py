"""``SoloEnv``: one learner among vehicles that follow a policy, a plain Gymnasium environment."""

from collections.abc import Mapping
from typing import Any, Unpack

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from numpy.typing import ArrayLike

from uuv_marl.baselines import make_policy
from uuv_marl.baselines.team_names import PolicyLike
from uuv_marl.envs.changes import EnvOptions, ScenarioLike
from uuv_marl.envs.core import StepResult, make_batched_env
from uuv_marl.envs.drawing.options import RenderOptions
from uuv_marl.envs.ending import ending
from uuv_marl.envs.mixins import RenderMixin, SpecMixin
from uuv_marl.sim.arguments import action_array, rounding, whole_number, world_seeds
from uuv_marl.types import Float32


class SoloEnv(  # pyright: ignore[reportIncompatibleVariableOverride] - spec is a property
    SpecMixin, RenderMixin, gymnasium.Env[Float32, Float32]
):
    """The learner, vehicle 0 or that of ``reset``'s options, acts by ``step``; all others run the policy ``others``.

    Observation, action and reward are those of one agent of ``parallel_env``. The episode terminates when the task
    is done or the learner is lost, and is truncated by the time limit; others may be lost before. Every info holds the
    state of the episode (``uuv_marl.envs.ending.ending``), so that a wrapper may end it.

    Args:
        others: name of a policy, ``module:Class``, or a team (``uuv_marl.make_policy``) in which the learner
            acts by ``step`` instead. The scenario gets its requirements
            (``uuv_marl.with_policy_requirements``), also for the learner: ``sdc`` makes observations longer.
        render_mode: ``human``, ``rgb_array`` or None.
        render_options: as for ``uuv_marl.parallel_env``; ``sonar_of`` is the learner by default.
        info_terms: whether the info holds the reward's terms.
        scenario: a name, a TOML file or a ``Scenario``.
        options: the other arguments of ``uuv_marl.parallel_env`` but ``for_policy``.

    Raises:
        ScenarioError: a change contradicts a requirement of ``others``.
    """

    metadata: dict[str, Any] = {"render_modes": ["human", "rgb_array"], "render_fps": 10}  # noqa: RUF012

    def __init__(
        self,
        scenario: ScenarioLike = "single_obstacle",
        others: PolicyLike = "bio_inspired",
        *,
        render_mode: str | None = None,
        render_options: RenderOptions | None = None,
        info_terms: bool = False,
        **options: Unpack[EnvOptions],
    ) -> None:
        if not isinstance(others, str | Mapping):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise TypeError(f"others must be the name of a policy, or module:Class, got {others!r}")
        if "for_policy" in options:
            raise TypeError(f"SoloEnv takes no for_policy: the scenario suits others={others!r}; leave it out")
        options["for_policy"] = others
        batch = make_batched_env(scenario, keep_terms=info_terms, **options)
        self._wrap(batch, render_mode, render_options, sonar_of=0)
        self._others = make_policy(others, self.scenario)
        self._info_terms = info_terms
        layout = batch.layout
        self.observation_space = Box(layout.low, layout.high)
        self.action_space = Box(-1.0, 1.0, (self.scenario.action_size,))
        self.learner = 0
        """Index of the learner in the present episode."""
        self._running = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Float32, dict[str, Any]]:
        """Start an episode: with a seed that of ``parallel_env``, without one the random stream continues.

        ``options={"vehicle": i}`` makes vehicle i the learner of this episode. Raises ValueError if it does not exist.
        """
        (own,) = world_seeds(seed, [0])
        learner = whole_number("options['vehicle']", (options or {}).get("vehicle", 0), 0)
        if learner >= self.swarm.num_vehicles:
            raise ValueError(f"options['vehicle'] must be 0 to {self.swarm.num_vehicles - 1}, got {learner}")
        self.learner = learner
        super().reset(seed=own, options=options)
        observation = self._batch.reset(own)
        self._renderer.update()
        self._running = True
        return observation[0, learner], ending(self._batch, 0, learner)

    def step(self, action: ArrayLike) -> tuple[Float32, float, bool, bool, dict[str, Any]]:
        """One decision of the learner and of all others. Raises RuntimeError before a reset and after the end."""
        if not self._running:
            raise RuntimeError("no episode is running; call reset() to start one")
        own = action_array(action, (self.scenario.action_size,), "the action")
        if not np.isfinite(own).all():
            raise ValueError(f"the action must be finite, got {own.tolist()}")
        with rounding():
            actions = np.array(self._others.act(self.swarm.percept), np.float32)
        mine = 0, self.learner
        actions[mine] = own
        result = self._batch.step(actions)
        self._running = bool(result.acting[mine])
        self._renderer.update()
        return (
            result.observation[mine],
            float(result.reward[mine]),
            bool(result.terminated[mine]),
            bool(result.truncated[mine]),
            self._info(result),
        )

    def _info(self, result: StepResult) -> dict[str, Any]:
        info = ending(self._batch, 0, self.learner)
        if self._info_terms:
            info["reward_terms"] = {name: float(term[0, self.learner]) for name, term in result.terms.items()}
        return info
