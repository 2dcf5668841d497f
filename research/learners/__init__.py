"""Learners on all tasks, by one protocol: trainings, episodes, page."""
