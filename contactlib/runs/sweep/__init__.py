"""Sweeps over the parameters of a scenario, on one machine or on a cluster."""

from contactlib.runs.analysis import ANALYSES
from contactlib.runs.sweep.ensemble import ensemble, report, results_path, write_table
from contactlib.runs.sweep.execution import (
    Workers,
    cluster_workers,
    default_workers,
    process_workers,
    thread_workers,
)
from contactlib.runs.sweep.loading import load_sweep, with_own
from contactlib.runs.sweep.plan import Sweep

__all__ = [
    "ANALYSES",
    "Sweep",
    "Workers",
    "cluster_workers",
    "default_workers",
    "ensemble",
    "load_sweep",
    "process_workers",
    "report",
    "results_path",
    "thread_workers",
    "with_own",
    "write_table",
]
