"""Episodes to look at: recorded once, then shown in a browser or as a film."""

MOST_EPISODES = 4
"""Side by side, on a page or in a film."""
FILMS = (".mp4", ".gif", ".png")
"""Endings of what ``replay.film`` writes."""
