"""Policies as ONNX models: the whole way from observation to action, barrier, memory, filter and bounds included."""

import json
from typing import Any

from uuv_marl.atomic import writing
from uuv_marl.baselines.export.graph import Graph, Value
from uuv_marl.baselines.export.memoryless import learned_nodes
from uuv_marl.baselines.export.remembering import KEPT, NEXT, remembered, remembering_nodes
from uuv_marl.baselines.filtered import Filtered
from uuv_marl.baselines.guarded import Guarded
from uuv_marl.baselines.learned import Learned
from uuv_marl.baselines.memory import Surroundings
from uuv_marl.baselines.policy import Policy, PolicyError
from uuv_marl.baselines.registry import granted, make
from uuv_marl.extras import extra
from uuv_marl.paths import UserPath, user_path
from uuv_marl.percept import PerceptLayout
from uuv_marl.scenario import Scenario
from uuv_marl.sim.tables import rows

with extra("onnx", "export to ONNX"):
    import onnx
    from onnx import TensorProto, helper

__all__ = ["KEPT", "NEXT", "OPSET", "write_onnx"]

OPSET = 18
"""Version of ONNX's operators: the first that has every operator in its present form."""


def write_onnx(policy: str, scenario: Scenario, path: UserPath) -> None:
    """Write a policy as an ONNX model that maps observations (vehicle, size) to actions (vehicle, 2), float32.

    What a policy remembers is further inputs, ``kept_...`` of shape (vehicle, ...), zeros at the start. It comes out as
    ``next_...``, to be put in at the next decision. Such a model decides once for every decision period of the
    scenario.

    Args:
        policy: name of a learned policy, or path of its checkpoint; ``scout``; ``guarded:`` before a learned one.
        scenario: gives the percept's layout, the vehicle's limits, the decision period and, where the policy remembers,
            the number of vehicles, by which its gains go; the model keeps them.
        path: the file.

    Raises:
        PolicyError: ONNX has no form for the policy, or it was trained on another percept or vehicle than the scenario
            has.
        ResultsError: the file can't be written.
    """
    path = user_path(path)
    made = make(policy, granted(policy, scenario))
    if made.reader is not None or (made.rudder is not None and not isinstance(made, Filtered)):
        what = "a scenario in a vehicle's scale" if made.reader is not None else "a vehicle with a rudder"
        raise PolicyError(f"policy {policy!r} has no form in ONNX for {what}; choose another scenario")
    if isinstance(made, Filtered):
        graph = remembering_nodes(made)
    elif isinstance(made, Learned):
        graph = Graph()
        learned_nodes(graph, made, Value(graph, "observation"), "action")
    else:
        raise PolicyError(
            f"policy {policy!r} is no network and has no form in ONNX; give a learned policy, such as the folder best "
            "of a training (uuv-marl train mappo), scout, or guarded: before a learned policy without memory"
        )
    model = _model(made, graph)
    onnx.checker.check_model(model, full_check=True)  # pyright: ignore[reportUnknownMemberType] - of a path
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(model.SerializeToString())


def _model(policy: Policy, graph: Graph) -> onnx.ModelProto:
    """The model with its documentation; its metadata hold what the policy knows of itself."""
    inputs, outputs = _doors(policy.layout)
    if isinstance(policy, Filtered):
        for name, shape in remembered(policy):
            meaning = rows(Surroundings)[name].meaning
            for door, called in ((inputs, KEPT + name), (outputs, NEXT + name)):
                door.append(helper.make_tensor_value_info(called, TensorProto.DOUBLE, ["vehicle", *shape], meaning))
    damping = policy.scenario.actuators.yaw_damping_nms
    opset = [helper.make_opsetid("", OPSET)]
    model = helper.make_model(
        helper.make_graph(graph.nodes, "policy", inputs, outputs, graph.used()),
        opset_imports=opset,
        ir_version=helper.find_min_ir_version_for(opset),
        producer_name="uuv_marl",
        doc_string=f"A policy of uuv_marl, {policy.name}, for every vehicle of a swarm{_size(policy)}. It decides "
        f"every {_periods(policy)} s, beside an inner loop with a yaw damping of {damping:g} N m s.",
    )
    helper.set_model_props(model, _said(policy))
    return model


def _doors(layout: PerceptLayout) -> tuple[list[Any], list[Any]]:
    """Input and output that every model has."""
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
        "Surge force, and yaw torque or rudder [full force, full torque or rudder], within the unit disc.",
    )
    return [observation], [action]


def _network(policy: Policy) -> Any:
    """The checkpoint that a policy holds, None for none."""
    return getattr(policy.inner if isinstance(policy, Guarded) else policy, "checkpoint", None)


def _periods(policy: Policy) -> str:
    """Between decisions [s]."""
    if isinstance(policy, Filtered):
        return f"{policy.scenario.timing.decision_period_s:g}"
    shortest, longest = _network(policy).card.decision_period_s
    return f"{shortest:g} to {longest:g}"


def _size(policy: Policy) -> str:
    return f" of {policy.scenario.swarm.num_vehicles}" if isinstance(policy, Filtered) else ""


def _said(policy: Policy) -> dict[str, str]:
    """Metadata: the vehicle's limits, how many vehicles a policy counts on, and card and digest of a checkpoint."""
    checkpoint, said = _network(policy), {"limits": json.dumps(policy.limits._asdict())}
    if isinstance(policy, Filtered):
        said["num_vehicles"] = f"{policy.scenario.swarm.num_vehicles}"
    if checkpoint is not None:
        said |= {"card": checkpoint.card.model_dump_json(), "checkpoint": checkpoint.digest}
    return said
