"""``EnvPolicy``: a policy that maps an environment's observations to its actions, through any interface."""

from collections.abc import Mapping, Sequence
from typing import Any, Protocol, cast, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from uuv_marl.baselines.policy import Policy, PolicyError
from uuv_marl.percept import Clock, Percept
from uuv_marl.sim.arguments import rounding
from uuv_marl.sim.swarm import Swarm
from uuv_marl.types import Float32, Int64


class HasSwarm(Protocol):
    """The part of an environment that ``make_policy`` needs; a wrapper has it through ``unwrapped``."""

    @property
    def unwrapped(self) -> Any:
        """The environment below all wrappers, with ``scenario`` and ``swarm``."""
        ...


class EnvPolicy:
    """Maps the observations of an environment to the actions that its ``step`` takes.

    Call it with what the environment returns. A dictionary by agent (PettingZoo, RLlib) gives a dictionary for the same
    agents, one at a time as in an AEC loop or all at once. An array of shape (world, vehicle, entry) (``vector_env``),
    (row, entry) (``SwarmVecEnv``) or (entry,) (``SoloEnv``) gives an array of actions of that shape.

    It follows the environment's clock: when an episode begins, it clears its memory. A second call at the same time
    does not change the memory, and a policy with a memory refuses a call after a skipped decision. Vehicles without a
    given observation use the environment's own.

    Args:
        policy: made for the environment's scenario and worlds.
        env: the environment, below all wrappers.
    """

    def __init__(self, policy: Policy, env: Any) -> None:
        self.policy, self._env = policy, env
        self._swarm: Swarm = env.swarm
        agents: Sequence[str] = getattr(env, "possible_agents", ())  # empty where observations are arrays
        self._index = {agent: i for i, agent in enumerate(agents)}
        self._now: tuple[bytes, ...] = ()  # time and episode of every world at the latest call
        self._before: Mapping[str, NDArray[Any]] | None = None
        """The policy's state before this time, where not all observations were given at once."""
        self._flat = self._actions = np.zeros(0, np.float32)
        """Percepts of all vehicles at this time and their actions, a row each."""

    def reset(self, seed: int | None = None) -> None:
        """Clear the memory; never required. A seed is that of the policy's random numbers in the next episode."""
        self.policy.reset(seed)
        self._now = ()

    @overload
    def __call__(self, observations: Mapping[str, Any]) -> dict[str, Float32]: ...
    @overload
    def __call__(self, observations: ArrayLike) -> Float32: ...
    def __call__(self, observations: Mapping[str, Any] | ArrayLike) -> dict[str, Float32] | Float32:
        """Actions for these observations.

        Raises PolicyError if an agent is unknown, observations have another shape than the environment's, or the policy
        has a memory and a decision was skipped.
        """
        if isinstance(observations, Mapping):
            return self._by_agent(observations)
        return self._by_row(np.asarray(observations))

    def _by_agent(self, observations: Mapping[str, Any]) -> dict[str, Float32]:
        if unknown := observations.keys() - self._index.keys():
            known = f"agents are uuv_0 to {list(self._index)[-1]}" if self._index else "it takes an array"
            raise PolicyError(f"this policy's environment has no agent {min(unknown, key=str)!r}; {known}")
        if not observations:
            return {}
        vehicles = np.array([self._index[agent] for agent in observations])
        return dict(zip(observations, self._act(vehicles, np.array([*observations.values()])), strict=True))

    def _by_row(self, observations: NDArray[Any]) -> Float32:
        worlds, vehicles = self._swarm.num_worlds, self._swarm.num_vehicles
        rows, entry, shape = worlds * vehicles, (self.policy.layout.size,), observations.shape
        if shape == entry and worlds == 1:
            return self._act(np.array([getattr(self._env, "learner", 0)]), observations[None])[0]
        if shape not in ((worlds, vehicles, *entry), (rows, *entry)):
            raise PolicyError(
                "observations must have the shape that the environment gives them, for instance "
                f"{(worlds, vehicles, *entry)} (world, vehicle, entry), got {shape}"
            )
        return self._act(np.arange(rows), observations.reshape(rows, -1)).reshape(*shape[:-1], -1)

    def _act(self, index: Int64, observations: NDArray[Any]) -> Float32:
        """Actions of these rows, ``world * vehicles + i``, shape (row, 2), from their observations (row, entry)."""
        percept, layout = self._swarm.percept, self.policy.layout
        if observations.shape[1:] != (layout.size,):
            raise PolicyError(
                f"an observation of this environment has {layout.size} entries, got {observations.shape[1:]}; give the "
                "policy what the environment returns"
            )
        with rounding():
            rows = Percept.from_observation(observations.astype(np.float32), layout).flat
        clock = cast(Clock, percept.clock)
        now = (clock.time_s.tobytes(), clock.episode.tobytes())
        renewed = now != self._now
        if renewed:
            self._now, self._flat = now, percept.flat.reshape(-1, layout.size).copy()
            missing = self._swarm.state.alive.reshape(-1).copy()
            missing[index] = False
            self._before = self.policy.snapshot() if missing.any() else None
        elif self._before is not None and not np.array_equal(self._flat[index], rows):
            self.policy.restore(self._before)  # an observation other than the environment's own: a wrapper's
            renewed = True
        self._flat[index] = rows
        if renewed or self._before is None:
            flat = self._flat.reshape(percept.flat.shape)
            action = self.policy.act(Percept(flat, layout, clock, percept.alive))
            self._actions = action.reshape(-1, action.shape[2]).copy()
        return self._actions[index]


def environment(target: HasSwarm, name: str) -> Any:
    """The environment below all wrappers, with ``scenario`` and ``swarm``, for the policy of that name.

    Raises PolicyError if it is not an environment of this package or does not observe positions.
    """
    env: Any = getattr(target, "unwrapped", None)
    swarm = getattr(env, "swarm", None)
    if not isinstance(swarm, Swarm):
        raise PolicyError(
            f"a policy is made for a Scenario (see load_scenario) or an environment of uuv_marl, got {target!r}"
        )
    if not getattr(env, "observes_positions", True):
        raise PolicyError(f"policy {name!r} reads positions; make the environment with observe='positions'")
    return env
