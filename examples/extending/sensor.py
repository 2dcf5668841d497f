"""A sensor fault of your own: a sonar mounted askew, for ``uuv-marl benchmark --policy sensor:Askew,degrees=10``."""

import dataclasses
import math

import numpy as np
from numpy.typing import NDArray

from uuv_marl import baselines, load_scenario
from uuv_marl.baselines.paper.bio_inspired import BioInspiredPlus
from uuv_marl.benchmark.evaluate import episodes
from uuv_marl.percept import Percept
from uuv_marl.scenario import Scenario


def turned(percept: Percept, angle: float) -> Percept:
    """What vehicles know whose sonar is turned by this angle to starboard [rad] and nobody has told them."""
    known = dataclasses.replace(percept, flat=percept.flat.copy())
    c, s = math.cos(angle), math.sin(angle)
    for name in ("neighbour", "echo_position"):  # help(uuv_marl.percept.Percept) lists the fields
        x, y = np.moveaxis(percept[name], -1, 0)
        known[name][...] = np.stack([c * x - s * y, s * x + c * y], axis=-1)
    return known


class Askew(BioInspiredPlus):
    """The paper's law in its strongest form, which is told wrong bearings. Any policy without memory can be wrapped so.

    Args:
        scenario: gives the vehicle's limits.
        num_worlds: first axis of the percepts.
        degrees: by which the sonar is turned to starboard.
    """

    def __init__(self, scenario: Scenario, num_worlds: int = 1, degrees: float = 20.0) -> None:
        super().__init__(scenario, num_worlds)
        self._angle = -math.radians(degrees)  # what is ahead of the ship seems to lie to port of the sonar's axis

    def decide(self, percept: Percept) -> NDArray[np.float32]:
        """Shares of full force and torque, shape (world, vehicle, 2)."""
        return super().decide(turned(percept, self._angle))


if __name__ == "__main__":
    scenario = baselines.with_policy_requirements("bio_inspired_plus", load_scenario("starter"))
    for degrees in (0.0, 20.0, 60.0):
        (run,) = episodes(scenario, "sensor:Askew", [0], degrees=degrees)
        time_s, away = run.metrics["task_time_s"] or float("nan"), run.metrics["min_obstacle_distance_m"]
        print(f"{degrees:g} deg askew: arrived after {time_s:.1f} s, {away:.1f} m from the obstacle")
