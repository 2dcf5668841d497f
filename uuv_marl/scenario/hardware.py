"""What a scenario's vehicles are: hull, actuators and sonar arrays, as sections.

In SI units and degrees. Symbols of the vehicle are Fossen's; resistances (X_u, Y_v, ...) are positive, as in the
paper's Eq. 4.
"""

import math
from typing import Annotated, Literal

from pydantic import Field

from uuv_marl.scenario.fields import Lag, Name, NonNegative, NonPositive, Positive, Radius, Section, Signed, within

MIN_SECTOR_DEG, MAX_SECTOR_DEG = 0.01, 120.0
"""Widths of sub-sectors that the sonar's table of directions is made for."""
Channel = Literal["compass", "link", "current", "age", "ranged", "modem"]


class Vehicle(Section):
    """Parameters of Eq. 3-4. Dimensions follow from the force or moment and the velocities they multiply."""

    name: Name
    """The file in ``vehicles/`` that the numbers come from, where nothing overrides them."""
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
        """A vehicle whose mass (and moment of inertia), added masses and resistances are times these factors."""
        factors = dict.fromkeys(("m_kg", "I_z_kgm2"), mass)
        factors |= dict.fromkeys(("X_udot_kg", "Y_vdot_kg", "Y_rdot_kgm", "N_rdot_kgm2"), added_mass)
        factors |= dict.fromkeys(("X_u", "Y_v", "Y_r", "N_v", "N_r", "X_uu", "Y_vv", "Y_rr", "N_rv", "N_rr"), drag)
        return self.model_copy(update={name: factor * getattr(self, name) for name, factor in factors.items()})


class Actuators(Section):
    """Limits of thrust and torque, the same for every policy."""

    max_force_n: Positive
    """Surge force at full action, ahead or astern."""
    max_torque_nm: Positive
    """Yaw torque at full action."""
    lever_arm_m: Annotated[float, within(0.001, 1_000)]
    """Turns the sideways component of a desired force into a torque (Eq. 22)."""
    yaw_damping_nms: NonNegative
    """Inner loop: torque -c r, added within the torque limit."""
    thrust_lag_s: Lag
    """Time constant with which thrust follows what is asked; 0: at once."""
    yaw_lag_s: Lag
    """The same of the torque."""
    yaw_authority: Annotated[float, within(0, 1)]
    """Share of the torque that reaches the water."""


class SonarArray(Section):
    """One fan, split into equal sub-sectors; the nearest vehicle of each is heard."""

    name: Annotated[str, Field(min_length=1)]
    """Unique within the suite."""
    kind: Literal["active", "passive"]
    """Only active arrays hear obstacles."""
    mounting_deg: Annotated[float, within(-360, 360)]
    """Direction of the fan's axis, clockwise from the bow."""
    aperture_deg: Annotated[float, within(0.01, 360)]
    """Width of the fan."""
    range_m: Radius
    """Vehicles nearer than this, and obstacles whose surface is, are heard."""
    sub_sectors: Annotated[int, within(1, 64)]
    """k_a (Eq. 12)."""

    def _check(self) -> None:
        width = self.aperture_deg / self.sub_sectors
        if width > MAX_SECTOR_DEG:
            raise ValueError(
                f"sonar.arrays.{self.name}.sub_sectors must leave sub-sectors of at most {MAX_SECTOR_DEG:g} deg, "
                f"got {width:g} deg; use at least {math.ceil(self.aperture_deg / MAX_SECTOR_DEG)}"
            )
        if width < MIN_SECTOR_DEG:
            raise ValueError(
                f"sonar.arrays.{self.name}.sub_sectors must leave sub-sectors of at least {MIN_SECTOR_DEG:g} deg, "
                f"got {width:g} deg; lower it or raise aperture_deg"
            )


class Sonar(Section):
    """What a vehicle hears."""

    echo_reports: Literal["centre", "surface"]
    """What an echo's position is: the obstacle's centre, or the nearest point of its surface in the beam."""
    obstacles_hide_vehicles: bool
    """Whether an obstacle on the line of sight silences a vehicle."""
    channels: tuple[Channel, ...]
    """Granted beyond the percept: ``compass`` (heading), ``link`` (an oracle of neighbours' identity and velocity),
    ``modem`` (the same as their latest messages tell it), ``current`` (own velocity over ground and through the water),
    ``age`` (of each sub-sector's reading), ``ranged`` (whether its range was measured)."""
    arrays: Annotated[tuple[SonarArray, ...], Field(min_length=1)]
    """The suite; their order is the order of sub-sectors in the percept."""

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
