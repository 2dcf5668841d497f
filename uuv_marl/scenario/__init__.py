"""Scenarios: everything that defines a simulation, except the seed.

``load_scenario`` makes a ``Scenario`` from a name, a TOML file or another scenario. The ``*.toml`` files hold the
shipped scenarios, every number with its source.
"""

from uuv_marl.errors import ScenarioError
from uuv_marl.scenario.conditions import IDEAL, conditions, disturbances, sonar_is_ideal
from uuv_marl.scenario.fields import MAX_RANGE_M
from uuv_marl.scenario.files import differences, load_scenario, scenario_names, show, to_toml
from uuv_marl.scenario.overrides import parse_override
from uuv_marl.scenario.scenario import Scenario
from uuv_marl.scenario.sections import growth
from uuv_marl.scenario.vehicle_files import load_vehicle, show_vehicle, variant_names, vehicle_names

__all__ = [
    "IDEAL", "MAX_RANGE_M", "Scenario", "ScenarioError", "conditions", "differences", "disturbances", "growth",
    "load_scenario", "load_vehicle", "parse_override", "scenario_names", "show", "show_vehicle", "sonar_is_ideal",
    "to_toml", "variant_names", "vehicle_names",
]  # fmt: skip
