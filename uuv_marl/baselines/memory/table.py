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
    """Where a vehicle is in its own map, the obstacles that it has heard, and its neighbours with their velocities."""

    pose: Annotated[Float64, "world vehicle 4", "Own place in the map [m], cosine and sine of the heading in it."]
    motion: Annotated[Float64, "world vehicle 3", "Own velocity, body frame [m/s], and yaw rate [rad/s]."]
    action: Annotated[Float64, "world vehicle 2", "Own latest action: shares of full thrust and torque."]
    response: Annotated[
        Float64, "world vehicle 2 5", "How its thrust and its torque follow its actions: see ``memory.response``."
    ]
    actuators: Annotated[
        Float64, "world vehicle 2 13", "How thrust, and torque with the inner loop's, lag: see ``memory.actuators``."
    ]
    reference: Annotated[Float64, "world vehicle 4", "Place of l(t) [m], unit vector of its leg, 0 where it rests."]
    reference_speed: Annotated[Float64, "world vehicle", "Speed of l(t) [m/s]."]
    filtered: Annotated[
        Float64,
        "world vehicle 2",
        "1 where the safety filter changed the latest velocity; where it found none that is safe.",
    ]
    counted: Annotated[Float64, "world vehicle 2", "How often that was so at the decisions before."]
    begun: Annotated[Float64, "world vehicle", "1 once anything is remembered, and until the vehicle is lost."]
    disc: Annotated[Float64, "world vehicle 12 3", "Obstacles: centre in the map and radius [m]."]
    spread: Annotated[Float64, "world vehicle 12 6", "Their covariance [m2]: xx, xy, xR, yy, yR, RR."]
    score: Annotated[
        Float64,
        "world vehicle 12",
        "Decisions at which each was heard less those at which it was not though it should have been; 0 for none.",
    ]
    undetected: Annotated[Float64, "world vehicle 12", "Time since each was heard [s]."]
    disc_away: Annotated[
        Float64, "world vehicle 12", "Distance of each one's centre from the vehicle [m], infinite for none."
    ]
    place: Annotated[Float64, "world vehicle sector 2", "Neighbours: place in the map [m]."]
    away: Annotated[Float64, "world vehicle sector", "Their distance from the vehicle [m], infinite for none."]
    velocity: Annotated[Float64, "world vehicle sector 2", "Their velocity [m/s]."]
    reading: Annotated[Float64, "world vehicle sector 2", "Where each was heard last, in the map [m]."]
    known: Annotated[Float64, "world vehicle sector", "Decisions at which each was heard, 0 for none."]
    since: Annotated[Float64, "world vehicle sector", "Time since its latest new reading [s]."]
    error: Annotated[Float64, "world vehicle", "Errors of predicted places of neighbours, over their range [1]."]


def with_surroundings(name: str, table: type[Any]) -> type[Any]:
    """A table of the arrays of ``Surroundings``, then those of ``table``, with ``name`` in the module of ``table``."""
    hints = {**get_type_hints(Surroundings, include_extras=True), **get_type_hints(table, include_extras=True)}
    table_class: Any = namedtuple(name, hints, module=table.__module__)  # pyright: ignore[reportUntypedNamedTuple]
    table_class.__annotations__ = hints
    return table_class
