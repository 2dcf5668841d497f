"""Held-out evaluation of learned policies and controllers: sets, runs, page."""
