"""What users see of the sea: velocities over ground, pictures and replays of the current, and headers."""

import numpy as np

from uuv_marl import load_scenario
from uuv_marl.benchmark.evaluate import Run, evaluate
from uuv_marl.envs.state import global_state, state_layout
from uuv_marl.percept import Percept
from uuv_marl.replay.record import record
from uuv_marl.sim.swarm import Swarm
from uuv_marl.train.shaping import PRIVILEGED_SIZE, privileged_observation

CURRENT = {"current.speed_mps": 0.7, "current.direction_deg": 60.0}
FLOW = 0.7 * np.array([0.5, np.sqrt(0.75)])
"""North and east [m/s]."""


def carried(decisions=30):
    """The same actions in still water and in a current, which moves no bit of headings and velocities through it."""
    swarms = [Swarm(load_scenario("starter", overrides=change)) for change in ({"obstacles": []}, CURRENT)]
    for swarm in swarms:
        swarm.reset(3)
        rng = np.random.default_rng(7)
        for _ in range(decisions):
            swarm.step(rng.uniform(-1.0, 1.0, (1, 5, 2)))
    return swarms


def turned(vector, swarm):
    """A north-east vector in the frame of each vehicle."""
    c, s = np.moveaxis(swarm.heading[0], -1, 0)
    return np.stack([c * vector[0] + s * vector[1], c * vector[1] - s * vector[0]], axis=-1)


# --- Velocities over ground ---


def test_traces_and_recordings_hold_the_velocity_over_ground():
    """Vehicles that do nothing end up with the water, at rest relative to it."""
    scenario = load_scenario("starter", overrides=CURRENT)
    (run,) = [event for event in evaluate(scenario, "idle", [0]) if isinstance(event, Run)]
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
    np.testing.assert_allclose(fields[1]["velocity"] - fields[0]["velocity"], turned(FLOW, moved), atol=1e-5)
    np.testing.assert_array_equal(fields[1]["yaw_rate"], fields[0]["yaw_rate"])


def test_a_critic_sees_how_the_centre_moves_over_ground():
    seen = np.zeros((2, 1, 5, PRIVILEGED_SIZE), np.float32)
    calm, moved = carried()
    privileged_observation(calm, seen[0])
    privileged_observation(moved, seen[1])
    np.testing.assert_allclose((seen[1] - seen[0])[0, :, 6:8], turned(FLOW, moved) / 4.0, atol=1e-5)


def test_in_still_water_the_velocity_is_the_state_s_own():
    """Not one that is like it: off means the bits of before."""
    swarm = carried(3)[0]
    assert np.shares_memory(swarm.velocity, swarm.state.nu)
    np.testing.assert_array_equal(swarm.velocity, swarm.state.nu[:, :, :2])
