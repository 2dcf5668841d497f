"""Vehicles of a scenario: hull, actuators and sonar arrays, as sections.

In SI units and degrees. Symbols of the vehicle are Fossen's; resistances (X_u, Y_v, ...) are positive, as in the
paper's Eq. 4.
"""

import math
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from uuv_marl.scenario import fields
from uuv_marl.scenario.fields import Lag, NonNegative, NonPositive, Positive, Radius, Section, Signed, Speed, within
from uuv_marl.types import Float64

MIN_SECTOR_DEG, MAX_SECTOR_DEG = 0.01, 120.0  # widths of sub-sectors that the sonar's table of directions supports


class Vehicle(Section):
    """Parameters of Eq. 3-4. Dimensions follow from the force or moment and the velocities they multiply."""

    name: fields.VehicleName
    """The file in ``vehicles/`` with the numbers, and its variants, unless overridden."""
    m_kg: Positive
    I_z_kgm2: Positive
    x_G_m: Annotated[float, within(-100, 100)]
    X_udot_kg: NonPositive
    Y_vdot_kg: NonPositive
    Y_rdot_kgm: Signed
    N_rdot_kgm2: NonPositive
    X_u: NonNegative
    Y_v: NonNegative
    Y_r: Signed
    N_v: Signed
    N_r: NonNegative
    X_uu: NonNegative
    Y_vv: NonNegative
    Y_rr: Signed
    N_rv: Signed
    N_rr: NonNegative
    N_vv: Signed = 0.0
    """Yaw moment ``N_vv |v| v``, a derivative like N_v: a positive one adds."""
    Y_uv: Signed = 0.0
    """Lift of body and fins: the sway force (Y_uv v + Y_ur r) max(u, 0) and the yaw moment (N_uv v + N_ur r) max(u, 0).
    Derivatives, of lift alone: with ``munk_moment``, the added masses' part of a source's sums is in C(nu)."""
    Y_ur: Signed = 0.0
    N_uv: Signed = 0.0
    N_ur: Signed = 0.0
    munk_moment: bool = True
    """Whether C(nu) (Eq. 4) includes added masses, which turn a hull across its path. Inertia always does."""
    length_m: Positive | None = None
    """Length of the hull."""
    cruise_mps: Speed | None = None
    """Cruise speed; a rudder's steerage way is a share of it."""
    max_mps: Speed | None = None
    """Top speed according to the source."""
    source: str | None = None
    """Source of the numbers, in a line."""

    @property
    def inertia(self) -> tuple[float, float, float, float]:
        """Entries m_11 [kg], m_22 [kg], m_23 [kg m] and m_33 [kg m2] of Eq. 2's matrix M, added mass included."""
        return (
            self.m_kg - self.X_udot_kg,
            self.m_kg - self.Y_vdot_kg,
            self.m_kg * self.x_G_m - self.Y_rdot_kgm,
            self.I_z_kgm2 - self.N_rdot_kgm2,
        )

    def times(self, mass: float, added_mass: float, drag: float) -> "Vehicle":
        """The vehicle with scaled masses (and moment of inertia), added masses, and resistances and lift."""
        factors = dict.fromkeys(("m_kg", "I_z_kgm2"), mass)
        factors |= dict.fromkeys(("X_udot_kg", "Y_vdot_kg", "Y_rdot_kgm", "N_rdot_kgm2"), added_mass)
        factors |= dict.fromkeys(("X_u", "Y_v", "Y_r", "N_v", "N_r", "X_uu", "Y_vv", "Y_rr", "N_rv", "N_rr"), drag)
        factors |= dict.fromkeys(("N_vv", "Y_uv", "Y_ur", "N_uv", "N_ur"), drag)
        return self.model_copy(update={name: factor * getattr(self, name) for name, factor in factors.items()})


class Actuators(Section):
    """Limits of thrust and torque, or of thrust and rudder, the same for every policy."""

    max_force_n: Positive
    """Surge force at full action, ahead; astern too, unless ``max_astern_n`` is given."""
    max_torque_nm: Positive
    """Yaw torque at full action. With a rudder it is not a limit: hand-made policies divide the desired torque by it,
    so it should be what full rudder gives at cruise speed."""
    lever_arm_m: Annotated[float, within(0.001, 1_000)]
    """Converts the sideways component of a desired force into a torque (Eq. 22)."""
    yaw_damping_nms: NonNegative
    """Inner loop: torque -c r, added within the torque limit."""
    thrust_lag_s: Lag
    """Time constant of the thrust; 0: immediate."""
    yaw_lag_s: Lag
    """Time constant of the torque."""
    yaw_authority: Annotated[float, within(0, 1)]
    """Effective share of the torque, or of the rudder's angle."""
    kind: Literal["force_torque", "rudder"] = "force_torque"
    """Meaning of an action's second number: a share of ``max_torque_nm``, or of ``rudder_max_deg``. With a rudder both
    numbers lie in a square, not on the unit disc, and stay constant between control steps."""
    max_astern_n: NonNegative | None = None
    """Surge force at full action astern, if not ``max_force_n``."""
    Y_uud: Signed = 0.0
    """A rudder's sway force, Y_uud max(u, 0)^2 times its angle [rad], and yaw moment, N_uud max(u, 0)^2 times it. Signs
    as in the source: an angle that is positive there turns to port where N_uud is negative (Fossen). A positive action
    always turns to starboard."""
    N_uud: Signed = 0.0
    rudder_max_deg: Annotated[float, within(0, 60)] = 0.0
    """The rudder's largest angle, to either side."""

    @property
    def astern_n(self) -> float:
        """Surge force at full action astern."""
        return self.max_force_n if self.max_astern_n is None else self.max_astern_n

    @property
    def rudder(self) -> tuple[float, float]:
        """Sway force and yaw moment of a rudder over u^2 [kg/m, kg], for an angle that turns the vehicle clockwise."""
        side = -1.0 if self.N_uud < 0.0 else 1.0
        return side * self.Y_uud, side * self.N_uud

    def _check(self) -> None:
        rudder = self.kind == "rudder"
        for name in ("Y_uud", "N_uud", "rudder_max_deg"):
            value = getattr(self, name)
            if value and not rudder:
                raise ValueError(
                    f"actuators.{name} = {value:g} is a rudder's, and actuators.kind is 'force_torque'; set it to 0, "
                    "or actuators.kind = 'rudder'"
                )
            if rudder and not value and name != "Y_uud":
                raise ValueError(
                    f"actuators.{name} must not be 0 where actuators.kind is 'rudder': it would never turn; set it, or "
                    "actuators.kind = 'force_torque'"
                )
        if rudder and self.yaw_damping_nms > 0.0:
            raise ValueError(
                f"actuators.yaw_damping_nms must be 0 where actuators.kind is 'rudder', got {self.yaw_damping_nms:g}: "
                "a rudder has no torque of its own to damp with; set it to 0"
            )


class SonarArray(Section):
    """One fan, split into equal sub-sectors, each of which detects its nearest vehicle."""

    name: Annotated[str, Field(min_length=1)]
    """Unique within the suite."""
    kind: Literal["active", "passive"]
    """Active arrays detect vehicles and obstacles, passive ones only vehicles."""
    mounting_deg: Annotated[float, within(-360, 360)]
    """Direction of the fan's axis, clockwise from the bow."""
    aperture_deg: Annotated[float, within(0.01, 360)]
    """Width of the fan."""
    range_m: Radius
    """Largest distance of detected vehicles, and of detected obstacles' surfaces."""
    sub_sectors: Annotated[int, within(1, 64)]
    """k_a (Eq. 12)."""

    @property
    def bounds_rad(self) -> Float64:
        """Edges of the sub-sectors, clockwise from the bow, shape (sub-sector + 1,)."""
        return np.radians(self.mounting_deg + self.aperture_deg * np.linspace(-0.5, 0.5, self.sub_sectors + 1))

    def _check(self) -> None:
        width = self.aperture_deg / self.sub_sectors
        if not MIN_SECTOR_DEG <= width <= MAX_SECTOR_DEG:
            raise ValueError(
                f"sonar.arrays.{self.name}.sub_sectors must leave sub-sectors of {MIN_SECTOR_DEG:g} to "
                f"{MAX_SECTOR_DEG:g} deg, got {width:g} deg; use at least "
                f"{math.ceil(self.aperture_deg / MAX_SECTOR_DEG)} and at most {self.aperture_deg / MIN_SECTOR_DEG:.0f}"
            )


class Sonar(Section):
    """Sonar of a vehicle."""

    echo_reports: Literal["centre", "surface"]
    """Position of an echo: the obstacle's centre, or the nearest point of its surface in the beam."""
    obstacles_hide_vehicles: bool
    """Whether an obstacle on the line of sight hides a vehicle."""
    channels: tuple[str, ...]
    """Observations beyond the percept: ``compass`` (heading), ``identity`` (a number of the vehicle's own), ``link``
    (neighbours' true identity and velocity), ``modem`` (the same from their latest messages), ``current`` (own velocity
    over ground and through the water), ``age`` (of each sub-sector's reading), ``ranged`` (whether its range was
    measured), ``episode`` (whether it has had its reward for arriving, and the time left), and those of the task."""
    arrays: Annotated[tuple[SonarArray, ...], Field(min_length=1)]
    """The arrays, in the order of sub-sectors in the percept."""

    @property
    def num_sectors(self) -> int:
        """Sub-sectors of all arrays."""
        return sum(array.sub_sectors for array in self.arrays)

    @property
    def num_active_sectors(self) -> int:
        """Sub-sectors of the active arrays."""
        return sum(array.sub_sectors for array in self.arrays if array.kind == "active")

    def _check(self) -> None:
        names = [array.name for array in self.arrays]
        if len(set(names)) < len(names):
            raise ValueError(f"sonar.arrays must have different names, got {names}")
        if len(set(self.channels)) < len(self.channels):
            raise ValueError(f"sonar.channels must name each channel once, got {list(self.channels)}")
