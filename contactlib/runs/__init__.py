"""Runs in time: one wheelset, one scenario, many at once, and their outcomes."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from contactlib.runs.benchmarking import Benchmark as Benchmark
    from contactlib.runs.benchmarking import benchmark as benchmark
    from contactlib.runs.benchmarking import benchmark_scenarios as benchmark_scenarios
    from contactlib.runs.outcomes import OUTCOMES as OUTCOMES
    from contactlib.runs.outcomes import Metrics as Metrics
    from contactlib.runs.outcomes import comparison_table as comparison_table
    from contactlib.runs.outcomes import metrics as metrics
    from contactlib.runs.outcomes import write_comparison as write_comparison
    from contactlib.runs.plant import Plant as Plant
    from contactlib.runs.result import Event as Event
    from contactlib.runs.result import Result as Result
    from contactlib.runs.scenario_runs import run_many as run_many
    from contactlib.runs.scenario_runs import run_scenario as run_scenario
    from contactlib.runs.simulation import simulate as simulate
    from contactlib.runs.sweep import ANALYSES as ANALYSES
    from contactlib.runs.sweep import Sweep as Sweep
    from contactlib.runs.sweep import load_sweep as load_sweep
    from contactlib.runs.sweep.ensemble import ensemble as ensemble
    from contactlib.runs.tuning import Tuning as Tuning
    from contactlib.runs.tuning import sensor_errors as sensor_errors
    from contactlib.runs.tuning import tune as tune
else:
    from contactlib.base.lazy import lazy_names

    __getattr__, __dir__, __all__ = lazy_names(__name__)
