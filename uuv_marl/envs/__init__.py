"""Environments: one contract (observation, reward, endings), many APIs."""
