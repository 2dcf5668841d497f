"""A scenario in the scale of a vehicle: the rule, the conversion, and arrival in passage."""

import re

import numpy as np
import pytest

from uuv_marl import load_scenario, scenario_names
from uuv_marl.benchmark import handling
from uuv_marl.scenario import Scenario, ScenarioError, to_toml, vehicle_names
from uuv_marl.scenario.dimensions import NUMBER, dimension
from uuv_marl.scenario.scale import scale_of
from uuv_marl.scenario.turning import turning_radius
from uuv_marl.sim.swarm import Swarm

EVERY = handling.every()


def in_scale(name, vehicle, **changes):
    return load_scenario(name, overrides={"vehicle": vehicle, "scale": "vehicle", **changes})


def leaves(model, prefix=""):
    """Names and values of all numbers of a scenario's fields, entries of lists by their list's name."""
    if hasattr(type(model), "model_fields"):
        for name in type(model).model_fields:
            yield from leaves(getattr(model, name), name)
    elif isinstance(model, tuple):
        for entry in model:
            yield from leaves(entry, prefix)
    elif isinstance(model, int | float) and not isinstance(model, bool):
        yield prefix, model


# --- Dimensions ---


def numeric_fields(model):
    """Names of the fields of a model and of its sections that hold numbers."""
    schema = model.model_json_schema()
    for part in (schema, *schema["$defs"].values()):
        for name, field in part["properties"].items():
            if re.search(r"'type': '(number|integer)'", str(field)):
                yield name


def test_every_number_of_a_scenario_has_a_dimension():
    names = set(numeric_fields(Scenario))
    assert {"x_G_m", "N_rr", "max_force_n", "waypoints_m", "loss_times_s", "num_vehicles"} <= names
    assert [name for name in sorted(names) if dimension(name) is None] == []


# --- The rule ---


@pytest.mark.parametrize("name", ["lauv", "remus100", "remus100+munk_on", "remus100+small_rudder"])
def test_the_turning_radius_is_that_of_the_acceptance_test(name):
    """That one turns at full thrust, which loses speed to the turn; a hull with linear damping turns wider then."""
    vehicle = load_scenario("tracking", overrides={"vehicle": name, "scale": "vehicle"})
    radius = turning_radius(vehicle.vehicle, vehicle.actuators, vehicle.vehicle.cruise_mps)
    assert radius == pytest.approx(handling.turn(handling.alone(name))[2], rel=0.02)


@pytest.mark.parametrize("name", vehicle_names())
def test_neighbours_have_room_to_turn_and_more_than_their_length(name):
    scenario = in_scale("sea_trial", name)
    vehicle, limits = scenario.vehicle, scenario.constraints
    turn = 4.0 * turning_radius(vehicle, scenario.actuators, vehicle.cruise_mps)
    assert scenario.start.spacing_m >= turn + limits.s_u_m - 1e-9
    assert scenario.start.spacing_m >= 6.5 * (vehicle.length_m or 2.0)
    assert scenario.trajectory.speed_mps == pytest.approx(vehicle.cruise_mps)
    assert scenario.scale == scale_of(vehicle, scenario.actuators)


# --- The loader ---


@pytest.mark.parametrize("vehicle", EVERY)
@pytest.mark.parametrize("name", scenario_names())
def test_every_scenario_loads_in_the_scale_of_every_vehicle(name, vehicle):
    scenario, plain = in_scale(name, vehicle), load_scenario(name)
    follow = ("hull_radius_m", "integration_step_s")
    units = scenario.scale.units
    theirs = dict.fromkeys(["sound_speed_mps"], 1.0)
    sections = [f for f in Scenario.model_fields if f not in ("vehicle", "actuators", "scale")]
    for section in sections:
        before, now = (list(leaves(getattr(s, section), section)) for s in (plain, scenario))
        for (field, value), (same, there) in zip(before, now, strict=True):
            assert field == same
            if field not in follow:
                expected = value * theirs.get(field, units.of(dimension(field) or NUMBER))
                assert there == pytest.approx(min(expected, 4096.0) if field == "range_m" else expected), field


def test_files_are_scaled_and_overrides_are_not(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text('extends = "sea_trial"\nvehicle = "bluerov2_heavy"\n[start]\nspacing_m = 12.0\n')
    scenario = load_scenario(file, overrides={"constraints.s_u_m": 2.0})
    assert scenario.start.spacing_m == pytest.approx(0.23 * 12.0)
    assert scenario.constraints.s_u_m == 2.0
    assert load_scenario(scenario, overrides={"start.spacing_m": 2.0}).start.spacing_m == 2.0
    longer = load_scenario(file, overrides={"vehicle.length_m": 0.92, "scale": "vehicle"})
    assert longer.start.spacing_m == pytest.approx(0.46 * 12.0)
    assert longer.contact.hull_radius_m == 0.46


@pytest.mark.parametrize("vehicle", vehicle_names())
def test_a_scaled_scenario_is_not_scaled_twice(vehicle, tmp_path):
    scenario = in_scale("sea_trial", vehicle)
    file = tmp_path / "sea_trial.toml"
    file.write_text(to_toml(scenario))
    assert load_scenario(file) == scenario
    assert load_scenario(scenario, overrides={"scale": "vehicle"}) == scenario
    extended = tmp_path / "more.toml"
    extended.write_text(f'extends = "{file}"\nscale = "vehicle"\n')
    with pytest.raises(ScenarioError, match="in scale already; leave scale out"):
        load_scenario(extended)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"vehicle.cruise_mps": 0.0}, "scale = 'vehicle' needs vehicle.cruise_mps, .* 'lauv' has not, got 0.0; set it"),
        ({"vehicle.cruise_mps": 2.5}, "trajectory.speed_mps = 2.5 is more than the 1.97 m/s"),
        ({"scale": "paper"}, "scale must be 'vehicle', or a table of fields, got 'paper'"),
        ({"scale": "vehicle", "timing.integration_step_s": 1.0}, "timing.control_hold_s must be a whole multiple"),
        ({"scale.width": 2.0}, "scale.width is unknown"),
    ],
)
def test_a_scale_that_is_none_is_refused_with_the_remedy(changes, message):
    with pytest.raises(ScenarioError, match=message):
        load_scenario("sea_trial", overrides={"vehicle": "lauv", **changes})


# --- Passage ---


def passing(**changes):
    base = {"arrival.by": "passage", "trajectory.waypoints_m": [[0.0, 0.0], [100.0, 0.0], [100.0, 60.0]]}
    return load_scenario("tracking", num_vehicles=4, overrides={**base, "arrival.spread_m": 10.0, **changes})


SPREAD = np.array([[-3.0, -3.0], [3.0, -3.0], [-3.0, 3.0], [3.0, 3.0]])


@pytest.mark.parametrize(
    ("centre", "scattered", "time_s", "arrives"),
    [
        ((100.0, 59.9), 1.0, 50.0, False),
        ((100.0, 60.1), 1.0, 50.0, True),
        ((104.0, 60.1), 1.0, 50.0, True),
        ((108.0, 60.1), 1.0, 50.0, False),
        ((100.0, 90.0), 1.0, 50.0, True),
        ((100.0, 60.1), 3.0, 50.0, False),
        ((100.0, 60.1), 1.0, 39.8, False),
    ],
)
def test_a_swarm_arrives_as_its_centre_crosses_the_line_through_the_end_together(centre, scattered, time_s, arrives):
    """And l(t) has: its way of 160 m takes 40 s."""
    swarm = Swarm(passing())
    swarm.reset(0)
    swarm.state.eta[0, :, :2], swarm.state.tick[:] = np.array(centre) + scattered * SPREAD, round(10.0 * time_s)
    swarm.observe()
    assert swarm.arrived[0] == arrives
    assert not arrives or swarm.facts.arrival_s[0, 0] == swarm.facts.time_s[0], "at that moment"


@pytest.mark.parametrize("name", scenario_names())
def test_the_papers_vehicle_has_the_papers_scale(name):
    scenario, plain = in_scale(name, "literature_185"), load_scenario(name)
    assert set(scenario.scale.model_dump().values()) == {1.0}
    assert scenario == plain
    assert "scale" not in plain.model_fields_set or name == "sea_trial"


def test_hulls_that_cant_stop_pass_and_others_rest():
    by = {name: in_scale("sea_trial", name).arrival.by for name in vehicle_names()}
    assert by == {"bluerov2_heavy": "rest", "lauv": "passage", "literature_185": "rest", "remus100": "passage"}
    assert load_scenario("tracking").arrival.by == "rest"
    assert in_scale("sea_trial", "bluerov2_heavy", **{"actuators.max_astern_n": 0.0}).arrival.by == "passage"
