"""What a policy declares that it needs beyond the percept, and what of it a scenario grants: channels, loop, clock."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from uuv_marl.errors import PolicyError
from uuv_marl.scenario import Scenario


def inner_loop_nms(declared_nms: float, full_torque_nm: float, scenario: Scenario) -> float:
    """The inner loop that a policy gets on a scenario's vehicle [N m s]: the declared one, scaled with full torque.

    So on every vehicle the loop takes all torque at the same yaw rate. But it is no stiffer than a loop that stops a
    yaw rate within one control hold. For a vehicle with a rudder the loop is 0.

    Args:
        declared_nms: the policy's ``yaw_damping_nms``.
        full_torque_nm: full torque of the vehicle for which the policy declares the loop [N m].
        scenario: gives the vehicle.
    """
    actuators = scenario.actuators
    if actuators.kind == "rudder":
        return 0.0
    alike = declared_nms * (actuators.max_torque_nm / full_torque_nm)
    return min(alike, scenario.vehicle.inertia[3] / scenario.timing.control_step_s)


def resolved_channels(scenario: Scenario, declared: Sequence[str]) -> list[str]:
    """What a hand-made policy gets that declares these channels: ``modem`` for ``link`` where the scenario has it."""
    link_channel = "modem" if "modem" in scenario.sonar.channels and "modem" not in declared else "link"
    return [link_channel if channel == "link" else channel for channel in declared]


class PolicyRequirements(NamedTuple):
    """What a policy needs, by the names that ``Policy`` has for it."""

    channels: Sequence[str]
    yaw_damping_nms: float
    full_torque_nm: float
    decision_period_s: float | None


def check_requirements(name: str, policy: Any, scenario: Scenario) -> None:
    """Refuse a scenario that does not grant what a policy declares: channels, an inner loop, a clock.

    Args:
        name: the policy's name in the message.
        policy: a policy, its class, or what else has what ``Declared`` has.
        scenario: the scenario on which the policy should run.

    Raises:
        PolicyError: the scenario lacks channels, the inner loop or the clock; the message names them and the remedy.
    """
    has = scenario.sonar.channels
    missing = [name for name in policy.channels if name not in has and not (name == "link" and "modem" in has)]
    needs: list[str] = []
    if missing:
        needs.append(f"the channel{'s' if len(missing) > 1 else ''} {' and '.join(missing)} (sonar.channels)")
    damping = inner_loop_nms(policy.yaw_damping_nms, policy.full_torque_nm, scenario)
    if not scenario.timing.fixed and not math.isclose(scenario.actuators.yaw_damping_nms, damping, rel_tol=1e-9):
        needs.append(f"a yaw damping of {damping:g} N m s (actuators.yaw_damping_nms)")
    period = policy.decision_period_s
    if period and not math.isclose(scenario.timing.decision_period_s, period, rel_tol=1e-9):
        needs.append(f"a decision every {period:g} s (timing.decision_period_s)")
    if needs:
        own = f", or run it as {name},own_clock=true" if scenario.timing.fixed else ""
        raise PolicyError(
            f"{name} needs {' and '.join(needs)}, which scenario {scenario.name!r} does not have; "
            f"use uuv_marl.baselines.with_policy_requirements(policy, scenario), or override these fields{own}"
        )
