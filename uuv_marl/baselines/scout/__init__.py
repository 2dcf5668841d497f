"""``scout``: the safest hand-made controller."""
