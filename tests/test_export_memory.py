"""Exported policies that remember: nodes that are read from the compiled functions do what these do."""

import importlib.util
import itertools
import math
import os
import subprocess
import sys

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
from uuv_marl.baselines.gains import Gains
from uuv_marl.baselines.halfplanes import nearest_velocity
from uuv_marl.baselines.recall import RECALLED
from uuv_marl.baselines.trims import ALL_TRIMS
from uuv_marl.percept import PerceptLayout
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.swarm import Swarm
from uuv_marl.sim.trigonometry import cos_sin

CALM = {"random_field.legs": [1, 1], "random_field.leg_length_m": [250.0, 250.0]}
ROUGH = CALM | {
    "sonar.echo_reports": "surface", "noise.bearing_deg": 2.0, "noise.range_share": 0.02, "current.speed_mps": 0.5,
    "noise.silence_probability": 0.05, "noise.silence_readings": 5, "timing.decision_period_s": 0.2,
}  # fmt: skip
LAGGING = {"actuators.thrust_lag_s": 0.3, "actuators.yaw_lag_s": 0.3}
TORPEDO = CALM | {
    "vehicle.Y_uv": -60.0, "vehicle.N_uv": 15.0, "vehicle.N_ur": -10.0, "actuators.max_astern_n": 100.0,
    "timing.decision_period_s": 0.2,
}  # fmt: skip
RUDDER = TORPEDO | {"actuators.kind": "rudder", "actuators.N_uud": -90.0, "actuators.rudder_max_deg": 20.0}


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


def of_memory(folder, scale, trims=ALL_TRIMS):
    """A checkpoint with memory and random weights."""
    scenario, rng = granted("scout", load_scenario("random_field")), np.random.default_rng(0)
    sizes = itertools.pairwise((RECALLED, 16, 16, len(trims)))
    layers = [Layer(*(scale * rng.standard_normal(shape, np.float32) for shape in ((a, b), b))) for a, b in sizes]
    law = Gains(together=0.04, behind_m=1.0)
    card = Card(percept=rows_of(PerceptLayout.of(scenario)), features="memory", law=law, trims=trims)
    save_checkpoint(folder / WEIGHTS_FILE, card, layers)
    return str(folder)


@pytest.mark.parametrize(
    ("name", "overrides"),
    [
        *((name, overrides) for name in ("scout", "memory", "guarded:mappo") for overrides in (CALM, ROUGH)),
        ("steering", ROUGH),
        ("scout_wary", ROUGH | LAGGING),
        ("mappo_v4", ROUGH | LAGGING),
        ("scout", TORPEDO),
        ("scout", RUDDER),
    ],
    ids=[
        *(f"{name}-{sea}" for name in ("scout", "memory", "mappo") for sea in ("calm", "rough")),
        "steering",
        "lead",
        "trimmed lead",
        "lift",
        "rudder",
    ],
)
def test_it_remembers_and_acts_as_the_policy_does(name, overrides, tmp_path):
    """Not once in step with the policy: its own memory from the beginning."""
    trims = {"memory": ALL_TRIMS, "steering": ("push", "steering")}
    policy = of_memory(tmp_path, 0.3, trims[name]) if name in trims else name
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
    # Networks round otherwise, and vehicles reckon from their actions.
    within = 1e-8 if name.startswith("scout") else 1e-3
    for part, array in made.memory._asdict().items():
        np.testing.assert_allclose(model.kept[KEPT + part], array[0], rtol=0, atol=within, err_msg=part)
    assert (made.memory.score[0] > 0.0).any(), "discs are remembered"
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
    assert "every vehicle of a swarm of 54. It decides every 0.2 s" in model.doc_string
    assert {entry.key: entry.value for entry in model.metadata_props}["num_vehicles"] == "54"
    kept = {each.name: each for each in model.graph.input}
    assert "centre in the map" in kept["kept_disc"].doc_string
    assert [each.name for each in model.graph.output][:2] == ["action", "next_pose"]


@pytest.mark.parametrize("policy", ["bio_inspired", "guarded:sff", "guarded:scout"])
def test_what_has_no_form_is_said(policy, tmp_path):
    with pytest.raises(PolicyError, match="no form in ONNX|networks without memory"):
        write_onnx(policy, load_scenario("random_field"), tmp_path / "policy.onnx")


def translated(function, *arguments):
    """What a function's nodes give: its result, and the arrays that it may write to. Values are inputs of the model.

    A tuple of the arguments is known when the model is written; an array of float32 holds single precision.
    """
    g, given, heads, arrays, args = Translator({}), {}, [], [], []
    for k, value in enumerate(arguments):
        if isinstance(value, tuple):
            args.append(value)
            continue
        kind = TensorProto.INT64 if isinstance(value, int) else TensorProto.DOUBLE
        array = np.array(value, np.int64 if isinstance(value, int) else np.float64)
        given[f"x{k}"] = array.ravel() if array.ndim else array
        heads.append(helper.make_tensor_value_info(f"x{k}", kind, [array.size] if array.ndim else []))
        if array.ndim:
            arrays.append(g.array(f"x{k}", array.shape, value.dtype == np.float32))
        args.append(arrays[-1] if array.ndim else Scalar(f"x{k}", "i" if isinstance(value, int) else "f"))
    result = g.call(function, *args)
    parts = [] if result is None else result if isinstance(result, tuple) else (result,)
    names = [g.emit("Identity", g.scalar(part).name) for part in parts]
    names += [g.emit("Identity", g.tensors[ref.cells]) for ref in arrays]
    opset = [helper.make_opsetid("", 18)]
    graph = helper.make_graph(g.nodes, "kernel", heads, [onnx.ValueInfoProto(name=name) for name in names], g.used())
    model = helper.make_model(graph, opset_imports=opset, ir_version=helper.find_min_ir_version_for(opset))
    session = onnxruntime.InferenceSession(model.SerializeToString(), providers=["CPUExecutionProvider"])
    found = session.run(None, given)
    return [each.item() for each in found[: len(parts)]], found[len(parts) :]


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


@pytest.mark.parametrize(("start", "most"), [(1.0, 9), (6.0, 20), (6.0, 5), (7.0, 40), (27.0, 200), (6.0, 0), (6.0, 1)])
def test_loops_end_where_they_do_in_python(start, most):
    assert translated(collatz, start, most)[0] == list(collatz(start, most))


@compiled
def sieve(flags, num):
    """Writes to an array in loops whose bounds are not known; an index that would lie outside is not asked for."""
    count, last = 0, 0
    for k in range(2, num):
        if flags[k] == 0.0:
            count, last = count + 1, k
            for j in range(k, num):
                for m in range(2):
                    if m == 1 and not j <= k and (j - k * math.floor(j / k) == 0 or flags[j] > 0.0):
                        flags[j] = max(flags[j], 1.0)
    if num < 20 and flags[num] == 0.0:
        count = count + 100
    return count, last if num > 2 else -1


@pytest.mark.parametrize("num", [2, 3, 20])
def test_arrays_are_written(num):
    wanted = np.zeros(20)
    result, (flags,) = translated(sieve, np.zeros(20), num)
    assert result == list(sieve(wanted, num))
    np.testing.assert_array_equal(flags, wanted)


@compiled
def scale(matrix, by):
    """A view that shares entries, single precision, and a number that becomes double in a loop."""
    first, total = matrix[0], 0
    for k in range(matrix.shape[1]):
        matrix[1, k] = first[k] * 3.0 + by
        first[k] += matrix[1, k]
        total = total + first[k]
    return total, 1.0 * math.hypot(matrix[0, 1], matrix[1, 1]), by - matrix[0, 0]


def test_single_precision_rounds_where_numba_rounds():
    array = np.linspace(0.1, 0.7, 6, dtype=np.float32).reshape(2, 3)
    wanted = array.copy()
    result, (matrix,) = translated(scale, array, 0.1)
    np.testing.assert_allclose(result, scale(wanted, 0.1), rtol=1e-7)
    np.testing.assert_array_equal(matrix.reshape(2, 3).astype(np.float32), wanted)


@pytest.mark.parametrize("seed", range(12))
def test_the_nearest_velocity_is_that_of_the_compiled_function(seed):
    """With room, and without: both programs of ``halfplanes``."""
    rng = np.random.default_rng(seed)
    angle, num, firm = rng.uniform(0.0, 2.0 * np.pi, 9), int(rng.integers(1, 10)), 2 if seed % 3 else 0
    planes = np.stack([np.cos(angle), np.sin(angle), rng.normal(0.5 if seed % 2 else -1.0, 1.0, 9)], axis=1)
    result, _ = translated(nearest_velocity, 2.0, -1.0, planes, num, min(firm, num), 4.0)
    np.testing.assert_allclose(result, nearest_velocity(2.0, -1.0, planes, num, min(firm, num), 4.0), atol=1e-12)


@pytest.mark.parametrize("angle", [-700.0, -1.0, 0.0, 0.3, 2.0, 3.0, 5.5, 900.0])
def test_sines_are_ours(angle):
    assert translated(cos_sin, angle)[0] == list(cos_sin(angle))


@pytest.mark.parametrize(
    ("body", "told"),
    [
        ("return x ** 3", "Pow has no translation"),
        ("return x // 2.0", "FloorDiv has no translation"),
        ("return x is None", "Is has no translation"),
        ("while x > 0.0:\n        x = x - 1.0\n    return x", "While has no translation"),
        ("for k in range(3):\n        x = x + 1.0\n    else:\n        x = 0.0\n    return x", "have no else"),
        ("for k in range(0, 9, 2):\n        x = x + k\n    return x", "range"),
        ("return a[0, -1]", "does not lie in an axis of length 3"),
        ("return a[2, 0]", "does not lie in an axis of length 2"),
        ("return a[0, ::2][1]", "no step"),
        ("return a.strides[0]", "only the shape"),
        ("return x + ((x > 1.0) + (x > 2.0))", "no number to compute with"),
        ("return (x or 2.0) * 3.0", "a condition must be"),
        ("if x > 1.0:\n        return x", "may end without a result"),
        ("if x > 1.0:\n        y = 1.0\n    return y", "y has a value on some ways only"),
        ("return math.sin(x)", "has no translation"),
        ("return (x, 2.0) == (x, 3.0)", "is no number"),
        ("return len(a)", "has no translation"),
    ],
)
def test_what_has_no_translation_is_refused_with_its_place(body, told, tmp_path):
    path = tmp_path / "kernel.py"
    path.write_text(f"import math\n\n\ndef kernel(x, a):\n    {body}\n", encoding="utf-8")
    loaded = importlib.util.spec_from_file_location("kernel", path)
    module = importlib.util.module_from_spec(loaded)
    loaded.loader.exec_module(module)
    with pytest.raises(KernelError, match=told) as error:
        translated(module.kernel, 1.5, np.zeros((2, 3)))
    assert "function kernel" in str(error.value)


def test_a_file_is_the_same_each_time(tmp_path):
    """Whatever NumPy prints, and in whatever order a process keeps its sets."""
    code = (
        "import sys, numpy; numpy.set_printoptions(precision=2)\nfrom pathlib import Path\n"
        "from uuv_marl import load_scenario\nfrom uuv_marl.baselines.export import write_onnx\n"
        "write_onnx('scout', load_scenario('starter'), Path(sys.argv[1]))"
    )
    paths = [tmp_path / f"{k}.onnx" for k in range(2)]
    for seed, path in enumerate(paths):
        subprocess.run([sys.executable, "-c", code, path], check=True, env={**os.environ, "PYTHONHASHSEED": str(seed)})
    write_onnx("scout", load_scenario("starter"), tmp_path / "here.onnx")
    assert len({path.read_bytes() for path in (*paths, tmp_path / "here.onnx")}) == 1
