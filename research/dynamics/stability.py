"""Stability of steady tracking: the paper's controller (Eq. 18-22), linearised with frozen neighbour sets.

A swarm moves along a straight leg at the reference's speed, all bows along the leg. Positions are relative to l(t),
x ahead and y to starboard; a vehicle's state is (x, y, psi, u, v, r). Formations are sought in ``formation.py``.
"""

# pyright: reportUnknownMemberType=false
# Matplotlib leaves the types of its keyword arguments open.

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple, cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.linalg import expm
from threadpoolctl import threadpool_limits  # pyright: ignore[reportMissingTypeStubs]

from research.columns import Columns, columns, groups, where
from research.dynamics.formation import Formation, drag_n, formations, stiffness, straight_leg
from research.part import Part, Share, Tables
from uuv_marl.baselines.paper.bio_inspired import BioInspiredGains
from uuv_marl.benchmark.style import BLACK, BLUE, COLOURS, GREY, ORANGE, panels
from uuv_marl.benchmark.suite import Suite
from uuv_marl.scenario import Scenario
from uuv_marl.sim.vehicle import STILL, derivative, plant
from uuv_marl.types import Float64

Complex128 = NDArray[np.complex128]

SEEDS = (0, 1, 2, 3)
"""Starts from which formations are sought."""
CONTROL_STEPS_S = (0.0, 0.005, 0.01, 0.02, 0.035, 0.05, 0.1, 0.15, 0.2)
"""Control steps t_r swept; 0 is feedback without delay."""
SHOWN_CONTROL_STEPS_S = (0.0, 0.02, 0.05, 0.1)
"""Control steps whose eigenvalues are in the table."""
SWEEP_CONTROL_STEPS_S = (0.0, 0.1)
"""Control steps at which the yaw damping is swept."""
DAMPING_NMS = (0.0, 60.0, 120.0, 200.0, 300.0, 400.0, 600.0)
"""Yaw dampings swept."""
_CONTROL_STEP_COLOURS = {"continuous": BLUE, "t_r = 0.1 s": ORANGE, "control step on the axis": BLACK}
WEAVING_RAD_PER_S = 1.0
"""Modes that turn faster than this are weaving; slower ones rearrange the formation."""


class Rates(NamedTuple):
    """What the eigenvalues of a loop say."""

    growth: float
    """Largest real part [1/s]; minus this is the margin."""
    weaving: float
    """The same among the modes that turn faster than ``WEAVING_RAD_PER_S``; NaN without any."""


def vehicle_jacobians(scenario: Scenario) -> tuple[Float64, Float64]:
    """One vehicle on a leg: how the state's rate changes with the state (6, 6) and with (tau_u, tau_r) (6, 2)."""
    parameters, step = plant(scenario), 1e-6
    point = np.array([0.0, scenario.trajectory.speed_mps, 0.0, 0.0, drag_n(scenario), 0.0])

    def rate(at: Float64) -> Float64:
        psi, u, v, r, tau_u, tau_r = at.tolist()
        return np.array(derivative((0.0, 0.0, psi, u, v, r), (tau_u, tau_r), STILL, parameters))

    slopes = np.array([(rate(point + d) - rate(point - d)) / (2.0 * step) for d in np.eye(6) * step]).T
    return np.hstack([np.zeros((6, 2)), slopes[:, :4]]), slopes[:, 4:]


def feedback(scenario: Scenario, rigid: Float64) -> Float64:
    """How body forces (tau_u, tau_r) change with the states, shape (2 vehicle, 6 vehicle).

    ``rigid`` is ``stiffness``. The force is the drag, ahead; turning the body by dpsi takes -drag dpsi of it to the
    side, and Eq. 22 makes that a torque: a spring in yaw.
    """
    n, arm = len(rigid) // 2, scenario.actuators.lever_arm_m
    gain = np.zeros((n, 2, n, 6))
    gain[:, :, :, :2] = rigid.reshape(n, 2, n, 2)
    each = np.arange(n)
    gain[:, 1] *= arm
    gain[each, 1, each, 2] = -arm * drag_n(scenario)
    gain[each, 1, each, 5] = -scenario.actuators.yaw_damping_nms
    return gain.reshape(2 * n, 6 * n)


def loop(scenario: Scenario, rigid: Float64, control_step_s: float) -> Float64:
    """The closed loop, shape (6 vehicle, 6 vehicle): the state's rate for a control step of 0, else its next sample.

    Body forces are held for ``control_step_s`` exactly (zero-order hold); the simulation's Runge-Kutta step differs
    from that by its fifth-order error.
    """
    a, b = vehicle_jacobians(scenario)
    n = len(rigid) // 2
    if control_step_s > 0.0:
        both = expm(np.block([[a, b], [np.zeros((2, 8))]]) * control_step_s)
        a, b = both[:6, :6], both[:6, 6:]
    return np.kron(np.eye(n), a) + np.kron(np.eye(n), b) @ feedback(scenario, rigid)


def eigenvalues(scenario: Scenario, rigid: Float64, control_step_s: float) -> Complex128:
    """Eigenvalues as rates [1/s]; of a sampled loop log(eigenvalue) / t_r."""
    values = np.linalg.eigvals(loop(scenario, rigid, control_step_s)).astype(np.complex128)
    return cast(Complex128, np.log(values)) / control_step_s if control_step_s > 0.0 else values


def rates(values: Complex128) -> Rates:
    """What a spectrum [1/s] says, every mode counted."""
    real = values.real
    fast = real[np.abs(values.imag) > WEAVING_RAD_PER_S]
    return Rates(growth=float(real.max()), weaving=float(fast.max()) if fast.size else np.nan)


def tables(_suite: Suite, report: Share) -> Tables:
    """``eigenvalues`` of the nominal swarm (first seed); ``margins``, growth rates over t_r and yaw damping."""
    # Two BLAS threads fight over a busy core, and round differently.
    with threadpool_limits(1, user_api="blas"):
        nominal = formations(straight_leg(), BioInspiredGains(), SEEDS)
        rigid = stiffness(nominal[0].places, nominal[0].neighbour_indices, BioInspiredGains())
        spectrum = [
            {"loop": loop_name(control_step_s), "real_per_s": value.real, "imaginary_rad_per_s": value.imag}
            for control_step_s in SHOWN_CONTROL_STEPS_S
            for value in eigenvalues(straight_leg(), rigid, control_step_s)
        ]
        rows: list[dict[str, Any]] = []
        cases = [("t_r", control_step_s, 0.0, control_step_s) for control_step_s in CONTROL_STEPS_S]
        cases += [("yaw_damping_nms", c, c, step_s) for c in DAMPING_NMS for step_s in SWEEP_CONTROL_STEPS_S]
        for k, case in enumerate(cases):
            rows += _margins(*case, nominal)
            report((k + 1) / len(cases))
        return {"eigenvalues": columns(spectrum), "margins": columns(rows)}


def loop_name(control_step_s: float) -> str:
    """Name of a loop in the table of eigenvalues."""
    return f"t_r = {control_step_s:g} s" if control_step_s > 0.0 else "continuous"


def _margins(
    parameter: str, value: float, damping_nms: float, control_step_s: float, nominal: Sequence[Formation]
) -> Iterator[dict[str, Any]]:
    """Rows of ``margins`` for one value of one parameter, one for each seed."""
    scenario = straight_leg(yaw_damping_nms=damping_nms)
    for seed, formation in zip(SEEDS, nominal, strict=True):
        rigid = stiffness(formation.places, formation.neighbour_indices, BioInspiredGains())
        swarm = rates(eigenvalues(scenario, rigid, control_step_s))
        yield {
            "parameter": parameter, "value": value, "t_r_s": control_step_s, "seed": seed,
            "growth_per_s": swarm.growth, "weaving_growth_per_s": swarm.weaving,
            "settled": int(formation.settled), "residual_n": formation.residual_n,
        }  # fmt: skip


def draw(computed: Tables) -> Figure:
    """Eigenvalues of the nominal swarm, and growth rates over each parameter; from the tables alone."""
    figure, axes = panels(3, 3, (4.3, 4.0))
    for k, ((name,), own) in enumerate(groups(computed["eigenvalues"], "loop").items()):
        axes[0].plot(own["real_per_s"], own["imaginary_rad_per_s"], ".", color=COLOURS[k], label=name)
    axes[0].axvline(0.0, color=BLACK, linewidth=0.8)
    axes[0].set(xlim=(-2.0, 1.5), xlabel="growth rate [1/s]", ylabel="angular rate [rad/s]")
    axes[0].set_ylim(0.0)
    axes[0].set_title("eigenvalues of the nominal swarm, first seed")
    axes[0].legend(title="control step")
    for ax, parameter, label in (
        (axes[1], "t_r", "control step $t_r$ [s]"),
        (axes[2], "yaw_damping_nms", "yaw damping [N m s]"),
    ):
        _draw_sweep(ax, computed["margins"], parameter)
        ax.set_xlabel(label)
    for which, colour in _CONTROL_STEP_COLOURS.items():
        axes[1].plot([], [], color=colour, label=which)
    for fill, words in (("full", "forces balance"), ("none", "no balance found")):
        axes[1].plot([], [], "o", color=GREY, fillstyle=fill, label=f"one seed: {words}")
    figure.legend(*axes[1].get_legend_handles_labels(), loc="outside lower center", ncols=5)
    return figure


def _draw_sweep(ax: Axes, table: Columns, parameter: str) -> None:
    """Growth rates of the swarm over one parameter."""
    swept = where(table, parameter=parameter)
    by_control_step = {(None,): swept} if parameter == "t_r" else groups(swept, "t_r_s")
    for (control_step_s,), own in by_control_step.items():
        values, settled, growth = own["value"], own["settled"] > 0, own["growth_per_s"]
        colour = BLACK if control_step_s is None else _CONTROL_STEP_COLOURS[loop_name(control_step_s)]
        at = np.unique(values)
        ax.plot(at, [growth[values == value].mean() for value in at], color=colour)
        for rows, fill in ((settled, "full"), (~settled, "none")):
            ax.plot(values[rows], growth[rows], "o", color=colour, fillstyle=fill)
    ax.axhline(0.0, color=BLACK, linewidth=0.8)
    ax.set_ylabel("growth rate [1/s]")


PART = Part("stability", (), tables, draw)
