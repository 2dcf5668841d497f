"""What disturbs a world: currents, late and wrong sonar, messages, lags and faults. ``sea.py`` is the front."""
