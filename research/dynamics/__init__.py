"""Research on the model: parameters that the paper leaves open, stability, rest, time steps and swarm sizes."""
