"""The arrays of a batch of worlds by name: all that changes in a run. ``Swarm`` allocates them."""

from typing import Annotated, NamedTuple

from uuv_marl.sim.tables import Bounds, described
from uuv_marl.types import Bool, Float32, Float64, Int32, Int64


@described
class State(NamedTuple):
    """State that a step changes."""

    eta: Annotated[Float64, "world vehicle 3", "Pose: north [m], east [m], heading [rad]."]
    nu: Annotated[Float64, "world vehicle 3", "Velocity relative to the water: surge, sway [m/s], yaw rate [rad/s]."]
    before: Annotated[Float64, "world vehicle 2", "Position one control step ago, north and east [m]."]
    alive: Annotated[Bool, "world vehicle", "False for lost vehicles."]
    obstacles_before: Annotated[Float64, "world obstacle 3", "``WorldMap.obstacles`` one control step ago."]
    tick: Annotated[Int64, "world", "Control steps since the reset."]
    dwell: Annotated[Int64, "world radius", "Control steps that the swarm has stayed within each arrival radius."]
    collided: Annotated[Bool, "world vehicle", "Whether the vehicle has collided since the reset."]


@described
class WorldMap(NamedTuple):
    """Map that a reset samples."""

    waypoints: Annotated[Float64, "world group point 2", "Corners of each group's trajectory [m], padded."]
    times: Annotated[Float64, "world group point", "Time at which its l(t) passes them [s].", Bounds(0)]
    last: Annotated[Int64, "world group", "Index of the last corner.", Bounds(1, "point")]
    group: Annotated[Int64, "world vehicle", "Group of the vehicle, which has the reference l(t).", Bounds(0, "group")]
    informed: Annotated[Bool, "world vehicle", "Whether the vehicle perceives its reference; else it perceives zeros."]
    obstacles: Annotated[Float64, "world obstacle 3", "Centre north, east and radius [m], padded."]
    obstacle_velocity: Annotated[Float64, "world obstacle 2", "Velocity of obstacles [m/s]; 0 in the paper."]
    swing: Annotated[Float64, "world obstacle 4", "Initial position and velocity of oscillating obstacles [m, m/s]."]
    swing_control_steps: Annotated[Int64, "world obstacle", "Control steps from there to its turning point, or 0."]
    num_obstacles: Annotated[Int64, "world", "Number of obstacles.", Bounds(0, "obstacle", 1)]
    losses: Annotated[Int64, "world loss", "Vehicle lost at each scheduled loss.", Bounds(0, "vehicle")]


@described
class Senses(NamedTuple):
    """Detections of the latest step, and the percepts."""

    heading: Annotated[Float64, "world vehicle 2", "Cosine and sine of psi."]
    detected_index: Annotated[
        Int32, "world vehicle sector", "Index of the detected vehicle, -1 for none.", Bounds(-1, "vehicle")
    ]
    percept: Annotated[Float32, "world vehicle entry", "Flat percepts in physical units, 0 for lost vehicles."]


@described
class Facts(NamedTuple):
    """True values of the latest step; minima and counts are over all its control steps. Lengths in m."""

    time_s: Annotated[Float64, "world", "Time since the reset."]
    reference: Annotated[Float64, "world group 4", "Position (north, east) and velocity of each group's l(t)."]
    away: Annotated[Float64, "world vehicle", "Distance to its own reference; the last one if lost."]
    away_before: Annotated[Float64, "world vehicle", "The same at the end of the previous step."]
    centre: Annotated[Float64, "world 2", "Mean position of the living."]
    spacing: Annotated[Float64, "world vehicle", "Smallest distance to another vehicle; infinite if lost."]
    min_spacing: Annotated[Float64, "world", "The smallest of them."]
    max_spacing: Annotated[Float64, "world", "Largest distance between two vehicles at the end of the step."]
    clearance: Annotated[Float64, "world vehicle", "Smallest distance to an obstacle's surface; negative inside."]
    obstacle_clearance: Annotated[Float64, "world obstacle", "Smallest distance from its surface to a vehicle."]
    vehicle_collisions: Annotated[Int64, "world vehicle", "New collisions of the vehicle."]
    collisions: Annotated[Int64, "world", "New collisions."]
    lost: Annotated[Bool, "world vehicle", "True for vehicles lost in this step."]
    effort: Annotated[Float64, "world vehicle", "Mean squared action, as a share of full force or rudder."]
    saturated: Annotated[Float64, "world", "Share of actions at the actuators' limit."]
    arrival_s: Annotated[Float64, "world radius", "Arrival time of the swarm, by ``Rules.arrival_radii``; NaN before."]
    diverged: Annotated[Int64, "world", "First vehicle with diverged integration, or -1.", Bounds(-1, "vehicle")]


class World(NamedTuple):
    """All that changes, for a batch of worlds; the first axis of every array is the world."""

    state: State
    world_map: WorldMap
    facts: Facts
    senses: Senses
