"""What the paper leaves open: what we took, what was in view when it was chosen, and what else it may have been."""

from collections.abc import Mapping
from typing import NamedTuple

from uuv_marl.reproduce.study import NOTHING

ALL = "5.1 both, 5.2.1, 5.2.2 both, Table 2"
"""The six numbers of the paper's own controller."""
SEARCHED = "5.1 both, 5.2.1, Table 2"
"""Those that the identification looked at."""
ARRAYS = ("bow", "port", "starboard")


class Alternative(NamedTuple):
    """Another reading of one assumption."""

    label: str
    overrides: Mapping[str, object] = NOTHING
    parameters: Mapping[str, object] = NOTHING
    scenarios: tuple[str, ...] = ("tracking", "single_obstacle", "multi_obstacle")
    """Where it applies."""


class Assumption(NamedTuple):
    """One thing the paper does not say."""

    name: str
    taken: str
    in_view: str
    """Numbers of the paper that were known and looked at when it was chosen."""
    alternatives: tuple[Alternative, ...]


def everywhere(field: str, value: object) -> dict[str, object]:
    """A field of all three arrays."""
    return {f"sonar.arrays.{name}.{field}": value for name in ARRAYS}


def scaled(share: float, **fields: float) -> dict[str, object]:
    """Fields of the vehicle, times a share."""
    return {f"vehicle.{name}": share * value for name, value in fields.items()}


def array(name: str, kind: str, mounting_deg: float, range_m: float) -> dict[str, object]:
    """A sonar array with Table 1's aperture and seven sub-sectors."""
    return {
        "name": name, "kind": kind, "mounting_deg": mounting_deg, "aperture_deg": 120.0, "range_m": range_m,
        "sub_sectors": 7,
    }  # fmt: skip


BOW = array("bow", "active", 0.0, 100.0)
FORWARD_ONLY = Alternative(
    "both sectors ahead (as printed)", {"sonar.arrays": [BOW, array("ahead", "passive", 0.0, 500.0)]}
)
"""The literal reading of Table 1: one active and one passive sector, both about the heading."""
ONCE_PER_CENTRE = Alternative("centre, once per obstacle (as printed)", parameters={"obstacle_term": "per_obstacle"})
"""The literal reading of Eq. 21: O_j the centre, the sum over obstacles."""
RESISTANCE = {"X_u": 70.0, "X_uu": 100.0}
INERTIA = {"m_kg": 185.0, "I_z_kgm2": 50.0, "X_udot_kg": -30.0, "Y_vdot_kg": -80.0, "N_rdot_kgm2": -30.0}
LATER = ("single_obstacle", "multi_obstacle")
OBSTACLES = LATER

ASSUMPTIONS: tuple[Assumption, ...] = (
    Assumption("sub-sectors per array", "7", ALL, tuple(
        Alternative(f"{k}", everywhere("sub_sectors", k)) for k in (5, 6, 8, 10))),
    Assumption("mounting of the arrays", "bow active, both flanks passive", ALL, (
        FORWARD_ONLY,
        Alternative("active ahead, passive astern", {"sonar.arrays": [BOW, array("stern", "passive", 180.0, 500.0)]}),
    )),
    Assumption("O_j, and what Eq. 21 sums over", "centre, per echo", ALL, (
        ONCE_PER_CENTRE,
        Alternative("surface, per echo", {"sonar.echo_reports": "surface"}, NOTHING, OBSTACLES),
        Alternative("surface, once per obstacle", {"sonar.echo_reports": "surface"},
                    {"obstacle_term": "per_obstacle"}, OBSTACLES),
    )),
    Assumption("range of an echo", "surface within 100 m", ALL, (
        Alternative("centre within 100 m", {"sonar.arrays.bow.range_m": 75.0}),
        Alternative("150 m, against Table 1", {"sonar.arrays.bow.range_m": 150.0}),
        Alternative("190 m, against Table 1", {"sonar.arrays.bow.range_m": 190.0}),
    )),
    Assumption("obstacles hide vehicles", "no", ALL, (
        Alternative("yes", {"sonar.obstacles_hide_vehicles": True}, NOTHING, OBSTACLES),)),
    Assumption("the vehicle's surge resistance", "70 kg/s, 100 kg/m", ALL, tuple(
        Alternative(f"x {share:g}", scaled(share, **RESISTANCE)) for share in (0.8, 1.25))),
    Assumption("the vehicle's yaw resistance", "50 kg m2/s, 100 kg m2", ALL, tuple(
        Alternative(f"x {share:g}", scaled(share, N_r=50.0, N_rr=100.0)) for share in (0.5, 2.0))),
    Assumption("the vehicle's inertia", "185 kg, 50 kg m2 and added", ALL, tuple(
        Alternative(f"x {share:g}", scaled(share, **INERTIA)) for share in (0.5, 2.0))),
    Assumption("force and torque limit", "3000 N, 3000 N m", ALL, tuple(
        Alternative(f"{limit:g}", {"actuators.max_force_n": limit, "actuators.max_torque_nm": limit})
        for limit in (2000.0, 6000.0))),
    Assumption("lever arm of Eq. 22", "1 m", ALL, tuple(
        Alternative(f"{arm:g} m", {"actuators.lever_arm_m": arm}) for arm in (0.5, 2.0))),
    Assumption("start spacing", "13 m", ALL, (Alternative("10 m", {"start.spacing_m": 10.0}),)),
    Assumption("gap between the groups", "20 m", ALL, (
        Alternative("40 m", {"start.gap_m": 40.0, "start.width_m": 80.0}),)),
    Assumption("arrival", "centre within 2 m for 5 s", ALL, (
        Alternative("1 m", {"arrival.radius_m": 1.0}),
        Alternative("10 m", {"arrival.radius_m": 10.0}),
        Alternative("dwell 0 s", {"arrival.dwell_s": 0.0}),
    )),
    Assumption("speed of l(t) in 5.2", "4 m/s, as in 5.1", ALL, (
        Alternative("3.8 m/s", {"trajectory.speed_mps": 3.8}, NOTHING, LATER),)),
    Assumption("vehicles in 5.1 and 5.2.2", "54, as in 5.2.1", ALL, (
        Alternative("40", {"swarm.num_vehicles": 40}, NOTHING, ("tracking", "multi_obstacle")),
        Alternative("80", {"swarm.num_vehicles": 80}, NOTHING, ("tracking", "multi_obstacle")),
        Alternative("130", {"swarm.num_vehicles": 130}, NOTHING, ("tracking", "multi_obstacle")),
    )),
)  # fmt: skip
