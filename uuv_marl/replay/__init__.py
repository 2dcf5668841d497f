"""Recorded episodes, shown in a browser or as a film."""

MOST_EPISODES = 4
"""Most episodes side by side, on a page or in a film."""
FILMS = (".mp4", ".gif", ".png")
"""Suffixes of the files that ``replay.film`` writes."""
