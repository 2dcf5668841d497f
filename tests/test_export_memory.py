"""Exported policies that remember: nodes that are read from the compiled functions do what these do."""

import itertools
import math

import numpy as np
import onnx
import onnxruntime
import pytest
from onnx import TensorProto, helper

from uuv_marl import load_scenario
from uuv_marl.baselines import PolicyError, granted, make
from uuv_marl.baselines.checkpoint import WEIGHTS_FILE, Card, Layer, rows_of, save_checkpoint
from uuv_marl.baselines.export import KEPT, NEXT, write_onnx
from uuv_marl.baselines.export.kernels import Translator
from uuv_marl.baselines.export.numbers import KernelError, Scalar
from uuv_marl.baselines.recall import RECALLED
from uuv_marl.baselines.scout import TRIMS, Gains
from uuv_marl.percept import PerceptLayout
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.swarm import Swarm

CALM = {"random_field.legs": [1, 1], "random_field.leg_length_m": [250.0, 250.0]}
ROUGH = CALM | {
    "sonar.echo_reports": "surface", "noise.bearing_deg": 2.0, "noise.range_share": 0.02, "current.speed_mps": 0.5,
    "noise.silence_probability": 0.05, "noise.silence_readings": 5, "timing.decision_period_s": 0.2,
}  # fmt: skip


def opened(path):
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    return onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])


class Model:
    """An exported policy, and what it remembers."""

    def __init__(self, policy, scenario, folder):
        write_onnx(policy, scenario, folder / "policy.onnx")
        onnx.checker.check_model(onnx.load(folder / "policy.onnx"), full_check=True)
        self.session = opened(folder / "policy.onnx")
        self.outputs = [each.name for each in self.session.get_outputs()]
        num = scenario.swarm.num_vehicles
        shapes = {each.name: (num, *each.shape[1:]) for each in self.session.get_inputs() if each.name.startswith(KEPT)}
        self.kept = {name: np.zeros(shape) for name, shape in shapes.items()}

    def act(self, observation):
        given = self.session.run(None, {"observation": observation, **self.kept})
        action, *rest = given
        self.kept = {name.replace(NEXT, KEPT, 1): array for name, array in zip(self.outputs[1:], rest, strict=True)}
        return action


def of_memory(folder, scale):
    """A checkpoint with memory and random weights."""
    scenario, rng = granted("scout", load_scenario("random_field")), np.random.default_rng(0)
    sizes = itertools.pairwise((RECALLED, 16, 16, TRIMS))
    layers = [Layer(*(scale * rng.standard_normal(shape, np.float32) for shape in ((a, b), b))) for a, b in sizes]
    card = Card(percept=rows_of(PerceptLayout.of(scenario)), features="memory", law=Gains(together=0.04, behind_m=1.0))
    save_checkpoint(folder / WEIGHTS_FILE, card, layers)
    return str(folder)


@pytest.mark.parametrize("overrides", [CALM, ROUGH], ids=["calm", "rough"])
@pytest.mark.parametrize("name", ["scout", "memory", "guarded:mappo"])
def test_it_remembers_and_acts_as_the_policy_does(name, overrides, tmp_path):
    """Not once in step with the policy: its own memory from the beginning."""
    policy = of_memory(tmp_path, 0.3) if name == "memory" else name
    scenario = granted(policy, load_scenario("random_field", num_vehicles=8, overrides=overrides))
    model, made, swarm = Model(policy, scenario, tmp_path), make(policy, scenario), Swarm(scenario)
    # Near an obstacle, so that echoes, discs and the filter come up at once.
    swarm.reset(11_003)
    centre = swarm.course.obstacles[0][0]
    swarm.state.eta[0, :, :2] = centre[:2] + (centre[2] + 14.0) * np.array([[-1.0, 0.15 * k - 0.5] for k in range(8)])
    percept = swarm.observe()
    for _ in range(40):
        wanted = made.act(percept)
        np.testing.assert_allclose(model.act(percept.to_observation()[0]), wanted[0], rtol=0, atol=1e-5)
        percept = swarm.step(wanted)
    for part, array in made.memory._asdict().items():
        np.testing.assert_allclose(model.kept[KEPT + part], array[0], rtol=0, atol=1e-3, err_msg=part)
    assert (made.memory.score[0] > 0.0).any(), "discs are remembered"
    if name != "guarded:mappo":
        assert made.changed[0] > 0, "the filter acts"


def test_a_lost_vehicle_forgets(tmp_path):
    scenario = granted("scout", load_scenario("random_field", num_vehicles=4))
    model, swarm = Model("scout", scenario, tmp_path), Swarm(scenario)
    model.act(swarm.reset(0).to_observation()[0])
    observation = swarm.percept.to_observation()[0].copy()
    observation[2] = 0.0
    action = model.act(observation)
    assert not action[2].any()
    np.testing.assert_array_equal(model.kept[KEPT + "begun"], [1.0, 1.0, 0.0, 1.0])


def test_the_file_says_what_it_remembers(tmp_path):
    scenario = load_scenario("random_field", overrides={"timing.decision_period_s": 0.2})
    write_onnx("scout", scenario, tmp_path / "scout.onnx")
    model = onnx.load(tmp_path / "scout.onnx")
    assert "every 0.2 s" in model.doc_string
    kept = {each.name: each for each in model.graph.input}
    assert "centre in the map" in kept["kept_disc"].doc_string
    assert [each.name for each in model.graph.output][:2] == ["action", "next_pose"]


@pytest.mark.parametrize("policy", ["bio_inspired", "guarded:sff", "guarded:scout"])
def test_what_has_no_form_is_said(policy, tmp_path):
    with pytest.raises(PolicyError, match="no form in ONNX|networks without memory"):
        write_onnx(policy, load_scenario("random_field"), tmp_path / "policy.onnx")


@compiled
def collatz(start, most):
    """Loops, branches, and ways out of both."""
    value, odd = start, 0
    for k in range(most):
        if value == 1.0:
            return k, odd
        if value - 2.0 * math.floor(0.5 * value) == 0.0:
            value = 0.5 * value
            continue
        value, odd = 3.0 * value + 1.0, odd + 1
        if odd > 30:
            break
    return -1, odd


@compiled
def sieve(flags, num):
    """Writes to an array, within loops whose bounds are not known."""
    count = 0
    for k in range(2, num):
        if flags[k] == 0.0:
            count += 1
            for j in range(k, num):
                for m in range(2):
                    if m == 1 and not j <= k and (j - k * math.floor(j / k) == 0.0 or flags[j] > 0.0):
                        flags[j] = max(flags[j], 1.0)
    return count


def ran(function, shape, *inputs):
    """What a function's nodes give for numbers that only the model knows, and the array that it may write to."""
    g = Translator({})
    array = [g.zeros(shape)] if shape else []
    result = g.call(function, *array, *(Scalar(f"x{k}", kind) for k, (kind, _) in enumerate(inputs)))
    names = [g.scalar(part).name for part in (result if isinstance(result, tuple) else (result,))]
    names += [g.tensors[ref.cells] for ref in array]
    types = {"f": TensorProto.DOUBLE, "i": TensorProto.INT64}
    heads = [helper.make_tensor_value_info(f"x{k}", types[kind], []) for k, (kind, _) in enumerate(inputs)]
    tails = [onnx.ValueInfoProto(name=name) for name in names]
    opset = [helper.make_opsetid("", 18)]
    graph = helper.make_graph(g.nodes, "kernel", heads, tails, g.used())
    model = helper.make_model(graph, opset_imports=opset, ir_version=helper.find_min_ir_version_for(opset))
    values = {f"x{k}": np.array(v, np.float64 if kind == "f" else np.int64) for k, (kind, v) in enumerate(inputs)}
    session = onnxruntime.InferenceSession(model.SerializeToString(), providers=["CPUExecutionProvider"])
    return session.run(None, values)


@pytest.mark.parametrize(("start", "most"), [(1.0, 9), (6.0, 20), (6.0, 5), (7.0, 40), (27.0, 200), (6.0, 0)])
def test_loops_end_where_they_do_in_python(start, most):
    got = ran(collatz, (), ("f", start), ("i", most))
    assert [int(each) for each in got] == list(collatz(start, most))


@pytest.mark.parametrize("num", [2, 3, 20])
def test_arrays_are_written(num):
    count, flags = ran(sieve, (30,), ("i", num))
    wanted = np.zeros(30)
    assert count == sieve(wanted, num)
    np.testing.assert_array_equal(flags, wanted)


@compiled
def power(x):
    """An operator that has no translation."""
    return x**3


def test_what_has_no_translation_names_function_and_line():
    with pytest.raises(KernelError, match=r"function power: Pow"):
        ran(power, (), ("f", 2.0))
