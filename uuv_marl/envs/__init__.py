"""Environments: the same observations, rewards and endings in many APIs."""
