"""Learned policies from checkpoints: what they see, what they refuse, and that every path gives one run."""

import json
from pathlib import Path

import numpy as np
import pytest
import safetensors.numpy

from tests.nets import card_for, saved, tensors
from tests.swarms import fly, piloted, started
from uuv_marl import evaluate, load_scenario
from uuv_marl.baselines import PolicyError, make_policy, with_policy_requirements
from uuv_marl.baselines.learned.checkpoint import WEIGHTS_FILE, load_checkpoint, save_checkpoint, vehicle_of
from uuv_marl.baselines.learned.layers import ENCODED, Architecture, Network, NumpyOps, columns, shapes
from uuv_marl.baselines.registry import policy_class
from uuv_marl.benchmark.results import policy_info
from uuv_marl.errors import ScenarioError
from uuv_marl.sim.swarm import Swarm

SHORT = {"trajectory.waypoints_m": [[0.0, 0.0], [40.0, 0.0]], "time_limit.extra_s": 1.0, "time_limit.factor": 1.0}
KINDS = [(kind, memory) for kind in ("mlp", "sectors", "moments") for memory in (False, True)]
"""What networks are made of."""


def water(**overrides):
    return load_scenario("tracking", overrides={"actuators.yaw_damping_nms": 600.0, **overrides})


@pytest.fixture
def best(tmp_path):
    return saved(tmp_path / "best", water(), training={"seed": 3})


def test_a_checkpoint_comes_back_as_it_was_written(best):
    loaded = load_checkpoint(Path(best))
    assert loaded.card == card_for(water(), training={"seed": 3})
    for name, tensor in tensors(loaded.card).items():
        np.testing.assert_array_equal(loaded.tensors[name], tensor)


def test_the_networks_are_the_textbooks():
    made, sizes = Architecture(memory=True, hidden=(5, 4)), [("velocity", 3)]
    rng = np.random.default_rng(1)
    t = {name: rng.standard_normal(shape).astype(np.float32) for name, shape in shapes(made, sizes).items()}
    network, x, h = Network(made, sizes, t, NumpyOps), rng.standard_normal((9, 3)), rng.standard_normal((9, 4))
    x, h = x.astype(np.float32), h.astype(np.float32)
    gates, own = x @ t["gru.weight"] + t["gru.bias"], h @ t["gru.state_weight"] + t["gru.state_bias"]
    r, z = (1 / (1 + np.exp(-(gates[:, k : k + 4] + own[:, k : k + 4]))) for k in (0, 4))
    after = (1 - z) * np.tanh(gates[:, 8:] + r * own[:, 8:]) + z * h
    np.testing.assert_allclose(network.step(network.gates(x), h), after, atol=1e-5)
    y = np.concatenate([x, after], axis=1)
    for k in range(2):
        y = np.tanh(y @ t[f"{k}.weight"] + t[f"{k}.bias"])
    np.testing.assert_allclose(network.output(x, after.astype(np.float32)), y @ t["2.weight"] + t["2.bias"], atol=2e-5)


def test_an_encoder_reads_sub_sectors_in_any_order_with_their_places():
    """And what it makes of them has one width for any number of sub-sectors."""
    made, rng = Architecture(kind="sectors"), np.random.default_rng(0)
    widths = set()
    for num in (3, 7):
        sizes = [("velocity", 2), ("closeness", num), ("neighbour_direction", 2 * num), ("echo_closeness", 2),
                 ("echo_direction", 4)]  # fmt: skip
        (sectors, _), t = columns(sizes), {}
        for name, shape in shapes(made, sizes).items():
            t[name] = rng.standard_normal(shape).astype(np.float32)
        x, order = rng.standard_normal((4, 8 + 3 * num)).astype(np.float32), rng.permutation(num)
        turned = x.copy()
        turned[:, sectors["heard"].ravel()] = x[:, sectors["heard"][order].ravel()]
        seen = Network(made, sizes, t, NumpyOps).features(x)
        again = Network(made, sizes, {**t, "heard.place": t["heard.place"][order]}, NumpyOps).features(turned)
        np.testing.assert_allclose(seen, again, atol=1e-6)
        assert np.abs(Network(made, sizes, t, NumpyOps).features(turned) - seen).max() > 1e-3
        widths.add(seen.shape[1])
    assert widths == {2 + 2 * ENCODED}


def test_moments_are_sums_over_sub_sectors_in_any_order():
    sizes = {"velocity": 2, "closeness": 5, "neighbour_direction": 10, "echo_closeness": 2, "echo_direction": 4}
    sizes = [*sizes.items()]
    made, rng = Architecture(kind="moments"), np.random.default_rng(0)
    x, order = rng.standard_normal((3, 23)).astype(np.float32), rng.permutation(5)
    seen, near, way = Network(made, sizes, {}, NumpyOps).features(x), x[:, 2:7], x[:, 7:17].reshape(3, 5, 2)
    assert seen.shape[1] == shapes(made, sizes)["0.weight"][0] == 23 + 16
    np.testing.assert_array_equal(seen[:, :23], x)
    for k, power in enumerate((0, 1, 2, 4)):
        total = np.einsum("rs,rsk->rk", near**power, way)
        np.testing.assert_allclose(seen[:, 23 + 2 * k : 25 + 2 * k], total, atol=1e-5)
    x[:, 2:7], x[:, 7:17] = near[:, order], way[:, order].reshape(3, 10)
    np.testing.assert_allclose(Network(made, sizes, {}, NumpyOps).features(x)[:, 23:], seen[:, 23:], atol=1e-5)


@pytest.mark.needs("torch")
@pytest.mark.parametrize(("kind", "memory"), KINDS)
def test_torch_and_numpy_give_the_same(kind, memory):
    import torch

    from uuv_marl.train.ppo import TorchActor

    card, rng = card_for(water(), kind=kind, memory=memory), np.random.default_rng(0)
    actor = TorchActor(card.network, card.sizes, rng)
    for tensor in actor.tensors.values():
        tensor.data += 0.2 * torch.from_numpy(rng.standard_normal(tensor.shape).astype(np.float32))
    t = {name: x.detach().numpy() for name, x in actor.tensors.items()}
    network = Network(card.network, card.sizes, t, NumpyOps)
    x = rng.uniform(-1, 1, (6, 10, sum(size for _, size in card.sizes))).astype(np.float32)
    begins = torch.ones(6, 10)
    begins[3, 4:] = 0.0
    state = torch.from_numpy(rng.uniform(-1, 1, (10, 16 * memory)).astype(np.float32))
    through, states = actor.through(torch.from_numpy(x), state, begins)
    mine = state.numpy()
    for k in range(6):
        z = network.features(x[k])
        if memory:
            mine = network.step(network.gates(z), mine * begins[k].numpy()[:, None])
            np.testing.assert_allclose(states.detach().numpy()[10 * k : 10 * k + 10], mine, atol=1e-5)
        told = network.output(z, mine if memory else None)
        np.testing.assert_allclose(through.detach().numpy()[10 * k : 10 * k + 10], told, atol=1e-5)


@pytest.mark.parametrize("n", [1, 20])
@pytest.mark.parametrize(("kind", "memory"), KINDS)
def test_a_run_depends_on_its_seed_alone(kind, memory, n, tmp_path):
    best = saved(tmp_path, water(), kind=kind, memory=memory)
    scenario = load_scenario("tracking", num_vehicles=n, overrides=SHORT)
    assert evaluate(best, scenario, [4, 5, 6])[1:2] == evaluate(best, scenario, [5])


def test_a_memory_can_be_kept_and_is_forgotten_at_a_reset(tmp_path):
    best = saved(tmp_path, water(), memory=True)
    swarm, policy = piloted(best, "tracking", worlds=2, seed=1, n=4)
    first = policy.act(swarm.percept).copy()
    percept = fly(swarm, policy, 5)
    kept, action = policy.snapshot(), policy.act(percept).copy()
    other = make_policy(best, swarm.scenario, 2)
    other.restore(kept)
    np.testing.assert_array_equal(other.act(percept), action)
    forgetful = make_policy(best, swarm.scenario, 2).act(percept)
    assert np.abs(forgetful - action).max() > 1e-3
    np.testing.assert_array_equal(policy.act(swarm.reset([1, 2])), first)


@pytest.mark.parametrize(
    ("beside", "policy_class"),
    [({}, "end to end"), ({"filter": True}, "end to end + filter"), ({"base_controller": "scout"}, "residual")],
)
def test_what_decides_beside_a_network_is_declared_and_acts(beside, policy_class, tmp_path):
    """A network with zero output leaves the base controller, or a filter around a vehicle at rest."""
    scenario = load_scenario("starter")
    best = saved(tmp_path, scenario, scale=0.0, **beside)
    assert load_checkpoint(best).card.policy_class == policy_class
    policy, swarm = make_policy(best, scenario), started(scenario, seed=3)
    alone = make_policy(beside.get("base_controller", "idle,safety_filter=true" if beside else "idle"), scenario)
    for _ in range(30):
        action = policy.act(swarm.percept)
        np.testing.assert_allclose(action, alone.act(swarm.percept), atol=1e-6)
        swarm.step(action)


def test_it_works_for_any_size_and_declares_what_it_needs(best):
    digest = load_checkpoint(Path(best) / WEIGHTS_FILE).digest
    known = {
        "channels": [], "yaw_damping_nms": 600.0, "decision_period_s": 0.1, "source": digest,
        "policy_class": "end to end",
    }  # fmt: skip
    assert policy_info(best) == known
    for n in (1, 200):
        swarm, policy = piloted(best, "tracking", n=n)
        assert policy.act(swarm.percept).shape == (1, n, 2)
    with pytest.raises(PolicyError, match="yaw damping of 600.*with_policy_requirements"):
        make_policy(best, load_scenario("tracking"))


def test_another_percept_or_period_is_refused_with_the_remedy(best):
    """A clock that the scenario does not fix is the policy's own."""
    other = with_policy_requirements(best, water(**{"sonar.arrays.bow.sub_sectors": 5}))
    message = r"another percept.*was .'closeness', 21, '1', 1.0. in .* is .'closeness', 19, '1', 1.0. here; use"
    with pytest.raises(PolicyError, match=message):
        make_policy(best, other)
    slow = water(**{"timing.decision_period_s": 0.5})
    assert with_policy_requirements(best, slow).timing.decision_period_s == 0.1
    fixed = with_policy_requirements(best, water(**{"timing.decision_period_s": 0.5, "timing.fixed": True}))
    odd = {"timing.control_step_s": 0.2, "timing.integration_step_s": 0.2, "timing.decision_period_s": 0.2}
    with pytest.raises(ScenarioError, match="can't run on scenario 'tracking' with what it requires: .*multiple"):
        with_policy_requirements(best, water(**odd))
    for other in (slow, fixed):
        with pytest.raises(PolicyError, match=r"needs a decision every 0.1 s .timing.decision_period_s."):
            make_policy(best, other)


def test_what_is_no_checkpoint_is_explained(best, tmp_path):
    (tmp_path / "bad").write_bytes(b"\x80\x04pickled")
    (tmp_path / "other").write_bytes(safetensors.numpy.save({"x": np.zeros(2, np.float32)}))
    for name, message in (
        (tmp_path / "nowhere", "can't be read.*give a checkpoint"),
        (tmp_path / "bad", "holds no policy of uuv_marl"),
        (tmp_path / "other", "holds no policy of uuv_marl"),
        ("bio_inspred", "did you mean 'bio_inspired'.*paths of checkpoints"),
    ):
        with pytest.raises(PolicyError, match=message):
            make_policy(str(name), load_scenario("tracking"))


def test_a_rewritten_checkpoint_is_loaded_anew(best):
    assert policy_class(best).requirements.yaw_damping_nms == 600.0
    saved(Path(best), water(**{"actuators.yaw_damping_nms": 100.0}))
    assert policy_class(best).requirements.yaw_damping_nms == 100.0


@pytest.mark.parametrize(("field", "value"), [("vehicle.m_kg", 600.0), ("actuators.lever_arm_m", 2.0)])
@pytest.mark.parametrize("name", ["mappo", "best"])
def test_another_vehicle_is_refused_unless_asked_for(name, field, value, best):
    name = best if name == "best" else name
    other = with_policy_requirements(name, load_scenario("tracking", num_vehicles=2, overrides={field: value}))
    was = {**vehicle_of(load_scenario("tracking"))}[field]
    told = f"{field} was {was} in the training and is {value} here"
    message = f"another vehicle than scenario 'tracking' has: {told}.*any_vehicle=True"
    with pytest.raises(PolicyError, match=message):
        make_policy(name, other)
    assert make_policy(name, other, any_vehicle=True).act(Swarm(other).reset(0)).shape == (1, 2, 2)


def test_a_checkpoint_runs_on_the_vehicle_that_it_was_trained_on(best):
    heavy = water(**{"vehicle.m_kg": 600.0})
    saved(Path(best), heavy)
    make_policy(best, with_policy_requirements(best, heavy))
    with pytest.raises(PolicyError, match=r"vehicle.m_kg was 600.0 in the training and is 185.0"):
        make_policy(best, with_policy_requirements(best, load_scenario("tracking")))


def changed(name, value=None, at=None, **more):
    """Tensors with one replaced, or one entry of it, or missing."""
    made = tensors(card_for(water(), **more))
    if at is not None:
        made[name][at] = value
    elif value is None:
        del made[name]
    else:
        made[name] = np.asarray(value, np.float32)
    return made, more


@pytest.mark.parametrize(("made", "message"), [
    (changed("0.weight", np.zeros((100, 16))), r"0.weight is float32 \(100, 16\), expected float32 \(93, 16\)"),
    (changed("0.weight", np.nan, (0, 0)), "0.weight must hold finite numbers"),
    (changed("0.weight", 1e38, (3, 1)), "0.weight must hold finite numbers of at most 1e"),
    (changed("0.bias", 0.0), r"0.bias is float32 \(1,\), expected"),
    (changed("2.weight", np.zeros((16, 3))), r"2.weight is float32 \(16, 3\), expected float32 \(16, 2\)"),
    (changed("gru.bias", memory=True), "gru.bias is missing"),
    (changed("echo.place", np.zeros((6, 32)), kind="sectors"), r"echo.place is float32 \(6, 32\), expected"),
])  # fmt: skip
def test_weights_that_cannot_run_are_refused(made, message, tmp_path):
    own, more = made
    save_checkpoint(tmp_path / "bad", card_for(water(), **more), own)
    with pytest.raises(PolicyError, match=f"bad holds no policy of uuv_marl .{message}"):
        make_policy(str(tmp_path / "bad"), load_scenario("tracking"))


@pytest.mark.parametrize(("field", "value"), [
    ("network", {"hidden": []}),
    ("network", {"hidden": [0, 4]}),
    ("decision_period_s", 0.0),
    ("yaw_damping_nms", float("nan")),
    ("percept", "none"),
    ("format", 2),
    ("wings", 2),
])  # fmt: skip
def test_cards_that_say_nothing_sensible_are_refused(field, value, tmp_path):
    card = card_for(water())
    said = json.dumps({**card.model_dump(mode="json"), field: value})
    (tmp_path / "bad").write_bytes(safetensors.numpy.save(tensors(card), {"uuv_marl": said}))
    with pytest.raises(PolicyError, match=f"bad holds no policy of uuv_marl .its card's {field}"):
        make_policy(str(tmp_path / "bad"), load_scenario("tracking"))


def test_the_hash_of_a_checkpoint_is_that_of_its_tensors_alone(tmp_path):
    scenario, folders = load_scenario("starter"), [tmp_path / name for name in ("a", "b", "c")]
    for folder in folders:
        folder.mkdir()
    plain, titled, other = (
        load_checkpoint(saved(folder, scenario, scale, training={"title": title})).digest
        for folder, scale, title in zip(folders, (0.3, 0.3, 0.2), ("", "another", ""), strict=True)
    )
    assert plain == titled != other
