"""Policies on scenarios over seeds: one definition of every metric, resumable results, tables and figures."""

from uuv_marl.benchmark.frame import load
from uuv_marl.benchmark.results import load_trace

__all__ = ["load", "load_trace"]
