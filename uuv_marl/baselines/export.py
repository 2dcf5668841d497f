"""Learned policies as ONNX models: the whole way from observation to action, barrier and bounds included.

The graph repeats ``features.Features`` and Eq. 20-21 for a batch of vehicles, without loops. As there, features and
forces are computed in double precision and the network in single.
"""

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uuv_marl.atomic import writing
from uuv_marl.baselines.actors import Trained
from uuv_marl.baselines.bio_inspired import MAX_EXPONENT, MIN_DISTANCE_M, Gains
from uuv_marl.baselines.features import MOST_BARRIER
from uuv_marl.baselines.learned import Learned
from uuv_marl.baselines.policy import Limits, PolicyError
from uuv_marl.baselines.registry import GUARDED, granted, policy_class
from uuv_marl.extras import extra
from uuv_marl.percept import PerceptLayout
from uuv_marl.scenario import Scenario

with extra("onnx", "export to ONNX"):
    import onnx
    from onnx import TensorProto, helper, numpy_helper

OPSET = 18
"""Version of ONNX's operators: the first that has every operator in its present form."""


class _Graph:
    """Nodes and constants, in the order in which formulas make them."""

    def __init__(self) -> None:
        self.nodes: list[onnx.NodeProto] = []
        self.constants: list[onnx.TensorProto] = []

    def __call__(self, operator: str, *inputs: Any, name: str = "", **attributes: Any) -> "_Value":
        """The output of a new node.

        Args:
            operator: of ONNX.
            inputs: values, arrays, or numbers, which become double constants.
            name: of the output; made up where empty.
            attributes: of the operator.
        """
        name = name or f"{operator}_{len(self.nodes)}"
        values = [each if isinstance(each, _Value) else self._constant(each) for each in inputs]
        self.nodes.append(helper.make_node(operator, [value.name for value in values], [name], name, **attributes))
        return _Value(self, name)

    def split(self, value: "_Value", sizes: Sequence[int]) -> "list[_Value]":
        """Consecutive columns of a value (vehicle, sum of sizes)."""
        names = [f"part_{k}" for k in range(len(sizes))]
        inputs = [value.name, self._constant(np.array(sizes, np.int64)).name]
        self.nodes.append(helper.make_node("Split", inputs, names, "Split", axis=1))
        return [_Value(self, name) for name in names]

    def _constant(self, value: NDArray[Any] | float) -> "_Value":
        name = f"constant_{len(self.constants)}"
        self.constants.append(numpy_helper.from_array(np.asarray(value), name))
        return _Value(self, name)


class _Value:
    """A tensor of a graph; formulas of it add nodes."""

    def __init__(self, graph: _Graph, name: str) -> None:
        self.graph, self.name = graph, name

    def __add__(self, other: Any) -> "_Value":
        return self.graph("Add", self, other)

    def __sub__(self, other: Any) -> "_Value":
        return self.graph("Sub", self, other)

    def __mul__(self, other: Any) -> "_Value":
        return self.graph("Mul", self, other)

    def __truediv__(self, other: Any) -> "_Value":
        return self.graph("Div", self, other)

    def __rtruediv__(self, other: Any) -> "_Value":
        return self.graph("Div", other, self)

    def at_least(self, bound: float) -> "_Value":
        return self.graph("Max", self, bound)

    def at_most(self, bound: float) -> "_Value":
        return self.graph("Min", self, bound)

    def norm(self) -> "_Value":
        """Length along the last axis, which stays."""
        return self.graph("ReduceL2", self, np.array([-1]))

    def single(self) -> "_Value":
        return self.graph("Cast", self, to=TensorProto.FLOAT)

    def double(self) -> "_Value":
        return self.graph("Cast", self, to=TensorProto.DOUBLE)

    def shaped(self, *shape: int) -> "_Value":
        """With 0 for an axis that stays."""
        return self.graph("Reshape", self, np.array(shape))

    def where(self, flag: "_Value") -> "_Value":
        """Zero where a flag is not set."""
        return self.graph("Where", self.graph("Greater", flag, 0.0), self, 0.0)

    def total(self) -> "_Value":
        """Sum over the middle axis, which goes."""
        return self.graph("ReduceSum", self, np.array([1]), keepdims=0)


def write_onnx(policy: str, scenario: Scenario, path: Path) -> None:
    """Write a learned policy as an ONNX model that maps observations (vehicle, size) to actions (vehicle, 2), float32.

    Args:
        policy: name of a learned policy, or path of its checkpoint.
        scenario: gives the percept's layout and the vehicle's limits, which the model keeps.
        path: the file.

    Raises:
        PolicyError: the policy is no network, or was trained on another percept or vehicle than the scenario has.
        ResultsError: the file can't be written.
    """
    if policy.startswith(GUARDED):
        raise PolicyError(
            f"policy {policy!r}: the safety filter has no form in ONNX, since it remembers; export "
            f"{policy.removeprefix(GUARDED)!r}, and run the filter of uuv_marl.baselines.guarded behind it"
        )
    kind = policy_class(policy)
    if not isinstance(kind, Trained):
        raise PolicyError(
            f"policy {policy!r} is no network, so ONNX has no form for it; give a learned policy, such as the folder "
            "best of a training (uuv-marl train mappo)"
        )
    made = kind(granted(policy, scenario))
    if not isinstance(made, Learned):
        raise PolicyError(f"policy {policy!r} remembers, and its memory has no form in ONNX yet; run it from Python")
    model = _model(made)
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(model.SerializeToString())


def _model(policy: Learned) -> onnx.ModelProto:
    """The model with its documentation; its metadata hold the card, the vehicle's limits and the file's digest."""
    card, layout, graph = policy.checkpoint.card, policy.layout, _Graph()
    _act(graph, policy)
    units = [f"{row.kind.scale:g} {row.kind.unit}".removesuffix(" 1") for row in layout.table]
    fields = ", ".join(f"{row.name} {row.size} [{unit}]" for row, unit in zip(layout.table, units, strict=True))
    observation = helper.make_tensor_value_info(
        "observation",
        TensorProto.FLOAT,
        ["vehicle", layout.size],
        f"The percept as environments give it, body frame; name, size and unit of each part: {fields}.",
    )
    action = helper.make_tensor_value_info(
        "action",
        TensorProto.FLOAT,
        ["vehicle", 2],
        "Surge force and yaw torque [full force, full torque], within the unit disc.",
    )
    shortest, longest = card.decision_period_s
    opset = [helper.make_opsetid("", OPSET)]
    model = helper.make_model(
        helper.make_graph(graph.nodes, "policy", [observation], [action], graph.constants),
        opset_imports=opset,
        ir_version=helper.find_min_ir_version_for(opset),
        producer_name="uuv_marl",
        doc_string=f"A policy of uuv_marl for every vehicle of a swarm. It decides every {shortest:g} to {longest:g} "
        f"s, beside an inner loop with a yaw damping of {card.yaw_damping_nms:g} N m s.",
    )
    helper.set_model_props(
        model,
        {
            "card": card.model_dump_json(),
            "limits": json.dumps(policy.limits._asdict()),
            "checkpoint": policy.checkpoint.digest,
        },
    )
    return model


def _act(g: _Graph, policy: Learned) -> _Value:
    """``Learned.act``, from the input "observation" to the output "action"."""
    card, layers, _ = policy.checkpoint
    flat = _Value(g, "observation") * policy.layout.scale
    features, barrier = _look(g, flat.double(), policy.layout, card.barrier, policy.limits)
    x = features.single()
    for k, layer in enumerate(layers):
        y = g("Gemm", x, layer.weight, layer.bias)
        x = g("Tanh", y) if k < len(layers) - 1 else y
    action = x.double() + barrier
    return g("Cast", action / action.norm().at_least(1.0), to=TensorProto.FLOAT, name="action")


def _look(g: _Graph, flat: _Value, layout: PerceptLayout, gains: Gains, limits: Limits) -> tuple[_Value, _Value]:
    """``features.Features.look``: features (vehicle, size) and barrier (vehicle, 2) [full force] from percepts.

    Args:
        g: takes the nodes.
        flat: percepts in physical units, double, shape (vehicle, entry).
        layout: of the percepts.
        gains: of the barrier.
        limits: of the actuators, and the surge resistance.
    """
    sizes = {row.name: row.size for row in layout.table}
    percept = dict(zip(sizes, g.split(flat, list(sizes.values())), strict=True))
    sectors, active = sizes["heard"], sizes["echo"]
    reference, lead = percept["reference"], percept["reference"].norm()
    own = [
        percept["velocity"] * np.array([1 / 4.0, 1.0]),
        percept["yaw_rate"],
        percept["reference_velocity"] / 4.0,
        reference / (lead * 0.5).at_least(64.0),
        reference / (lead + 8.0),
    ]

    heard, p = percept["heard"].shaped(0, sectors, 1), percept["neighbour"].shaped(0, sectors, 2)
    away = p.norm()
    near = p * (10.0 / ((away + 5.0) * away.at_least(1e-3)))
    far = p / (away * 0.5).at_least(64.0)
    neighbours = g("Concat", near, far, axis=2).where(heard).shaped(0, 4 * sectors)
    pull = p * ((_bounded_exp(gains.delta_n, p) - math.e) * -gains.zeta_n)

    echo, o = percept["echo"].shaped(0, active, 1), percept["echo_position"].shaped(0, active, 2)
    reach = percept["echo_range"].shaped(0, active, 1)
    nearness = 20.0 / (reach + 10.0)
    towards = o * (nearness / o.norm().at_least(1e-3))
    obstacles = g("Concat", nearness, reach / 64.0, towards, axis=2).where(echo).shaped(0, 4 * active)
    push = o * (_bounded_exp(gains.delta_o, o) * -gains.zeta_o)

    force = pull.where(heard).total() + push.where(echo).total()
    share = force * np.array([1.0 / limits.max_force, limits.lever_arm / limits.max_torque])
    barrier = share * (MOST_BARRIER / share.norm().at_least(1e-9)).at_most(1.0)
    features = g("Concat", *own, neighbours, obstacles, barrier / (barrier.norm() + 1.0), axis=1)
    return features, barrier


def _bounded_exp(length: float, p: _Value) -> _Value:
    """exp(length / distance) [1] for positions (vehicle, sector, 2) [m], bounded as ``bio_inspired.bounded_exp``.

    Distances are rounded to single precision, as there: opposed forces differ by what the rounding makes.
    """
    distance = p.norm().single().double()
    return p.graph("Exp", (length / distance.at_least(MIN_DISTANCE_M)).at_most(MAX_EXPONENT))
