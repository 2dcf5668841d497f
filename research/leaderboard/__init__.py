"""A table of policies by task that others can join: entries are made and checked by commands."""
