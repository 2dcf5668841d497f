"""The paper's equations read as printed, where that fails: how it fails."""

# pyright: reportUnknownMemberType=false
# Matplotlib leaves the types of its keyword arguments open.

import math
from collections.abc import Callable

from matplotlib.figure import Figure

from research.columns import Columns, columns, where
from research.paper.assumptions import READINGS
from research.paper.cases import SINGLE, TRACKING
from research.paper.drawing import against_time
from research.part import Part, Share, Tables
from uuv_marl.benchmark.style import BLACK, BLUE, GREY, ORANGE, legend, panels
from uuv_marl.benchmark.suite import Suite
from uuv_marl.scenario import load_scenario
from uuv_marl.sim.vehicle import STILL, Plant, State6, advance, plant

FORCE = (1500.0, 150.0)
"""Held surge force [N] and yaw torque [N m] of the lone vehicle: a turning circle, from rest."""
DURATION_S = 20.0
STEPS_S = (0.4, 0.2, 0.1, 0.05, 0.025, 0.0125)


def printed_step(state: State6, h: float, p: Plant) -> State6:
    """Eq. 23-24 as printed: velocity by Runge-Kutta; then the pose, whose k4 takes V(t), not V(t + t_r).

    V(t + t_r / 2) is defined nowhere; the mean of V(t) and V(t + t_r) stands for it.
    """
    x, y, psi, u, v, r = state
    _, _, _, u_next, v_next, r_next = advance(state, FORCE, STILL, h, p)
    middle = ((u + u_next) / 2, (v + v_next) / 2, (r + r_next) / 2)

    def rate(angle: float, nu: tuple[float, float, float]) -> tuple[float, float, float]:
        c, s = math.cos(angle), math.sin(angle)
        return c * nu[0] - s * nu[1], s * nu[0] + c * nu[1], nu[2]

    k1 = rate(psi, (u, v, r))
    k2 = rate(psi + k1[2] * h / 2, middle)
    k3 = rate(psi + k2[2] * h / 2, middle)
    k4 = rate(psi + k3[2] * h, (u, v, r))
    dx, dy, dpsi = (h / 6 * (a + 2 * b + 2 * c + d) for a, b, c, d in zip(k1, k2, k3, k4, strict=True))
    return x + dx, y + dy, psi + dpsi, u_next, v_next, r_next


def classical_step(state: State6, h: float, p: Plant) -> State6:
    """What we use: Runge-Kutta on pose and velocity together."""
    return advance(state, FORCE, STILL, h, p)


def convergence() -> Columns:
    """Position error at the end, against an eighth of the finest step, by step and reading."""
    p = plant(load_scenario("tracking"))
    truth = _travel(classical_step, STEPS_S[-1] / 8, p)
    return columns(
        {"reading": name, "step_s": h, "position_error_m": math.dist(_travel(step, h, p)[:2], truth[:2])}
        for name, step in (("as printed", printed_step), ("classical", classical_step))
        for h in STEPS_S
    )


def _travel(step: Callable[[State6, float, Plant], State6], h: float, p: Plant) -> State6:
    state: State6 = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for _ in range(round(DURATION_S / h)):
        state = step(state, h, p)
    return state


AHEAD = READINGS["mounting of the arrays", "both sectors ahead (as printed)"]["tracking"]
INSIDE = READINGS["O_j, and what Eq. 21 sums over", "centre, once per obstacle (as printed)"]["single_obstacle"]
"""The literal readings of Table 1 and of Eq. 21, as the sensitivity runs them."""


def tables(suite: Suite, _report: Share) -> Tables:
    """Spacing with both sectors ahead, distance with one term per obstacle's centre, error of Eq. 24."""
    results: dict[str, Columns] = {"literal-eq-24": convergence()}
    for name, series, pair in (
        ("literal-forward-only", "min_spacing_m", (TRACKING, AHEAD)),
        ("literal-centre-once", "obstacle_distance_m", (SINGLE, INSIDE)),
    ):
        ours, printed = (suite.trace(case, 0) for case in pair)
        pick = slice(0, min(len(ours["time_s"]), len(printed["time_s"])), 5)
        results[name] = {"time_s": ours["time_s"][pick]} | {
            key: trace[series].reshape(len(trace["time_s"]), -1)[pick].min(axis=1)
            for key, trace in (("as_taken_m", ours), ("as_printed_m", printed))
        }
    return results


def draw(computed: Tables) -> Figure:
    """One panel for each reading."""
    figure, axes = panels(3, size=(4.6, 4.4))
    hull_m = load_scenario("tracking").collision.hull_radius_m
    for ax, name, title, what, collision_m in (
        (axes[0], "literal-forward-only", "(a) both sectors ahead: tracking", "smallest spacing [m]", 2 * hull_m),
        (axes[1], "literal-centre-once", "(b) centre, once per obstacle: single obstacle",
         "smallest distance to its surface [m]", hull_m),
    ):  # fmt: skip
        table = computed[name]
        ax.plot(table["time_s"], table["as_taken_m"], color=BLUE, label="as we take it")
        ax.plot(table["time_s"], table["as_printed_m"], "--", color=ORANGE, label="as printed")
        ax.axhline(collision_m, color=BLACK, linestyle=":", linewidth=1.0, label="collision")
        against_time(ax, what, title)
    axes[1].set_ylim(-15.0, 60.0)
    ax = axes[2]
    for name, colour, mark in (("as printed", ORANGE, "s--"), ("classical", BLUE, "o-")):
        own = where(computed["literal-eq-24"], reading=name)
        ax.loglog(own["step_s"], own["position_error_m"], mark, color=colour)
    ax.axvline(0.1, color=GREY, linestyle=":", label="t_r = 0.1 s")
    ax.set_xticks(STEPS_S, [f"{step:g}" for step in STEPS_S])
    ax.set_xticks([], minor=True)
    ax.set(xlabel="integration step [s]", ylabel=f"position error after {DURATION_S:g} s [m]")
    ax.set_title("(c) Eq. 24: a lone vehicle's turn")
    return legend(figure)


CASES = tuple(case._replace(seeds=range(1)) for case in (TRACKING, SINGLE, AHEAD, INSIDE))
PART = Part("literal-readings", CASES, tables, draw)
