"""Memory of a vehicle's surroundings, from its own percepts alone; ``Policy`` clears it at a reset."""
