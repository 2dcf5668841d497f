"""What a policy requires of a scenario: extra observations, yaw damping and decision period; and the check."""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from uuv_marl.errors import PolicyError
from uuv_marl.scenario import Scenario

FULL_TORQUE_NM = 3000.0
"""Full yaw torque of the paper's vehicle [N m], for which hand-made controllers state their yaw damping."""


class PolicyRequirements(NamedTuple):
    """What a policy requires of a scenario, and what its output means."""

    channels: Sequence[str] = ()
    """Channels beyond the percept, of ``uuv_marl.percept.CHANNELS``. ``modem`` can replace ``link``: then the link's
    fields start where ``Policy.at`` says, and ``percept["link_velocity"]`` does not exist."""
    yaw_damping_nms: float = 0.0
    """Yaw damping of the inner loop [N m s] on a vehicle of ``full_torque_nm``; see ``inner_loop_nms``."""
    full_torque_nm: float = FULL_TORQUE_NM
    """Full torque of the vehicle for which the policy states ``yaw_damping_nms`` [N m]."""
    decision_period_s: float | None = None
    """Decision period [s]; None if the policy works with any."""
    channels_if: Mapping[str, Sequence[str]] = {}
    """Further channels by the name of a parameter that requires them where it is true."""
    message_entries: int = 0
    """Numbers in a message that it sends (``modem.message_entries``); 0 if it sends none."""
    message_vectors: int = 0
    """Vectors among these (``modem.message_vectors``)."""
    outputs_force: bool = False
    """Whether ``decide`` returns desired forces. For a vehicle with a rudder they are then turned into thrust and
    rudder (``baselines.rudder``); for other vehicles they are actions already."""


def inner_loop_nms(required_nms: float, full_torque_nm: float, scenario: Scenario) -> float:
    """Yaw damping [N m s] for a policy on a scenario's vehicle: the required one, scaled with full torque.

    The loop then saturates at the same yaw rate on every vehicle. It is at most as stiff as a loop that stops a yaw
    rate within one control step, and 0 for a vehicle with a rudder.
    """
    actuators = scenario.actuators
    if actuators.kind == "rudder":
        return 0.0
    scaled = required_nms * (actuators.max_torque_nm / full_torque_nm)
    return min(scaled, scenario.vehicle.inertia[3] / scenario.timing.control_step_s)


def with_parameters(required: PolicyRequirements, true: Sequence[str]) -> PolicyRequirements:
    """The requirements of a policy some of whose parameters are true, given by name."""
    further = (channel for name, own in required.channels_if.items() if name in true for channel in own)
    return required._replace(channels=(*required.channels, *further), channels_if={})


def resolved_channels(scenario: Scenario, required: Sequence[str]) -> list[str]:
    """Channels for a hand-made policy: ``modem`` in place of ``link`` where the scenario has ``modem``."""
    link_channel = "modem" if "modem" in scenario.sonar.channels and "modem" not in required else "link"
    return [link_channel if channel == "link" else channel for channel in required]


def check_requirements(name: str, required: PolicyRequirements, scenario: Scenario) -> None:
    """Raise PolicyError, with the remedy, if the scenario lacks a policy's channels, inner loop or decision period."""
    has = scenario.sonar.channels
    missing = [name for name in required.channels if name not in has and not (name == "link" and "modem" in has)]
    needs: list[str] = []
    if missing:
        needs.append(f"the channel{'s' if len(missing) > 1 else ''} {' and '.join(missing)} (sonar.channels)")
    damping = inner_loop_nms(required.yaw_damping_nms, required.full_torque_nm, scenario)
    if not scenario.timing.fixed and not math.isclose(scenario.actuators.yaw_damping_nms, damping, rel_tol=1e-9):
        needs.append(f"a yaw damping of {damping:g} N m s (actuators.yaw_damping_nms)")
    period = required.decision_period_s
    late = period and not math.isclose(scenario.timing.decision_period_s, period, rel_tol=1e-9)
    if late:
        needs.append(f"a decision every {period:g} s (timing.decision_period_s)")
    modem, wanted = scenario.modem, (required.message_entries, required.message_vectors)
    if wanted[0] and wanted != (modem.message_entries, modem.message_vectors):
        needs.append("messages with modem.message_entries = {} and modem.message_vectors = {}".format(*wanted))
    if needs:
        own = " (add own_clock=true to the policy's name)" if late and scenario.timing.fixed else ""
        raise PolicyError(
            f"{name} needs {' and '.join(needs)}, which scenario {scenario.name!r} does not have; "
            f"use an environment's for_policy, with_policy_requirements(name, scenario){own}, or override these fields"
        )
