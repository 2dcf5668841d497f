"""``Actor``: a policy whose network maps observations as closeness to actions, in NumPy, with or without a memory."""

from collections.abc import Mapping
from typing import Annotated, Any, NamedTuple, cast

import numpy as np

from uuv_marl.baselines.learned.checkpoint import Card, Checkpoint, card_rows, vehicle_of
from uuv_marl.baselines.learned.layers import Network, NumpyOps
from uuv_marl.baselines.policy import Policy, PolicyError
from uuv_marl.percept import Percept
from uuv_marl.scenario import Scenario
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.observation import observation_layout, observer
from uuv_marl.sim.vehicle import project
from uuv_marl.types import Bool, Float32


class Remembered(NamedTuple):
    """Memory of a recurrent network."""

    state: Annotated[Float32, "world vehicle unit", "State of the recurrent layer [1]."]


class Actor(Policy):
    """A checkpoint's network, with or without memory, from a vehicle's percept to its action. Deterministic.

    Raises PolicyError if percept, decision period or inner loop differ from the training's, or the vehicle, unless
    ``any_vehicle``.
    """

    def __init__(
        self, scenario: Scenario, num_worlds: int = 1, *, name: str, checkpoint: Checkpoint, any_vehicle: bool = False
    ) -> None:
        self.name, self.checkpoint, card = name, checkpoint, checkpoint.card
        self.requirements = card.requirements
        if card.network.memory:
            cast(Any, self).Memory, self.axes = Remembered, {"unit": card.network.hidden[-1]}
        super().__init__(scenario, num_worlds)
        check_same_training(self, card, any_vehicle)
        self._seeing = observation_layout(scenario, "closeness")
        self._network = Network(card.network, card.sizes, checkpoint.tensors, NumpyOps)

    def remember(self, percept: Percept, worlds: Bool) -> None:
        """Update the recurrent layer's state with the latest observation."""
        z, state = self._features(percept, worlds), self.memory.state
        before = state[worlds].reshape(-1, state.shape[2])
        state[worlds] = self._network.step(self._network.gates(z), before).reshape(state[worlds].shape)

    def decide(self, percept: Percept) -> Float32:
        """Actions of shape (world, vehicle, ``scenario.action_size``)."""
        z = self._features(percept, self.active)
        state = self.memory.state[self.active].reshape(-1, self.axes["unit"]) if self.Memory else None
        action = self._network.output(z, state)
        bound(action, in_disc(self))
        whole = np.zeros((*percept.flat.shape[:2], action.shape[1]), np.float32)
        whole[self.active] = action.reshape(-1, *whole.shape[1:])
        return whole

    def _features(self, percept: Percept, worlds: Bool) -> Float32:
        """Features of the vehicles of these worlds, shape (row, entry)."""
        flat = self.flat(percept)
        chosen = Percept(flat if worlds.all() else flat[worlds], percept.layout)
        observation, observe = observer(chosen, self._seeing)
        observe(0, len(observation))
        return self._network.features(observation.reshape(-1, self._seeing.size))


@compiled
def bound(action: Float32, disc: bool) -> None:
    """Clip actions (row, entry) to [-1, 1], as trainers do, and project forces onto the disc if asked, in place."""
    for i in range(action.shape[0]):
        a_x, a_y = min(max(action[i, 0], -1.0), 1.0), min(max(action[i, 1], -1.0), 1.0)
        if disc:
            a_x, a_y = project(a_x, a_y)
        action[i, 0], action[i, 1] = a_x, a_y
        for k in range(2, action.shape[1]):
            action[i, k] = min(max(action[i, k], -1.0), 1.0)


def in_disc(policy: Policy) -> bool:
    """Whether decisions lie in the unit disc (forces), else in the square (thrust and rudder)."""
    return policy.requirements.outputs_force or policy.scenario.actuators.kind != "rudder"


def check_same_training(policy: Policy, card: Card, any_vehicle: bool) -> None:
    """Raise PolicyError if the scenario's percept differs from the training's, or, unless any may, the vehicle."""
    scenario, name = policy.scenario, policy.name
    rows = card_rows(scenario)
    then, now = ({f"field {k}": row for k, row in enumerate(own)} for own in (card.percept, rows))
    pairs: list[tuple[str, Mapping[str, object], Mapping[str, object], str]] = [
        ("percept", then, now, "use a scenario with the sonar suite of its training")
    ]
    if not any_vehicle:
        remedy = "use another policy, allow this vehicle with make_policy(..., any_vehicle=True)"
        pairs.append(("vehicle", card.vehicle, vehicle_of(scenario), remedy))
    for what, old, new, remedy in pairs:
        other = next((field for field in {**old, **new} if old.get(field) != new.get(field)), None)
        if other:
            raise PolicyError(
                f"{name} was trained on another {what} than scenario {scenario.name!r} has: {other} was "
                f"{old.get(other)} in the training and is {new.get(other)} here; {remedy}, or train on this scenario "
                f"(uuv-marl train {scenario.name})"
            )
