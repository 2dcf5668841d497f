"""Maps of walls: their kinds, paths through them on a grid, and the fields of the channel ``path``."""
