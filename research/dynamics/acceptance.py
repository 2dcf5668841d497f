"""Whether a vehicle swims as its source says: top speed, turn, coasting and stability, by the simulation's equations.

A vehicle is alone in still water. Its lags count. It is integrated with the longest step that is accepted for it.
"""

import math
from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uuv_marl.benchmark.handling import alone, every, last, swim, turn
from uuv_marl.scenario import Scenario, vehicle_names
from uuv_marl.sim.vehicle import STILL, derivative, plant

SPEEDS_MPS = (0.5, 1.0, 1.5, 2.0)
"""Speeds at which the stability of going straight is tabled."""
TURN_S = 60.0
"""Duration of a turn from rest, after which the integration step's error is taken."""
_FINER = 16


class Figure(NamedTuple):
    """A source's number for a vehicle."""

    vehicle: str
    quantity: str
    """A field of ``Measured``."""
    stated: float
    within: float
    """Tolerance, in the quantity's unit."""
    source: str


FIGURES = (
    Figure("lauv", "top_mps", 2.0, 0.05, "Havenstrøm 2020: largest speed of his simulator"),
    Figure("remus100", "top_mps", 2.5, 0.1, "Fossen: 1525 turns a minute in his simulators"),
)
"""All that the sources of the catalogue's numbers state of how these vehicles move."""


class Measured(NamedTuple):
    """The measured motion of a vehicle."""

    top_mps: float
    """Speed ahead at full thrust."""
    turn_mps: float
    """Speed in the turn at the limits: full thrust and rudder; full torque without thrust."""
    turn_dps: float
    """Yaw rate in it [deg/s]."""
    turn_radius_m: float
    coast_m: float
    """Distance from 1 to 0.1 m/s without thrust."""
    coast_s: float
    step_s: float
    """The longest integration step of ``handling.STEPS_S`` with which the vehicle is accepted."""
    step_error_m: float
    """Error of the place after 60 s from rest with that step, at full thrust and rudder, or full thrust and torque."""


def measured(vehicle: str) -> Measured:
    """The measured motion of a vehicle, by name or file. Raises ScenarioError as ``alone`` does."""
    scenario = alone(vehicle)
    (top_mps, turn_dps, radius_m), step_s = turn(scenario), scenario.timing.integration_step_s
    coast_m, coast_s = _coast(scenario)
    fine = alone(vehicle).model_copy(
        update={"timing": scenario.timing.model_copy(update={"integration_step_s": step_s / _FINER})}
    )
    action = (1.0, 1.0) if scenario.actuators.kind == "rudder" else (0.5, 0.5)
    places = [last(each, action, TURN_S)[:2] for each in (scenario, fine)]
    return Measured(
        top_mps=top_mps, turn_mps=radius_m * math.radians(turn_dps), turn_dps=turn_dps, turn_radius_m=radius_m,
        coast_m=coast_m, coast_s=coast_s, step_s=step_s, step_error_m=math.dist(*places),
    )  # fmt: skip


def _coast(scenario: Scenario) -> tuple[float, float]:
    """Distance [m] and time [s] from 1 to 0.1 m/s; within a step the speed falls evenly."""
    x, u, h = 0.0, 1.0, scenario.timing.integration_step_s
    for k, now in enumerate(swim(scenario, (0.0, 0.0), 3600.0, speed_mps=1.0)):
        if now[3] <= 0.1:
            share = (u - 0.1) / (u - now[3])
            return x + share * (now[0] - x), (k + share) * h
        x, u = now[0], now[3]
    return math.inf, math.inf


def sway_yaw(scenario: Scenario, speed_mps: float) -> NDArray[np.complex128]:
    """Eigenvalues [1/s] of sway and yaw of a vehicle that goes straight, (2,), the larger real part first.

    Those with a positive real part grow: without steering the vehicle turns off its course.
    """
    p, small = plant(scenario), 1e-7

    def rate(v: float, r: float) -> tuple[float, ...]:
        return derivative((0.0, 0.0, 0.0, speed_mps, v, r), (0.0, 0.0), STILL, p)[4:]

    slopes = [(np.subtract(rate(v, r), rate(-v, -r)) / (2.0 * small)).tolist() for v, r in ((small, 0.0), (0.0, small))]
    values = np.linalg.eigvals(np.array(slopes).T).astype(np.complex128)
    return values[np.lexsort((-values.imag, -values.real))]


# --- Tables of docs/vehicles.md ---


@cache
def _measured(vehicle: str) -> Measured:
    return measured(vehicle)


def measures() -> list[Sequence[str]]:
    """Rows of the motion of every vehicle, the header first."""
    rows: list[Sequence[str]] = [
        ("vehicle", "top speed [m/s]", "turn at the limits [deg/s]", "at [m/s]", "radius [m]", "coasts [m]", "for [s]",
         "longest step [s]", "its error [m]")
    ]  # fmt: skip
    for name in every():
        m = _measured(name)
        rows.append(
            (f"`{name}`", f"{m.top_mps:.2f}", f"{m.turn_dps:.1f}", f"{m.turn_mps:.2f}", f"{m.turn_radius_m:.2f}",
             f"{m.coast_m:.2f}", f"{m.coast_s:.1f}", f"{m.step_s:g}", f"{_order(m.step_error_m)}")
        )  # fmt: skip
    return rows


def _order(metres: float) -> str:
    """An error to one digit, rounded up; what rounding makes is called so."""
    if metres < 1e-9:
        return "below 1e-9"
    exponent = math.floor(math.log10(metres))
    return f"{math.ceil(metres / 10.0**exponent) * 10.0**exponent:.0e}"


def figures() -> list[Sequence[str]]:
    """Rows of the sources' figures beside the measured ones, the header first."""
    rows: list[Sequence[str]] = [("vehicle", "quantity", "source", "stated", "measured", "tolerance")]
    for name in vehicle_names():
        stated = [figure for figure in FIGURES if figure.vehicle == name]
        rows += [
            (f"`{name}`", "top speed", f.source, f"{f.stated:g} m/s", f"{getattr(_measured(name), f.quantity):.2f} m/s",
             f"{f.within:g} m/s")
            for f in stated
        ]  # fmt: skip
        lacking = "turn, coasting, stability" if stated else "top speed, turn, coasting, stability"
        rows.append((f"`{name}`", lacking, "none gives a figure", "–", "above", "–"))
    return rows


def stability() -> list[Sequence[str]]:
    """Rows of the eigenvalues of sway and yaw [1/s] by speed, the header first."""
    rows: list[Sequence[str]] = [("vehicle", *(f"{speed:g} m/s" for speed in SPEEDS_MPS))]
    for name in every():
        scenario = alone(name)
        rows.append((f"`{name}`", *(_shown(sway_yaw(scenario, speed)) for speed in SPEEDS_MPS)))
    return rows


def _shown(values: NDArray[np.complex128]) -> str:
    first, second = values.tolist()
    if first.imag:
        return f"{first.real:.2f} ± {abs(first.imag):.2f}i"
    return f"{first.real:.2f}, {second.real:.2f}"
