"""Shipped episodes run again: the source of each row, and whether its numbers are reproduced."""
