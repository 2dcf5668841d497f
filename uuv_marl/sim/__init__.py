"""The water: vehicles, trajectory, obstacles and sonar, as compiled loops over arrays (world, vehicle, ...)."""
