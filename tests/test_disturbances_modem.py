"""Messages: content, schedule, age and losses."""

import math

import numpy as np
import pytest

from tests.golden import STARTER
from tests.nets import saved
from tests.swarms import fly, piloted, started
from uuv_marl import load_scenario
from uuv_marl.baselines import Policy, with_policy_requirements
from uuv_marl.baselines.requirements import PolicyRequirements

MODEM = {"sonar.channels": ["link", "modem"], "modem.period_s": 2.0, "obstacles": []}


def swum(overrides, decisions=100, worlds=1):
    """The swarm after the reset and after each decision."""
    swarm = started(STARTER, MODEM | overrides, worlds)
    yield swarm
    rng = np.random.default_rng(1)
    for _ in range(decisions):
        swarm.step(rng.uniform(-1, 1, (worlds, swarm.num_vehicles, 2)))
        yield swarm


def test_a_message_is_the_velocity_when_it_was_sent_and_its_age_follows_the_schedule():
    past = {}
    for swarm in swum({}):
        tick, heading = int(swarm.state.tick[0]), swarm.heading[0]
        u, v = np.moveaxis(swarm.velocity[0], -1, 0)
        c, s = heading.T
        past[tick] = np.stack([c * u - s * v, s * u + c * v], axis=-1)
        see = swarm.percept
        for i in range(5):
            for k in np.flatnonzero(see["detected"][0, i]):
                j = int(swarm.detected_index[0, i, k])
                sent = 4 * j + 20 * math.floor((tick - 4 * (j + 1)) / 20)  # slots of 0.4 s, rounds of 2 s
                if sent < 4 * j:
                    assert see["modem_identity"][0, i, k] == see["modem_age"][0, i, k] == 0
                    continue
                assert see["modem_identity"][0, i, k] == see["link_identity"][0, i, k] == j + 1
                assert see["modem_age"][0, i, k] == pytest.approx(0.1 * (tick - sent), abs=1e-5)
                x, y = past[sent][j]
                told = [c[i] * x + s[i] * y, c[i] * y - s[i] * x]
                np.testing.assert_allclose(see["modem_velocity"][0, i, k], told, rtol=1e-5, atol=1e-5)


def test_a_lost_vehicle_sends_no_more():
    swarm = list(swum({"faults": [{"kind": "member", "share": 0.2, "onset_s": 3.0}]}))[-1]
    gone = np.flatnonzero(~swarm.state.alive[0])
    assert len(gone) == 1
    assert (swarm._disturbances.messages.sent[0, gone, 2] < 3.05).all()
    assert (np.delete(swarm._disturbances.messages.sent[0, :, 2], gone) > 7.9).all()


def test_messages_are_lost_at_the_given_rate():
    """1,000 rounds of 5 vehicles: 20,000 messages; the share within 5 deviations."""
    arrived, before = 0, None
    for swarm in swum({"modem.loss_probability": 0.3, "modem.period_s": 0.1}, 500, worlds=2):
        now = swarm._disturbances.messages.received[..., 2].copy()
        arrived += int((now != before).sum()) if before is not None else 0
        before = now
    total = 500 * 2 * 20
    assert abs(arrived / total - 0.7) < 5 * math.sqrt(0.3 * 0.7 / total)


def test_compass_errors_turn_messages_sent_and_read():
    """A velocity over ground is north and east by the sender's compass, ahead and abeam by the receiver's."""
    turns = 0
    for swarm in swum({"navigation.compass_bias_deg": 30.0, "modem.period_s": 0.1}, 20):
        bias = swarm._disturbances.navigation_errors.bias[0] @ [1.0, 1.0j]
        told, true = (swarm.percept[f"{name}_velocity"][0].astype(float) @ [1.0, 1.0j] for name in ("modem", "link"))
        for i, k in np.argwhere(swarm.percept["modem_identity"][0]):
            j = swarm.detected_index[0, i, k]
            fresh = swarm.percept["modem_age"][0, i, k] == 0.0
            assert abs(told[i, k] - true[i, k] * bias[j] / bias[i]) < 1e-5 or not fresh
            turns += fresh and abs(true[i, k]) > 0.1
    assert turns > 100


@pytest.mark.parametrize("policy", ["sff", "sdc", "olfati_saber_informed", "orca_informed"])
def test_comparators_run_on_messages_as_on_the_link(policy):
    """The same controller: with messages as recent as the link it acts the same."""
    base = {"modem.period_s": 0.1, "obstacles": []}
    paths = []
    for channels in ([], ["modem"]):
        swarm, actor = piloted(policy, STARTER, {**base, "sonar.channels": channels})
        assert ("link" in swarm.scenario.sonar.channels) == ("modem" not in swarm.scenario.sonar.channels)
        fly(swarm, actor, 30)
        paths.append(swarm.state.eta[0, :, :2].copy())
    assert np.abs(paths[0] - paths[1]).max() < 3.0  # the first message comes a decision late
    assert (paths[0] != paths[1]).any()


def test_modem_stands_in_for_the_link_where_a_policy_can_read_either(tmp_path):
    """Not for a policy that requires both, nor for an actor that was trained on the link."""
    scenario = load_scenario(STARTER, overrides={"sonar.channels": ["link", "modem"]})
    assert with_policy_requirements("sff", scenario).sonar.channels == ("modem",)
    assert with_policy_requirements("tests.test_disturbances_modem:Both", scenario).sonar.channels == ("link", "modem")
    linked = saved(tmp_path, load_scenario(STARTER, overrides={"sonar.channels": ["link"]}))
    assert with_policy_requirements(linked, scenario).sonar.channels == ("link",)


class Both(Policy):
    """Compares messages with true values."""

    requirements = PolicyRequirements(("link", "modem"))
