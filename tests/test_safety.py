"""The safety filter: what keeps to it stays beyond the margins, and where nothing is near it changes nothing."""

import numpy as np
import pytest

from tests.swarms import piloted
from uuv_marl import evaluate, load_scenario
from uuv_marl.baselines import Policy, PolicyError, make_policy, with_policy_requirements
from uuv_marl.baselines.requirements import PolicyRequirements
from uuv_marl.baselines.safety.barrier import Barrier
from uuv_marl.baselines.safety.guarded import Guarded


class Ahead(Policy):
    """Full thrust, and nothing else."""

    requirements = PolicyRequirements(yaw_damping_nms=600.0)

    def decide(self, percept):
        action = np.zeros((*percept.flat.shape[:2], 2), np.float32)
        action[..., 0] = 1.0
        return action


HERE = "tests.test_safety:Ahead"
AHEAD = {"obstacles": [{"centre_m": [300.0, 0.0], "radius_m": 20.0}]}
COURSE = {"trajectory.waypoints_m": [[0.0, 0.0], [900.0, 0.0]]}


def placed(overrides, poses, name, **parameters):
    """A swarm with its vehicles at (x, y, heading), and a policy for it."""
    swarm, policy = piloted(name, "single_obstacle", COURSE | overrides, n=len(poses), **parameters)
    swarm.state.eta[0], swarm.state.nu[0] = np.array(poses), 0.0
    return swarm, policy, swarm.observe()


@pytest.mark.parametrize("period", [0.1, 0.5, 1.2])
@pytest.mark.parametrize("echoes", ["centre", "surface"])
@pytest.mark.parametrize("aside", [0.0, 12.0])
def test_who_steers_at_an_obstacle_stays_beyond_the_margin(period, echoes, aside):
    overrides = AHEAD | {"timing.decision_period_s": period, "sonar.echo_reports": echoes}
    swarm, policy, percept = placed(overrides, [(150.0, aside, 0.0)], f"{HERE},safety_filter=true")
    nearest = np.inf
    for _ in range(round(60 / period)):
        percept = swarm.step(policy.act(percept))
        nearest = min(nearest, np.hypot(swarm.state.eta[0, 0, 0] - 300.0, swarm.state.eta[0, 0, 1]) - 20.0)
    assert nearest > policy.barrier.obstacle_m - (1.5 if period < 1.0 else 4.0), "sway can not be braked"
    assert nearest < policy.barrier.obstacle_m + (3.0 if period < 1.0 else 8.0), "nor need it stay so far away"


def test_two_that_meet_head_on_stay_beyond_the_margin():
    swarm, policy, percept = placed(
        {"obstacles": []}, [(0.0, 0.0, 0.0), (120.0, 0.5, np.pi)], f"{HERE},safety_filter=true"
    )
    nearest = np.inf
    for _ in range(400):
        percept = swarm.step(policy.act(percept))
        nearest = min(nearest, np.hypot(*(swarm.state.eta[0, 0, :2] - swarm.state.eta[0, 1, :2])))
    assert 6.5 < nearest < 12.0


def test_who_backs_into_what_it_no_longer_hears_is_stopped():
    """The cause of the shipped learned policy's collisions: thrust astern, an obstacle outside the active fan."""

    class Astern(Ahead):
        def decide(self, percept):
            return -super().decide(percept)

    swarm, _, percept = placed(AHEAD, [(240.0, 0.0, 0.0)], HERE)
    for acts, meets in ((Astern(swarm.scenario), True), (Guarded(swarm.scenario, inner=Astern(swarm.scenario)), False)):
        swarm.reset(0)
        swarm.state.eta[0], swarm.state.nu[0] = [(240.0, 0.0, 0.0)], 0.0
        percept = swarm.observe()
        for _ in range(10):  # it hears the obstacle ahead,
            percept = swarm.step(np.zeros((1, 1, 2), np.float32) * acts.act(percept))
        swarm.state.eta[0, 0, 2] = np.pi  # turns its back to it, which its own dead reckoning is told,
        if acts.Memory:
            acts.memory.pose[0, 0, 2:] *= -1.0
        percept = swarm.observe()
        clearance = np.inf
        for _ in range(150):  # and runs astern.
            percept = swarm.step(acts.act(percept))
            clearance = min(clearance, np.hypot(swarm.state.eta[0, 0, 0] - 300.0, swarm.state.eta[0, 0, 1]) - 20.0)
        assert bool(clearance < 0.0) is meets
        assert meets or clearance > 5.0


@pytest.mark.parametrize("name", ["bio_inspired", "mappo"])
def test_where_nothing_is_near_no_action_changes(name):
    poses = [(0.0, 0.0, 0.3), (200.0, 250.0, -1.0), (-300.0, 100.0, 2.0)]
    swarm, bare, percept = placed({"obstacles": []}, poses, name)
    guarded = make_policy(f"{name},safety_filter=true", swarm.scenario)
    for _ in range(round(10.0 / swarm.scenario.timing.decision_period_s)):
        action = bare.act(percept)
        np.testing.assert_array_equal(guarded.act(percept), action)
        percept = swarm.step(action)


@pytest.mark.parametrize("name", ["sff", "olfati_saber"])
def test_policies_that_collide_alone_do_not_inside_the_filter(name):
    """On a crowded field of the tuning seeds; more are in docs/policies.md."""
    collisions = {}
    for policy in (name, f"{name},safety_filter=true"):
        collisions[policy] = evaluate(policy, "random_field", [10_007])[0]["collisions"]
    assert collisions[name] > 0
    assert collisions[f"{name},safety_filter=true"] == 0


def test_the_filter_takes_margins_and_parameters_of_the_policy_inside():
    scenario = with_policy_requirements("bio_inspired,safety_filter=true", load_scenario("starter"))
    policy = make_policy("bio_inspired,zeta_n=0.5,safety_filter=true", scenario, barrier=Barrier(obstacle_m=9.0))
    assert policy.name == "bio_inspired,zeta_n=0.5,safety_filter=true"
    assert policy.parts["inner"].gains.zeta_n == 0.5
    assert policy.barrier.obstacle_m == 9.0
    guarded = make_policy("sff,safety_filter=true", with_policy_requirements("sff,safety_filter=true", scenario))
    with pytest.raises(PolicyError, match=r"the snapshot's identity must be"):
        guarded.restore(guarded.snapshot() | {"inner.identity": np.zeros(3)})


@pytest.mark.parametrize("echoes", ["centre", "surface"])
def test_scout_arrives_and_touches_nothing(echoes):
    runs = evaluate("scout", "random_field", [10_007, 10_008], overrides={"sonar.echo_reports": echoes})
    assert all(run["collisions"] == 0 and run["task_time_s"] is not None for run in runs)
