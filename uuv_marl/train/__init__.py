"""Training: one description, PPO on it, and what a run writes."""
