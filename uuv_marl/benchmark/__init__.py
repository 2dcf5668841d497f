"""Policies on scenarios over seeds: one definition of every metric, resumable results, tables and figures."""
