"""``SoloEnv``: one learner among vehicles that follow a policy, a plain Gymnasium environment."""

from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from numpy.typing import ArrayLike, NDArray

from uuv_marl.baselines import granted, make
from uuv_marl.envs.task import Float32, Outcome, Reward, ScenarioLike, TaskBased, make_task, with_period
from uuv_marl.envs.view import View
from uuv_marl.scenario_files import load_scenario


class SoloEnv(TaskBased, gymnasium.Env[Float32, Float32]):
    """The learner is vehicle 0 and acts by ``step``; all others run the policy ``others``.

    Observation, action and reward are those of one agent of ``parallel_env``. The episode terminates when the swarm
    arrives or the learner is lost, and is truncated by the time limit; others may be lost on the way.

    Args:
        others: name of a policy, or ``module:Class``. The scenario gets the channels and the inner loop that it
            declares (``uuv_marl.baselines.granted``), for the learner too: with ``sdc`` the observation is longer.
        render_mode: ``human``, ``rgb_array`` or None.
        info_terms: put the reward's terms into the info.
        scenario, num_vehicles, max_cycles, reward, decision_period, overrides: as for ``uuv_marl.parallel_env``.
    """

    metadata: dict[str, Any] = {"render_modes": ["human", "rgb_array"], "render_fps": 10}  # noqa: RUF012

    def __init__(
        self,
        scenario: ScenarioLike = "single_obstacle",
        others: str = "bio_inspired",
        num_vehicles: int | None = None,
        max_cycles: int | None = None,
        render_mode: str | None = None,
        *,
        reward: Reward = "individual",
        info_terms: bool = False,
        decision_period: float | None = None,
        overrides: Mapping[str, object] | None = None,
    ) -> None:
        changes = with_period(overrides, decision_period)
        suited = granted(others, load_scenario(scenario, num_vehicles=num_vehicles, overrides=changes))
        self._task = make_task(suited, max_cycles=max_cycles, reward=reward)
        self._others = make(others, self.scenario)
        self._view = View(render_mode, self.metadata["render_modes"], self.scenario)
        self._info_terms = info_terms
        self.render_mode = render_mode
        self.metadata = {**self.metadata, "render_fps": self._view.fps}
        layout = self.swarm.layout
        self.observation_space = Box(layout.low, layout.high)
        self.action_space = Box(-1.0, 1.0, (2,))
        self._running = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Float32, dict[str, Any]]:
        """Start an episode: with a seed that of ``parallel_env``, without one its random stream goes on."""
        super().reset(seed=seed, options=options)
        observation = self._task.reset(seed)
        # Policies that draw follow the world's seed, and go on from the environment's stream where there is none.
        self._others.reset(int(self.np_random.integers(2**31)) if seed is None else seed)
        self._view.update(self.swarm)
        self._running = True
        return observation[0, 0], {}

    def step(self, action: ArrayLike) -> tuple[Float32, float, bool, bool, dict[str, Any]]:
        """One decision of the learner and of all others. Raises RuntimeError before a reset and after the end."""
        if not self._running:
            raise RuntimeError("there is no episode to step; call reset() to start one")
        own = np.asarray(action, np.float32)
        if own.shape != (2,) or not np.isfinite(own).all():
            raise ValueError(f"the action must be finite and of shape (2,), got {own.tolist()}")
        actions = self._others.act(self.swarm.percept)
        actions[0, 0] = own
        outcome = self._task.step(actions)
        self._running = bool(outcome.acting[0, 0])
        self._view.update(self.swarm)
        return (
            outcome.observation[0, 0],
            float(outcome.reward[0, 0]),
            bool(outcome.terminated[0, 0]),
            bool(outcome.truncated[0, 0]),
            self._info(outcome),
        )

    def _info(self, outcome: Outcome) -> dict[str, Any]:
        if not self._info_terms:
            return {}
        return {"reward_terms": {name: float(term[0, 0]) for name, term in outcome.terms.items()}}

    def render(self) -> NDArray[np.uint8] | None:
        """A picture (height, width, 3) in mode ``rgb_array``; None in mode ``human``, which shows a window."""
        self._task.need_reset("render()")
        return self._view.draw(self.swarm)

    def close(self) -> None:
        """Close the window, if there is one."""
        self._view.close()
