"""Networks as ONNX models: the whole way from an observation to an action, barrier and bounds included.

The nodes repeat ``percept_features`` and Eq. 20-21, for a batch of vehicles and without loops. As there, features and
forces are computed in double precision and the network in single.
"""

import json
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uuv_marl.atomic import writing
from uuv_marl.baselines import granted, make
from uuv_marl.baselines.learned.checkpoint import Layer
from uuv_marl.baselines.learned.network import Learned
from uuv_marl.baselines.learned.percept_features import MOST_BARRIER
from uuv_marl.baselines.paper.bio_inspired import MAX_EXPONENT, MIN_DISTANCE_M, BioInspiredGains
from uuv_marl.baselines.policy import Limits, PolicyError
from uuv_marl.extras import extra
from uuv_marl.paths import UserPath, user_path
from uuv_marl.percept import PerceptLayout
from uuv_marl.scenario import Scenario

with extra("onnx", "export to ONNX"):
    import onnx
    from onnx import TensorProto, helper, numpy_helper

OPSET = 18
"""Version of ONNX's operators: the first that has every operator in its present form."""


def write_onnx(policy: str, scenario: Scenario, path: UserPath) -> None:
    """Write a network as an ONNX model that maps observations (vehicle, size) to actions (vehicle, 2), float32.

    Args:
        policy: name of a network that sees one percept, or path of its checkpoint.
        scenario: gives the percept's layout and the vehicle's limits; the model keeps them.
        path: the file.

    Raises:
        PolicyError: the policy is no such network, or was trained on another percept or vehicle than the scenario has.
        ResultsError: the file can't be written.
    """
    path = user_path(path)
    made = make(policy, granted(policy, scenario))
    if not isinstance(made, Learned):
        raise PolicyError(
            f"policy {policy!r} can't be exported: ONNX holds networks that see one observation, not laws, filters "
            "or what they remember. Export mappo, ppo or a checkpoint of a training without memory; run this policy "
            "with uuv_marl.baselines.make"
        )
    if made.reader is not None or made.rudder is not None:
        what = "a scenario in a vehicle's scale" if made.reader is not None else "a vehicle with a rudder"
        raise PolicyError(f"policy {policy!r} has no form in ONNX for {what}; choose another scenario")
    graph = Graph()
    _learned_nodes(graph, made, Value(graph, "observation"))
    model = _model(made, graph)
    onnx.checker.check_model(model, full_check=True)  # pyright: ignore[reportUnknownMemberType] - of a path
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(model.SerializeToString())


def _model(policy: Learned, graph: "Graph") -> onnx.ModelProto:
    """The model with its documentation; its metadata hold the vehicle's limits, and card and digest of the weights."""
    layout, checkpoint = policy.layout, policy.checkpoint
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
    damping, (shortest, longest) = policy.scenario.actuators.yaw_damping_nms, checkpoint.card.decision_period_s
    opset = [helper.make_opsetid("", OPSET)]
    model = helper.make_model(
        helper.make_graph(graph.nodes, "policy", [observation], [action], graph.constants),
        opset_imports=opset,
        ir_version=helper.find_min_ir_version_for(opset),
        producer_name="uuv_marl",
        doc_string=f"A policy of uuv_marl, {policy.name}, for every vehicle of a swarm. It decides every {shortest:g} "
        f"to {longest:g} s, beside an inner loop with a yaw damping of {damping:g} N m s.",
    )
    limits = json.dumps(policy.limits._asdict())
    said = {"limits": limits, "card": checkpoint.card.model_dump_json(), "checkpoint": checkpoint.digest}
    helper.set_model_props(model, said)
    return model


def _learned_nodes(g: "Graph", policy: Learned, observation: "Value") -> None:
    """``Learned.decide``: the actions (vehicle, 2), float32, from an observation (vehicle, size), float32."""
    card, layers, _ = policy.checkpoint
    flat = observation * policy.layout.scale
    features, barrier = _look(g, flat.double(), policy.layout, card.barrier, policy.limits)
    action = _forward(g, features.single(), layers).double() + barrier
    g("Cast", action / action.norm().at_least(1.0), to=TensorProto.FLOAT, name="action")


def _forward(g: "Graph", x: "Value", layers: Sequence[Layer]) -> "Value":
    """``learned.forward``: what a network makes of features (row, size), float32."""
    for k, layer in enumerate(layers):
        y = g("Gemm", x, layer.weight, layer.bias)
        x = g("Tanh", y) if k < len(layers) - 1 else y
    return x


def _look(
    g: "Graph", flat: "Value", layout: PerceptLayout, gains: BioInspiredGains, limits: Limits
) -> "tuple[Value, Value]":
    """``features.Features.look``: features (vehicle, size) and barrier (vehicle, 2) [full force] from percepts."""
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


def _bounded_exp(length: float, p: "Value") -> "Value":
    """exp(length / distance) [1] for positions (vehicle, sector, 2) [m], bounded as ``bio_inspired.bounded_exp``.

    Distances are rounded to single precision, as there: opposed forces differ by what the rounding makes.
    """
    distance = p.norm().single().double()
    return p.graph("Exp", (length / distance.at_least(MIN_DISTANCE_M)).at_most(MAX_EXPONENT))


class Graph:
    """Nodes and constants, in the order in which formulas make them."""

    def __init__(self) -> None:
        self.nodes: list[onnx.NodeProto] = []
        self.constants: list[onnx.TensorProto] = []
        self._named = 0

    def __call__(self, operator: str, *inputs: Any, name: str = "", **attributes: Any) -> "Value":
        """The output of a new node.

        Args:
            operator: of ONNX.
            inputs: values, arrays, or numbers, which become constants.
            name: of the output; made up where empty.
            attributes: of the operator.
        """
        name = name or self.fresh(operator)
        values = [each if isinstance(each, Value) else self.constant(each) for each in inputs]
        self.nodes.append(helper.make_node(operator, [value.name for value in values], [name], name, **attributes))
        return Value(self, name)

    def split(self, value: "Value", sizes: Sequence[int]) -> "list[Value]":
        """Consecutive columns of a value (vehicle, sum of sizes)."""
        names = [self.fresh("part") for _ in sizes]
        inputs = [value.name, self.constant(np.array(sizes, np.int64)).name]
        self.nodes.append(helper.make_node("Split", inputs, names, self.fresh("Split"), axis=1))
        return [Value(self, name) for name in names]

    def fresh(self, stem: str) -> str:
        """A name that nothing has."""
        self._named += 1
        return f"{stem}_{self._named}"

    def constant(self, value: NDArray[Any] | float) -> "Value":
        """An array or a number: double, or int64 where it is whole."""
        name = self.fresh("constant")
        self.constants.append(numpy_helper.from_array(np.asarray(value), name))
        return Value(self, name)


class Value:
    """A tensor of a graph; formulas of it add nodes."""

    def __init__(self, graph: Graph, name: str) -> None:
        self.graph, self.name = graph, name

    def __add__(self, other: Any) -> "Value":
        return self.graph("Add", self, other)

    def __sub__(self, other: Any) -> "Value":
        return self.graph("Sub", self, other)

    def __mul__(self, other: Any) -> "Value":
        return self.graph("Mul", self, other)

    def __truediv__(self, other: Any) -> "Value":
        return self.graph("Div", self, other)

    def __rtruediv__(self, other: Any) -> "Value":
        return self.graph("Div", other, self)

    def at_least(self, bound: float) -> "Value":
        """No less than a bound."""
        return self.graph("Max", self, bound)

    def at_most(self, bound: float) -> "Value":
        """No more than a bound."""
        return self.graph("Min", self, bound)

    def norm(self) -> "Value":
        """Length along the last axis, which stays."""
        return self.graph("ReduceL2", self, np.array([-1]))

    def single(self) -> "Value":
        """The value in single precision."""
        return self.graph("Cast", self, to=TensorProto.FLOAT)

    def double(self) -> "Value":
        """The value in double precision."""
        return self.graph("Cast", self, to=TensorProto.DOUBLE)

    def shaped(self, *shape: int) -> "Value":
        """With 0 for an axis that stays."""
        return self.graph("Reshape", self, np.array(shape, np.int64))

    def where(self, flag: "Value") -> "Value":
        """Zero where a flag is not set."""
        return self.graph("Where", self.graph("Greater", flag, 0.0), self, 0.0)

    def total(self) -> "Value":
        """Sum over the middle axis, which goes."""
        return self.graph("ReduceSum", self, np.array([1]), keepdims=0)
