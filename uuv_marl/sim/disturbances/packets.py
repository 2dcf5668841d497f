"""Messages that policies choose: numbers of an action, sent in the vehicle's own slot and received once sound arrives.

In a slot a vehicle sends the numbers of the action in force, rounded to ``modem.bits_per_entry``; vectors among them
are sent north and east by its compass, and read by the receiver's in its body frame. The message arrives once it has
been sent and sound has travelled from the place of the sender then to the receiver, within ``modem.range_m``; each
receiver loses it with a probability. With TDMA the slots of a round go to the vehicles in order. With slotted ALOHA
(Abramson 1970) each vehicle sends in random slots; messages of a slot whose senders are in a receiver's range destroy
each other, and a vehicle that sends does not receive.
"""

import math
from typing import Annotated, NamedTuple

import numpy as np

from uuv_marl.percept import DURATION, NUM_RECENT, DisturbanceFields
from uuv_marl.scenario import Scenario
from uuv_marl.sim.arrays import State, World
from uuv_marl.sim.compiled import compiled, compiled_inner
from uuv_marl.sim.disturbances.navigation import NavigationErrors, by_compass
from uuv_marl.sim.disturbances.noise import gap
from uuv_marl.sim.perception import saturate
from uuv_marl.sim.random import MESSAGE, SLOT, uniform
from uuv_marl.sim.tables import described
from uuv_marl.sim.vehicle import project
from uuv_marl.types import Bool, Float32, Float64, Int64


class PacketModel(NamedTuple):
    """Constants of a scenario's messages."""

    vectors: int  # number of vectors with which the entries begin
    levels: float  # number of values of an entry, less one
    airtime_s: float  # time in which a message is sent [s]
    slot_s: float  # time between the starts of two slots [s]
    probability: float  # that a vehicle sends in a slot; 0 with TDMA, in which it sends once in a round
    range: float  # largest distance [m]
    sound_speed: float  # [m/s]
    loss: float  # probability that a receiver loses a message
    control_step_s: float  # length of a control step [s]


@described
class Packets(NamedTuple):
    """Messages sent and received. All axes are empty where messages have no entries."""

    next_message: Annotated[Float64, "world modem message_entry", "Numbers of the action in force, rounded [1]."]
    next_slot: Annotated[Int64, "world modem", "Number of the vehicle's next slot."]
    packet: Annotated[Float64, "world modem message_entry", "Latest message [1]."]
    packet_slot: Annotated[Int64, "world modem", "Its slot, -1 before the first."]
    packet_from: Annotated[Float64, "world modem 2", "Position of the sender then, north and east [m]."]
    packet_travels: Annotated[Bool, "world modem modem", "Whether it has yet to reach each other vehicle."]
    inbox: Annotated[Float64, "world modem modem message_entry", "Latest message received from each other one [1]."]
    inbox_s: Annotated[Float64, "world modem modem", "When it was sent [s], -1 before the first."]
    recent: Annotated[
        Float64, "world modem recent message_entry", "The latest messages received, the latest first [1]."
    ]
    recent_s: Annotated[Float64, "world modem recent", "When each was sent [s], -1 for none."]


def packet_model(scenario: Scenario) -> PacketModel:
    """Constants of the scenario's messages for the compiled functions."""
    modem, n, sound = scenario.modem, scenario.swarm.num_vehicles, scenario.latency.sound_speed_mps
    every, tdma = modem.round_s(n, sound), modem.access == "tdma"
    slot = every / n if tdma else modem.slot_s(sound)
    return PacketModel(
        modem.message_vectors, 2.0**modem.bits_per_entry - 1.0, modem.airtime_s, slot, 0.0 if tdma else slot / every,
        modem.range_m, sound, modem.loss_probability, scenario.timing.control_step_s,
    )  # fmt: skip


@compiled
def slot_after(slot: int, i: int, key: np.uint64, n: int, model: PacketModel) -> int:
    """Number of a vehicle's slot after this one; its first is that after -1."""
    if model.probability > 0.0:
        return slot + 1 + gap(uniform(key, SLOT, slot + 1, i, 0), model.probability)
    return slot + n if slot >= 0 else i


def begin_packets(w: int, key: np.uint64, model: PacketModel, packets: Packets) -> None:
    """Clear the messages of world w's new episode."""
    for array in packets:
        array[w] = 0
    packets.packet_slot[w], packets.inbox_s[w], packets.recent_s[w] = -1, -1.0, -1.0
    write_first_slots(key, model, packets.next_slot[w])


@compiled
def write_first_slots(key: np.uint64, model: PacketModel, slots: Int64) -> None:
    """Write the number of every vehicle's first slot, shape (vehicle,)."""
    for i in range(slots.shape[0]):
        slots[i] = slot_after(-1, i, key, slots.shape[0], model)


@compiled
def rounded(value: float, levels: float) -> float:
    """The nearest of ``levels`` + 1 values, evenly from -1 to 1."""
    share = 0.5 * (min(max(value, -1.0), 1.0) + 1.0)
    return 2.0 * math.floor(share * levels + 0.5) / levels - 1.0


@compiled_inner
def load_entries(
    w: int, action: Float32, world: World, model: PacketModel, errors: NavigationErrors, packets: Packets
) -> None:
    """Store the messages of a decision's actions, shape (world, vehicle, 2 + entry)."""
    heading, message = world.senses.heading, packets.next_message
    for i in range(message.shape[1]):
        if not world.state.alive[w, i]:
            continue
        for k in range(message.shape[2]):
            message[w, i, k] = np.float64(action[w, i, 2 + k])
        c, s = by_compass(w, i, heading[w, i, 0], heading[w, i, 1], errors)
        for v in range(model.vectors):
            x, y = project(message[w, i, 2 * v], message[w, i, 2 * v + 1])
            message[w, i, 2 * v], message[w, i, 2 * v + 1] = c * x - s * y, s * x + c * y
        for k in range(message.shape[2]):
            message[w, i, k] = rounded(message[w, i, k], model.levels)


@compiled_inner
def transmit(w: int, key: np.uint64, world: World, model: PacketModel, packets: Packets) -> None:
    """Receive the messages that have arrived, then send those of the slots that began in the latest control step."""
    state, n, now_s = world.state, packets.next_slot.shape[1], world.state.tick[w] * model.control_step_s
    for j in range(n):
        sent_s = packets.packet_slot[w, j] * model.slot_s
        recently = packets.packet_slot[w, j] >= 0 and now_s <= sent_s + model.slot_s + model.control_step_s
        for i in range(n if recently else 0):
            if packets.packet_travels[w, j, i]:
                away = distance(w, i, j, state, packets)
                if now_s >= sent_s + model.airtime_s + away / model.sound_speed:
                    packets.packet_travels[w, j, i] = False
                    if is_received(w, i, j, away, key, state, model, packets):
                        receive(w, i, j, sent_s, packets)
    for j in range(n):
        start_s = packets.next_slot[w, j] * model.slot_s
        if start_s < now_s - 1e-9:
            if state.alive[w, j]:
                send(w, j, 1.0 - (now_s - start_s) / model.control_step_s, state, packets)
            packets.next_slot[w, j] = slot_after(packets.next_slot[w, j], j, key, n, model)


@compiled_inner
def send(w: int, j: int, share: float, state: State, packets: Packets) -> None:
    """Send a vehicle's message after a share of the latest control step."""
    packets.packet_slot[w, j] = packets.next_slot[w, j]
    for k in range(packets.next_message.shape[2]):
        packets.packet[w, j, k] = packets.next_message[w, j, k]
    for c in range(2):
        packets.packet_from[w, j, c] = state.before[w, j, c] + share * (state.eta[w, j, c] - state.before[w, j, c])
    for i in range(packets.packet_travels.shape[2]):
        packets.packet_travels[w, j, i] = i != j


@compiled_inner
def distance(w: int, i: int, j: int, state: State, packets: Packets) -> float:
    """Distance of a vehicle from the place where another one sent its latest message [m]."""
    x, y = state.eta[w, i, 0] - packets.packet_from[w, j, 0], state.eta[w, i, 1] - packets.packet_from[w, j, 1]
    return math.sqrt(x * x + y * y)


@compiled_inner
def is_received(
    w: int, i: int, j: int, away: float, key: np.uint64, state: State, model: PacketModel, packets: Packets
) -> bool:
    """Whether a message that has arrived from vehicle j, sent ``away`` m from vehicle i, is not lost to it."""
    slot = packets.packet_slot[w, j]
    if away > model.range or not state.alive[w, i] or uniform(key, MESSAGE, slot, i, j) < model.loss:
        return False
    for other in range(packets.packet_slot.shape[1] if model.probability > 0.0 else 0):
        together = other != j and packets.packet_slot[w, other] == slot
        if together and distance(w, i, other, state, packets) <= model.range:  # vehicle i's own, too
            return False
    return True


@compiled_inner
def receive(w: int, i: int, j: int, sent_s: float, packets: Packets) -> None:
    """Store vehicle j's latest message, sent at that time, as vehicle i's."""
    for r in range(packets.recent_s.shape[2] - 1, 0, -1):
        packets.recent_s[w, i, r] = packets.recent_s[w, i, r - 1]
        for k in range(packets.packet.shape[2]):
            packets.recent[w, i, r, k] = packets.recent[w, i, r - 1, k]
    packets.recent_s[w, i, 0], packets.inbox_s[w, i, j] = sent_s, sent_s
    for k in range(packets.packet.shape[2]):
        packets.recent[w, i, 0, k] = packets.inbox[w, i, j, k] = packets.packet[w, j, k]


@compiled_inner
def read(message: Float64, c: float, s: float, vectors: int, out: Float32) -> None:
    """Write a message's entries, its vectors in the body frame of a heading with this cosine and sine."""
    for k in range(message.shape[0]):
        out[k] = message[k]
    for v in range(vectors):
        x, y = message[2 * v], message[2 * v + 1]
        out[2 * v], out[2 * v + 1] = saturate(c * x + s * y, 1.0), saturate(c * y - s * x, 1.0)


@compiled
def bounded_duration(time_s: float) -> float:
    """A time within the bounds of a percept [s]."""
    return min(max(time_s, DURATION.low), DURATION.high)


@compiled_inner
def write_packets(
    w: int, world: World, model: PacketModel, errors: NavigationErrors, packets: Packets, more: DisturbanceFields
) -> None:
    """Write the messages that have arrived, and the time to the own next slot, into the percepts of world w."""
    now_s, heading = world.facts.time_s[w], world.senses.heading
    for i in range(world.state.alive.shape[1] if more.time_to_slot.shape[2] else 0):
        if not world.state.alive[w, i]:
            continue
        c, s = by_compass(w, i, heading[w, i, 0], heading[w, i, 1], errors)
        more.time_to_slot[w, i, 0] = bounded_duration(packets.next_slot[w, i] * model.slot_s - now_s)
        for k in range(more.neighbour_message_valid.shape[2]):
            j = world.senses.detected_index[w, i, k]
            if j >= 0 and packets.inbox_s[w, i, j] >= 0.0:
                more.neighbour_message_valid[w, i, k] = 1.0
                more.neighbour_message_age[w, i, k] = bounded_duration(now_s - packets.inbox_s[w, i, j])
                read(packets.inbox[w, i, j], c, s, model.vectors, more.neighbour_message[w, i, k])
        for r in range(NUM_RECENT):
            if packets.recent_s[w, i, r] >= 0.0:
                more.message_valid[w, i, r] = 1.0
                more.message_age[w, i, r] = bounded_duration(now_s - packets.recent_s[w, i, r])
                read(packets.recent[w, i, r], c, s, model.vectors, more.message[w, i, r])
