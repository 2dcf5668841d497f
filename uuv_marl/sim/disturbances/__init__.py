"""Disturbances: currents, sonar delays and errors, messages, lags and faults; ``disturbances.py`` is the interface."""
