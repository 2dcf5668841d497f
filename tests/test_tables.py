"""Arrays are declared once; memory, documentation and checks are made from that, for every scenario."""

import itertools
from typing import Annotated, Any, NamedTuple, TypeVar

import numpy as np
import pytest
from typing_extensions import TypeAliasType

from tests.golden import STARTER
from tests.swarms import started
from uuv_marl import load_scenario
from uuv_marl.percept import CHANNELS
from uuv_marl.scenario.hardware import CHANNEL_NAMES
from uuv_marl.sim import entry_points
from uuv_marl.sim.arrays import Facts, Senses, State, WorldMap
from uuv_marl.sim.tables import allocate, array_specs
from uuv_marl.sim.workspace import MOST_NEARBY, TABLES, Workspace, obstacle_columns, workspace, workspace_buffers
from uuv_marl.types import Float32

RUDDER = {"vehicle.Y_uv": -60.0, "vehicle.N_ur": -10.0, "vehicle.munk_moment": False, "actuators.kind": "rudder",
          "actuators.N_uud": -40.0, "actuators.rudder_max_deg": 20.0, "actuators.max_astern_n": 0.0}  # fmt: skip
AXES = ("world", "vehicle", "group", "point", "obstacle", "loss", "sector", "radius", "entry")
SIZES = dict(zip(AXES, (2, 5, 2, 3, 4, 1, 21, 4, 98), strict=True))
LENGTHS = {"vehicle": 8, "sector": 22, "cell": 5, "obstacle": 4, "nearby": 7 * MOST_NEARBY}


@pytest.fixture
def workspaces():
    buffers = workspace_buffers(threads=2, num_vehicles=7, num_sectors=21, num_cells=4, num_obstacles=3)
    own = [workspace.py_func(buffers, t) for t in range(2)]
    return buffers, [(*each[:-1], obstacle_columns.py_func(each.obstacles)) for each in own]


def test_arrays_of_workspaces_share_no_memory(workspaces):
    arrays = [array for own in workspaces[1] for table in own for array in table]
    assert len(arrays) == 2 * sum(len(table._fields) for table in TABLES)
    for a, b in itertools.combinations(arrays, 2):
        assert not np.shares_memory(a, b)


def test_a_workspace_uses_every_column_and_has_the_declared_types(workspaces):
    buffers, own = workspaces
    for table, arrays in zip(TABLES, Workspace(*own[0]), strict=True):
        for (name, spec), array in zip(array_specs(table).items(), arrays, strict=True):
            assert array.dtype == spec.dtype, name
            assert len(array) >= LENGTHS[spec.axes[0]], name
    columns = sum(block.shape[1] for block in buffers)
    assert columns == sum(len(table._fields) for table in TABLES)


def test_an_array_may_be_declared_by_any_alias_of_its_type():
    number = TypeVar("number", bound=np.generic)
    newer = TypeAliasType("newer", np.ndarray[tuple[Any, ...], np.dtype[number]], type_params=(number,))  # from 2.5 on
    for alias in (Float32, newer[np.float32]):

        class Heights(NamedTuple):
            height: Annotated[alias, "world", "How high [m]."]

        assert array_specs(Heights)["height"].dtype is np.float32


def test_a_table_documents_shapes_types_and_meaning():
    state = allocate(State, SIZES)
    assert (state.eta.shape, state.eta.dtype, state.alive.dtype) == ((2, 5, 3), np.float64, np.bool_)
    assert "eta: Pose: north [m], east [m], heading [rad]. Shape (world, vehicle, 3), float64." in State.__doc__
    for table in (State, WorldMap, Senses, Facts):
        assert all(f"\n        {name}: " in table.__doc__ for name in table._fields)


def test_a_scenario_accepts_the_channels_that_add_fields():
    assert CHANNELS == CHANNEL_NAMES


def test_the_compiled_types_are_the_same_for_all_scenarios():
    """Otherwise each scenario, hull or disturbance compiles the whole simulation again."""
    changes = [
        (STARTER, {}),
        ("tracking", {"num_vehicles": 1}),
        ("single_obstacle", {"overrides": {"sonar.arrays.bow.sub_sectors": 3, "sonar.echo_reports": "surface"}}),
        ("multi_obstacle", {"num_vehicles": 300}),
        ("lossy", {"overrides": {"sonar.channels": ["compass", "link"]}}),
        ("random_field", {"overrides": {"vehicle.m_kg": 250.0, "collision.ends_vehicle": True}}),
        (STARTER, {"overrides": RUDDER}),
        (STARTER, {"overrides": {**RUDDER, "actuators.yaw_lag_s": 0.2}}),
        (STARTER, {"overrides": {"current.eddies": 8, "current.eddy_speed_mps": 0.5}}),
        ("random_field", {"overrides": {"sonar.channels": ["age"], "faults": [{"kind": "yaw", "share": 0.5}]}}),
    ]
    for name, change in changes:
        scenario = load_scenario(name, **change)
        for worlds in (1, 2):
            swarm = started(scenario, worlds=worlds)
            swarm.step(np.zeros((worlds, swarm.num_vehicles, 2)))
    for function in (entry_points.observe, entry_points.step_worlds):
        assert len(function.signatures) == 2, "one without disturbances, one with them"
