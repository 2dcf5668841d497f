"""Vehicles identify how their actuators answer, and a law with a lead makes up for it."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from tests.swarms import fly, piloted
from tests.test_memory import room
from uuv_marl.baselines.memory.actuators import answer, identify, lead

PERIOD_S = 0.1
LAGS = st.floats(0.05, 2.0)
SHARES = st.floats(0.1, 1.0)


class Component:
    """An actuator that lags by so many seconds and gives so large a share of what is asked; and what is seen of it."""

    def __init__(self, lag_s, share, drift=0.0):
        self.e = math.exp(-PERIOD_S / lag_s)
        self.mean = (1.0 - self.e) * lag_s / PERIOD_S
        self.share, self.drift, self.acts, self.kept = share, drift, 0.0, room()

    def step(self, asked):
        left = self.acts - self.share * asked
        self.acts = self.share * asked + self.e * left
        acted = self.share * asked + self.mean * left
        identify(0, 0, 1, asked, acted + self.drift - asked, PERIOD_S, self.kept)


@given(lag_s=st.floats(0.05, 0.5), share=st.floats(0.5, 1.0), drift=st.floats(-0.2, 0.2), seed=st.integers(0, 99))
def test_lag_and_weakness_of_actuators_are_identified_from_any_actions(lag_s, share, drift, seed):
    rng, component = np.random.default_rng(seed), Component(lag_s, share, drift)
    for asked in rng.uniform(-1.0, 1.0, 200):
        component.step(asked)
    e, found, at_once = answer(0, 0, 1, component.kept)
    assert e == pytest.approx(component.e, abs=0.05)
    assert found * (1.0 - e) == pytest.approx(share * (1.0 - component.e), abs=0.03)
    assert at_once == pytest.approx(share * (1.0 - component.mean), abs=0.03)
    assert answer(0, 0, 0, component.kept) == (0.0, 1.0, 1.0), "the other component"


@given(lag_s=LAGS, share=SHARES, wanted=st.floats(-0.5, 0.5), seed=st.integers(0, 99))
def test_with_a_lead_what_is_wanted_acts_after_one_period(lag_s, share, wanted, seed):
    rng, component = np.random.default_rng(seed), Component(lag_s, share)
    assume(share * (1.0 - component.e) > 0.08)  # of what hardly answers in a period, a lead asks for no more
    for asked in rng.uniform(-1.0, 1.0, 200):
        component.step(asked)
    asked = lead(0, 0, 1, wanted, 1.0, component.kept)
    assert abs(asked) <= 1.0
    component.step(asked)
    if abs(asked) < 0.999 and answer(0, 0, 1, component.kept)[2] < 0.7:
        assert component.acts == pytest.approx(wanted, abs=0.02)
    assert lead(0, 0, 1, wanted, 0.0, component.kept) == wanted, "no lead asks for what is wanted"


@pytest.mark.parametrize(("overrides", "least"), [
    ({"actuators.thrust_lag_s": 0.2, "actuators.yaw_lag_s": 0.2}, 5.0),
    ({"actuators.thrust_lag_s": 0.5, "actuators.yaw_lag_s": 0.5}, 5.0),
    ({"actuators.yaw_authority": 0.2}, 5.0),
], ids=["0.2 s", "0.5 s", "weak"])  # fmt: skip
def test_with_a_lead_vehicles_do_not_swing(overrides, least):
    """The mean yaw rate on a leg is a fraction of that without; margins of two and more over what six seeds showed."""
    rates = []
    for share in (0.0, 1.0):
        swarm, policy = piloted("scout,preset=plus", "tracking", overrides, seed=10_501, n=6, lead=share)
        rate = []
        for k in range(500):
            fly(swarm, policy, 1)
            rate.append(np.abs(swarm.state.nu[0, :, 2]).mean() if k > 300 else 0.0)
        rates.append(sum(rate))
    assert rates[0] > least * rates[1]
