"""Scenarios in the scale of a vehicle: lengths and speeds are to it as the paper's are to the paper's vehicle.

``scale = "vehicle"`` in a scenario's file says that its numbers are those for the paper's vehicle. Lengths, speeds and
times are then multiplied, so that the course is to the vehicle as the paper's is to the paper's vehicle. Hull and
actuators, which are the vehicle's own, stay as they are; so does the speed of sound. Ranges of the sonar are
multiplied, too: Table 1's are of no device, and a vehicle should be warned as early, in its own lengths and times, as
the paper's. A device's own range can be set beside (``--set sonar.arrays.bow.range_m=80``).
"""

from collections.abc import Mapping
from typing import Annotated, Any, cast

from pydantic import ValidationError

from uuv_marl.scenario.dimensions import Units, converted
from uuv_marl.scenario.fields import MAX_RANGE_M, Section, within
from uuv_marl.scenario.hardware import Actuators, Vehicle
from uuv_marl.scenario.sections import Start, Timing
from uuv_marl.scenario.turning import turning_radius
from uuv_marl.scenario.vehicle_checks import can_follow

Ratio = Annotated[float, within(1e-6, 1e6)]
PAPER_LENGTH_M, PAPER_SPEED_MPS, PAPER_FORCE_N = 2.0, 4.0, 3000.0
"""The paper's vehicle: twice ``contact.hull_radius_m``, ``trajectory.speed_mps``, and ``literature_185``'s full
thrust."""
PAPER_TURN_M = 2.0
"""Room to turn in: vehicles start 13 m apart with headings drawn at random. Two neighbours that both make a full circle
of this radius keep s_u = 5 m from each other: 13 m - 4 x 2 m."""
_OWN = ("vehicle", "actuators", "sound_speed_mps")
_HALVINGS = 12


class Scale(Section):
    """A vehicle's scale over the paper's: the factors of a scenario's lengths, speeds and times."""

    length: Ratio = 1.0
    """Factor of lengths; times are multiplied by this over ``speed``."""
    speed: Ratio = 1.0
    """Factor of speeds."""
    force: Ratio = 1.0
    """Full thrust over that of the paper's vehicle. Nothing of the scenario is multiplied by it; policies take it as
    their unit of force."""

    @property
    def units(self) -> Units:
        """The units in which the scenario looks like the paper's."""
        time = self.length / self.speed
        return Units(self.length, time, self.force * time * time / self.length)


def scale_of(vehicle: Vehicle, actuators: Actuators) -> Scale:
    """The scale of a vehicle; 1 each for ``literature_185``.

    Speed: cruise over the paper's 4 m/s. Length: the larger of the hull's over the paper's 2 m (that of the paper where
    the vehicle's file gives none), and of the turning radius at cruise and full rudder over 2 m.

    Raises:
        ValueError: the vehicle has no cruise speed.
    """
    cruise = vehicle.cruise_mps
    if not cruise:
        raise ValueError(
            f"scale = 'vehicle' needs vehicle.cruise_mps, the speed of the course, which {vehicle.name!r} has not, got "
            f"{cruise}; set it, or leave scale out"
        )
    hull = (vehicle.length_m or PAPER_LENGTH_M) / PAPER_LENGTH_M
    turn = turning_radius(vehicle, actuators, cruise) / PAPER_TURN_M  # pyright: ignore[reportArgumentType] - frozen models have a hash
    return Scale(
        length=max(hull, turn), speed=cruise / PAPER_SPEED_MPS, force=actuators.max_force_n / PAPER_FORCE_N
    )  # fmt: skip


def can_stop(actuators: Actuators) -> bool:
    """Whether a vehicle can come to rest and stay at a place: it steers without flow, and has thrust astern."""
    return actuators.kind == "force_torque" and actuators.astern_n > 0.0


def in_scale(data: dict[str, Any], was: Scale) -> dict[str, Any]:
    """A scenario's fields and values, not yet checked, in the scale of its vehicle.

    Beside lengths, speeds and times these follow the vehicle: ``contact.hull_radius_m`` is half the hull's length,
    ``arrival.by`` is ``"passage"`` for hulls that can't stop, and ``timing.integration_step_s`` is halved until the
    vehicle is accepted.

    Args:
        data: as files and overrides give them.
        was: the scale that the data are in.

    Raises:
        ValidationError: hull or actuators are not valid.
        ValueError: the vehicle has no scale.
    """
    vehicle, actuators = Vehicle.model_validate(data.get("vehicle")), Actuators.model_validate(data.get("actuators"))
    scale = scale_of(vehicle, actuators)
    length = scale.length / was.length
    made = converted(data, Units(length, length / (scale.speed / was.speed), 1.0), keep=_OWN)
    own = {
        "contact": {"hull_radius_m": vehicle.length_m and vehicle.length_m / 2.0},
        "arrival": {"by": "rest" if can_stop(actuators) else "passage"},
        "timing": {"integration_step_s": _step(made, vehicle, actuators)},
    }
    _bound_ranges(made.get("sonar"))
    for section, fields in own.items():
        if isinstance(made.get(section), dict):
            made[section] |= {name: value for name, value in fields.items() if value is not None}
    return {**made, "scale": scale.model_dump()}


def _bound_ranges(sonar: Any) -> None:
    """Sonars hear no farther than percepts tell."""
    arrays: Any = cast(dict[str, Any], sonar).get("arrays") if isinstance(sonar, dict) else None
    for array in cast(list[Any], arrays) if isinstance(arrays, list | tuple) else ():
        own = cast(dict[str, Any], array) if isinstance(array, dict) else {}
        if isinstance(own.get("range_m"), float):
            own["range_m"] = min(own["range_m"], MAX_RANGE_M)


def _step(data: Mapping[str, Any], vehicle: Vehicle, actuators: Actuators) -> float | None:
    """The longest integration step [s] that the vehicle is accepted with; None where there is none."""
    try:
        timing, start = Timing.model_validate(data.get("timing")), Start.model_validate(data.get("start"))
    except ValidationError:
        return None  # whoever checks the whole scenario says what is wrong
    steps = (timing.integration_step_s / 2**k for k in range(_HALVINGS))
    return next((step for step in steps if can_follow(vehicle, actuators, start.speed_max_mps, step)), None)
