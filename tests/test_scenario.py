"""Scenarios: sources, overrides, and errors that name the field, the value and the remedy."""

import re
import tomllib
from importlib import resources

import pytest

from tests.conftest import SCENARIOS
from uuv_marl import load_scenario, scenario_names
from uuv_marl.scenario_files import ScenarioError, parse_override, show, to_toml

FOLDER = resources.files("uuv_marl") / "scenarios"
BASE = "single_obstacle"


def test_the_shipped_scenarios():
    assert set(scenario_names()) == set(SCENARIOS)


@pytest.mark.parametrize("name", ["base", *SCENARIOS])
def test_every_number_carries_its_source(name):
    for line in (FOLDER / f"{name}.toml").read_text().splitlines():
        value = line.split("#")[0]
        if re.search(r"=.*(\d|true|false|\[\])", value) and not value.startswith(("version", "title", "source")):
            comment = line.partition("#")[2]
            assert re.search(
                r"section|Table|Eq\.|assumed|Repoulias|none in the paper|nobody|as in the paper", comment
            ), line


@pytest.mark.parametrize("name", ["tracking", "single_obstacle", "multi_obstacle"])
def test_the_papers_scenarios_differ_only_in_what_the_paper_says(name):
    data = tomllib.loads((FOLDER / f"{name}.toml").read_text())
    assert set(data) <= {"title", "source", "version", "trajectory", "obstacles"}
    assert set(data["trajectory"]) == {"waypoints_m"}


@pytest.mark.parametrize("name", SCENARIOS)
def test_toml_out_and_in_again(name, tmp_path):
    scenario = load_scenario(name, num_vehicles=20)
    path = tmp_path / f"{name}.toml"
    path.write_text(to_toml(scenario))
    assert load_scenario(path) == scenario
    assert load_scenario(str(path)) == scenario


@pytest.mark.parametrize("name", SCENARIOS)
def test_show_is_complete_and_loads(name, tmp_path):
    text = show(name)
    path = tmp_path / f"{name}.toml"
    path.write_text(text)
    assert load_scenario(path) == load_scenario(name)
    assert "Repoulias" in text


def test_durations_are_the_papers_bounds():
    for name, duration in (("single_obstacle", 159.1), ("tracking", 462.1), ("multi_obstacle", 457.9)):
        assert load_scenario(name).trajectory.duration_s == pytest.approx(duration, abs=0.05)


def test_overrides_reach_every_level():
    scenario = load_scenario(
        BASE,
        num_vehicles=10,
        overrides={
            "sonar.arrays.bow.range_m": 80.0,
            "sonar.arrays.1.sub_sectors": 3,
            "obstacles.0.radius_m": 30.0,
            "sonar.channels": ["link"],
        },
    )
    assert scenario.swarm.num_vehicles == 10
    assert [a.range_m for a in scenario.sonar.arrays] == [80.0, 500.0, 500.0]
    assert scenario.sonar.arrays[1].sub_sectors == 3
    assert scenario.obstacles[0].radius_m == 30.0
    assert load_scenario(BASE).sonar.arrays[0].range_m == 100.0


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("swarm.num_vehicles=20", ("swarm.num_vehicles", 20)),
        ("sonar.echo_reports=surface", ("sonar.echo_reports", "surface")),
        ('sonar.channels=["link"]', ("sonar.channels", ["link"])),
        ("contact.ends_vehicle = true", ("contact.ends_vehicle", True)),
    ],
)
def test_overrides_from_the_command_line(text, expected):
    assert parse_override(text) == expected


BAD = [
    ({"sonar.arrays.bow.range_m": -3}, r"sonar.arrays.bow.range_m must lie within 0.001 to 4,096, got -3"),
    ({"vehicle.m_kg": float("nan")}, "vehicle.m_kg must lie within 0.001 to 1,000,000, got nan"),
    ({"trajectory.speed_mps": float("inf")}, "trajectory.speed_mps must lie within 0.01 to 100, got inf"),
    ({"swarm.num_vehicles": 2.5}, "swarm.num_vehicles must be a whole number, got 2.5"),
    ({"swarm.num_vehicles": 0}, "swarm.num_vehicles must lie within 1 to 16,384, got 0"),
    ({"vehicle.m_kgg": 3.0}, "vehicle.m_kgg is unknown; did you mean 'm_kg'"),
    ({"sonar.arrays.stern.range_m": 3.0}, "no entry 'stern'; use one of bow, port, starboard"),
    ({"sonar.echo_reports": "nothing"}, "sonar.echo_reports must be 'centre' or 'surface', got 'nothing'"),
    ({"start.spacing_m": 30.0, "start.gap_m": 30.0}, "start.spacing_m = 30 leaves room for .* 27 are needed; lower it"),
    ({"start.gap_m": 5.0}, "start.gap_m must be at least start.spacing_m = 13"),
    ({"vehicle.X_u": 0.0, "vehicle.X_uu": 0.0}, "vehicle.X_u and vehicle.X_uu must not both be 0"),
    ({"vehicle.N_r": 0.0, "vehicle.N_rr": 0.0}, "vehicle.N_r and vehicle.N_rr must not both be 0"),
    ({"start.spacing_m": 1.5}, "start.spacing_m must be at least two hull radii"),
    ({"start.speed_min_mps": 5.0}, "start.speed_min_mps must not exceed"),
    ({"obstacles.0.centre_m": [130.0, 130.0]}, "obstacles.0 at .* lies on the start"),
    ({"obstacles.0.centre_m": [610.0, 600.0]}, "obstacles.0 at .* lies on the trajectory's end"),
    ({"obstacles.0.radius_m": 0.0}, "obstacles.0.radius_m must lie within 0.001 to 4,096, got 0"),
    ({"vehicle.N_r": 500.0, "vehicle.N_rr": 1000.0}, "timing.integration_step_s = 0.1 is too long .* use at most"),
    ({"vehicle.N_r": 2500.0}, "timing.integration_step_s = 0.1 is too long"),
    ({"actuators.yaw_damping_nms": 2000.0}, "actuators.yaw_damping_nms = 2000 is unstable .* use less than 1600"),
    ({"vehicle.x_G_m": 1.0}, "not positive definite"),
    ({"vehicle.Y_r": 500.0}, "lets linear damping add energy"),
    ({"vehicle.Y_rr": 1000.0}, "lets quadratic damping add energy"),
    ({"timing.decision_period_s": 0.15}, "timing.decision_period_s must be a whole multiple"),
    ({"timing.integration_step_s": 0.2}, "timing.control_hold_s must be a whole multiple"),
    ({"disturbance.loss_times_s": [3.0, 1.0]}, "disturbance.loss_times_s must not fall"),
    ({"swarm.num_vehicles": 2, "disturbance.loss_times_s": [1.0, 2.0]}, "at least one must remain"),
    ({"trajectory.waypoints_m": [[1.0, 1.0], [1.0, 1.0]]}, "must differ from one to the next"),
    ({"trajectory.waypoints_m": [[1.0, 1.0]]}, "trajectory.waypoints_m must have at least 2 entries"),
    ({"sonar.arrays.bow.sub_sectors": 1, "sonar.arrays.bow.aperture_deg": 200.0}, "use at least 2"),
    ({"sonar.channels": ["link", "link"]}, "sonar.channels must name each channel once"),
    ({"nonsense": 1}, "nonsense is unknown"),
    ({"swarm.num_vehicles.deep": 1}, "swarm.num_vehicles.deep is unknown"),
]


@pytest.mark.parametrize(("overrides", "message"), BAD)
def test_bad_values_name_field_value_and_remedy(overrides, message):
    with pytest.raises(ScenarioError, match=message):
        load_scenario(BASE, overrides=overrides)


def test_bad_random_fields_are_named():
    for overrides in ({"random_field.legs": [3, 1]}, {"random_field.obstacles": [0, 100]}):
        with pytest.raises(ScenarioError, match=next(iter(overrides))):
            load_scenario("random_field", overrides=overrides)


def test_unknown_names_suggest_the_nearest():
    with pytest.raises(ScenarioError, match="did you mean 'single_obstacle'"):
        load_scenario("single_obstcle")
    with pytest.raises(ScenarioError, match="does not exist"):
        load_scenario("nowhere.toml")
    with pytest.raises(ScenarioError, match="must look like field=value"):
        parse_override("swarm.num_vehicles")


def test_a_file_extends_one_beside_it(tmp_path):
    (tmp_path / "a.toml").write_text('extends = "single_obstacle"\n[swarm]\nnum_vehicles = 12\n')
    (tmp_path / "b.toml").write_text('extends = "a.toml"\n[arrival]\nradius_m = 3.0\n')
    scenario = load_scenario(tmp_path / "b.toml")
    assert (scenario.name, scenario.swarm.num_vehicles, scenario.arrival.radius_m) == ("b", 12, 3.0)
    (tmp_path / "a.toml").write_text('extends = "b.toml"\n')
    with pytest.raises(ScenarioError, match="must not lead back"):
        load_scenario(tmp_path / "b.toml")
    (tmp_path / "a.toml").write_text("extends = 3\n")
    with pytest.raises(ScenarioError, match="extends must be a scenario's name or file, got 3"):
        load_scenario(tmp_path / "a.toml")
    (tmp_path / "a.toml").write_bytes(b"\xff")
    with pytest.raises(ScenarioError, match="not valid TOML"):
        load_scenario(tmp_path / "a.toml")


def test_broken_files_are_named(tmp_path):
    path = tmp_path / "broken.toml"
    path.write_text("[swarm\n")
    with pytest.raises(ScenarioError, match=r"broken.toml is not valid TOML: .*line 1"):
        load_scenario(path)
    path.write_text('title = "x"\nsource = "x"\nversion = 1\n')
    with pytest.raises(ScenarioError, match=r"trajectory.waypoints_m is needed"):
        load_scenario(path)


@pytest.mark.parametrize(
    ("n_r", "n_rr", "diverges"), [(500.0, 1000.0, True), (2500.0, 100.0, True), (50.0, 100.0, False)]
)
def test_what_is_refused_as_stiff_does_diverge(n_r, n_rr, diverges):
    import numpy as np

    from uuv_marl.sim.vehicle import advance, plant

    p = plant(load_scenario(BASE))._replace(N_r=n_r, N_rr=n_rr)
    rng, state = np.random.default_rng(0), (0.0, 0.0, 0.0, 4.0, 0.0, 0.0)
    for _ in range(2000):
        angle = rng.uniform(0, 2 * np.pi)
        state = advance(*state, 3000 * np.cos(angle), 3000 * np.sin(angle), 0.1, p)
    assert (not np.isfinite(state).all() or max(map(abs, state[3:])) > 100) is diverges
