"""Research on the model: what the paper leaves open, stability, rest, and what changes with clocks and numbers."""
