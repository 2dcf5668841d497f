"""Shipped episodes run again: what a row of each file comes from, and whether its numbers are those of today."""
