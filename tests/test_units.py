"""Policies in the units of a vehicle's scale, and from a wished force to a rudder."""

import math
import re

import numpy as np
import pytest

from tests.conftest import COUPLED, LIFT
from uuv_marl import load_scenario
from uuv_marl.baselines import PolicyError, granted, make
from uuv_marl.baselines.grants import inner_loop_nms
from uuv_marl.baselines.paper.bio_inspired import BioInspired
from uuv_marl.baselines.policy import Limits, Policy
from uuv_marl.baselines.rudder import STEERAGE, Rudder, steer_by_rudder
from uuv_marl.baselines.steering import steer
from uuv_marl.percept import Percept, PerceptLayout
from uuv_marl.scenario.dimensions import converted
from uuv_marl.scenario.scale import Scale
from uuv_marl.sim.swarm import Swarm
from uuv_marl.train.training import overrides_for

POLICIES = (
    "bio_inspired", "bio_inspired_plus", "scout", "sff", "sdc", "apf", "olfati_saber", "orca_informed",
    "pull", "mappo", "guarded:bio_inspired_plus", "guarded:mappo",
)  # fmt: skip
RUDDER = LIFT | {
    "actuators.kind": "rudder", "actuators.Y_uud": 100.0, "actuators.N_uud": -90.0, "actuators.rudder_max_deg": 20.0,
    "actuators.max_astern_n": 100.0, "arrival.by": "passage",
}  # fmt: skip
LAGGING = COUPLED | {"current.speed_mps": 0.25, "actuators.thrust_lag_s": 0.25, "actuators.yaw_lag_s": 0.25}
SHORT = {"random_field.legs": [1, 1], "random_field.leg_length_m": [250.0, 250.0]}


def alike(scenario, length, speed, force):
    """The scenario with a vehicle that is its own in all but its size, in that vehicle's scale."""
    scale = Scale(length=length, speed=speed, force=force)
    return converted(scenario, scale.units).model_copy(update={"scale": scale})


# --- Similarity ---


@pytest.mark.parametrize("scale", [(2.0, 2.0, 16.0), (0.5, 2.0, 1.0), (4.0, 0.5, 0.25)])
@pytest.mark.parametrize(
    ("policy", "vehicle"), [*((name, {}) for name in POLICIES), ("scout,preset=lead", LAGGING), ("scout", RUDDER)]
)
def test_a_vehicle_that_is_alike_swims_alike_bit_for_bit(policy, vehicle, scale):
    """By powers of two, so that nothing is rounded otherwise: the same places over L and velocities over V."""
    plain = load_scenario("random_field", num_vehicles=9, overrides={**SHORT, **vehicle})
    scenarios = granted(policy, plain), granted(policy, alike(plain, *scale))
    swarms = [Swarm(scenario) for scenario in scenarios]
    policies = [make(policy, scenario) for scenario in scenarios[:1]]
    policies.append(make(policy, scenarios[1]))
    percepts = [swarm.reset(10_003) for swarm in swarms]
    for actor in policies:
        actor.reset(10_003)
    length, speed, _ = scale
    for _ in range(150):
        actions = [actor.act(percept) for actor, percept in zip(policies, percepts, strict=True)]
        np.testing.assert_array_equal(*actions)
        percepts = [swarm.step(action) for swarm, action in zip(swarms, actions, strict=True)]
        np.testing.assert_array_equal(swarms[1].state.eta, swarms[0].state.eta * [length, length, 1.0])
        np.testing.assert_array_equal(swarms[1].state.nu, swarms[0].state.nu * [speed, speed, speed / length])
    assert swarms[1].facts.time_s[0] == swarms[0].facts.time_s[0] * length / speed
    np.testing.assert_array_equal(swarms[1].facts.effort, swarms[0].facts.effort)


# --- The rudder ---


def helm(scenario, force, u):
    """Thrust and rudder for a wished force, body frame, as shares of full thrust and torque."""
    layout = PerceptLayout.of(scenario)
    flat = np.zeros((1, 1, layout.size), np.float32)
    Percept(flat, layout)["velocity"][..., 0] = u
    action = np.array([[force]], np.float32)
    steer_by_rudder(flat, layout.offsets, Rudder.of(scenario), action)
    return action[0, 0].tolist()


LAUV = load_scenario("sea_trial", num_vehicles=1, overrides={"vehicle": "lauv", "scale": "vehicle"})


@pytest.mark.parametrize("u", [0.75, 1.0, 1.5, 1.9])
def test_a_rudder_gives_the_moment_that_is_wished(u):
    """Where it can: moment over N_uud u^2, from the plant's own numbers."""
    actuators, wish = LAUV.actuators, 0.1
    _, share = helm(LAUV, (0.5, wish), u)
    angle = share * math.radians(actuators.rudder_max_deg)
    assert abs(actuators.N_uud) * u**2 * angle == pytest.approx(wish * actuators.max_torque_nm, rel=1e-5)


def test_a_rudder_turns_the_bow_to_a_force_astern_and_keeps_steerage_way():
    cruise = LAUV.vehicle.cruise_mps
    assert helm(LAUV, (0.6, 0.0), cruise) == [pytest.approx(0.6), 0.0]
    assert helm(LAUV, (0.6, 1.0), 0.5 * cruise)[1] == 1.0
    assert helm(LAUV, (-1.0, -0.001), cruise) == [0.0, -1.0], "no thrust astern, and hard to port"
    slow = STEERAGE * cruise * 0.99
    thrust, _ = helm(LAUV, (-1.0, 0.0), slow)
    hull = LAUV.vehicle
    resistance = (hull.X_u + hull.X_uu * STEERAGE * cruise) * STEERAGE * cruise
    assert thrust * LAUV.actuators.max_force_n == pytest.approx(resistance)
    assert helm(LAUV, (0.0, 0.1), 0.0)[1] == helm(LAUV, (0.0, 0.1), slow)[1] < 1.0, "flow is bounded below"
    remus = load_scenario("sea_trial", num_vehicles=1, overrides={"vehicle": "remus100", "scale": "vehicle"})
    assert helm(remus, (-0.7, 0.0), 1.5)[0] == pytest.approx(-0.7), "it has thrust astern"


@pytest.mark.parametrize("wished", [(1.0, 0.0), (1.0, 0.4), (-1.0, 0.5), (0.2, -3.0)])
def test_to_a_wished_velocity_a_rudder_turns_by_the_angle_whatever_the_hull_slips(wished):
    limits, given = Limits.of(LAUV), []
    for v in (-0.3, 0.0, 0.3):
        out = np.zeros(2, np.float32)
        steer(*wished, 1.0, v, 50.0, limits, out)
        given.append(out.tolist())
    assert given[0] == given[1] == given[2]
    angle = math.atan2(wished[1], wished[0])
    asked = math.sin(angle) / math.sin(math.radians(30.0))
    assert given[0][1] == pytest.approx(np.clip(asked, -1.0, 1.0) if wished[0] > 0.0 else math.copysign(1.0, angle))


@pytest.mark.parametrize("name", ["lauv", "remus100"])
@pytest.mark.parametrize("policy", ["bio_inspired", "scout"])
def test_torpedoes_pass_the_sea_trial_without_a_collision(policy, name):
    scenario = load_scenario("sea_trial", num_vehicles=12, overrides={"vehicle": name, "scale": "vehicle"})
    scenario = granted(policy, scenario)
    swarm, actor = Swarm(scenario), make(policy, scenario)
    percept, collisions = swarm.reset(10_000), 0
    actor.reset(10_000)
    while not swarm.ended[0]:
        percept = swarm.step(actor.act(percept))
        collisions += int(swarm.facts.collisions[0])
    assert swarm.arrived[0]
    assert collisions == 0


# --- What is refused ---


class Acts(Policy):
    def act(self, percept):
        return np.zeros((*percept.flat.shape[:2], 2), np.float32)


def test_bad_combinations_are_refused_with_the_remedy():
    with pytest.raises(PolicyError, match="computes in the paper's units, .* make it with uuv_marl.baselines.make"):
        BioInspired(LAUV)
    with pytest.raises(PolicyError, match=r"'Acts' must define decide\(percept\), and leave act, .* alone"):
        make("tests.test_units:Acts", LAUV)
    with pytest.raises(PolicyError, match=r"mappo was trained on another vehicle .* any_vehicle=True"):
        make("mappo", granted("mappo", LAUV))
    rov = load_scenario("sea_trial", overrides={"vehicle": "bluerov2_heavy", "scale": "vehicle"})
    needed = re.escape(f"a yaw damping of {inner_loop_nms(600.0, 3000.0, rov):g} N m s")
    with pytest.raises(PolicyError, match=f"scout needs {needed}"):
        make("scout", rov)


# --- Training ---


@pytest.mark.parametrize(("vehicle", "damping"), [("literature_185", 600.0), ("bluerov2_heavy", 5.8), ("lauv", 0.0)])
def test_a_training_has_the_inner_loop_of_its_vehicle(vehicle, damping):
    slow = {"trajectory.speed_mps": 0.5, "start.speed_max_mps": 0.5, "timing.integration_step_s": 0.05}
    changes = overrides_for("random_field", {"vehicle": vehicle, **slow})
    assert changes["actuators.yaw_damping_nms"] == pytest.approx(damping)
    assert load_scenario("random_field", overrides=changes).timing.decision_period_s == 0.5
    assert overrides_for("random_field", {"actuators.yaw_damping_nms": 7.0})["actuators.yaw_damping_nms"] == 7.0
