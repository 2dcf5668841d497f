"""Acoustic messages: in each round every vehicle sends its velocity once, in its own time slot (TDMA).

A message arrives at the end of its slot, which allows for sending it and for sound to cross ``modem.guard_m``; each
receiver loses it with a probability. A vehicle keeps the latest message of each other one. Detections are assumed to
identify their vehicle: a percept has the message of the vehicle detected in a sub-sector. A velocity is sent north and
east by the sender's compass, and read by the receiver's.
"""

import math
from typing import Annotated, NamedTuple

import numpy as np

from uuv_marl.percept import DisturbanceFields
from uuv_marl.scenario import Scenario
from uuv_marl.sim.arrays import World
from uuv_marl.sim.compiled import compiled, compiled_inner
from uuv_marl.sim.disturbances.current import Flow, over_ground
from uuv_marl.sim.disturbances.navigation import NavigationErrors, by_compass
from uuv_marl.sim.perception import body_velocity
from uuv_marl.sim.random import MESSAGE, uniform
from uuv_marl.sim.tables import described
from uuv_marl.types import Float64

_MAX_AGE_S = 4096.0


class ModemModel(NamedTuple):
    """Constants of a scenario's messages."""

    round_s: float  # time between two messages of a vehicle [s]
    control_step_s: float  # length of a control step [s]
    loss: float  # probability that a receiver loses a message


@described
class Messages(NamedTuple):
    """Messages sent and received; times are -1 before the first. The axis peer is empty without the channel."""

    sent: Annotated[Float64, "world peer 3", "Latest message: velocity over ground, north, east [m/s]; sent at [s]."]
    received: Annotated[Float64, "world vehicle peer 3", "Latest message received from each other vehicle, likewise."]


def modem_model(scenario: Scenario) -> ModemModel:
    """Constants of the scenario's messages for the compiled functions."""
    round_s = scenario.modem.round_s(scenario.swarm.num_vehicles, scenario.latency.sound_speed_mps)
    return ModemModel(round_s, scenario.timing.control_step_s, scenario.modem.loss_probability)


@compiled
def rounds(tick: int, slots: float, numbers: ModemModel) -> int:
    """Latest round that began at least a share ``slots`` of a round before this control step, or -1."""
    return max(math.floor(tick * numbers.control_step_s / numbers.round_s - slots + 1e-9), -1)


@compiled_inner
def exchange(
    w: int, key: np.uint64, world: World, numbers: ModemModel, messages: Messages, flow: Flow, errors: NavigationErrors
) -> None:
    """Send and receive messages due at the start of an episode, or at the end of a control step already counted."""
    state, n, tick = world.state, messages.sent.shape[1], world.state.tick[w]
    for j in range(n):
        if not state.alive[w, j]:
            continue
        if rounds(tick, j / n, numbers) > rounds(tick - 1, j / n, numbers):
            v_x, v_y = over_ground(w, j, state, flow)
            messages.sent[w, j, 0], messages.sent[w, j, 1] = by_compass(w, j, v_x, v_y, errors)
            messages.sent[w, j, 2] = tick * numbers.control_step_s
        arrived = rounds(tick, (j + 1) / n, numbers)
        if arrived > rounds(tick - 1, (j + 1) / n, numbers) and messages.sent[w, j, 2] >= 0.0:
            for i in range(n):
                if i != j and uniform(key, MESSAGE, arrived, i, j) >= numbers.loss:
                    for part in range(3):
                        messages.received[w, i, j, part] = messages.sent[w, j, part]


@compiled_inner
def write_messages(w: int, world: World, messages: Messages, errors: NavigationErrors, more: DisturbanceFields) -> None:
    """Write, for each sub-sector, the latest message of the vehicle detected in it into the percepts of world w."""
    heading, now_s = world.senses.heading, world.facts.time_s[w]
    for i in range(world.state.alive.shape[1]):
        c, s = by_compass(w, i, heading[w, i, 0], heading[w, i, 1], errors)
        for k in range(more.modem_identity.shape[2]):
            j = world.senses.detected_index[w, i, k]
            if not world.state.alive[w, i] or j < 0 or messages.received[w, i, j, 2] < 0.0:
                continue
            v_x, v_y = messages.received[w, i, j, 0], messages.received[w, i, j, 1]
            more.modem_identity[w, i, k] = j + 1
            more.modem_velocity[w, i, k, 0], more.modem_velocity[w, i, k, 1] = body_velocity(v_x, v_y, c, s)
            more.modem_age[w, i, k] = min(now_s - messages.received[w, i, j, 2], _MAX_AGE_S)
