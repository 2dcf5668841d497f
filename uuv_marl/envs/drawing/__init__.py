"""Pictures of a world: what is seen (``scene``), from where (``camera``), and how it is drawn. pygame is an extra."""
