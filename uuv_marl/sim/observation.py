"""Observations: percepts scaled by the table in ``uuv_marl.percept``, or as closeness."""

from collections.abc import Callable
from typing import Literal

import numpy as np

from uuv_marl.percept import (
    DIRECTION,
    FieldTable,
    Percept,
    PerceptField,
    PerceptLayout,
    Quantity,
    Starts,
    percept_table,
)
from uuv_marl.scenario import Scenario
from uuv_marl.sim.compiled import compiled
from uuv_marl.sim.views import fields
from uuv_marl.types import Float32

Observe = Literal["positions", "closeness"]

CLOSENESS = Quantity("1", 1.0, 0.0, 2.0)
_SIGNED = Quantity("1", 1.0, -2.0, 2.0)
_NEAR = Quantity("1", 1.0, 0.0, 4.0)
_BASE = len(percept_table(0, 0, ()))
"""Number of fields of every percept, which ``closeness`` replaces."""
_BEFORE = 9
"""Entries of ``closeness`` before those of sub-sectors: velocities and reference."""


def observation_layout(scenario: Scenario, observe: Observe) -> PerceptLayout:
    """The table of an observation, with its bounds and scales.

    Raises:
        ValueError: ``observe`` has another value.
    """
    percept = PerceptLayout.of(scenario)
    if observe == "positions":
        return percept
    if observe != "closeness":
        raise ValueError(f"observe must be 'positions' or 'closeness', got {observe!r}")
    return PerceptLayout((*closeness_table(scenario), *percept.table[_BASE:]))


def closeness_table(scenario: Scenario) -> FieldTable:
    """The fields of ``closeness`` that replace those of every percept; p: a position [m], d: its length."""
    sectors, active = scenario.sonar.num_sectors, scenario.sonar.num_active_sectors
    own = {row.name: row for row in percept_table(sectors, active, ())}
    return (
        own["velocity"],
        own["yaw_rate"],
        PerceptField("reference_direction", (2,), DIRECTION, "p/(d + 1 m), p: vector to the reference point"),
        PerceptField("reference_near", (2,), _NEAR, "min(d/64 m, 4) and min(d/16 m, 4)"),
        own["reference_velocity"],
        PerceptField("closeness", (sectors,), CLOSENESS, "per sub-sector: c = 8 m/(d + 4 m) of its vehicle, or 0"),
        PerceptField("neighbour_direction", (sectors, 2), _SIGNED, "per sub-sector: c p/d of that vehicle"),
        PerceptField("echo_closeness", (active,), CLOSENESS, "per active sub-sector: e = 20 m/(range + 10 m), or 0"),
        PerceptField("echo_direction", (active, 2), _SIGNED, "per active sub-sector: e p/d of the echo's position"),
    )


def observer(percept: Percept, layout: PerceptLayout) -> tuple[Float32, Callable[[int, int], None]]:
    """A new array (world, vehicle, entry), and a function that fills a range of worlds with present observations.

    They are those of ``Percept.to_observation``, or closeness, of ``percept.flat``.
    """
    flat, own = percept.flat, percept.layout
    observation = np.empty((*flat.shape[:2], layout.size), np.float32)
    inverse = np.float32(1.0) / layout.scale
    if layout == own:
        return observation, lambda begin, end: _scale(begin, end, flat, inverse, observation)
    rest = sum(field.size for field in own.table[:_BASE])
    return observation, lambda begin, end: _weigh(begin, end, flat, own.offsets, rest, inverse, observation)


@compiled
def _scale(begin: int, end: int, flat: Float32, inverse: Float32, observation: Float32) -> None:
    """Fill observations; scales are powers of two, so that a product with the inverse has the quotient's bits."""
    for w in range(begin, end):
        for i in range(flat.shape[1]):
            for k in range(flat.shape[2]):
                observation[w, i, k] = flat[w, i, k] * inverse[k]


@compiled
def _weigh(begin: int, end: int, flat: Float32, at: Starts, rest: int, inverse: Float32, observation: Float32) -> None:
    """Fill ``closeness``; the percept's entries from ``rest`` on are scaled as usual."""
    see = fields(flat, at)
    sectors, active = see.detected.shape[2], see.echo.shape[2]
    for w in range(begin, end):
        for i in range(flat.shape[1]):
            out = observation[w, i]
            out[0], out[1] = see.velocity[w, i, 0], see.velocity[w, i, 1]
            out[2] = see.yaw_rate[w, i, 0]
            x, y = see.reference[w, i, 0], see.reference[w, i, 1]
            d = np.sqrt(x * x + y * y)
            out[3], out[4] = x / (d + 1.0), y / (d + 1.0)
            out[5], out[6] = min(d / 64.0, 4.0), min(d / 16.0, 4.0)
            out[7], out[8] = see.reference_velocity[w, i, 0], see.reference_velocity[w, i, 1]
            k = _BEFORE
            for s in range(sectors):
                x, y = see.neighbour[w, i, s, 0], see.neighbour[w, i, s, 1]
                d = np.sqrt(x * x + y * y)
                out[k + s] = 8.0 / (d + 4.0) if see.detected[w, i, s] > 0.0 else 0.0
                turn = out[k + s] / max(d, 1e-6)
                out[k + sectors + 2 * s], out[k + sectors + 2 * s + 1] = turn * x, turn * y
            k += 3 * sectors
            for a in range(active):
                x, y = see.echo_position[w, i, a, 0], see.echo_position[w, i, a, 1]
                d = np.sqrt(x * x + y * y)
                out[k + a] = 20.0 / (see.echo_range[w, i, a] + 10.0) if see.echo[w, i, a] > 0.0 else 0.0
                turn = out[k + a] / max(d, 1e-6)
                out[k + active + 2 * a], out[k + active + 2 * a + 1] = turn * x, turn * y
            k += 3 * active
            for c in range(rest, flat.shape[2]):
                out[k + c - rest] = flat[w, i, c]
            for c in range(out.shape[0]):
                out[c] *= inverse[c]
