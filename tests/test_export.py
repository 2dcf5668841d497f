"""Exported policies: the ONNX model acts as the policy does, step by step, also with a memory."""

import numpy as np
import onnx
import pytest
from onnx.reference import ReferenceEvaluator

from tests.nets import card_for, saved, tensors
from tests.processes import refused, succeeds
from uuv_marl import load_scenario, parallel_env
from uuv_marl.baselines import POLICIES, PolicyError, make_policy, with_policy_requirements
from uuv_marl.baselines.learned.checkpoint import WEIGHTS_FILE, load_checkpoint, save_checkpoint
from uuv_marl.baselines.learned.export import write_onnx
from uuv_marl.baselines.learned.trained import Trained

BOW = {"name": "bow", "kind": "active", "mounting_deg": 0.0, "aperture_deg": 90.0, "range_m": 80.0, "sub_sectors": 5}
RING = {
    "name": "ring", "kind": "passive", "mounting_deg": 180.0, "aperture_deg": 270.0, "range_m": 300.0, "sub_sectors": 9,
}  # fmt: skip
TALK = {"modem.message_entries": 3, "sonar.channels": ["messages"]}


@pytest.mark.parametrize("memory", [False, True], ids=["mlp", "gru"])
@pytest.mark.parametrize("kind", ["mlp", "sectors", "moments"])
@pytest.mark.parametrize(
    "overrides",
    [{}, {"sonar.arrays": [BOW, RING]}, {"sonar.arrays": [RING]}, TALK],
    ids=["suite", "two", "passive", "talk"],
)
def test_an_exported_network_acts_as_the_policy_does(overrides, kind, memory, tmp_path):
    scenario = load_scenario("starter", overrides=overrides)
    best = saved(tmp_path, scenario, kind=kind, memory=memory)
    scenario = with_policy_requirements(best, scenario)
    write_onnx(best, scenario, tmp_path / "policy.onnx")
    onnx.checker.check_model(onnx.load(tmp_path / "policy.onnx"), full_check=True)
    model, policy = ReferenceEvaluator(str(tmp_path / "policy.onnx")), make_policy(best, scenario)
    env = parallel_env(scenario, observe="closeness")
    observations, _ = env.reset(seed=3)
    state = {"state": np.zeros((5, 16), np.float32)} if memory else {}
    for _ in range(12):
        seen = np.stack(list(observations.values()))
        action, *rest = model.run(None, {"observation": seen, **state})
        state = {"state": rest[0]} if memory else {}
        assert action.dtype == np.float32
        np.testing.assert_allclose(action, policy.act(env.swarm.percept)[0], rtol=0, atol=1e-5)
        observations, *_ = env.step(dict(zip(env.agents, action, strict=True)))
    assert np.hypot(*action[:, :2].T).max() <= 1.0 + 1e-6
    assert np.abs(action).max() <= 1.0 + 1e-6


@pytest.mark.parametrize("policy", ["bio_inspired", "scout", "mappo,safety_filter=true"])
def test_what_is_no_network_end_to_end_is_refused_with_the_remedy(policy, tmp_path):
    with pytest.raises(PolicyError, match=rf"'{policy}' can't be exported.*not controllers.*run this policy with"):
        write_onnx(policy, load_scenario("tracking"), tmp_path / "policy.onnx")
    assert not list(tmp_path.iterdir())


def test_what_was_trained_for_something_else_is_refused(tmp_path):
    best = saved(tmp_path, load_scenario("starter"))
    other = load_scenario("starter", overrides={"sonar.arrays.bow.sub_sectors": 5})
    with pytest.raises(PolicyError, match="trained on another percept"):
        write_onnx(best, other, tmp_path / "policy.onnx")
    guarded = saved(tmp_path / "filtered", load_scenario("starter"), filter=True)
    with pytest.raises(PolicyError, match="can't be exported"):
        write_onnx(guarded, load_scenario("starter"), tmp_path / "policy.onnx")
    assert not (tmp_path / "policy.onnx").exists()


def test_the_command(tmp_path):
    best, output = saved(tmp_path, load_scenario("starter"), memory=True), tmp_path / "policy.onnx"
    succeeds("export", best, output)
    assert ReferenceEvaluator(str(output)).input_names == ["observation", "state"]
    other = {"sonar.arrays.bow.sub_sectors": 5}  # the training's scenario is found by what the checkpoint says
    card = card_for(load_scenario("starter", overrides=other), training={"scenario": "starter", "overrides": other})
    save_checkpoint(tmp_path / "other" / WEIGHTS_FILE, card, tensors(card))
    succeeds("export", tmp_path / "other", output)
    refused("/dev/null", "export", best, "/dev/null/policy.onnx")


@pytest.mark.parametrize("name", [name for name, kind in POLICIES.items() if isinstance(kind, Trained)])
def test_a_shipped_network_is_exported_by_its_name(name, tmp_path, monkeypatch):
    """Also where a folder of that name lies: a path to it is ./NAME."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / name).mkdir()
    succeeds("export", name, "policy.onnx")
    said = {entry.key: entry.value for entry in onnx.load("policy.onnx").metadata_props}
    assert said["checkpoint"] == POLICIES[name].checkpoint.digest == load_checkpoint(name).digest
    with pytest.raises(PolicyError, match=r"can't be read"):
        load_checkpoint(f"./{name}")
