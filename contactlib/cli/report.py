"""The report of a study: metrics, time series and figures in a folder."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Protocol

from contactlib import figures
from contactlib.runs.outcomes import Metrics, comparison_table, metrics, write_comparison
from contactlib.runs.result import Result
from contactlib.runs.study import Run, Study


class Reporter(Protocol):
    """Display of the progress and results of a report."""

    def step(self, title: str) -> AbstractContextManager[Callable[[float], object]]:
        """A step that takes time; yields a function to call with the fraction done."""

    def line(self, text: str) -> None:
        """Show a line."""


def write_report(
    study: Study,
    runs: Mapping[str, Run],
    folder: str | os.PathLike[str],
    reporter: Reporter,
    formats: Sequence[str] = ("png", "svg"),
) -> dict[str, Metrics]:
    """Run, show the metrics, and write metrics, time series and figures to a folder.

    Parameters
    ----------
    study : Study
        Gives name, drivetrain and caption.
    runs : mapping
        The wanted runs of the study, by name.
    folder : path
        Created after the runs if missing. It gets metrics.txt, .csv and .json, a CSV file and a
        figure for each run, and for more than one run a figure that compares them.
    reporter : Reporter
        Shows progress, events and metrics.
    formats : sequence of str, optional
        Of the figures, each one that matplotlib writes.

    Returns
    -------
    dict
        Metrics by name.

    Raises
    ------
    OSError
        If the folder cannot be created or written.
    """
    output = Path(folder)
    for line in study.outlook:
        reporter.line(line)
    results: dict[str, Result] = {}
    found: dict[str, Metrics] = {}
    for name, run in runs.items():
        with reporter.step(f"{study.name}: {name.replace('_', ' ')}") as progress:
            results[name] = run(progress)
        found[name] = metrics(results[name], study.drivetrain)
        for event in results[name].events:
            reporter.line(
                f"{event.name:<12} at {event.time:.6g} s: creepage {event.creepage:.6g}, "
                f"speed {event.speed:.6g} m/s, drive torque {event.drive_torque:.6g} N.m"
            )
    reporter.line(comparison_table(found))
    output.mkdir(parents=True, exist_ok=True)
    for name, result in results.items():
        result.to_csv(output / f"{name}.csv")
    caption = f"{figures.drivetrain_setting(study.drivetrain)} {study.measured}".rstrip()
    write_comparison(output, found)
    with reporter.step(f"{study.name}: drawing"):
        drawn = {
            name: figures.scenario_run(
                results[name],
                found[name],
                title=f"{study.name}: {figures.run_name(name)}",
                caption=caption,
            )
            for name in runs
        }
        if len(runs) > 1:
            drawn["comparison"] = figures.comparison(
                results, found, title=study.name, caption=caption
            )
        if len(runs) == 1:
            for suffix in formats:
                (output / f"comparison.{suffix}").unlink(missing_ok=True)  # from earlier runs
        for name, figure in drawn.items():
            figures.save_pictures(figure, output, name, formats)
    return found
