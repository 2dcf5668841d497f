"""A table of policies by task that anybody can join: entries are made and checked by commands."""
