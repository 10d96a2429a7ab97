"""The report of a study: metrics, time series and figures in a folder."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Protocol

from contactlib import figures
from contactlib.comparison import comparison_table, write_comparison
from contactlib.metrics import Metrics, metrics
from contactlib.simulation import Result
from contactlib.study import Run, Study


class Reporter(Protocol):
    """Where a report shows what it does."""

    def step(self, title: str) -> AbstractContextManager[Callable[[float], object]]:
        """A step that takes time; what it yields is told the part done, from 0 to 1."""

    def line(self, text: str) -> None:
        """Show a line."""


def write_report(
    study: Study, runs: Mapping[str, Run], folder: str | os.PathLike[str], reporter: Reporter
) -> dict[str, Metrics]:
    """Run, print the metrics, and write metrics, time series and figures to a folder.

    Parameters
    ----------
    study : Study
        What is driven.
    runs : mapping
        Those of the study's runs that are wanted, by name.
    folder : path
        Made, after the runs, if it is not there. It gets metrics.txt, .csv and .json, and for each
        run a CSV file and a figure; for more than one run a figure that compares them.
    reporter : Reporter
        Where to show it.

    Returns
    -------
    dict
        Metrics by name.

    Raises
    ------
    OSError
        If the folder cannot be made or written.
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
            for suffix in ("png", "svg"):
                (output / f"comparison.{suffix}").unlink(missing_ok=True)  # of other runs
        for name, figure in drawn.items():
            figures.save_pictures(figure, output, name)
    return found
