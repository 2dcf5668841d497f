"""Data sets of episodes for learning without a simulation: as Parquet and for Minari. Needs the extra ``data``."""
