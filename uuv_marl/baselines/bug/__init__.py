"""``tangent_bug``: the strongest hand-made controller for water with walls."""
