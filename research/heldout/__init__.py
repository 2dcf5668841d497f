"""Held-out evaluation of learned policies beside the hand-made ones: sets, runs, page."""
