"""Scenarios: sources, overrides, and errors that name the field, the value and the remedy."""

import re
from collections import UserDict, UserList
from importlib import resources

import numpy as np
import pytest

from tests.conftest import SCENARIOS as LARGE
from tests.processes import python
from uuv_marl import load_scenario
from uuv_marl.scenario import ScenarioError, load_vehicle, parse_override, show, to_toml, vehicle_names
from uuv_marl.scenario.hardware import Vehicle
from uuv_marl.sim.swarm import Swarm

FOLDER = resources.files("uuv_marl.scenario")
BASE = "single_obstacle"
SCENARIOS = (*LARGE, "starter")
NO_NUMBERS = ("version", "title", "source", "name")
FAULTS = [{"kind": "array", "share": 0.1, "array": "bow"}, {"kind": "yaw", "share": 0.2, "onset_s": 3.0}]
SEA = {"current.speed_mps": 0.5, "current.direction_deg": 30.0, "modem.period_s": 9.0, "faults": FAULTS}
SOURCES = (
    r"section|Table|Eq\.|assumed|none in the paper|as in the paper|MBARI|Nanomodem|ahoi|"
    r"Repoulias|da Silva|Havenstrøm|lauv_gazebo|Prestero|Fossen|Allen|Sgarioto|von Benzon|Wu"
)


@pytest.mark.parametrize("name", ["base", *(f"vehicles/{name}" for name in vehicle_names()), *SCENARIOS])
def test_every_number_carries_its_source(name):
    for line in (FOLDER / f"{name}.toml").read_text().splitlines():
        value = line.split("#")[0]
        if re.search(r"=.*(\d|true|false|\[\])", value) and not value.startswith(NO_NUMBERS):
            assert re.search(SOURCES, line.partition("#")[2]), line


@pytest.mark.parametrize(("name", "overrides"), [*((name, {}) for name in SCENARIOS), (BASE, SEA)])
def test_a_scenario_goes_out_as_toml_and_in_again(name, overrides, tmp_path):
    scenario = load_scenario(name, num_vehicles=8, overrides=overrides)
    path = tmp_path / f"{name}.toml"
    path.write_text(to_toml(scenario))
    assert load_scenario(path) == load_scenario(str(path)) == scenario
    for each in (name, path):
        expected = load_scenario(each)
        path.write_text(show(each))
        assert load_scenario(path) == expected


FORMS = {
    "tables": "[vehicle]\nm_kg = 300.0\n[trajectory]\nspeed_mps = 2.5  # my ship's log\n",
    "inline": "vehicle = {m_kg = 300.0}\ntrajectory = {speed_mps = 2.5}  # my ship's log\n",
    "dotted": "vehicle.m_kg = 300.0\ntrajectory.speed_mps = 2.5  # my ship's log\n",
    "no obstacles": "obstacles = []\n[vehicle]\nm_kg = 300.0\n",
    "other arrays": "obstacles = [{centre_m = [350.0, 350.0], radius_m = 20.0}]\nvehicle.m_kg = 300.0\n"
    "[[sonar.arrays]]\n"
    'name = "all"\nkind = "active"\nmounting_deg = 0.0\naperture_deg = 360.0\nrange_m = 80.0\nsub_sectors = 9\n',
}


@pytest.mark.parametrize("form", FORMS)
def test_what_is_shown_loads_and_names_the_file_of_each_number(form, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(f'extends = "single_obstacle"\n{FORMS[form]}')
    shown, before = show(path), load_scenario(path)
    assert "m_kg = 300.0  # mine.toml" in shown
    assert "I_z_kgm2 = 50.0  # Repoulias" in shown
    path.write_text(shown)
    assert load_scenario(path) == before


def test_overrides_reach_every_level():
    sonar = {"sonar.arrays.bow.range_m": 80.0, "sonar.arrays.1.sub_sectors": 3, "sonar.channels": ["link"]}
    scenario = load_scenario(BASE, num_vehicles=10, overrides=sonar | {"obstacles.0.radius_m": 30.0})
    assert scenario.swarm.num_vehicles == 10
    assert [a.range_m for a in scenario.sonar.arrays] == [80.0, 500.0, 500.0]
    assert scenario.sonar.arrays[1].sub_sectors == 3
    assert scenario.obstacles[0].radius_m == 30.0
    assert load_scenario(BASE).sonar.arrays[0].range_m == 100.0
    mine = {"faults": [{"kind": "yaw", "share": 0.5}], "faults.0.share": 0.25}
    assert load_scenario(BASE, overrides=mine).faults[0].share == 0.25
    assert mine["faults"] == [{"kind": "yaw", "share": 0.5}], "a caller's overrides stay as they are"


@pytest.mark.parametrize(("text", "expected"), [
        ("swarm.num_vehicles=20", ("swarm.num_vehicles", 20)),
        ("sonar.echo_reports=surface", ("sonar.echo_reports", "surface")),
        ('sonar.channels=["link"]', ("sonar.channels", ["link"])),
        ("collision.ends_vehicle = true", ("collision.ends_vehicle", True)),
])  # fmt: skip
def test_overrides_from_the_command_line(text, expected):
    assert parse_override(text) == expected


CYCLE = {}
CYCLE["again"] = CYCLE
SUMS = {"vehicle.Y_uv": -28.6, "vehicle.Y_ur": 5.22, "vehicle.N_uv": -24.0, "vehicle.N_ur": -2.0}
"""Prestero's: the added masses' Coriolis terms are in them already."""
RUDDER = {"actuators.kind": "rudder", "actuators.N_uud": -40.0, "actuators.rudder_max_deg": 20.0}
BAD = [
    ({"vehicle.m_kg": float("nan")}, "vehicle.m_kg must be less than or equal to 1000000, got nan"),
    ({"vehicle.m_kg": 10**5000}, "vehicle.m_kg must be a valid number, got int too large to show"),
    ({"swarm.num_vehicles": 2.5}, "swarm.num_vehicles must be a valid integer, got 2.5"),
    ({"vehicle.m_kgg": 3.0}, "vehicle.m_kgg is unknown; did you mean 'vehicle.m_kg'"),
    ({"speed": 3.0}, "speed is unknown; did you mean 'trajectory.speed_mps'"),
    ({"": 1}, "'' is unknown"),
    ({"vehicle": CYCLE}, "nested too deeply"),
    ({"sonar.arrays.stern.range_m": 3.0}, "no entry 'stern'; use one of bow, port, starboard"),
    ({"sonar.arrays.².range_m": 5.0}, "there is no entry '²'"),
    ({"sonar.arrays.0.name": ""}, "sonar.arrays.0.name must have at least 1 character"),
    ({"sonar.echo_reports": "nothing"}, "sonar.echo_reports must be 'centre' or 'surface', got 'nothing'"),
    ({"latency.travel_time": 1}, "latency.travel_time must be a valid boolean, got 1"),
    ({"start.spacing_m": 30.0, "start.gap_m": 30.0}, "start.spacing_m = 30 leaves room for .* 27 are needed; lower it"),
    ({"start.spacing_m": 1.5}, "start.spacing_m must be at least two hull radii"),
    ({"start.speed_min_mps": 5.0}, "start.speed_min_mps must not exceed"),
    ({"obstacles.0.centre_m": [130.0, 130.0]}, "obstacles.0 at .* lies on the start"),
    ({"obstacles": [{"centre_m": [1e5, 1e5], "radius_m": 1.0}] * 2000}, "obstacles must have at most 1024 entries"),
    ({"vehicle.X_u": 0.0, "vehicle.X_uu": 0.0}, "vehicle.X_u and vehicle.X_uu must not both be 0"),
    ({"vehicle.N_r": 500.0, "vehicle.N_rr": 1000.0}, "timing.integration_step_s = 0.1 is too long .* use at most"),
    ({"actuators.max_force_n": 86797.0, "vehicle.Y_vv": 44.6}, "max_force_n = 86797 .* use at most"),
    (RUDDER | {"actuators.Y_uud": 3e4}, "max_force_n = 3000 and rudder_max_deg = 20; "),  # the trial's own finding
    ({"actuators.yaw_damping_nms": 2000.0}, "actuators.yaw_damping_nms = 2000 is unstable .* use less than 1600"),
    ({"vehicle.x_G_m": 1.0}, "not positive definite"),
    ({"vehicle.Y_r": 500.0}, "lets linear damping add energy"),
    ({"vehicle.N_vv": -900.0}, "vehicle.N_vv = -900 let quadratic damping add energy; lower their sizes, or raise"),
    ({"vehicle.Y_uv": 5.0}, "vehicle.Y_uv = 5, .* are a lift that adds energy to sway and yaw; keep"),
    (SUMS, "N_uv = -24 and N_ur = -2 are a lift that adds energy .* give the lift's part alone"),
    ({"actuators.N_uud": 3.0}, "actuators.N_uud = 3 is a rudder's, and actuators.kind is 'force_torque'; set it to 0"),
    ({"actuators.kind": "rudder"}, "actuators.N_uud must not be 0 where actuators.kind is 'rudder'"),
    ({"actuators.kind": "rudder", "actuators.N_uud": 3.0}, "actuators.rudder_max_deg must not be 0 where"),
    (RUDDER | {"actuators.yaw_damping_nms": 6.0}, "yaw_damping_nms must be 0 where .*'rudder', got 6: a rudder has no"),
    (RUDDER | {"trajectory.speed_mps": 6.0}, r"speed_mps = 6 is more than the 5.14 m/s .*max_force_n = 3000"),
    ({"timing.decision_period_s": 0.15}, "timing.decision_period_s must be a whole multiple"),
    ({"timing.decision_period_s": 1000.0}, "decision_period_s must be at most the shortest time limit = 298.649"),
    ({"timing.decision_period_s": 10.0, "timing.integration_step_s": 0.0001}, "takes 100,000 steps .*at most 10,000"),
    ({"swarm.num_vehicles": 2, "losses.times_s": [1.0, 2.0]}, "at least one must remain"),
    ({"trajectory.waypoints_m": [[1.0, 1.0], [1.0, 1.0]]}, "must differ from one to the next"),
    ({"sonar.arrays.bow.sub_sectors": 1, "sonar.arrays.bow.aperture_deg": 200.0}, "use at least 2"),
    ({"sonar.channels": ["link", "link"]}, "sonar.channels must name each channel once"),
    ({"vehicle": "literature_18"}, r"vehicle 'literature_18' is unknown; did you mean 'literature_185'\?"),
    ({"swarm.num_vehicles": np.float64(7.0)}, "swarm.num_vehicles must be a valid integer, got 7.0"),
    ({"swarm.num_vehicles": np.bool_(True)}, "swarm.num_vehicles must be a valid integer, got True"),
    ({"trajectory.speed_mps": np.complex64(1)}, "trajectory.speed_mps must be a valid number"),
    ({"sonar.channels": {"compass"}}, "sonar.channels must be a list, got {'compass'}"),
    ({"sonar.channels": "compass"}, "sonar.channels must be a list, got 'compass'"),
    ({"sonar.channels": b"compass"}, "sonar.channels must be a list"),
    ({"current": 0.5}, "current must be a table of fields, got 0.5"),
]
SHORT = {"timing.control_step_s": 0.001, "timing.integration_step_s": 0.001}
COURSE = {"trajectory.waypoints_m": [[0.0, 0.0], [1e6, 1e6]]}
ARRAY, MEMBER = ({"kind": kind, "share": 0.1} for kind in ("array", "member"))
BAD_SEA = [
    ({"current.eddies": 64, "current.eddy_speed_mps": 1.0} | COURSE, "makes 256,256,064 eddies .*; at most 4,096"),
    ({"latency.processing_s": 1.0, **SHORT}, "processing_s = 1 is 1,000 control steps; at most 64 readings are kept"),
    ({"latency.travel_time": True, "latency.sound_speed_mps": 100.0, **SHORT}, r"sound 5,000 control.*500 m.*1,024"),
    ({"latency.active_period_s": 0.1}, "latency.active_period_s must be at least 0.1333, .* range of 100 m, or 0 "),
    (
        {"mismatch.mass": 0.5, "mismatch.added_mass": 0.5, "mismatch.drag": 0.5},
        r"mismatch.mass = 0.5, added_mass = 0.5, drag = 0.5 and thrust = 0 may draw .*; lower them, or for this one: "
        r"timing.integration_step_s = 0.1 is too long .*; use at most 0.05, or lower",
    ),
    ({"faults": "yaw"}, "faults must be a list, got 'yaw'"),
    ({"faults": [{"kind": "yaw"}]}, "faults.0.share is missing; give it"),
    ({"faults": [MEMBER | {"efficency": 0.5}]}, "faults.0.efficency is unknown; did you mean 'faults.0.efficiency'"),
    ({"faults": [MEMBER | {"efficiency": 0.5}]}, "faults.efficiency is of no use to kind member, got 0.5; leave"),
    ({"faults": [MEMBER | {"duration_s": 5.0}]}, "faults.duration_s is of no use to kind member, got 5.*leave it out"),
    ({"faults": [MEMBER | {"array": "bow"}]}, "faults.array must be given for kind array and for no other kind"),
    ({"faults": [ARRAY | {"array": "stern"}]}, "faults.0.array must be one of bow, port, starboard, got 'stern'"),
    ({"faults": [MEMBER | {"share": 1.0}]}, "and faults .* may lose 54 of 54 vehicles; .*must remain: shorten"),
    ({"faults": [MEMBER] * 65}, "faults must have at most 64 entries"),
    ({"faults.0.share": 0.2}, "faults.0.share is unknown: .* the list is empty: give it as a whole"),
]


FAST = {"traffic.speed_mps": 2.0, "timing.decision_period_s": 0.1}
BAD_TASKS = [
    ("hard_water", {"task.kinds": ["gates"]}, "task.kinds must name some of pocket, bar, .*got .'gates'."),
    ("hard_water", {"task.gate.gap_m": [20.0, 10.0]}, r"gate.gap_m must be \[low, high\] with low .* got \[20.0, 10.0"),
    ("hard_water", {"task.bar.hole_m": 3.0}, "task.bar.hole_m is unknown"),
    ("hard_water", {"task.length_m": [150.0, 400.0]}, r"at least 167, task.first_wall_m and task.goal_clear_m"),
    ("hard_water", {"task.piles.apart_m": [0.0, 0.0]}, "task.piles.apart_m.0 must be greater than or equal to 0.001"),
    ("two_swarms", {"task.gap_aside_m": 100.0}, "must leave a wall on both sides within task.half_width_m .*, got 128"),
    ("two_swarms", {"task.gap_m": [1.0, 2.0]}, r"gap_m must be above 2, twice collision.hull_radius_m, got \[1.0, 2.0"),
    ("two_swarms", {"task.apart_m": 30.0}, "apart_m must be at least .*, so that groups .* long start before the wall"),
    ("two_swarms", {"start.width_m": 210.0}, "the groups must start within the banks of task 'two_swarms'"),
    ("silent_targets", {"task.speed_share": [0.5, 1.5]}, r"speed_share must be at most 1, .* got \[0.5, 1.5\]; lower"),
    ("silent_targets", {"task.turn_s": [20.0, 10.0]}, r"turn_s must be \[low, high\] with low <= high, got \[20.0, 10"),
    ("silent_targets", {"task.clear_m": 700.0}, "must be at most half of task.side_m = 1200, got 700; lower it"),
    ("silent_targets", {"task.targets": 0}, "task.targets must be greater than or equal to 1, got 0"),
    ("silent_targets", {"start.width_m": 200.0}, "hold the start, two times 40 x 200 m, got 110; raise it"),
    ("hard_water", FAST, "traffic.speed_mps must be 0 for task 'hard_water', .* got 2; leave it out"),
    ("two_swarms", FAST, "traffic.speed_mps must be 0 for task 'two_swarms', .* got 2; leave"),
    ("starter", FAST | {"traffic.amplitude_m": 0.1}, "must be at least 0.2, .*; raise it or lower the speed"),
    ("random_field", FAST | {"traffic.amplitude_m": 55.1}, r"at most .* = 55, so .*, got 55.1; lower it"),
    ("starter", FAST | {"traffic.amplitude_m": 90.0}, "lies on the trajectory's end; keep 95 m"),
    ("starter", {"traffic.share": 1.5}, "traffic.share must be less than or equal to 1, got 1.5"),
]


@pytest.mark.parametrize(
    ("scenario", "overrides", "message"), [*((BASE, *bad) for bad in (*BAD, *BAD_SEA)), *BAD_TASKS]
)
def test_bad_values_name_field_value_and_remedy(scenario, overrides, message):
    with pytest.raises(ScenarioError, match=message):
        Swarm(load_scenario(scenario, overrides=overrides))


@pytest.mark.parametrize(("arguments", "message"), [
        ({"scenario": 5}, "scenario must be a name, a path ending in .toml, or a Scenario, got 5"),
        ({"scenario": "single_obstcle"}, "did you mean 'single_obstacle'"),
        ({"scenario": "mycourse"}, "scenario 'mycourse' is unknown; give one of few_informed, .* or a path"),
        ({"scenario": "x" * 5000 + ".toml"}, "scenario file 'xxx.*... does not exist"),
        ({"num_vehicles": True}, "swarm.num_vehicles must be a valid integer, got True"),
        ({"overrides": "x"}, "overrides must be a dictionary of fields and values, got 'x'"),
        ({"overrides": {"swarm.num_vehicles": iter([1])}}, "swarm.num_vehicles must be"),
        ({"scenario": "random_field", "overrides": {"random_field.legs": [3, 1]}}, "random_field.legs"),
        ({"scenario": "random_field", "overrides": {"random_field.obstacles": [0, 100]}}, "random_field.obstacles"),
])  # fmt: skip
def test_bad_arguments_are_named(arguments, message):
    with pytest.raises(ScenarioError, match=message):
        load_scenario(**{"scenario": BASE, **arguments})


@pytest.mark.parametrize("text", ["vehicle", "x=" + "[" * 3000, "x=" + "9" * 5000, "swarm.num_vehicles=1\nfoo=2", "=3"])
def test_what_the_command_line_cannot_mean_is_refused(text):
    with pytest.raises(ScenarioError, match="--set"):
        parse_override(text)


def test_a_file_extends_one_beside_it(tmp_path):
    (tmp_path / "a.toml").write_text('extends = "single_obstacle"\n[swarm]\nnum_vehicles = 12\n')
    (tmp_path / "b.toml").write_text('extends = "a.toml"\n[arrival]\nradius_m = 3.0\n')
    scenario = load_scenario(tmp_path / "b.toml")
    assert (scenario.name, scenario.swarm.num_vehicles, scenario.arrival.radius_m) == ("b", 12, 3.0)
    with pytest.raises(ScenarioError, match="'my b.toml' must have a name of letters.*rename the file"):
        load_scenario((tmp_path / "b.toml").rename(tmp_path / "my b.toml"))


@pytest.mark.parametrize(("text", "message"), [
        ('extends = "../here/mine.toml"\n', "must not lead back"),
        ("extends = 3\n", "extends must be a scenario's name or file, got 3"),
        ("\udcff", "not valid TOML"),
        ("[swarm\n", "mine.toml is not valid TOML: .*line 1"),
        ('title = "x"\nsource = "x"\nversion = 1\n', "trajectory.waypoints_m is needed"),
        ("x = " + "[" * 3000, "nested too deeply"),
        ("x = " + "9" * 5000, "not valid TOML"),
        ("x = 1 #" + " " * 1_000_000, "not a scenario: it has more than 1,000,000 bytes"),
], ids=range(8))  # fmt: skip
def test_a_file_that_is_no_scenario_is_refused(tmp_path, text, message):
    (tmp_path / "here").mkdir()
    (tmp_path / "here" / "mine.toml").write_bytes(text.encode("utf-8", "surrogateescape"))
    with pytest.raises(ScenarioError, match=message):
        load_scenario(tmp_path / "here" / "mine.toml")


@pytest.mark.parametrize(
    ("n_r", "n_rr", "diverges"), [(500.0, 1000.0, True), (2500.0, 100.0, True), (50.0, 100.0, False)]
)
def test_what_is_refused_as_stiff_does_diverge(n_r, n_rr, diverges):
    from uuv_marl.sim.vehicle import STILL, advance, plant

    p = plant(load_scenario(BASE))._replace(N_r=n_r, N_rr=n_rr)
    rng, state = np.random.default_rng(0), (0.0, 0.0, 0.0, 4.0, 0.0, 0.0)
    for _ in range(2000):
        angle = rng.uniform(0, 2 * np.pi)
        state = advance(state, (3000 * np.cos(angle), 3000 * np.sin(angle)), STILL, 0.1, p)
    assert (not np.isfinite(state).all() or max(map(abs, state[3:])) > 100) is diverges


def test_no_vehicle_is_accepted_that_runs_away_in_a_minute():
    from uuv_marl.sim.vehicle import STILL, advance, plant

    names = ["m_kg", "I_z_kgm2", "X_udot_kg", "Y_vdot_kg", "N_rdot_kgm2", "X_u", "Y_v", "N_r", "X_uu", "Y_vv", "N_rr"]
    rng, base, accepted = np.random.default_rng(5), load_scenario(BASE), 0
    for _ in range(30):
        scale = dict(zip(names, np.exp(rng.uniform(-2.3, 2.3, len(names))), strict=True))
        changes = {f"vehicle.{name}": getattr(base.vehicle, name) * float(k) for name, k in scale.items()}
        force, torque = 3000.0 * np.exp(rng.uniform(-3.4, 3.4, 2))
        changes |= {"actuators.max_force_n": float(force), "actuators.max_torque_nm": float(torque)}
        try:
            p = plant(load_scenario(base, overrides=changes))
        except ScenarioError:
            continue
        accepted += 1
        for hold in (1, 10, 100, 600):
            state = (0.0, 0.0, 0.0, 4.0, 0.0, 0.0)
            for angle in np.repeat(rng.uniform(0.0, 2 * np.pi, 600 // hold), hold):
                state = advance(state, (force * np.cos(angle), torque * np.sin(angle)), STILL, 0.1, p)
            assert np.isfinite(state).all(), changes
    assert accepted > 5


READ_TWO = "from uuv_marl import load_scenario; load_scenario('starter'); load_scenario('random_field')"
LIST_ALL = """
from typer.testing import CliRunner
from uuv_marl.baselines import POLICIES
assert not any('checkpoint' in vars(policy) for policy in POLICIES.values()), 'weights were read'
from uuv_marl.cli import app
for what in ('scenarios', 'policies'): assert CliRunner().invoke(app, ['list', what]).exit_code == 0
"""


@pytest.mark.parametrize(("code", "heavy"), [
        ("import uuv_marl", {"numba", "torch", "matplotlib", "ray"}),
        (READ_TWO, {"numba", "scipy"}),
        (LIST_ALL, {"matplotlib", "scipy.stats"}),
], ids=["import", "load_scenario", "uuv-marl list"])  # fmt: skip
def test_light_work_imports_nothing_heavy(code, heavy):
    python("-c", f"{code}\nimport sys; assert not {heavy!r} & set(sys.modules)")


def test_a_scenario_names_its_vehicle_whose_numbers_stand_in_a_file(tmp_path):
    scenario = load_scenario("tracking")
    assert load_scenario(scenario, overrides={"vehicle": "literature_185"}) == scenario
    assert 'name = "literature_185"' in show("tracking")
    hull = (FOLDER / "vehicles" / "literature_185.toml").read_text()
    heavy = hull.replace("m_kg = 185.0", "m_kg = 300.0").replace('"literature_185"', '"heavy"')
    (tmp_path / "heavy.toml").write_text(heavy)
    (tmp_path / "mine.toml").write_text('vehicle = "heavy.toml"\nextends = "tracking"\n')
    mine = load_scenario(tmp_path / "mine.toml")
    assert (mine.vehicle.name, mine.vehicle.m_kg, mine.actuators) == ("heavy", 300.0, scenario.actuators)
    assert load_scenario(mine) == mine


def test_overrides_count_in_whatever_order_they_are_given():
    """A vehicle before its numbers, a table before its entries."""
    pairs = [
        {"actuators.max_force_n": 40.0, "vehicle": "bluerov2_heavy"},
        {"faults.0.share": 0.25, "faults": [{"kind": "yaw", "share": 0.5}]},
    ]
    slow = {"trajectory.speed_mps": 0.5, "start.speed_max_mps": 0.5, "timing.integration_step_s": 0.05}
    base = load_scenario("single_obstacle", overrides=slow)
    for one in pairs:
        other = dict(reversed(one.items()))
        assert load_scenario(base, overrides=one) == load_scenario(base, overrides=other)
    assert load_scenario(base, overrides=pairs[0]).actuators.max_force_n == 40.0


def test_a_vehicle_of_one_s_own_takes_nothing_from_the_paper_s(tmp_path):
    """Read back from its TOML, which can't say that a number is unknown."""
    own = load_scenario("starter", overrides={"vehicle.cruise_mps": None, "vehicle.source": None})
    path = tmp_path / "mine.toml"
    path.write_text(to_toml(own))
    assert load_scenario(path).vehicle == own.vehicle


@pytest.mark.parametrize(("field", "same", "given"), [
        ("sonar.channels", ["compass"], UserList(["compass"])),
        ("sonar.channels", ["compass"], np.array(["compass"])),
        ("swarm.num_vehicles", 7, np.int64(7)),
        ("swarm.num_vehicles", 7, np.array(7)),
        ("collision.ends_vehicle", True, np.bool_(True)),
        ("collision.ends_vehicle", True, np.array(True)),
        ("losses.times_s", [1.0, 2.5], np.array([1.0, 2.5], np.float32)),
        ("trajectory.speed_mps", 3.5, np.float32(3.5)),
        ("obstacles", [{"centre_m": [1.0, 2.0], "radius_m": 3.0}],
         UserList([UserDict(centre_m=np.array([1.0, 2.0]), radius_m=np.float64(3.0))])),
])  # fmt: skip
def test_a_value_of_an_override_is_taken_for_what_it_can_do(field, same, given):
    assert load_scenario("lossy", overrides={field: given}) == load_scenario("lossy", overrides={field: same})
    path = field.split(".")
    nested = UserDict({path[0]: UserDict({path[1]: given})}) if path[1:] else UserDict({field: given})
    assert load_scenario("lossy", overrides=nested) == load_scenario("lossy", overrides={field: same})


def test_a_table_changes_the_fields_that_it_has():
    def same(whole, single, name="lossy"):
        assert load_scenario(name, overrides=whole) == load_scenario(name, overrides=single)

    same({"current": {"speed_mps": 0.5}}, {"current.speed_mps": 0.5})
    same({"vehicle": {"X_uu": 90.0}}, {"vehicle.X_uu": 90.0})
    slow = {"trajectory.speed_mps": 1.5, "start.speed_max_mps": 1.5}
    same({"actuators": {"yaw_lag_s": 0.5}, "vehicle": "lauv", **slow},
         {"vehicle": "lauv", "actuators.yaw_lag_s": 0.5, **slow})  # fmt: skip
    first = load_scenario("lossy").sonar.arrays[0].name
    same({f"sonar.arrays.{first}": {"range_m": 80.0}}, {f"sonar.arrays.{first}.range_m": 80.0})


def test_a_whole_vehicle_takes_no_optional_number_from_the_vehicle_below():
    vehicle = load_vehicle("literature_185")["vehicle"]
    whole = {name: value for name, value in vehicle.items() if Vehicle.model_fields[name].is_required()}
    below = load_scenario("starter", overrides={"vehicle": {"N_vv": -3.0, "source": "mine"}})
    assert below.vehicle.N_vv == -3.0
    assert load_scenario(below, overrides={"vehicle": whole}).vehicle == Vehicle.model_validate(whole)
