"""Many runs of one scenario: sweeps over its parameters, on one machine or on many."""

from contactlib.sweep.dataset import report
from contactlib.sweep.ensemble import ensemble, results_path
from contactlib.sweep.loading import load_sweep
from contactlib.sweep.outcomes import ANALYSES, OUTCOMES, Outcome
from contactlib.sweep.sweep import Sweep
from contactlib.sweep.workers import (
    Workers,
    cluster_workers,
    default_workers,
    process_workers,
    thread_workers,
)

__all__ = [
    "ANALYSES",
    "OUTCOMES",
    "Outcome",
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
]
