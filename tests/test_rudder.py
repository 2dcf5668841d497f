"""From a desired force to a rudder, and policies on vehicles other than the paper's."""

import math
import re

import numpy as np
import pytest

from tests.swarms import fly, piloted
from uuv_marl import load_scenario
from uuv_marl.baselines import PolicyError, make_policy
from uuv_marl.baselines.policy import Limits
from uuv_marl.baselines.requirements import inner_loop_nms
from uuv_marl.baselines.rudder import STEERAGE, Rudder, steer_by_rudder
from uuv_marl.baselines.steering import steer
from uuv_marl.percept import Percept, PerceptLayout
from uuv_marl.train.training import overrides_for


def with_vehicle(vehicle, num_vehicles=1, speed=1.5):
    """The paper's obstacle at a speed of the vehicle."""
    return load_scenario(
        "single_obstacle", num_vehicles=num_vehicles, overrides={
            "vehicle": vehicle, "trajectory.speed_mps": speed, "start.speed_max_mps": speed,
            "timing.integration_step_s": 0.025, "arrival.criterion": "passage",
        },
    )  # fmt: skip


def helm(scenario, force, u):
    """Thrust and rudder for a desired force, body frame, as shares of full thrust and torque."""
    layout = PerceptLayout.of(scenario)
    flat = np.zeros((1, 1, layout.size), np.float32)
    Percept(flat, layout)["velocity"][..., 0] = u
    action = np.array([[force]], np.float32)
    steer_by_rudder(flat, layout.offsets, Rudder.of(scenario), action)
    return action[0, 0].tolist()


LAUV = with_vehicle("lauv")


@pytest.mark.parametrize("u", [0.75, 1.0, 1.5, 1.9])
def test_a_rudder_gives_the_desired_moment(u):
    """Where it can: moment over N_uud u^2, from the plant's own numbers."""
    actuators, desired = LAUV.actuators, 0.1
    _, share = helm(LAUV, (0.5, desired), u)
    angle = share * math.radians(actuators.rudder_max_deg)
    assert abs(actuators.N_uud) * u**2 * angle == pytest.approx(desired * actuators.max_torque_nm, rel=1e-5)


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
    assert helm(with_vehicle("remus100"), (-0.7, 0.0), 1.5)[0] == pytest.approx(-0.7), "it has thrust astern"


@pytest.mark.parametrize("desired", [(1.0, 0.0), (1.0, 0.4), (-1.0, 0.5), (0.2, -3.0)])
def test_to_a_desired_velocity_a_rudder_turns_by_the_angle_whatever_the_hull_slips(desired):
    actions = np.zeros((3, 2), np.float32)
    for v, out in zip((-0.3, 0.0, 0.3), actions, strict=True):
        steer(*desired, 1.0, v, 50.0, Limits.of(LAUV), out)
    assert (actions == actions[0]).all()
    angle = math.atan2(desired[1], desired[0])
    rudder = np.clip(math.sin(angle) / math.sin(math.radians(30.0)), -1.0, 1.0)
    assert actions[0, 1] == pytest.approx(rudder if desired[0] > 0.0 else math.copysign(1.0, angle))


@pytest.mark.parametrize("name", ["lauv", "remus100"])
def test_torpedoes_pass_an_obstacle_without_a_collision(name):
    (swarm, policy), collisions = piloted("scout", with_vehicle(name, num_vehicles=12), seed=10_000), 0
    while not swarm.ended[0]:
        fly(swarm, policy, 1)
        collisions += int(swarm.facts.collisions[0])
    assert swarm.arrived[0]
    assert collisions == 0


def test_a_yaw_damping_that_the_vehicle_lacks_is_named_in_its_own_size():
    rov = with_vehicle("bluerov2_heavy", speed=0.5)
    needed = re.escape(f"a yaw damping of {inner_loop_nms(600.0, 3000.0, rov):g} N m s")
    with pytest.raises(PolicyError, match=f"scout needs {needed}"):
        make_policy("scout", rov)


@pytest.mark.parametrize(("vehicle", "damping"), [("literature_185", 600.0), ("bluerov2_heavy", 5.8), ("lauv", 0.0)])
def test_a_training_has_the_inner_loop_of_its_vehicle(vehicle, damping):
    slow = {"trajectory.speed_mps": 0.5, "start.speed_max_mps": 0.5, "timing.integration_step_s": 0.05}
    changes = overrides_for("random_field", {"vehicle": vehicle, **slow})
    assert changes["actuators.yaw_damping_nms"] == pytest.approx(damping)
    assert load_scenario("random_field", overrides=changes).timing.decision_period_s == 0.5
    assert overrides_for("random_field", {"actuators.yaw_damping_nms": 7.0})["actuators.yaw_damping_nms"] == 7.0
