"""Laws of the policies, and what they demand."""

import dataclasses
import json
import math
import pickle
from importlib import resources

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from research.episodes import read_rows
from tests.golden import STARTER
from tests.nets import ANYWHERE
from tests.processes import ROOT
from tests.swarms import fly, piloted
from uuv_marl import load_scenario, parallel_env, scenario_names
from uuv_marl.baselines import POLICIES, Policy, PolicyError, PolicyRequirements, make_policy, with_policy_requirements
from uuv_marl.baselines.paper import bio_inspired, sdc, sff
from uuv_marl.baselines.scout.gains import DEFAULT_PRESET, PRESETS
from uuv_marl.benchmark.tuning import OBJECTIVES, SPACES, TRIALS
from uuv_marl.percept import Percept, PerceptLayout
from uuv_marl.sim.swarm import Swarm

WITH_MEMORY = ["sff", "sdc", "scout", "tangent_bug", "sff,safety_filter=true"]
FOLDER = resources.files("uuv_marl.baselines") / "tuned"
TRIED = ROOT / "research" / "tuned"
GAINS = bio_inspired.BioInspiredGains()


def test_the_default_gains_are_table_1():
    assert GAINS[:5] == (30.0, 0.8, 60.0, 8.0, 80.0)
    assert GAINS.feed_forward == 0.0


@given(st.floats(-400, 400), st.floats(-400, 400))
def test_pair_forces_are_central_and_opposite(x, y):
    a = bio_inspired.neighbour_force(x, y, GAINS)
    b = bio_inspired.neighbour_force(-x, -y, GAINS)
    assert a[:2] == pytest.approx((-b[0], -b[1]))
    assert a[0] * y == pytest.approx(a[1] * x, rel=1e-9, abs=1e-6)


def test_clamps_bind_only_where_equation_20_overflows_and_are_counted():
    assert bio_inspired.bounded_exp(60.0, 2.0) == (math.exp(30.0), 0)
    assert bio_inspired.bounded_exp(60.0, 0.1) == (math.exp(50.0), 1)
    assert bio_inspired.bounded_exp(10.0, 0.1) == (math.exp(20.0), 1)


def written_as_in_the_paper(percept, gains, limits):
    """Eq. 18-22 with NumPy, for one vehicle."""
    force = gains.zeta_l * percept["reference"].astype(float)
    for heard, p in zip(percept["detected"], percept["neighbour"].astype(float), strict=True):
        if heard:
            d = np.hypot(*p)
            force += gains.zeta_n * -p * (np.exp(gains.delta_n / d) - np.e)
    for echo, p in zip(percept["echo"], percept["echo_position"].astype(float), strict=True):
        if echo:
            force += gains.zeta_o * np.exp(gains.delta_o / np.hypot(*p)) * -p
    action = force / [limits.max_force, limits.max_torque]
    return action / max(1.0, np.hypot(*action))


@settings(max_examples=15)
@given(st.integers(0, 1000))
def test_the_controller_is_equations_18_to_22(seed):
    swarm, policy = piloted("bio_inspired", "single_obstacle", seed=seed)
    swarm.state.eta[0, :, :2] += 150.0  # before and beside the obstacle
    percept = swarm.observe()
    action = policy.act(percept)
    assert action.dtype == np.float32
    assert percept["echo"].any()
    for i in range(54):
        mine = Percept(percept.flat[0, i], percept.layout)
        np.testing.assert_allclose(action[0, i], written_as_in_the_paper(mine, GAINS, policy.limits), atol=1e-5)


@pytest.mark.parametrize("name", [*(name for name in ANYWHERE if name != "random"), "mappo,safety_filter=true"])
def test_forces_turn_with_the_world(name):
    """Body-frame actions don't change, up to float32, when the world is rotated and moved."""
    turn, (x, y) = 0.7, (50.0, -80.0)
    rotation = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    actions = []
    for moved in (False, True):
        swarm, policy = piloted(name, "single_obstacle", seed=3, n=20)
        swarm.state.eta[0, :, :2] += 150.0
        if moved:
            swarm.state.eta[0, :, :2] = swarm.state.eta[0, :, :2] @ rotation.T + (x, y)
            swarm.state.eta[0, :, 2] += turn
            swarm.world_map.obstacles[0, :, :2] = swarm.world_map.obstacles[0, :, :2] @ rotation.T + (x, y)
            swarm.world_map.waypoints[0, 0] = swarm.world_map.waypoints[0, 0] @ rotation.T + (x, y)
        percept = swarm.observe()
        if name.startswith("sdc"):  # its lattice lies north-east, so only the move is a symmetry
            policy.act(percept)
            if moved:
                policy.memory.slots[...] = policy.memory.slots @ rotation.T
        actions.append(policy.act(percept))
    if not name.startswith("sdc"):
        np.testing.assert_allclose(actions[0], actions[1], atol=2e-4)


@pytest.mark.parametrize("name", [name for name in ANYWHERE if name != "random"])
def test_who_a_vehicle_is_does_not_matter(name):
    """Vehicles that swap their places swap their actions."""
    order, actions = np.random.default_rng(0).permutation(20), []
    for places in (np.arange(20), order):
        swarm, policy = piloted(name, "single_obstacle", seed=3, n=20)
        swarm.state.eta[0, :, :2] += 150.0
        swarm.state.eta[0], swarm.state.nu[0] = swarm.state.eta[0, places], swarm.state.nu[0, places]
        actions.append(policy.act(swarm.observe())[0])
    np.testing.assert_allclose(actions[0][order], actions[1], atol=1e-6)


@given(st.floats(10.0, 26.0), st.floats(4.0, 20.0))
def test_clustering_repels_within_its_distance_and_attracts_beyond(distance, width):
    gains = sff.SffGains(1, 1, 100.0, distance, width, 60.0, 0, 0, 0, 1, 0, 1, 0)
    assert sff.clustering(distance, gains) == 0.0
    assert sff.clustering(distance - 5.0, gains) < 0 < sff.clustering(distance + 5.0, gains)
    assert sff.clustering(60.0, gains) == 0.0


def test_sff_predicts_where_a_neighbour_will_be():
    """A neighbour that closes in is pushed away earlier than one that stands, in whatever frame the vehicle turns."""
    gains = sff.SffGains(0.001, 60, 600.0, 18.0, 12.0, 40.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 0.0)
    scenario = with_policy_requirements("sff", load_scenario("tracking", num_vehicles=2))
    layout = PerceptLayout.of(scenario)

    def second_action(before, now, yaw_rate=0.0):
        policy = make_policy("sff", scenario, gains=gains)
        for place in (before, now):
            flat = np.zeros((1, 2, layout.size), np.float32)
            percept = Percept(flat, layout)
            percept["detected"][0, 0, 3] = 1
            percept["neighbour"][0, 0, 3] = place
            percept["link_identity"][0, 0, 3] = 2
            percept["yaw_rate"][0, 0] = yaw_rate
            action = policy.act(percept)
        return action[0, 0]

    standing = second_action((20.0, 0.0), (20.0, 0.0))
    closing = second_action((20.4, 0.0), (20.0, 0.0))
    np.testing.assert_allclose(standing, [sff.clustering(20.0, gains) / 3000, 0.0], atol=1e-7)
    np.testing.assert_allclose(closing, [sff.clustering(16.0, gains) / 3000, 0.0], atol=1e-5)
    turned = 20.0 * math.cos(0.05), -20.0 * math.sin(0.05)
    turning = second_action((20.0, 0.0), turned, yaw_rate=0.5)
    assert np.hypot(*turning) == pytest.approx(np.hypot(*standing), rel=1e-3)


@pytest.mark.parametrize("n", [1, 2, 7, 54, 200])
def test_slots_are_a_lattice_around_zero(n):
    slots = sdc.hexagonal_slots(n)
    assert slots.shape == (n, 2)
    np.testing.assert_allclose(slots.mean(axis=0), 0.0, atol=1e-9)
    if n > 1:
        away = np.hypot(*(slots[:, None] - slots[None]).transpose(2, 0, 1)) + 1e9 * np.eye(n)
        np.testing.assert_allclose(away.min(axis=1), sdc.SLOT_PITCH_M)


@pytest.mark.parametrize("file", SPACES)
def test_tuned_gains_come_from_shipped_trials(file):
    data = json.loads((FOLDER / f"{file}.json").read_text())
    trials = read_rows(TRIED / f"{file}.csv.gz")
    name, _, what = file.partition(".")
    assert len(trials) == TRIALS
    assert data["objective"] in OBJECTIVES
    assert all(10_000 <= seed < 100_000 for seed in data["seeds"])
    best = {key: float(value) for key, value in min(trials, key=lambda trial: float(trial["cost_s"])).items()}
    assert best == {"cost_s": data["best_cost_s"], **data["best"]}
    chosen = {"scout": "scout,preset=closed", "nearest_target.lanes": "nearest_target,lanes=true"}
    policy = chosen.get(file, f"{name},tuned_for={what}" if what else name)
    flown_in = "silent_targets" if name == "nearest_target" else "tracking"
    made = make_policy(policy, with_policy_requirements(policy, load_scenario(flown_in)))
    numbers = vars(made) | made.gains._asdict() | (made.barrier._asdict() if hasattr(made, "barrier") else {})
    assert {key: numbers[key] for key in data["best"]} == data["best"]


def flown(name):
    swarm, policy = piloted(name, STARTER, worlds=2)
    policy.reset(0)
    return swarm, policy, fly(swarm, policy, 6)


@pytest.mark.parametrize("name", [*ANYWHERE, "mappo,safety_filter=true"])
def test_a_policy_pickles_with_its_memory_and_goes_on_from_a_snapshot(name):
    swarm, policy, percept = flown(name)
    again, kept, water = pickle.loads(pickle.dumps(policy)), policy.snapshot(), swarm.snapshot()
    first = policy.act(percept)
    assert np.array_equal(again.act(percept), first)
    swarm.step(first)
    policy.act(swarm.percept)
    swarm.restore(water)
    policy.restore(kept)
    assert np.array_equal(policy.act(swarm.percept), first)
    with pytest.raises(PolicyError, match="clamps must be int64 of shape"):
        policy.restore({**kept, "clamps": np.zeros(5)})


@pytest.mark.parametrize("name", WITH_MEMORY)
def test_a_policy_with_memory_notices_what_it_was_left_out_of(name):
    swarm, policy, percept = flown(name)
    first = policy.act(percept)
    assert np.array_equal(policy.act(percept), first), "asked twice at one time, it must say the same"
    swarm.step(first)
    swarm.step(first)
    with pytest.raises(PolicyError, match=r"was called at 0\.6 s and then at 0\.8 s in world 0, but its memory needs"):
        policy.act(swarm.percept)
    policy.reset(0)
    policy.act(swarm.percept)


@pytest.mark.parametrize("name", WITH_MEMORY)
def test_a_world_that_was_reset_is_forgotten_without_a_word(name):
    """So that memory does not outlive an autoreset, whichever API did it; the other world keeps its own."""
    swarm, policy, percept = flown(name)
    before = [array[1].copy() for array in policy.memory]
    percept = swarm.reset([5], worlds=[0])
    action = policy.act(percept)
    alone = make_policy(name, swarm.scenario, 1)
    assert np.array_equal(action[0], alone.act(Swarm(swarm.scenario).reset(5))[0])
    assert any(not np.array_equal(now[0], then) for now, then in zip(policy.memory, before, strict=True))
    idle = policy.memory[0][0].copy()
    policy.active[:] = [False, True]
    swarm.step(action)
    policy.act(swarm.percept)
    assert np.array_equal(policy.memory[0][0], idle), "a world that does not count was remembered"


def test_gains_and_parameters_can_be_written_behind_a_name():
    scenario = load_scenario(STARTER)
    policy = make_policy("bio_inspired,zeta_n=0.5,obstacle_term=per_obstacle", scenario)
    assert policy.gains == bio_inspired.BioInspiredGains(zeta_n=0.5)
    assert make_policy("bio_inspired", scenario, zeta_n=0.5).gains == policy.gains
    percept = Swarm(scenario).reset(0)
    assert not np.array_equal(policy.act(percept), make_policy("bio_inspired", scenario).act(percept))
    assert with_policy_requirements("sff,cluster=3", scenario).sonar.channels == ("link",)


def test_a_preset_is_a_set_of_numbers_of_which_each_can_still_be_given():
    scenario = with_policy_requirements("scout", load_scenario(STARTER))
    assert make_policy("scout", scenario).gains == make_policy(f"scout,preset={DEFAULT_PRESET}", scenario).gains
    for name, preset in PRESETS.items():
        policy = make_policy(f"scout,preset={name},push=3.5,safety_filter=true", scenario).parts["inner"]
        assert (policy.gains, policy.barrier) == (preset.gains._replace(push=3.5), preset.barrier)
        assert make_policy("scout", scenario, preset=name).gains == preset.gains


def test_a_remedy_is_one_that_helps():
    fixed = load_scenario("random_field", overrides={"timing.fixed": True})
    with pytest.raises(PolicyError, match="add own_clock=true to the policy's name"):
        make_policy("mappo", with_policy_requirements("mappo", fixed))
    make_policy("mappo,own_clock=true", with_policy_requirements("mappo,own_clock=true", fixed))
    with pytest.raises(PolicyError, match="override these fields$"):
        make_policy("sdc", fixed)


class Acts(Policy):
    """Has another's method, and not its own."""

    def act(self, percept):
        return np.zeros((*percept.flat.shape[:2], 2), np.float32)


class Returns(Policy):
    """Returns what it is told."""

    output = ()

    def decide(self, percept):
        return np.zeros(self.output, np.float32)


@pytest.mark.parametrize("shape", [(1, 5, 1), (1, 5, 7), (5, 2), (1, 4, 2)])
def test_actions_of_another_shape_are_refused(shape):
    env = parallel_env(STARTER)
    policy = Returns(env.scenario)
    policy.output = shape
    env.reset(seed=0)
    with pytest.raises(PolicyError, match=r"decide must return an array of shape \(1, 5, 2\), got \("):
        policy.act(env.swarm.percept)


def test_a_class_stands_for_its_name():
    class Slow(Policy):
        requirements = PolicyRequirements(channels=("compass",), decision_period_s=0.4, yaw_damping_nms=300.0)

    scenario = with_policy_requirements(Slow, load_scenario("tracking"))
    assert "compass" in scenario.sonar.channels
    assert (scenario.timing.decision_period_s, scenario.actuators.yaw_damping_nms) == (0.4, 300.0)


@pytest.mark.parametrize(("name", "message"), [
    ("tests.test_baselines:Acts+mappo", r"no attribute 'Acts\+mappo'.*; a team has the form scout@uuv_0\+mappo"),
    ("sff", "link .sonar.channels.*use an environment's for_policy, with_policy_requirements"),
    ("sdc", "compass and link and identity .sonar.channels.*use an environment.s for_policy, with_policy"),
    ("bio_inspired_plus", "yaw damping of 600 .*actuators.yaw_damping_nms.*with_policy_requirements"),
    ("tests.test_baselines:Acts", r"policy '.*Acts' must define decide\(percept\), and leave act, .* alone"),
    ("bio_inspired,zeta_m=1", "has no parameter 'zeta_m'; did you mean 'zeta_"),
    ("bio_inspired,zeta_n=x", "the gain zeta_n must be a finite number, got 'x'"),
    ("bio_inspired,zeta_n=nan", "the gain zeta_n must be a finite number, got nan"),
    ("bio_inspired,zeta_n", "'zeta_n' must be key=value"),
    ("bio_inspired,obstacle_term=none", "obstacle_term must be 'per_echo' or 'per_obstacle', got 'none'"),
    ("scout,preset=bold", "preset of scout must be one of base, plus, lead, wary, closed, gap, got 'bold'"),
    ("bio_insp,safety_filter=true", "did you mean 'bio_inspired'"),
    ("idle,barrier=5,safety_filter=true", "barrier must be a uuv_marl.baselines.safety.Barrier, got '5'"),
    ("idle,safety_filter=perhaps", "safety_filter must be true or false, got 'perhaps'"),
])  # fmt: skip
def test_a_name_that_means_nothing_is_explained(name, message):
    with pytest.raises(PolicyError, match=message):
        make_policy(name, load_scenario(STARTER))
    with pytest.raises(PolicyError, match=message):
        make_policy(name, parallel_env(STARTER))


def test_what_a_policy_cannot_be_made_for_is_explained():
    damped = with_policy_requirements("bio_inspired_plus", load_scenario("tracking"))
    for arguments, message in (((damped,), "yaw damping of 0"), (("tracking",), "made for a Scenario"),
                               ((load_scenario("tracking"), 0), "num_worlds must be at least 1")):  # fmt: skip
        with pytest.raises(PolicyError, match=message):
            make_policy("bio_inspired", *arguments)


@pytest.mark.parametrize(("change", "damping"), [
    ({}, 600.0),
    ({"actuators.max_torque_nm": 30.0, "vehicle.N_r": 5.0}, 6.0),
    ({"actuators.kind": "rudder", "actuators.N_uud": -40.0, "actuators.rudder_max_deg": 20.0}, 0.0),
], ids=["as declared", "a hundredth of the torque", "rudder"])  # fmt: skip
@pytest.mark.parametrize("name", ["scout", "mappo"])
def test_the_inner_loop_is_scaled_with_the_vehicle_s_torque(name, change, damping):
    scenario = with_policy_requirements(name, load_scenario("single_obstacle", num_vehicles=3, overrides=change))
    assert scenario.actuators.yaw_damping_nms == pytest.approx(damping, rel=1e-12)
    any_vehicle = {"any_vehicle": True} if name == "mappo" else {}
    percept = Swarm(scenario).reset(0)
    assert np.isfinite(make_policy(name, scenario, **any_vehicle).act(percept)).all()


@pytest.mark.parametrize("name", [*POLICIES, "nearest_target,lanes=true", "sdc,safety_filter=true"])
def test_vehicles_that_perceive_the_same_act_alike(name):
    """No policy but ``random`` uses a vehicle's row; ``identity`` is a channel."""
    plain = name.partition(",")[0].removeprefix("mappo_").removesuffix("_messages")
    homes = {"nearest_target": "silent_targets", "oracle": "hard_water", "carrot_informed": "hard_water"}
    home = homes.get(plain, plain if plain in scenario_names() else "starter")
    scenario = with_policy_requirements(name, load_scenario(home, num_vehicles=4))
    policy, alike, swarm = make_policy(name, scenario), make_policy(name, scenario), Swarm(scenario)
    percept, acted_alike = swarm.reset(3), True
    for _ in range(12):
        action = policy.act(percept).copy()
        copies = dataclasses.replace(percept, flat=np.repeat(percept.flat[:, 2:3], 4, axis=1))
        acted = alike.act(copies)
        acted_alike &= np.allclose(acted, acted[:, :1], atol=1e-3)
        percept = swarm.step(action)
    assert acted_alike == (name != "random")
