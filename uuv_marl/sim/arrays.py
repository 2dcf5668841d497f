"""The arrays of a batch of worlds, by name: all that changes while it runs. ``Swarm`` allocates them."""

from typing import Annotated, NamedTuple

from uuv_marl.sim.tables import Bounds, described
from uuv_marl.types import Bool, Float32, Float64, Int32, Int64


@described
class State(NamedTuple):
    """What a step changes."""

    eta: Annotated[Float64, "world vehicle 3", "Pose: north [m], east [m], heading [rad]."]
    nu: Annotated[
        Float64, "world vehicle 3", "Velocity through the water, body frame: surge, sway [m/s]; yaw rate [rad/s]."
    ]
    before: Annotated[Float64, "world vehicle 2", "Position one control hold ago, north and east [m]."]
    alive: Annotated[Bool, "world vehicle", "False for lost vehicles."]
    obstacles_before: Annotated[
        Float64, "world obstacle 3", "``Course.obstacles`` one control hold ago; infinitely far where there was none."
    ]
    tick: Annotated[Int64, "world", "Control holds since the reset."]
    dwell: Annotated[Int64, "world radius", "Control holds for which the swarm has rested within each arrival radius."]
    collided: Annotated[Bool, "world vehicle", "Whether the vehicle has touched anything since the reset."]


@described
class WorldMap(NamedTuple):
    """What a reset draws."""

    waypoints: Annotated[Float64, "world group point 2", "Corners of each group's trajectory [m], padded."]
    times: Annotated[Float64, "world group point", "When its l(t) passes them [s].", Bounds(0)]
    last: Annotated[Int64, "world group", "Index of the last corner.", Bounds(1, "point")]
    group: Annotated[Int64, "world vehicle", "Group of the vehicle, whose l(t) is its reference.", Bounds(0, "group")]
    informed: Annotated[Bool, "world vehicle", "Whether the vehicle perceives its reference; else it perceives zeros."]
    obstacles: Annotated[Float64, "world obstacle 3", "Centre north, east and radius [m], padded."]
    obstacle_velocity: Annotated[
        Float64, "world obstacle 2", "Velocity of the obstacle, north and east [m/s]; 0 in the paper."
    ]
    swing: Annotated[
        Float64, "world obstacle 4", "Of one that moves to and fro: its place and velocity at the start [m, m/s]."
    ]
    swing_control_steps: Annotated[
        Int64, "world obstacle", "Control holds from there to where it turns; 0 if it does not move to and fro."
    ]
    num_obstacles: Annotated[Int64, "world", "Obstacles that there are.", Bounds(0, "obstacle", 1)]
    losses: Annotated[Int64, "world loss", "Vehicle lost at each scheduled loss.", Bounds(0, "vehicle")]


@described
class Senses(NamedTuple):
    """What was heard at the latest step, and the percept made of it."""

    heading: Annotated[Float64, "world vehicle 2", "Cosine and sine of psi."]
    detected_index: Annotated[
        Int32, "world vehicle sector", "Index of the vehicle heard, -1 for none.", Bounds(-1, "vehicle")
    ]
    percept: Annotated[Float32, "world vehicle entry", "Flat percepts in physical units, zero for the lost."]


@described
class Facts(NamedTuple):
    """What is true of the latest step. Smallest values and counts are over all its control holds. Lengths in m."""

    time_s: Annotated[Float64, "world", "Time since the reset."]
    reference: Annotated[Float64, "world group 4", "Position (north, east) and velocity of each group's l(t)."]
    away: Annotated[Float64, "world vehicle", "Distance to its own reference; the last one for the lost."]
    away_before: Annotated[Float64, "world vehicle", "The same at the end of the step before."]
    centre: Annotated[Float64, "world 2", "Mean position of the living."]
    spacing: Annotated[Float64, "world vehicle", "Smallest distance to another vehicle; infinite for the lost."]
    min_spacing: Annotated[Float64, "world", "The smallest of them."]
    max_spacing: Annotated[Float64, "world", "Largest distance between two vehicles at the end of the step."]
    clearance: Annotated[Float64, "world vehicle", "Smallest distance to an obstacle's surface; negative inside."]
    obstacle_clearance: Annotated[
        Float64, "world obstacle", "Smallest distance from its surface to a vehicle; infinite in the padding."
    ]
    vehicle_collisions: Annotated[Int64, "world vehicle", "Contact episodes of the vehicle that began."]
    collisions: Annotated[Int64, "world", "Contact episodes that began."]
    lost: Annotated[Bool, "world vehicle", "True for vehicles lost in this step."]
    effort: Annotated[Float64, "world vehicle", "Mean squared action, as a share of full force or rudder."]
    saturated: Annotated[Float64, "world", "Share of actions at the actuators' limit."]
    arrival_s: Annotated[Float64, "world radius", "When the swarm arrived, by ``Rules.arrival_radii``; NaN before."]
    diverged: Annotated[
        Int64, "world", "First vehicle whose speed the integration let run away, -1 for none.", Bounds(-1, "vehicle")
    ]


class World(NamedTuple):
    """All that changes, for a batch of worlds; the first axis of every array is the world."""

    state: State
    world_map: WorldMap
    facts: Facts
    senses: Senses
