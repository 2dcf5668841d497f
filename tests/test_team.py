"""Teams: a vehicle acts as in a swarm of its own policy, whatever the others run, and a learner learns from its own."""

import itertools
import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import uuv_marl
from research.episodes import read_rows
from tests.nets import card_for, tensors
from tests.players import CYCLES, PLAYERS, compare, suited
from tests.processes import ROOT, succeeds
from uuv_marl import evaluate, load_scenario
from uuv_marl.baselines import PolicyError, make_policy, with_policy_requirements
from uuv_marl.baselines.learned.checkpoint import WEIGHTS_FILE, save_checkpoint
from uuv_marl.baselines.making import check_base_controller, policy_requirements
from uuv_marl.baselines.team_names import parse_team, policy_name
from uuv_marl.benchmark.evaluate import episodes
from uuv_marl.benchmark.results import Results, policy_info
from uuv_marl.benchmark.runner import run_missing, write_report
from uuv_marl.errors import TrainingError
from uuv_marl.replay.record import record
from uuv_marl.sim.swarm import Swarm

LOSES = {"losses.times_s": [1.0, 2.0]}
MEMBERS = {
    "starter": ("bio_inspired", "scout", "sdc", "orca_informed", "random", "random,safety_filter=true", "mappo"),
    "hard_water": ("tangent_bug", "oracle", "mappo_hard_water", "idle"),
    "few_informed": ("leader_broadcast", "leader_follower", "mappo_few_informed", "random"),
}
"""Policies without memory, with one, with random numbers, and that require channels or send messages."""


def test_a_mapping_is_a_name():
    assert policy_name({"*": "mappo", "uuv_0": "scout,pull=0.04"}) == "scout,pull=0.04@uuv_0+mappo"
    assert policy_name({"30%": "scout", "*": "mappo"}) == "scout@30%+mappo"
    assert policy_name({"*": "scout"}) == policy_name("scout") == "scout"
    assert parse_team("scout,pull=1e+1@uuv_1+./runs/a+b@c/best").members == ("scout,pull=1e+1", "./runs/a+b@c/best")
    assert parse_team("scout,pull=1e+1") is None
    few = {"num_vehicles": 3, "overrides": {"time_limit.factor": 0.01, "time_limit.extra_s": 5.0}}
    by_name, by_mapping = (
        evaluate(team, "starter", [4], **few) for team in ("idle@uuv_1+scout", {"uuv_1": "idle", "*": "scout"})
    )
    assert by_name == by_mapping != evaluate("scout", "starter", [4], **few)


@pytest.mark.parametrize(("name", "message"), [
    ("scout@uuv_5+mappo", "there is no vehicle uuv_5; name one of uuv_0 to uuv_4"),
    ("scout@uuv_0+mappo@uuv_2", "uuv_1 has no policy; name one, or end with a policy for all others"),
    ("scout@uuv_0+mappo@uuv_0+idle", "two policies for uuv_0; leave one out"),
    ("scout@*+mappo", r"two policies for \*; leave one out"),
    ("scout@uuv_0+mappo@30%+idle", "vehicles and shares; give one kind"),
    ("scout@30%+mappo@60%", "shares must sum to 100 %, got 90 %; change one"),
    ("scout@30%+mappo@80%+idle", "shares must sum to 100 %, got 110 %; change one"),
    ("scout@left+mappo", "'left' must be a vehicle such as uuv_3, a share such as 30%, or "),
    ("scout@uuv_00+mappo", "'uuv_00' must be a vehicle"),
    ("scoot@uuv_0+mappo", "policy 'scoot' is unknown; did you mean 'scout'"),
    ({"uuv_0": "scout", "*": 1}, "a team by names, as in .*, got"),
    ({}, "a team by names"),
    (None, "a policy is given by its name, such as 'scout'.*got None"),
])  # fmt: skip
def test_a_team_that_cannot_be_is_named_with_the_remedy(name, message):
    scenario = load_scenario("starter", num_vehicles=5)
    with pytest.raises(PolicyError, match=message):
        make_policy(name, with_policy_requirements(name, scenario))


def test_members_that_cannot_swim_together_are_named_with_the_remedy():
    field = load_scenario("random_field", num_vehicles=5)
    for name, message in (
        (
            "scout@uuv_0+bio_inspired",
            r"same yaw damping \[N m s\], got scout 600.0, bio_inspired 0.0; set timing.fixed",
        ),
        ("mappo@uuv_0+ppo,own_clock=true@uuv_1+idle", "same yaw damping"),
    ):
        with pytest.raises(PolicyError, match=message):
            with_policy_requirements(name, field)
    with pytest.raises(PolicyError, match=r"same decision period \[s\], got scout,own_clock=true 0.1, mappo 0.5"):
        with_policy_requirements("scout,own_clock=true@uuv_0+mappo", load_scenario("hard_water"))
    with pytest.raises(PolicyError, match="write pull into the name of a member"):
        make_policy("scout@uuv_0+mappo", load_scenario("starter"), pull=0.1)
    with pytest.raises(PolicyError, match="sdc needs the channel.* compass and link and identity"):
        make_policy("sdc@uuv_0+mappo", load_scenario("starter"))
    assert with_policy_requirements("scout@uuv_0+mappo", field).timing.decision_period_s == 0.5


def test_a_base_controller_of_a_checkpoint_can_be_no_team():
    """One member of it could execute other code."""
    for name in ("scout@50%+mine:Policy", "scout,pull=1@50%+mine:Policy", "scout@50%+mappo"):
        with pytest.raises(PolicyError, match="base_controller must be one of"):
            check_base_controller(name)


@settings(max_examples=100, deadline=None)
@given(
    n=st.integers(1, 60), seed=st.integers(0, 2**64 - 1), percents=st.lists(st.integers(0, 50), min_size=1, max_size=2)
)
def test_shares_are_whole_vehicles_that_the_seed_orders(n, seed, percents):
    names = [f"p{k}" for k in range(len(percents))]
    name = "+".join([*(f"{p}@{share}%" for p, share in zip(names, percents, strict=True)), "rest"])
    runs = parse_team(name).assigned(n, seed)
    for k, share in enumerate([*percents, 100 - sum(percents)]):
        assert abs((runs == k).sum() - n * share / 100) <= 1.0
    assert (runs == parse_team(name).assigned(n, seed)).all()
    larger = parse_team(f"p0@{percents[0] + 10}%+rest").assigned(n, seed)
    assert (larger[runs == 0] == 0).all()
    drawn = {tuple(parse_team("a@50%+b").assigned(20, s)) for s in range(seed % 1000, seed % 1000 + 4)}
    assert len(drawn) == 4


@pytest.mark.parametrize(("scenario", "name"), [(s, name) for s, names in MEMBERS.items() for name in names])
def test_a_team_of_one_policy_acts_as_the_policy_alone(scenario, name):
    """Bit for bit, as two members of the same kind, in a batch whose worlds end at different times."""
    changes = {"swarm.num_vehicles": 4, "time_limit.factor": 0.001, "time_limit.extra_s": 4.0}
    alone = suited(name, scenario, **changes, **(LOSES if scenario == "starter" else {}))
    team = f"{name}@50%+{name},own_clock=false"
    both = with_policy_requirements(team, alone)
    assert both == alone
    assert len(parse_team(team).members) == 2
    taken = {name: [], team: []}
    for each, actions in taken.items():

        def watch(swarm, action, actions=actions):
            if action is not None:
                actions.append(np.where(swarm.state.alive[:, :, None], action, 0).tobytes())

        list(episodes(both, each, [3, 4, 5], watch))
    assert len(taken[name]) > 5
    assert taken[name] == taken[team]


@settings(max_examples=12, deadline=None)
@given(data=st.data(), seed=st.integers(0, 2**40))
def test_a_member_acts_as_alone_whatever_the_others_require(data, seed):
    """And in the same water, however the vehicles are mixed; its percept has no channel for the others' sake."""
    where = data.draw(st.sampled_from([*MEMBERS]))
    names = data.draw(st.permutations(MEMBERS[where]))[:3]
    team = f"{names[0]}@30%+{names[1]}@40%+{names[2]}"
    base = load_scenario(where, overrides={"swarm.num_vehicles": 6})
    shared = with_policy_requirements(team, base)
    swarm, policy = Swarm(shared, 2), make_policy(team, shared, 2)
    alone = {name: Swarm(with_policy_requirements(name, base), 2) for name in names}
    members = {name: make_policy(name, each.scenario, 2) for name, each in alone.items()}
    assert [part.layout for part in policy.parts.values()] == [member.layout for member in members.values()]
    for each in (swarm, *alone.values()):
        each.reset([seed, seed + 7])
    for _ in range(12):
        action = policy.act(swarm.percept)
        for name, each in alone.items():
            own = policy.running(name, swarm.percept.clock)
            decided = members[name].act(each.percept)
            size = decided.shape[2]
            assert decided[own].tobytes() == action[own, :size].tobytes(), name
            assert not action[own, size:].any()
            sent = np.zeros((2, 6, each.scenario.action_size), np.float32)
            sent[:, :, : min(size, action.shape[2])] = action[:, :, :size]
            members[name].record_action(sent)
            each.step(sent)
        swarm.step(action)
        assert all((each.state.eta == swarm.state.eta).all() for each in alone.values())


@pytest.mark.parametrize("player", PLAYERS, ids=lambda player: player.__name__)
@pytest.mark.parametrize(("name", "where"), [
    ("scout@40%+sdc@20%+random", "starter"), ("leader_broadcast@uuv_1+leader_follower", "few_informed"),
])  # fmt: skip
def test_a_team_acts_the_same_through_every_interface(name, where, player):
    for overrides in ({}, LOSES) if where == "starter" else ({},):
        scenario = suited(name, where, **{"swarm.num_vehicles": 5, **overrides})
        compare(player, name, scenario, 11, 2 * CYCLES + 3, np.random.default_rng(0))


def test_shares_do_not_depend_on_the_batch_and_change_with_the_seed():
    name = "scout@50%+idle"
    few = {"num_vehicles": 6, "overrides": {"time_limit.factor": 0.01, "time_limit.extra_s": 8.0}}
    together = evaluate(name, "starter", range(10), **few)
    assert together[3:5] + together[9:] == [evaluate(name, "starter", [seed], **few)[0] for seed in (3, 4, 9)]
    swarm = Swarm(suited(name, "starter", **{"swarm.num_vehicles": 12}), 3)
    policy = make_policy(name, swarm.scenario, 3)
    swarm.reset([5, 6, 5])
    runs = policy.running("idle", swarm.percept.clock).copy()
    assert (runs.sum(axis=1) == 6).all()
    for w, seed in enumerate((5, 6, 5)):
        assert (runs[w] == (parse_team(name).assigned(12, seed) == 1)).all()
    assert (runs[0] != runs[1]).any()
    assert not policy.act(swarm.percept)[runs].any()
    swarm.reset([6], [0])
    assert (policy.running("idle", swarm.percept.clock) == runs[[1, 1, 2]]).all(), "one world alone"


def test_worlds_that_do_not_count_keep_the_members_memory():
    name = "scout@50%+mappo_few_informed"
    swarm = Swarm(suited(name, "few_informed", **{"swarm.num_vehicles": 4}), 2)
    policy = make_policy(name, swarm.scenario, 2)
    swarm.reset(3)
    policy.act(swarm.percept)
    before = policy.snapshot()
    policy.active[1] = False
    swarm.step(policy.act(swarm.percept))
    policy.act(swarm.percept)
    after = policy.snapshot()
    changed = {key: [after[key][w].tobytes() != array[w].tobytes() for w in (0, 1)] for key, array in before.items()}
    assert any(ran for ran, _ in changed.values())
    assert not any(waited for _, waited in changed.values())


def test_a_restored_team_goes_on_as_it_would_have():
    name = "scout@50%+random"
    swarm = Swarm(suited(name, "starter", **{"swarm.num_vehicles": 4}), 2)
    policy, other = (make_policy(name, swarm.scenario, 2) for _ in range(2))
    swarm.reset(3)
    for _ in range(5):
        swarm.step(policy.act(swarm.percept))
    saved, state = swarm.snapshot(), policy.snapshot()
    expected = [swarm.step(policy.act(swarm.percept)).flat.tobytes() for _ in range(5)]
    swarm.restore(saved)
    other.restore(state)
    assert [swarm.step(other.act(swarm.percept)).flat.tobytes() for _ in range(5)] == expected


def test_results_say_which_vehicles_run_what_and_name_a_changed_member(tmp_path):
    net, field = tmp_path / "net", load_scenario("starter", num_vehicles=4)
    weights = tensors(card_for(field))
    save_checkpoint(net / WEIGHTS_FILE, card_for(field), weights)
    name = f"sdc@uuv_0+{net}"
    info = policy_info(name)
    assert info["channels"] == ["compass", "link", "identity"]
    assert policy_info("sdc@uuv_0+scout")["source"] is None
    results = Results(tmp_path / "results", [field])
    run_missing(results, [field], [name], [1, 2], lambda *_: None)
    rows = results.rows
    run_missing(Results(tmp_path / "results", [field]), [field], [name], [1, 2], lambda *_: pytest.fail)
    (table,), paths = write_report(results, [field], [1, 2])
    assert table.rows[0]["policy"] == name
    assert name in paths[0].read_text()
    assert [row.policy for row in rows] == [name] * 2
    recording = record(field, name, 1)
    assert recording.metrics == rows[0].metrics
    save_checkpoint(net / WEIGHTS_FILE, card_for(field), {key: 2 * array for key, array in weights.items()})
    assert make_policy(name, with_policy_requirements(name, field))
    assert policy_info(name)["source"] != info["source"]


def test_the_command_line_takes_a_team(tmp_path):
    team = "idle@uuv_0+scout"
    succeeds("replay", "--scenario", "starter", "--policy", team, "--output", tmp_path / "a.html")
    succeeds("benchmark", "--scenario", "starter", "--policy", team, "--seeds", "1", "--output", tmp_path / "b")
    content = json.loads((tmp_path / "b" / "results.json").read_text())
    assert [run["policy"] for run in content["runs"]] == [team]


def test_one_learner_among_a_team():
    """Others run what their names say; vehicle 0 does as it is told."""
    import gymnasium

    env = gymnasium.make("uuv_marl/Solo-v2", scenario="starter", num_vehicles=3, others={"uuv_2": "idle", "*": "scout"})
    swarm = env.unwrapped.swarm
    env.reset(seed=1)
    taken, step = [], env.unwrapped._batch.step
    env.unwrapped._batch.step = lambda action: taken.append(action.copy()) or step(action)
    env.step(np.array([0.25, 0.5], np.float32))
    assert taken[0][0, 0].tolist() == [0.25, 0.5]
    assert taken[0][0, 1].any()
    assert not taken[0][0, 2].any()
    assert swarm.scenario.actuators.yaw_damping_nms == 600.0


BRIEF = {"time_limit.factor": 0.001, "time_limit.extra_s": 3.0}


def training(**fields):
    from uuv_marl.train.training import Ppo, Training

    few = {"scenario": "starter", "sizes": [(4, 2)], "steps": 300, "overrides": BRIEF, "validations": 1}
    return Training(**{**few, "validation_episodes": 2, "ppo": Ppo(horizon=8, minibatches=2), **fields})


@pytest.mark.needs("torch")
@pytest.mark.parametrize("beside", [
    {}, {"filter": True}, {"base_controller": "scout"}, {"overrides": {**BRIEF, "sonar.channels": ["identity"]}},
], ids=["alone", "filter", "base", "channel"])  # fmt: skip
def test_vehicles_that_run_others_are_no_rows_of_the_learner(beside):
    """Whatever is asked of them they run their policy, and the learner observes what it would alone."""
    from uuv_marl.baselines.team import narrowed
    from uuv_marl.train.rows import Rows

    swarms = []
    for others in ("", "sdc@50%"):
        seeds = itertools.count(100_000)
        swarms.append(
            Rows(training(others=others, **beside), lambda num, seeds=seeds: [next(seeds) for _ in range(num)])
        )
    alone, team = swarms
    assert team.features == alone.features
    np.testing.assert_array_equal(team.observation, alone.observation)
    group, counts = team.groups[0], []
    step = group.env.step
    expert = make_policy("sdc", suited("sdc", group.env.swarm.scenario), 2)
    for t in range(9):
        taken = []
        group.env.step = lambda action, taken=taken: taken.append(action.copy()) or step(action)
        action = np.random.default_rng(t).uniform(-1, 1, (8, 2)).astype(np.float32)
        expected = expert.act(narrowed(group.env.swarm.percept, expert.layout)).reshape(8, 2)
        transition = team.step(action)
        acted = transition.acted
        np.testing.assert_array_equal(taken[0].reshape(8, 2)[~acted], expected[~acted])
        assert (taken[0].reshape(8, 2)[acted] != expected[acted]).any()
        expert.record_action(taken[0])
        counts.append(acted.copy())
    assert (np.sum(counts, axis=1) == 4).all()
    assert (counts[0] != counts[-1]).any(), "another draw in another episode"


@pytest.mark.needs("torch")
@pytest.mark.parametrize("beside", [{}, {"expert": "scout", "imitation_share": 0.5}], ids=["alone", "expert"])
def test_a_training_among_others_is_recorded_and_resumes_bit_for_bit(beside, tmp_path):
    from uuv_marl.baselines.learned.checkpoint import load_checkpoint
    from uuv_marl.train.run import best_of, resume, train

    records = list(train(tmp_path / "whole", training(others="sdc@uuv_0", **beside)))
    assert records[0].agent_steps == 8 * 2 * 3
    begun = train(tmp_path / "parts", training(others="sdc@uuv_0", checkpoint_every=1, **beside))
    for _ in range(3):
        next(begun)
    begun.close()
    rest = list(resume(tmp_path / "parts"))
    assert [each.reward for each in rest] == [each.reward for each in records[3:]]
    card = load_checkpoint(tmp_path / "parts" / "best").card
    assert card == load_checkpoint(tmp_path / "whole" / "best").card.model_copy(update={"training": card.training})
    assert card.training["others"] == "sdc@uuv_0"
    assert not card.channels
    assert f"sdc@uuv_0+{tmp_path}/whole/best" in best_of(tmp_path / "whole")[1]
    assert policy_requirements(f"sdc@uuv_0+{tmp_path}/whole/best").channels == ["compass", "link", "identity"]


@pytest.mark.needs("torch")
def test_a_training_is_validated_among_its_others(monkeypatch):
    from uuv_marl.train import validation

    seen = []
    monkeypatch.setattr(validation, "episodes", lambda *args: seen.append(args[1]) or episodes(*args))
    assert validation.validate("mappo", training(others="sdc@uuv_0")).worst.vehicles == 4
    assert seen == ["sdc@uuv_0+mappo"]


@pytest.mark.needs("torch")
def test_a_training_whose_others_have_changed_is_refused(tmp_path):
    from uuv_marl.errors import ResultsError
    from uuv_marl.train.run import resume, train

    other, card = tmp_path / "other", card_for(training().loaded)
    weights = tensors(card)
    save_checkpoint(other / WEIGHTS_FILE, card, weights)
    begun = train(tmp_path / "run", training(others=f"{other}@50%", checkpoint_every=1))
    next(begun)
    begun.close()
    save_checkpoint(other / WEIGHTS_FILE, card, {name: 2.0 * array for name, array in weights.items()})
    with pytest.raises(ResultsError, match="was started with others = .*, and others is"):
        next(resume(tmp_path / "run"))


@pytest.mark.needs("torch")
@pytest.mark.parametrize(("others", "error", "message"), [
    ("scout", TrainingError, "others = 'scout' must name vehicles for each policy, and leave some to the learner"),
    ("scout@30%+mappo", TrainingError, "must name vehicles for each policy"),
    ("scout@30%+mappo@*", PolicyError, "two policies for"),
    ("scout@100%", TrainingError, "leave none of 4 vehicles to the learner; name fewer"),
    ("scout@uuv_7", PolicyError, "there is no vehicle uuv_7"),
    ("scoot@30%", PolicyError, "policy 'scoot' is unknown"),
])  # fmt: skip
def test_others_that_leave_nothing_to_learn_are_named(others, error, message):
    with pytest.raises(error, match=message):
        training(others=others)


@pytest.mark.docs
def test_the_study_s_table_is_that_of_its_counts():
    from research.teams import table

    assert table(read_rows(ROOT / "research" / "teams.csv")) in (ROOT / "docs" / "policies.md").read_text()


def test_for_policy_takes_a_team():
    env = uuv_marl.parallel_env("starter", num_vehicles=3, for_policy={"uuv_0": "sdc", "*": "scout"})
    assert env.unwrapped.scenario.sonar.channels == ("compass", "link", "identity")
