"""The metrics of several runs side by side: as text, CSV and JSON."""

from __future__ import annotations

import csv
import io
import json
import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path

from contactlib.files import write_whole
from contactlib.metrics import UNITS, Metrics


def comparison_table(metrics: Mapping[str, Metrics]) -> str:
    """Text of fixed width: a line for each metric, a column for each run.

    Examples
    --------
    >>> run = Metrics(0.93, 0.02, 0.2, 0.1, 3e4, 0.013, 1.5, float("nan"), 120.0, 1e-9)
    >>> print(comparison_table({"pi": run, "open_loop": run._replace(recovery_time=float("inf"))}))
    metric                unit     pi  open_loop
    adhesion utilisation  1      0.93       0.93
    largest creepage      1      0.02       0.02
    largest slip speed    m/s     0.2        0.2
    recovery time         s       0.1      never
    slip work             J     30000      30000
    slip share            1     0.013      0.013
    jerk                  m/s3    1.5        1.5
    torsional peak        N.m       -          -
    distance              m       120        120
    energy defect         1     1e-09      1e-09
    """
    rows = [["metric", "unit", *metrics]]
    for name, unit in UNITS.items():
        values = [_shown(getattr(run, name)) for run in metrics.values()]
        rows.append([name.replace("_", " "), unit, *values])
    return fixed_width(rows)


def fixed_width(rows: Sequence[Sequence[str]]) -> str:
    """Cells in columns, of which the first two, what it is and its unit, begin on the left."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = []
    for row in rows:
        cells = [
            cell.ljust(width) if i < 2 else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append("  ".join(cells).rstrip())
    return "\n".join(lines)


def write_comparison(
    folder: str | os.PathLike[str], metrics: Mapping[str, Metrics]
) -> tuple[Path, Path, Path]:
    """Write metrics.txt, metrics.csv and metrics.json to a folder; return their paths.

    The CSV has a line for each run, numbers to full precision, "nan" and "inf". JSON knows neither:
    there what does not apply is null, and a recovery that never came is "never".

    Raises
    ------
    OSError
        If the folder cannot be written.
    """
    lines = io.StringIO()
    writer = csv.writer(lines, lineterminator="\n")
    writer.writerow(["controller", *(f"{name} [{unit}]" for name, unit in UNITS.items())])
    writer.writerows([name, *map(repr, run)] for name, run in metrics.items())
    parts = {
        name: {key: {"value": _json(value), "unit": UNITS[key]} for key, value in values.items()}
        for name, values in ((name, run._asdict()) for name, run in metrics.items())
    }
    contents = {
        "txt": comparison_table(metrics) + "\n",
        "csv": lines.getvalue(),
        "json": json.dumps(parts, indent=2, allow_nan=False) + "\n",
    }
    as_text, as_csv, as_json = (
        write_whole(Path(folder) / f"metrics.{suffix}", content.encode())
        for suffix, content in contents.items()
    )
    return as_text, as_csv, as_json


def _shown(value: float) -> str:
    if math.isnan(value):
        return "-"
    return "never" if math.isinf(value) else f"{value:.5g}"


def _json(value: float) -> float | str | None:
    if math.isnan(value):
        return None
    return "never" if math.isinf(value) else value
