"""Arrays are declared once; memory, documentation and checks are made from that, for every scenario."""

import numpy as np

from tests.conftest import LIFT, RUDDER
from tests.golden import STARTER
from tests.swarms import started
from uuv_marl import load_scenario
from uuv_marl.sim import world
from uuv_marl.sim.arrays import Facts, Senses, State, WorldMap
from uuv_marl.sim.tables import allocate

TORPEDO = LIFT | RUDDER | {"vehicle.munk_moment": False}
AXES = ("world", "vehicle", "group", "point", "obstacle", "loss", "sector", "radius", "entry")
SIZES = dict(zip(AXES, (2, 5, 2, 3, 4, 1, 21, 4, 98), strict=True))


def test_a_table_documents_shapes_types_and_meaning():
    state = allocate(State, SIZES)
    assert (state.eta.shape, state.eta.dtype, state.alive.dtype) == ((2, 5, 3), np.float64, np.bool_)
    assert "eta: Pose: north [m], east [m], heading [rad]. Shape (world, vehicle, 3), float64." in State.__doc__
    for table in (State, WorldMap, Senses, Facts):
        assert all(f"\n        {name}: " in table.__doc__ for name in table._fields)


def test_the_compiled_types_are_the_same_for_all_scenarios():
    """Otherwise each scenario, hull or disturbance compiles the whole simulation again."""
    changes = [
        (STARTER, {}),
        ("tracking", {"num_vehicles": 1}),
        ("single_obstacle", {"overrides": {"sonar.arrays.bow.sub_sectors": 3, "sonar.echo_reports": "surface"}}),
        ("multi_obstacle", {"num_vehicles": 300}),
        ("lossy", {"overrides": {"sonar.channels": ["compass", "link"]}}),
        ("random_field", {"overrides": {"vehicle.m_kg": 250.0, "collision.ends_vehicle": True}}),
        (STARTER, {"overrides": TORPEDO}),
        (STARTER, {"overrides": {**TORPEDO, "actuators.yaw_lag_s": 0.2}}),
        (STARTER, {"overrides": {"current.eddies": 8, "current.eddy_speed_mps": 0.5}}),
        ("random_field", {"overrides": {"sonar.channels": ["age"], "faults": [{"kind": "yaw", "share": 0.5}]}}),
    ]
    for name, change in changes:
        scenario = load_scenario(name, **change)
        for worlds in (1, 2):
            swarm = started(scenario, worlds=worlds)
            swarm.step(np.zeros((worlds, swarm.num_vehicles, 2)))
    for function in (world.observe_world, world.step_worlds):
        assert len(function.signatures) == 2, "one without disturbances, one with them"
