"""A sensor fault of your own: a sonar mounted askew, for ``uuv-marl benchmark --policy sensor:Askew,degrees=10``."""

import dataclasses
import math

import numpy as np
from numpy.typing import NDArray

import uuv_marl
from uuv_marl.baselines.paper.bio_inspired import BioInspiredPlus
from uuv_marl.percept import Percept
from uuv_marl.scenario import Scenario


def turned(percept: Percept, angle: float) -> Percept:
    """The percept with bearings that are off by this angle, positive to starboard [rad]."""
    changed = dataclasses.replace(percept, flat=percept.flat.copy())
    c, s = math.cos(angle), math.sin(angle)
    for name in ("neighbour", "echo_position"):  # uuv_marl.percept.FIELDS lists the fields
        x, y = np.moveaxis(percept[name], -1, 0)
        changed[name][...] = np.stack([c * x - s * y, s * x + c * y], axis=-1)
    return changed


class Askew(BioInspiredPlus):
    """The paper's controller in its strongest form, with wrong bearings; any policy without memory may be wrapped so.

    Args:
        scenario: of the vehicles.
        num_worlds: first axis of the percepts.
        degrees: angle of the sonar to starboard.
    """

    def __init__(self, scenario: Scenario, num_worlds: int = 1, degrees: float = 20.0) -> None:
        super().__init__(scenario, num_worlds)
        self._angle = -math.radians(degrees)  # an obstacle ahead lies to port of the sonar's axis

    def decide(self, percept: Percept) -> NDArray[np.float32]:
        """Shares of full force and torque, shape (world, vehicle, 2)."""
        return super().decide(turned(percept, self._angle))


if __name__ == "__main__":
    for degrees in (0.0, 20.0, 60.0):
        (metrics,) = uuv_marl.evaluate(f"sensor:Askew,degrees={degrees}", "starter", [0])
        time_s, away = metrics["task_time_s"] or float("nan"), metrics["min_obstacle_distance_m"]
        print(f"{degrees:g} deg askew: arrived after {time_s:.1f} s, {away:.1f} m from the obstacle")
