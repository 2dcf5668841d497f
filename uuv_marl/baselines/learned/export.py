"""Networks as ONNX models: from an observation, and the state of a recurrent layer, to an action.

The nodes are created by the code that NumPy runs, ``layers.Network``.
"""

import functools
import json
from collections.abc import Sequence
from typing import Any

import numpy as np

from uuv_marl.atomic import writing
from uuv_marl.baselines import make_policy, with_policy_requirements
from uuv_marl.baselines.learned.actor import Actor, in_disc
from uuv_marl.baselines.learned.layers import Network
from uuv_marl.baselines.policy import PolicyError
from uuv_marl.extras import extra
from uuv_marl.paths import UserPath, user_path
from uuv_marl.scenario import Scenario
from uuv_marl.sim.observation import observation_layout

with extra("onnx", "export to ONNX"):
    import onnx
    from onnx import TensorProto, helper, numpy_helper

OPSET = 18  # version of ONNX's operators: the first that has every operator in its present form


def write_onnx(policy: str, scenario: Scenario, path: UserPath) -> None:
    """Write a network as an ONNX model that maps observations (vehicle, size) to actions (vehicle, entry), float32.

    Observations are those of an environment with ``observe="closeness"``. A recurrent network also takes its state
    (vehicle, unit), zeros at first, and returns the next one.

    Args:
        policy: name of a network, or path of a checkpoint.
        scenario: gives the observation's layout.
        path: the file.

    Raises:
        PolicyError: the policy is not such a network, or was trained on another percept or vehicle than the scenario's.
        ResultsError: the file can't be written.
    """
    path = user_path(path)
    actor = make_policy(policy, with_policy_requirements(policy, scenario))
    if not isinstance(actor, Actor):
        raise PolicyError(
            f"policy {policy!r} can't be exported: ONNX holds networks end to end, not controllers, safety filters or "
            "residual networks. Export a checkpoint of a training without filter and base controller; run this "
            "policy with uuv_marl.baselines.make_policy"
        )
    graph = Graph()
    network = Network(actor.checkpoint.card.network, actor.checkpoint.card.sizes, actor.checkpoint.tensors, graph)
    z, state = network.features(Value(graph, "observation")), None
    if network.architecture.memory:
        state = graph("Identity", network.step(network.gates(z), Value(graph, "state")), name="next_state")
    clipped = graph("Clip", network.output(z, state), np.float32(-1.0), np.float32(1.0))
    entries = actor.checkpoint.card.message_entries
    force = graph.take(clipped, np.arange(2)) if entries else clipped
    longest = graph("ReduceL2", force, np.array([-1])) if in_disc(actor) else np.float32(1.0)
    bounded = graph("Div", force, graph("Max", longest, np.float32(1.0)), name="" if entries else "action")
    if entries:
        graph("Concat", bounded, graph.take(clipped, np.arange(2, 2 + entries)), axis=1, name="action")
    model = _model(actor, graph)
    onnx.checker.check_model(model, full_check=True)  # pyright: ignore[reportUnknownMemberType] - of a path
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(model.SerializeToString())


def _model(policy: Actor, graph: "Graph") -> onnx.ModelProto:
    """The model with its documentation; metadata hold the vehicle's limits, the card, and the digest of the weights."""
    layout, checkpoint = observation_layout(policy.scenario, "closeness"), policy.checkpoint
    units = [f"{row.quantity.scale:g} {row.quantity.unit}".removesuffix(" 1") for row in layout.table]
    fields = ", ".join(f"{row.name} {row.size} [{unit}]" for row, unit in zip(layout.table, units, strict=True))
    sees = f"As closeness, body frame; name, size and unit of each part: {fields}."
    size = policy.scenario.action_size
    acts = "Surge force and yaw torque [full force, full torque], within the unit disc" + ", and a message" * (size > 2)
    takes, gives = [_tensor("observation", layout.size, sees)], [_tensor("action", size, f"{acts}.")]
    if checkpoint.card.network.memory:
        units_of = checkpoint.card.network.hidden[-1]
        takes.append(_tensor("state", units_of, "State of the recurrent layer; zeros at an episode's start."))
        gives.append(_tensor("next_state", units_of, "Next state of the recurrent layer."))
    damping, period = policy.scenario.actuators.yaw_damping_nms, checkpoint.card.decision_period_s
    opset = [helper.make_opsetid("", OPSET)]
    model = helper.make_model(
        helper.make_graph(graph.nodes, "policy", takes, gives, graph.constants),
        opset_imports=opset,
        ir_version=helper.find_min_ir_version_for(opset),
        producer_name="uuv_marl",
        doc_string=f"A policy of uuv_marl, {policy.name}, for every vehicle of a swarm. It decides every {period:g} s, "
        f"beside an inner loop with a yaw damping of {damping:g} N m s.",
    )
    limits = json.dumps(policy.limits._asdict())
    metadata = {"limits": limits, "card": checkpoint.card.model_dump_json(), "checkpoint": checkpoint.digest}
    helper.set_model_props(model, metadata)
    return model


def _tensor(name: str, size: int, description: str) -> onnx.ValueInfoProto:
    return helper.make_tensor_value_info(name, TensorProto.FLOAT, ["vehicle", size], description)


class Graph:
    """Nodes and constants, in the order of creation: the operations of a ``layers.Network``."""

    def __init__(self) -> None:
        self.nodes: list[onnx.NodeProto] = []
        self.constants: list[onnx.TensorProto] = []
        self._named = 0
        operators = ("Tanh", "Sigmoid", "Relu", "Gemm")
        self.tanh, self.sigmoid, self.relu, self.dense = (functools.partial(self, name) for name in operators)
        self.take = functools.partial(self, "Gather", axis=1)

    def __call__(self, operator: str, *inputs: Any, name: str = "", **attributes: Any) -> "Value":
        """The output of a new node with an operator's inputs (values, or arrays as constants), name and attributes."""
        name = name or self.fresh(operator)
        values = [each if isinstance(each, Value) else self.constant(each) for each in inputs]
        self.nodes.append(helper.make_node(operator, [value.name for value in values], [name], name, **attributes))
        return Value(self, name)

    def shaped(self, x: "Value", shape: Sequence[int]) -> "Value":
        """The tensor in another shape; -1 for an axis that follows from the others."""
        return self("Reshape", x, np.array(shape, np.int64))

    def joined(self, parts: "Sequence[Value]") -> "Value":
        """Columns side by side."""
        return self("Concat", *parts, axis=1)

    def parts(self, x: "Value") -> "list[Value]":
        """Thirds of the columns."""
        names = [self.fresh("part") for _ in range(3)]
        self.nodes.append(helper.make_node("Split", [x.name], names, self.fresh("Split"), axis=1, num_outputs=3))
        return [Value(self, name) for name in names]

    def total(self, x: "Value") -> "Value":
        """Sum over the middle axis, which is removed."""
        return self("ReduceSum", x, np.array([1]), keepdims=0)

    def fresh(self, stem: str) -> str:
        """An unused name."""
        self._named += 1
        return f"{stem}_{self._named}"

    def constant(self, value: Any) -> "Value":
        """An array as a constant."""
        name = self.fresh("constant")
        self.constants.append(numpy_helper.from_array(np.asarray(value), name))
        return Value(self, name)


class Value:
    """A tensor of a graph; arithmetic on it adds nodes."""

    def __init__(self, graph: Graph, name: str) -> None:
        self.graph, self.name = graph, name

    def __add__(self, other: Any) -> "Value":
        return self.graph("Add", self, other)

    def __sub__(self, other: Any) -> "Value":
        return self.graph("Sub", self, other)

    def __mul__(self, other: Any) -> "Value":
        return self.graph("Mul", self, other)
