"""Laws of the stability study: the linear part is that of the real swarm, and weaving is as predicted."""

import math

import numpy as np
import pytest

from research.dynamics import formation, rest, stability
from uuv_marl import load_scenario
from uuv_marl.baselines.paper.bio_inspired import BioInspiredGains
from uuv_marl.sim.swarm import Swarm

GAINS = BioInspiredGains()


@pytest.fixture(scope="module")
def seven():
    """A formation of seven vehicles in balance."""
    return formation.formations(formation.straight_leg(7), GAINS, [0])[0]


def timed(scenario, control_step_s, steps=1):
    clocks = dict.fromkeys(("timing.control_step_s", "timing.decision_period_s"), control_step_s)
    return load_scenario(scenario, overrides=clocks | {"timing.integration_step_s": control_step_s / steps})


def placed(scenario, found, worlds=1):
    """A swarm in steady tracking at l(0) = 0, and the paper's law."""
    swarm = Swarm(scenario, worlds)
    swarm.reset(0)
    swarm.state.eta[:, :, :2], swarm.state.eta[:, :, 2] = found.places, 0.0
    swarm.state.nu[:] = [scenario.trajectory.speed_mps, 0.0, 0.0]
    law = rest.Variant("", yaw_damping_nms=scenario.actuators.yaw_damping_nms)
    return swarm, law.policy(scenario, worlds)


def relative(swarm):
    """States (x, y, psi, u, v, r) relative to l(t), shape (world, 6 vehicle)."""
    states = np.concatenate([swarm.state.eta, swarm.state.nu], axis=2)
    states[:, :, :2] -= swarm.facts.reference[:, 0, None, :2]
    return states.reshape(len(states), -1)


def test_stiffness_is_the_slope_of_the_force():
    rng = np.random.default_rng(0)
    places = rng.uniform(-60.0, 60.0, (12, 2))
    heard = np.where(rng.random((12, 5)) < 0.8, rng.integers(0, 12, (12, 5)), -1)
    heard[heard == np.arange(12)[:, None]] = -1
    slopes = []
    for step in 1e-5 * np.eye(24):
        ahead, astern = places + step.reshape(12, 2), places - step.reshape(12, 2)
        slopes.append(formation.forces(ahead, heard, GAINS) - formation.forces(astern, heard, GAINS))
    expected = np.reshape(slopes, (24, 24)).T / 2e-5
    np.testing.assert_allclose(formation.stiffness(places, heard, GAINS), expected, rtol=1e-5, atol=1e-3)


def test_the_real_swarm_stays_in_a_settled_formation(seven):
    assert seven.settled
    scenario = formation.straight_leg(7)
    swarm, policy = placed(scenario, seven)
    before = relative(swarm)
    for _ in range(3):
        swarm.step(policy.act(swarm.observe()))
    np.testing.assert_allclose(relative(swarm), before, atol=2e-5)


@pytest.mark.parametrize(("control_step_s", "damping"), [(0.1, 0.0), (0.05, 60.0)])
def test_the_loop_is_the_slope_of_one_step_of_the_real_swarm(seven, control_step_s, damping):
    scenario = timed(formation.straight_leg(7, damping), control_step_s, steps=5)
    steps = np.diag(np.tile([2e-2, 2e-2, 1e-3, 1e-3, 1e-3, 1e-3], 7))
    shifts = np.concatenate([steps, -steps])
    swarm, policy = placed(scenario, seven, len(shifts))
    swarm.state.eta[:] += shifts.reshape(-1, 7, 6)[..., :3]
    swarm.state.nu[:] += shifts.reshape(-1, 7, 6)[..., 3:]
    percept = swarm.observe()
    assert (swarm.detected_index == seven.neighbour_indices).all()
    swarm.step(policy.act(percept))
    after = relative(swarm)
    slope = (after[:42] - after[42:]).T / (2.0 * steps.sum(axis=0))
    rigid = formation.stiffness(seven.places, seven.neighbour_indices, GAINS)
    np.testing.assert_allclose(slope, stability.loop(scenario, rigid, control_step_s), atol=5e-3)


@pytest.mark.parametrize(("control_step_s", "grows"), [(0.02, False), (0.06, True)])
def test_a_lone_vehicle_weaves_as_predicted(control_step_s, grows):
    """With a short hold it straightens, with a long one it swings up, at the rate that the eigenvalues say."""
    lone = -GAINS.zeta_l * np.eye(2)  # the pull to l(t) alone
    scenario = timed(formation.straight_leg(1), control_step_s)
    rate = stability.rates(stability.eigenvalues(scenario, lone, control_step_s)).weaving
    assert (rate > 0.0) == grows
    found = formation.formations(scenario, GAINS, [0], rounds=200)[0]
    swarm, policy = placed(scenario, found)
    swarm.state.nu[0, 0, 2] = 2e-3
    percept, yaw = swarm.observe(), []
    for _ in range(round(24.0 / control_step_s)):
        percept = swarm.step(policy.act(percept))
        yaw.append(abs(swarm.state.nu[0, 0, 2]))
    early, late = (max(yaw[round(t / control_step_s) : round((t + 3.0) / control_step_s)]) for t in (6.0, 20.0))
    assert math.log(late / early) / 14.0 == pytest.approx(rate, abs=0.02)
