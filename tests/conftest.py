"""Fixtures that several test files share."""

import os
from importlib.util import find_spec

os.environ.setdefault("SDL_VIDEODRIVER", "dummy")
os.environ.setdefault("OMP_WAIT_POLICY", "passive")  # threads that wait leave their core to the other half of the tests

import numpy as np
import pytest
from hypothesis import settings

from uuv_marl import load_scenario
from uuv_marl.sim.swarm import Swarm

NEEDS = {
    "test_env.py": "pygame", "test_rendering.py": "pygame", "test_vector_env.py": "pygame", "test_export.py": "onnx",
    "test_film.py": "av", "test_first_tries.py": "torch", "test_train.py": "torch", "test_torchrl.py": "torchrl",
    "test_sb3.py": "stable_baselines3", "test_data.py": "minari",
}  # fmt: skip
"""Files that need an extra's library throughout; a test that does says so by the mark ``needs``."""
collect_ignore = [file for file, library in NEEDS.items() if find_spec(library) is None]

settings.register_profile("laws", deadline=None, derandomize=True, max_examples=60)
settings.load_profile("laws")

SCENARIOS = ("tracking", "single_obstacle", "multi_obstacle", "lossy", "random_field")
"""Those that tests step through; ``starter`` is one of their kind, only shorter."""

COUPLED = {"vehicle.x_G_m": 0.05, "vehicle.Y_rdot_kgm": -4.0, "vehicle.Y_r": 12.0, "vehicle.N_v": -20.0,
           "vehicle.Y_rr": 15.0, "vehicle.N_rv": -40.0}  # fmt: skip
LIFT = {"vehicle.Y_uv": -60.0, "vehicle.Y_ur": 20.0, "vehicle.N_uv": 15.0, "vehicle.N_ur": -10.0, "vehicle.N_vv": -9.0}
RUDDER = {"actuators.kind": "rudder", "actuators.Y_uud": 60.0, "actuators.N_uud": -40.0,
          "actuators.rudder_max_deg": 20.0, "actuators.max_astern_n": 0.0}  # fmt: skip
"""Vehicles that have every term of the equations."""


def pytest_report_header():
    return [f"left out, for want of {NEEDS[file]}: {file}" for file in collect_ignore]


def pytest_runtest_setup(item):
    for mark in item.iter_markers("needs"):
        pytest.importorskip(*mark.args)


@pytest.fixture(scope="session", autouse=True)
def compiled_by_halves():
    """Of two processes that find nothing compiled, one begins with calm water and the other with the sea."""
    halves = {"gw0": {}, "gw1": {"current.speed_mps": 0.1}}
    half = halves.get(os.environ.get("PYTEST_XDIST_WORKER", ""))
    if half is not None:
        scenario = load_scenario("starter", overrides=half)
        for worlds in (1, 2):
            swarm = Swarm(scenario, worlds)
            swarm.reset(0)
            swarm.step(np.zeros((worlds, scenario.swarm.num_vehicles, 2), np.float32))


@pytest.fixture(params=SCENARIOS)
def scenario_name(request):
    return request.param
