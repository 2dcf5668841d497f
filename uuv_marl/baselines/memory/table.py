"""Arrays of a vehicle's memory of its surroundings, in a map of its own.

The map's origin is the reference point l(t) at its first percept, and its first axis the direction in which l(t) moved
then (the bow, if l(t) was at rest).
"""

from collections import namedtuple
from typing import Annotated, Any, NamedTuple, get_type_hints

from uuv_marl.sim.tables import described
from uuv_marl.types import Float64


@described
class Surroundings(NamedTuple):
    """Pose of a vehicle in its map, detected obstacles, and neighbours with their velocities."""

    pose: Annotated[Float64, "world vehicle 4", "Position in the map [m], cosine and sine of the heading."]
    motion: Annotated[Float64, "world vehicle 3", "Own velocity, body frame [m/s], and yaw rate [rad/s]."]
    action: Annotated[Float64, "world vehicle 2", "Own latest action: shares of full thrust and torque."]
    response: Annotated[Float64, "world vehicle 2 5", "Response of thrust and torque: see ``memory.response``."]
    actuators: Annotated[Float64, "world vehicle 2 13", "Lag of thrust and total torque: see ``memory.actuators``."]
    reference: Annotated[Float64, "world vehicle 4", "Position of l(t) [m], unit vector of its leg, 0 at rest."]
    reference_speed: Annotated[Float64, "world vehicle", "Speed of l(t) [m/s]."]
    begun: Annotated[Float64, "world vehicle", "1 from the first percept until the vehicle is lost."]
    disc: Annotated[Float64, "world vehicle 12 3", "Obstacles: centre in the map and radius [m]."]
    spread: Annotated[Float64, "world vehicle 12 6", "Their covariance [m2]: xx, xy, xR, yy, yR, RR."]
    score: Annotated[Float64, "world vehicle 12", "Detections of each less missed ones; 0 for none."]
    undetected: Annotated[Float64, "world vehicle 12", "Time since each was detected [s]."]
    disc_away: Annotated[Float64, "world vehicle 12", "Distance of each one's centre [m], infinite for none."]
    place: Annotated[Float64, "world vehicle sector 2", "Neighbours: position in the map [m]."]
    away: Annotated[Float64, "world vehicle sector", "Their distance from the vehicle [m], infinite for none."]
    velocity: Annotated[Float64, "world vehicle sector 2", "Their velocity [m/s]."]
    reading: Annotated[Float64, "world vehicle sector 2", "Latest reading of each, in the map [m]."]
    known: Annotated[Float64, "world vehicle sector", "Detections of each, 0 for none."]
    since: Annotated[Float64, "world vehicle sector", "Time since its latest new reading [s]."]
    error: Annotated[Float64, "world vehicle", "Mean error of neighbours' predicted positions, over range [1]."]


def with_surroundings(name: str, table: type[Any]) -> type[Any]:
    """A table of the arrays of ``Surroundings``, then those of ``table``, with ``name`` in the module of ``table``."""
    hints = {**get_type_hints(Surroundings, include_extras=True), **get_type_hints(table, include_extras=True)}
    table_class: Any = namedtuple(name, hints, module=table.__module__)  # pyright: ignore[reportUntypedNamedTuple]
    table_class.__annotations__ = hints
    return table_class
