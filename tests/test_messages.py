"""Messages that policies choose: schedule, sound, range, bits, collisions, and what is observed of them."""

import math

import numpy as np
import pytest

from tests.golden import STARTER
from tests.swarms import started
from uuv_marl import load_scenario, parallel_env
from uuv_marl.baselines import make_policy
from uuv_marl.errors import ScenarioError

TALK = {
    "modem.message_entries": 3, "modem.bits_per_entry": 4, "sonar.channels": ["messages"], "obstacles": [],
    "modem.range_m": 60.0, "modem.guard_m": 60.0,
}  # fmt: skip
ALOHA = {"modem.access": "aloha"}
VECTORS = {"modem.message_vectors": 1, "navigation.compass_bias_deg": 5.0}
STEP_S = 0.1


class Log:
    """A swarm's positions and actions at every control step of random motion, and its percepts."""

    def __init__(self, overrides, steps, seed=0, n=12, scale=1.0):
        self.swarm = started(STARTER, TALK | overrides, 1, seed, n=n)
        rng = np.random.default_rng(seed)
        self.positions, self.actions, self.percepts = [self.swarm.state.eta[0, :, :2].copy()], [], []
        self.headings = [self.swarm.compass[0] @ [1, 1j]]
        self.slots, self.received = self.next_slots(), np.zeros(n, np.int64)
        before = self.swarm._disturbances.packets.inbox_s.copy()
        for _ in range(steps):
            action = rng.uniform(-1.0, 1.0, (1, n, self.swarm.scenario.action_size)).astype(np.float32)
            action[..., :2] *= scale
            percept = self.swarm.step(action)
            self.positions.append(self.swarm.state.eta[0, :, :2].copy())
            self.headings.append(self.swarm.compass[0] @ [1, 1j])
            self.actions.append(action[0])
            self.percepts.append({name: percept[name][0].copy() for name in percept.names})
            self.slots |= self.next_slots()
            latest = self.swarm._disturbances.packets.inbox_s
            self.received += (latest != before)[0].sum(axis=1)
            before = latest.copy()

    def next_slots(self):
        return {(int(slot), j) for j, slot in enumerate(self.swarm._disturbances.packets.next_slot[0])}

    def sent(self):
        """Slot, sender, time, message and place of everything sent, from the log alone."""
        modem, n = self.swarm.scenario.modem, self.swarm.num_vehicles
        pitch = modem.round_s(n, 1500.0) / n if modem.access == "tdma" else modem.slot_s(1500.0)
        levels = 2**modem.bits_per_entry - 1
        for slot, j in sorted(self.slots):
            step = math.floor(slot * pitch / STEP_S + 1e-9)
            if step < len(self.actions):
                share = slot * pitch / STEP_S - step
                place = (1.0 - share) * self.positions[step][j] + share * self.positions[step + 1][j]
                message = self.actions[step][j, 2:].astype(float)
                if modem.message_vectors:
                    vector = message[:2] @ [1, 1j]
                    vector *= self.headings[step][j] / max(abs(vector), 1.0)
                    message[:2] = vector.real, vector.imag
                numbers = np.round((message + 1.0) / 2.0 * levels) / levels * 2.0 - 1.0
                yield slot, j, slot * pitch, numbers, place

    def read(self, i, step, numbers):
        """A message as vehicle i observes it after a step."""
        if self.swarm.scenario.modem.message_vectors:
            vector = numbers[:2] @ [1, 1j] / self.headings[step][i]
            numbers = np.clip([vector.real, vector.imag, *numbers[2:]], -1.0, 1.0)
        return numbers

    def arrivals(self, i):
        """Step, time of sending and message of all that vehicle i should receive, in order."""
        modem, sent, found = self.swarm.scenario.modem, list(self.sent()), []
        for slot, j, time_s, numbers, place in sent:
            others = [(k, where) for s, k, _, _, where in sent if s == slot and k != j]
            for step in range(1, len(self.positions)):
                away = math.dist(self.positions[step][i], place)
                if j != i and step * STEP_S >= time_s + modem.airtime_s + away / 1500.0:
                    collides = any(math.dist(self.positions[step][i], where) <= modem.range_m for _, where in others)
                    if away <= modem.range_m and not collides:
                        found.append((step, j, time_s, numbers))
                    break
        return [(step, time_s, numbers) for step, _, time_s, numbers in sorted(found, key=lambda one: one[:2])]


@pytest.mark.parametrize(
    "overrides", [{}, ALOHA, {"modem.period_s": 9.0}, VECTORS], ids=["tdma", "aloha", "slow", "vectors"]
)
def test_a_message_arrives_when_sound_does_and_nothing_else_arrives(overrides):
    """Against a reconstruction from logged positions and actions: what, when, in which order, and its age."""
    log = Log(overrides, 150)
    for i in range(log.swarm.num_vehicles):
        due = log.arrivals(i)
        assert len(due) > 5
        for step, percept in enumerate(log.percepts, 1):
            latest = [one for one in due if one[0] <= step][::-1][:4]
            assert percept["message_valid"][i].tolist() == [1.0] * len(latest) + [0.0] * (4 - len(latest))
            for k, (_, time_s, numbers) in enumerate(latest):
                np.testing.assert_allclose(percept["message"][i, k], log.read(i, step, numbers), atol=1e-6)
                assert percept["message_age"][i, k] == pytest.approx(step * STEP_S - time_s, abs=1e-4)


def test_no_vehicle_receives_more_bits_than_the_schedule_carries():
    """All of them are in range, so that each receives what the others' slots carry, and no more."""
    log = Log({"modem.range_m": 500.0, "modem.guard_m": 500.0}, 600)
    modem, n = log.swarm.scenario.modem, log.swarm.num_vehicles
    bits = log.received * (8 * modem.header_bytes + 3 * modem.bits_per_entry)
    share_on_air = modem.airtime_s / modem.slot_s(1500.0)
    carried = 60.0 * modem.bit_rate_bps * share_on_air * (n - 1) / n
    np.testing.assert_allclose(bits, carried, rtol=0.03)


def test_a_detected_neighbours_message_is_the_latest_of_that_vehicle():
    log = Log(VECTORS | {"modem.range_m": 500.0, "modem.guard_m": 500.0}, 250, scale=0.3)
    messages, seen = {(time_s, j): numbers for _, j, time_s, numbers, _ in log.sent()}, 0
    last, packets = log.percepts[-1], log.swarm._disturbances.packets
    for i, k in np.argwhere(last["neighbour_message_valid"] > 0.0):
        j = int(log.swarm.detected_index[0, i, k])
        sent_s = max(time_s for time_s, sender in messages if sender == j and time_s <= packets.inbox_s[0, i, j] + 1e-9)
        read = log.read(i, len(log.percepts), messages[sent_s, j])
        np.testing.assert_allclose(last["neighbour_message"][i, k], read, atol=1e-6)
        assert last["neighbour_message_age"][i, k] == pytest.approx(25.0 - sent_s, abs=1e-4)
        seen += 1
    assert seen > 12
    assert (last["neighbour_message"][last["neighbour_message_valid"] == 0.0] == 0.0).all()


@pytest.mark.parametrize("overrides", [{}, ALOHA, {"timing.decision_period_s": 0.5}], ids=["tdma", "aloha", "slower"])
def test_a_message_that_is_not_sent_changes_nothing(overrides):
    """Nor does a message change forces; one that is sent does change percepts."""
    swarms = [started(STARTER, TALK | overrides, 2, 5, n=8) for _ in range(3)]
    rng = np.random.default_rng(1)
    for _ in range(80):
        sends = swarms[0].sends
        actions = [rng.uniform(-1.0, 1.0, (2, 8, 5)).astype(np.float32) for _ in range(3)]
        for action in actions[1:]:
            action[..., :2] = actions[0][..., :2]
        actions[1][sends] = actions[0][sends]
        for swarm, action in zip(swarms, actions, strict=True):
            swarm.step(action)
        np.testing.assert_array_equal(swarms[0].percept.flat, swarms[1].percept.flat)
        np.testing.assert_array_equal(swarms[0].state.eta, swarms[2].state.eta)
    assert (swarms[0].percept["message"] != swarms[2].percept["message"]).any()


def test_slotted_aloha_delivers_the_share_that_theory_gives():
    """(n - 1) p (1 - p)^(n - 1) of the slots bring a message (Abramson 1970); within 5 deviations."""
    log = Log(ALOHA | {"modem.range_m": 500.0, "modem.guard_m": 500.0}, 6000, n=6, scale=0.0)
    slots = 600.0 / log.swarm.scenario.modem.slot_s(1500.0)
    expected = slots * 5 / 6 * (1 - 1 / 6) ** 5
    np.testing.assert_allclose(log.received, expected, atol=5 * math.sqrt(expected))


def test_messages_are_lost_at_the_given_rate():
    every, some = (Log({"modem.loss_probability": loss}, 600, scale=0.0).received.sum() for loss in (0.0, 0.4))
    assert some == pytest.approx(0.6 * every, abs=5 * math.sqrt(0.24 * every))


def test_a_lost_vehicle_neither_sends_nor_receives():
    swarm = started(STARTER, TALK | {"losses.times_s": [5.0]}, 1, 0, n=6)
    for _ in range(200):
        swarm.step(np.ones((1, 6, 5)) * np.array([0.0, 0.0, 1.0, 1.0, 1.0]))
    packets, gone = swarm._disturbances.packets, np.flatnonzero(~swarm.state.alive[0])
    modem = swarm.scenario.modem
    pitch = modem.round_s(6, 1500.0) / 6
    assert len(gone) == 1
    assert (packets.packet_slot[0, gone] * pitch < 5.0).all()
    assert packets.inbox_s[0, gone].max() < 5.0 < packets.inbox_s[0].max()
    assert not swarm.sends[0, gone].any()


def test_a_snapshot_with_messages_under_way_continues_bit_for_bit():
    rng = np.random.default_rng(0)
    actions = rng.uniform(-1.0, 1.0, (120, 2, 8, 5))
    whole, resumed = (started(STARTER, TALK | ALOHA, 2, 3, n=8) for _ in range(2))
    for t, action in enumerate(actions):
        whole.step(action)
        if t == 59:
            resumed.restore(whole.snapshot())
        elif t > 59:
            resumed.step(action)
    np.testing.assert_array_equal(whole.percept.flat, resumed.percept.flat)


@pytest.mark.parametrize(
    ("overrides", "said"),
    [
        ({"modem.guard_m": 50.0}, "modem.guard_m must be at least modem.range_m = 60"),
        ({"modem.period_s": 1.0}, r"modem.period_s must be at least 2.035, 12 slots of 0.1696 s each"),
        ({"sonar.channels": ["modem"]}, "sonar.channels can't hold modem"),
        ({"modem.message_entries": 0}, "modem.message_entries must be at least 1 with the channel messages"),
        ({"modem.message_vectors": 2}, "modem.message_vectors must be at most half of modem.message_entries = 3"),
        ({"modem.bit_rate_bps": 1e5}, r"slots of 0.0406 s, shorter than timing.control_step_s = 0.1"),
    ],
)
def test_an_impossible_schedule_is_refused_with_the_remedy(overrides, said):
    with pytest.raises(ScenarioError, match=said):
        load_scenario(STARTER, overrides=TALK | overrides, num_vehicles=12)


def test_a_long_wait_stays_within_the_observation_s_bounds():
    env = parallel_env(STARTER, overrides=TALK | {"modem.period_s": 36_000.0}, num_vehicles=6)
    observations, _ = env.reset(seed=0)
    assert all(env.observation_space(agent).contains(own) for agent, own in observations.items())
    assert env.swarm.percept["time_to_slot"].max() == 4096.0


def test_a_silent_policy_sends_zeros_and_keeps_its_forces():
    quiet, env = (parallel_env(STARTER, overrides=own, num_vehicles=6) for own in ({"obstacles": []}, TALK))
    spoken, silent = env.reset(seed=1)[0], quiet.reset(seed=1)[0]
    assert env.action_space("uuv_0").shape == (5,)
    talks, mute = (make_policy("idle", one) for one in (env, quiet))
    assert talks(spoken)["uuv_0"].tolist() == [0.0] * 5
    assert mute(silent)["uuv_0"].tolist() == [0.0] * 2
    assert np.abs(make_policy("random", env)(spoken)["uuv_3"][2:]).min() > 0.0
