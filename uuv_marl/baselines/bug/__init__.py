"""``tangent_bug``: the strongest hand-made law here for water with walls."""
