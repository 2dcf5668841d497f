"""Policies without memory as nodes, for a batch of vehicles and without loops.

They repeat ``features.Features`` and Eq. 20-21. As there, features and forces are computed in double precision and the
network in single.
"""

import math
from collections.abc import Sequence

import numpy as np

from uuv_marl.baselines.bio_inspired import MAX_EXPONENT, MIN_DISTANCE_M, Gains
from uuv_marl.baselines.checkpoint import Layer
from uuv_marl.baselines.export.graph import Graph, Value
from uuv_marl.baselines.features import MOST_BARRIER
from uuv_marl.baselines.learned import Learned
from uuv_marl.baselines.policy import Limits
from uuv_marl.extras import extra
from uuv_marl.percept import PerceptLayout

with extra("onnx", "export to ONNX"):
    from onnx import TensorProto


def learned_nodes(g: Graph, policy: Learned, observation: Value, name: str = "") -> Value:
    """``Learned.act``: actions (vehicle, 2), float32.

    Args:
        g: takes the nodes.
        policy: the network, with its barrier.
        observation: of shape (vehicle, size), float32.
        name: of the actions.
    """
    card, layers, _ = policy.checkpoint
    flat = observation * policy.layout.scale
    features, barrier = _look(g, flat.double(), policy.layout, card.barrier, policy.limits)
    action = forward_nodes(g, features.single(), layers).double() + barrier
    return g("Cast", action / action.norm().at_least(1.0), to=TensorProto.FLOAT, name=name)


def forward_nodes(g: Graph, x: Value, layers: Sequence[Layer]) -> Value:
    """``learned.forward``: what a network makes of features (row, size), float32."""
    for k, layer in enumerate(layers):
        y = g("Gemm", x, layer.weight, layer.bias)
        x = g("Tanh", y) if k < len(layers) - 1 else y
    return x


def _look(g: Graph, flat: Value, layout: PerceptLayout, gains: Gains, limits: Limits) -> tuple[Value, Value]:
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


def _bounded_exp(length: float, p: Value) -> Value:
    """exp(length / distance) [1] for positions (vehicle, sector, 2) [m], bounded as ``bio_inspired.bounded_exp``.

    Distances are rounded to single precision, as there: opposed forces differ by what the rounding makes.
    """
    distance = p.norm().single().double()
    return p.graph("Exp", (length / distance.at_least(MIN_DISTANCE_M)).at_most(MAX_EXPONENT))
