"""Policies that remember as nodes: a ``Scan`` over the vehicles, in which what a vehicle remembers goes in and out.

Memory, law and filter are the compiled functions that Python runs (``kernels``).
"""

import functools
from collections.abc import Sequence
from typing import Any, NamedTuple, cast

import numpy as np

from uuv_marl.baselines.export.graph import Value
from uuv_marl.baselines.export.kernels import Translator
from uuv_marl.baselines.export.memoryless import forward_nodes, learned_nodes
from uuv_marl.baselines.export.numbers import Ref, view_of
from uuv_marl.baselines.filtered import Filtered
from uuv_marl.baselines.guarded import Guarded, guard_all
from uuv_marl.baselines.learned import Learned
from uuv_marl.baselines.learned_law import LearnedLaw
from uuv_marl.baselines.memory import Surroundings, listen
from uuv_marl.baselines.policy import PolicyError
from uuv_marl.baselines.recall import RECALLED, recall
from uuv_marl.baselines.rudder import steer_by_rudder
from uuv_marl.baselines.scout import Scout, ScoutLead, ScoutPlus, ScoutWary, decide_all
from uuv_marl.baselines.trims import MOST_TRIM
from uuv_marl.extras import extra
from uuv_marl.percept import PerceptLayout, Starts
from uuv_marl.sim.views import Fields, fields

with extra("onnx", "export to ONNX"):
    from onnx import NodeProto, TensorProto, ValueInfoProto, helper

KEPT, NEXT = "kept_", "next_"
"""Before the name of what is remembered: as it was before the decision, and as it is after it."""
_ONE = np.array([True])
"""The worlds that go on: the only one."""


class Remembered(NamedTuple):
    """An array that a vehicle remembers, as input and output of the model."""

    name: str
    shape: tuple[int, ...]
    """Shape of one vehicle's part."""


def remembered(policy: Filtered) -> Sequence[Remembered]:
    """What the model of a policy remembers."""
    memory: Surroundings = policy.memory
    return [Remembered(name, array.shape[2:]) for name, array in memory._asdict().items()]


def remembering_nodes(policy: Filtered) -> Translator:
    """A graph from "observation" (vehicle, size) and what is remembered to "action" and what is remembered then.

    Raises:
        PolicyError: it has no form in ONNX.
    """
    g = Translator({fields: functools.partial(_fields, policy.layout)})
    inputs = ["observation", *(KEPT + name for name, _ in remembered(policy))]
    if isinstance(policy, Guarded):
        if not isinstance(policy.inner, Learned):
            raise PolicyError(
                f"policy {policy.name!r} has no form in ONNX: inside the filter only networks without memory have one; "
                "give such a network, or scout"
            )
        inputs.append(learned_nodes(g, policy.inner, Value(g, "observation")).name)
    nodes: list[NodeProto] = []
    with g.within(nodes):
        heads, tails = _vehicle(g, policy)
    body = helper.make_graph(nodes, "vehicle", heads, tails)
    outputs = ["action", *(NEXT + name for name, _ in remembered(policy))]
    g.nodes.append(helper.make_node("Scan", inputs, outputs, "vehicles", body=body, num_scan_inputs=len(inputs)))
    return g


def _vehicle(g: Translator, policy: Filtered) -> tuple[list["ValueInfoProto"], list["ValueInfoProto"]]:
    """Nodes of one vehicle's decision; its inputs and outputs."""
    kept, size = remembered(policy), policy.layout.size
    heads = [_info("row", TensorProto.FLOAT, (size,))]
    heads += [_info(f"own_{name}", TensorProto.DOUBLE, shape) for name, shape in kept]
    percept = (Value(g, "row") * policy.layout.scale).double()
    memory = Surroundings(**{name: _array(g, Value(g, f"own_{name}"), shape) for name, shape in kept})
    knows = policy.layout.offsets, _ONE, policy.model, policy.kept_s
    seen = _array(g, percept, (size,), single=True)
    g.call(listen, seen, *knows, memory)
    if isinstance(policy, Guarded):
        heads.append(_info("wish", TensorProto.FLOAT, (2,)))
        action = _guarded(g, policy, memory)
    elif isinstance(policy, Scout) and type(policy) in (Scout, ScoutPlus, ScoutLead, ScoutWary, LearnedLaw):
        action = _by_law(g, policy, memory)
    else:
        raise PolicyError(f"policy {policy.name!r} has no form in ONNX; give a learned policy or scout")
    if policy.rudder is not None:
        g.call(steer_by_rudder, seen, policy.layout.offsets, policy.rudder, action)
    g.tensors[cast(Any, memory.action).cells] = g.tensors[action.cells]
    acted = Value(g, g.tensors[action.cells]).single().name
    tails = [_info(acted, TensorProto.FLOAT, (2,))]
    for (_, shape), ref in zip(kept, cast(Any, memory), strict=True):
        own = Value(g, g.tensors[ref.cells]).shaped(*shape)
        tails.append(_info(own.name, TensorProto.DOUBLE, shape))
    return heads, tails


def _guarded(g: Translator, policy: Guarded, memory: Surroundings) -> Ref:
    """The action, shape (1, 1, 2), that the filter leaves of "wish"."""
    action = _array(g, Value(g, "wish").double(), (2,), single=True)
    by = policy.model.own, policy.barrier, policy.limits, policy.gain
    g.call(guard_all, _ONE, *by, memory, g.zeros(policy.planes.shape), action)
    return action


def _by_law(g: Translator, policy: Scout, memory: Surroundings) -> Ref:
    """The action, shape (1, 1, 2), of the law, whose gains a network may trim."""
    by = policy.model.own.period_s, policy.grown(), policy.barrier, policy.limits
    planes, trims = g.zeros(policy.planes.shape), g.zeros((1, 1, policy.num_trims), single=True)
    if isinstance(policy, LearnedLaw):
        features = g.zeros((1, 1, RECALLED), single=True)
        g.call(recall, _ONE[None], policy.scenario.swarm.num_vehicles, *by, memory, planes, features)
        seen = Value(g, g.tensors[features.cells]).single().shaped(1, RECALLED)
        output = forward_nodes(g, seen, policy.checkpoint.layers)
        bounds = (np.array(bound, np.float32) for bound in (-MOST_TRIM, MOST_TRIM))
        places = np.eye(policy.num_trims, dtype=np.float32)[policy.columns]
        trims = _array(g, g("MatMul", g("Clip", output, *bounds), places).double(), places.shape[1:], single=True)
    action = g.zeros((1, 1, 2), single=True)
    g.call(decide_all, _ONE, *by, policy.gain, memory, planes, trims, action)
    return action


def _array(g: Translator, value: Value, shape: tuple[int, ...], single: bool = False) -> Any:
    """A tensor of one vehicle as an array over one world and one vehicle."""
    return g.array(value.shaped(-1).name, (1, 1, *shape), single)


def _info(name: str, kind: int, shape: tuple[int, ...]) -> "ValueInfoProto":
    return helper.make_tensor_value_info(name, kind, list(shape))


def _fields(layout: PerceptLayout, flat: Ref, _at: Starts) -> Fields:
    """``views.fields`` of one vehicle's percept."""
    parts: dict[str, Any] = dict.fromkeys(Fields._fields, np.zeros((1, 1, 0)))
    for row in layout.table:
        if row.name in parts:
            parts[row.name] = view_of(flat.cells, (1, 1, *row.shape), layout.starts[row.name])
    return Fields(**parts)
