"""What every environment API shares: a swarm, its reward and its endings, as arrays over worlds and vehicles."""

from collections.abc import Mapping, Sequence
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from uuv_marl.envs.reward import RewardFunction, reward_terms
from uuv_marl.scenario import Scenario
from uuv_marl.sim.swarm import Swarm

Float32 = NDArray[np.float32]
Float64 = NDArray[np.float64]
Bool = NDArray[np.bool_]
Reward = Literal["individual", "team"] | RewardFunction


class Outcome(NamedTuple):
    """One step of every world. Arrays of shape (world, vehicle, ...)."""

    observation: Float32
    reward: Float64
    terminated: Bool
    """The swarm arrived, or the vehicle was lost in this step."""
    truncated: Bool
    """The time limit, for vehicles that are not lost."""
    terms: Mapping[str, Float64]
    """The reward's terms; empty for a user's own reward."""


class Task:
    """A swarm with the reward and the endings of the environment's contract.

    Args:
        scenario: what to simulate.
        num_worlds: worlds stepped together.
        reward: ``individual`` (the sum of a vehicle's terms), ``team`` (their mean over all vehicles, for each; a lost
            vehicle is also charged its own loss whole), or a function from the swarm to an array (world, vehicle).
        max_cycles: truncates after so many decisions, if the scenario's time limit does not come first.
    """

    def __init__(
        self, scenario: Scenario, num_worlds: int = 1, reward: Reward = "individual", max_cycles: int | None = None
    ) -> None:
        if not callable(reward) and reward not in ("individual", "team"):
            raise ValueError(f"reward must be 'individual', 'team' or a function of the swarm, got {reward!r}")
        self.swarm = Swarm(scenario, num_worlds)
        self.max_cycles = max_cycles
        self._reward: Reward = reward

    @property
    def max_cycles(self) -> int | None:
        """Decisions after which an episode is truncated."""
        return self._max_cycles

    @max_cycles.setter
    def max_cycles(self, value: int | None) -> None:
        if value is not None and (not isinstance(value, int) or value < 1):
            raise ValueError(f"max_cycles must be a whole number from 1, or None for the time limit, got {value!r}")
        self._max_cycles = value

    def reset(self, seed: int | Sequence[int] | None = None, worlds: Sequence[int] | None = None) -> Float32:
        """Start worlds anew, as ``Swarm.reset``; the observations (world, vehicle, entry)."""
        return self.swarm.reset(seed, worlds).to_observation()

    def step(self, action: Float32) -> Outcome:
        """One decision of every world; ``action`` has shape (world, vehicle, 2)."""
        swarm = self.swarm
        before = swarm.state.alive.copy()
        observation = swarm.step(action).to_observation()
        alive, ended = swarm.state.alive, swarm.arrived[:, None]
        terms: Mapping[str, Float64] = {}
        if callable(self._reward):
            reward = np.asarray(self._reward(swarm), np.float64)
            if reward.shape != alive.shape:
                raise ValueError(f"the reward function must give an array {alive.shape}, got {reward.shape}")
            if not np.isfinite(reward[before]).all():
                raise ValueError(
                    "the reward function must give finite numbers; distances are infinite where nobody is near "
                    "(facts.spacing of a lone vehicle) or nothing is there (facts.clearance without obstacles)"
                )
        else:
            terms = reward_terms(swarm)
            reward = np.sum(list(terms.values()), axis=0)
            if self._reward == "team":
                # Who is lost leaves the team's later costs behind, and so bears its own charge whole.
                reward = reward.mean(axis=1, keepdims=True) + terms["loss"]
        late = swarm.timed_out | (swarm.state.tick >= self._last_tick)
        return Outcome(
            observation=observation,
            reward=reward,
            terminated=before & (ended | ~alive),
            truncated=alive & ~ended & late[:, None],
            terms=terms,
        )

    @property
    def _last_tick(self) -> float:
        return np.inf if self.max_cycles is None else self.max_cycles * self.swarm.scenario.timing.holds_per_decision
