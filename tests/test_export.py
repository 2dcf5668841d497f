"""Exported policies: the ONNX model acts as the policy does, on percepts from the water and on hostile ones."""

import itertools

import numpy as np
import onnx
import pytest
from onnx.reference import ReferenceEvaluator
from typer.testing import CliRunner

from uuv_marl import load_scenario
from uuv_marl.baselines import PolicyError, granted, make
from uuv_marl.baselines.learned.checkpoint import WEIGHTS_FILE, Card, Layer, card_rows, save_checkpoint
from uuv_marl.baselines.learned.export import write_onnx
from uuv_marl.baselines.learned.percept_features import BARRIER
from uuv_marl.baselines.paper.bio_inspired import BioInspiredGains
from uuv_marl.cli import app
from uuv_marl.percept import Percept

BOW = {"name": "bow", "kind": "active", "mounting_deg": 0.0, "aperture_deg": 90.0, "range_m": 80.0, "sub_sectors": 5}
RING = {
    "name": "ring", "kind": "passive", "mounting_deg": 180.0, "aperture_deg": 270.0, "range_m": 300.0, "sub_sectors": 9,
}  # fmt: skip


def saved(folder, scenario, scale, **changes):
    """A checkpoint of three layers with random weights."""
    rng = np.random.default_rng(0)
    size = 11 + 4 * scenario.sonar.num_sectors + 4 * scenario.sonar.num_active_sectors
    layers = [
        Layer(*(scale * rng.standard_normal(shape, np.float32) for shape in ((a, b), b)))
        for a, b in itertools.pairwise((size, 32, 32, 2))
    ]
    save_checkpoint(folder / WEIGHTS_FILE, Card(percept=card_rows(scenario), **changes), layers)
    return str(folder)


@pytest.fixture(params=[0.0, 0.1, 0.3])
def scale(request):
    """Of the weights: the barrier alone, a wish that it outweighs, and a wish that does not wait."""
    return request.param


def exported(policy, scenario, folder):
    write_onnx(policy, scenario, folder / "policy.onnx")
    onnx.checker.check_model(onnx.load(folder / "policy.onnx"), full_check=True)
    return ReferenceEvaluator(str(folder / "policy.onnx"))


def expect_the_same(model, policy, flat):
    """Actions of percepts (vehicle, size); returns them."""
    percept = Percept(np.asarray(flat, np.float32)[None], policy.layout)
    policy = make(policy.name, load_scenario(policy.scenario, num_vehicles=len(flat)))
    (action,) = model.run(None, {"observation": percept.to_observation()[0]})
    assert action.dtype == np.float32
    np.testing.assert_allclose(action, policy.act(percept)[0], rtol=0, atol=1e-5)
    return action


@pytest.mark.parametrize("arrays", [None, [BOW, RING], [RING]])
@pytest.mark.parametrize("barrier", [BARRIER, BioInspiredGains(zeta_n=0.8, delta_n=2.0, zeta_o=0.3, delta_o=5.0)])
def test_hostile_percepts(arrays, barrier, scale, tmp_path):
    """Positions from on top of the vehicle to the ends of the bounds, flags at random, rubbish where none is set."""
    scenario = load_scenario("single_obstacle", overrides={"sonar.arrays": arrays} if arrays else {})
    best = saved(tmp_path, scenario, scale, barrier=barrier)
    scenario = granted(best, scenario)
    model, policy, rng = exported(best, scenario, tmp_path), make(best, scenario), np.random.default_rng(4)
    percept = Percept(np.zeros((400, policy.layout.size), np.float32), policy.layout)
    for row in policy.layout.table:
        # Magnitudes from a millionth of the bound on, so that distances lie on either side of every bound.
        size = row.kind.high * 10.0 ** rng.uniform(-6.0, 0.0, (400, *row.shape[:1], *(1 for _ in row.shape[1:])))
        percept[row.name][:] = size * rng.uniform(row.kind.low / row.kind.high, 1.0, (400, *row.shape))
    for flag in ("heard", "echo"):
        percept[flag][:] = rng.random(percept[flag].shape) < rng.random((400, 1)) ** 3
    percept.flat[0] = 0.0
    percept["heard"][1], percept["neighbour"][1] = 1.0, 0.0
    percept["heard"][2:20] = 0.0
    percept["echo"][1:20] = 0.0
    action = expect_the_same(model, policy, percept.flat)
    assert np.hypot(*action.T).max() <= 1.0 + 1e-6
    if scale == 0.0:
        assert not action[:20].any(), "nothing heard, no barrier"
        assert action[20:].any(axis=1).mean() > 0.4


@pytest.mark.parametrize("policy", ["bio_inspired", "scout", "guarded:mappo", "trimmed_scout"])
def test_what_is_no_network_on_one_observation_is_refused_with_the_remedy(policy, tmp_path):
    with pytest.raises(
        PolicyError, match=rf"'{policy}' can't be exported.*not laws.*Export mappo.*run this policy with"
    ):
        write_onnx(policy, load_scenario("tracking"), tmp_path / "policy.onnx")
    assert not list(tmp_path.iterdir())


def test_what_was_trained_for_something_else_is_refused(tmp_path):
    best = saved(tmp_path, load_scenario("tracking"), 0.1)
    other = load_scenario("tracking", overrides={"sonar.arrays.bow.sub_sectors": 5})
    with pytest.raises(PolicyError, match="trained on another percept"):
        write_onnx(best, other, tmp_path / "policy.onnx")
    heavy = load_scenario("tracking", overrides={"vehicle.m_kg": 600.0})
    with pytest.raises(PolicyError, match=r"another vehicle.*vehicle.m_kg was 185.0 in the training and is 600.0"):
        write_onnx(best, heavy, tmp_path / "policy.onnx")
    saved(tmp_path, load_scenario("tracking"), np.nan)
    with pytest.raises(PolicyError, match="0.weight must hold finite numbers"):
        write_onnx(best, load_scenario("tracking"), tmp_path / "policy.onnx")
    assert not (tmp_path / "policy.onnx").exists()


def test_the_command(tmp_path):
    best, output = saved(tmp_path, load_scenario("tracking"), 0.1), tmp_path / "policy.onnx"
    done = CliRunner().invoke(app, ["export", best, str(output), "--scenario=single_obstacle"])
    assert done.exit_code == 0, done.output
    assert ReferenceEvaluator(str(output)).input_names == ["observation"]
    assert CliRunner().invoke(app, ["export", "mappo", str(tmp_path / "mappo.onnx")]).exit_code == 0
    unwritable = CliRunner().invoke(app, ["export", best, "/dev/null/policy.onnx"])
    assert unwritable.exit_code == 2
    assert "can't be written" in unwritable.output
    done = CliRunner().invoke(app, ["export", "idle", str(output)])
    assert done.exit_code == 2
    assert "can't be exported" in done.output
