"""Axles of a run on the creep curve. Lines are as in `contactlib.figures.scenario`."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from contactlib.base.quantities import FloatArray
from contactlib.figures.scenario import (
    _drawn,
    _label_first,
    _legend,
    keys,
)
from contactlib.figures.style import (
    by_stability,
    labelled,
    new_columns,
    paint,
    styled,
)
from contactlib.runs.result import Result
from contactlib.vehicle.wheelset import Wheelset

AT_THE_END = "at the end, or before standstill"
CELLS, JUMP = 50.0, 0.12  # cells of each axis; part of it that one row of a path may pass [1]


def vehicle_creep_curve(
    result: Result,
    wheelset: Wheelset,
    *,
    title: str,
    caption: str,
    minimum_speed: float = 0.0,
) -> Figure:
    """Creep force over load against creepage of each axle: its path through the run, and the curve.

    The curves are those of the rails with the highest and the lowest friction that the axle meets,
    under the nominal load, at the highest speed there. A dot is at the end of the run, or where the
    vehicle becomes slower than the contact's minimum speed: nothing is drawn below it. A jump from
    row to row interrupts a path, and one that often passes the same places is thin. The axis of the
    creepages is logarithmic if a wheel slips away.

    Parameters
    ----------
    result, title, caption, minimum_speed
        As for `scenario_run`; the minimum speed is at least the contact's.
    wheelset : Wheelset
        Wheelset of the scenario's drivetrain.
    """
    runs = _drawn(result.by_axle, "time", max(minimum_speed, wheelset.element.minimum_speed))
    zeta0 = wheelset.element.saturation_creepage
    creepages = np.abs([run.creepage for run in runs])
    largest = float(np.fmax.reduce(creepages, axis=None, initial=0.0))  # nan does not count
    wide = largest > 10.0 * zeta0
    near, far = 0.1 * zeta0 * wide, max((2.0 if wide else 1.1) * largest, 2.0 * zeta0)
    zeta = np.geomspace(near, far, 600) if wide else np.linspace(near, far, 600)
    grey: dict[str, Any] = {"color": paint.grey, "lw": 1.0}
    end: dict[str, Any] = {"color": paint.ink, "marker": "o", "ms": 5, "ls": "none", "zorder": 5}
    with styled():
        figure, grid = new_columns(len(runs), 1, low=False, below=1.0)
        for number, (run, axes) in enumerate(zip(runs, grid[0], strict=True)):
            for curve in _best_and_worst(wheelset, run.result, zeta):
                axes.plot(zeta, curve, **grey)
            ratio = run.result["creep_force"] / np.maximum(run.result["axle_load"], 1.0)
            at, path = np.abs(run.creepage), np.sign(run.creepage) * ratio
            last = np.flatnonzero(np.isfinite(at))[-1:]
            across = np.log(np.maximum(at, near) / near) / np.log(far / near) if wide else at / far
            smooth, width = _drawn_path(np.stack([across, path / np.abs(ratio).max(initial=1e-9)]))
            rises = run.result["falling_branch"] == 0.0
            by_stability(axes, at, np.where(smooth, path, np.nan), rises, lw=width)
            axes.plot(at[last], path[last], **end)
            names = "creepage", "traction coefficient", f"axle {number + 1}"
            labelled(axes, *names, log="x" * wide, steps=(1.0,), xlim=(near, far))
        grid[0, 0].set_ylim(0.0)
        _label_first(figure)
        met = Line2D([], [], label="steady, on the best and the worst rails met", **grey)
        _legend(figure, (), caption, (*keys()[:2], met, Line2D([], [], label=AT_THE_END, **end)))
        figure.suptitle(title.replace("$", r"\$"), x=0.01, ha="left")
    return figure


def _drawn_path(places: FloatArray) -> tuple[NDArray[np.bool_], float]:
    """Rows of a path that its rows resolve, and the width of its line, which passes make thinner.

    `places` are those across and up, from 0 to 1.
    """
    steps = np.abs(np.diff(places, axis=1, prepend=places[:, :1]))
    cells = np.floor(CELLS * places[:, np.isfinite(places[0])])
    entries = np.count_nonzero(np.diff(cells, axis=1).any(axis=0))
    again = entries / max(np.unique(cells, axis=1).shape[1], 1)
    return np.asarray((steps <= JUMP).all(axis=0)), 1.4 / min(max(again, 1.0), 10.0) ** 0.5


def _best_and_worst(wheelset: Wheelset, result: Result, zeta: FloatArray) -> Iterator[FloatArray]:
    """Creep curves on the rails with the highest and the lowest friction, at the speed there."""
    friction = 0.5 * (result["friction_scale_left"] + result["friction_scale_right"])
    for scale in sorted({friction.max(), friction.min()}):
        rows = np.flatnonzero(friction == scale)
        row = rows[np.abs(result["speed"][rows]).argmax()]
        yield curve_at(wheelset, result, row, zeta)


def curve_at(wheelset: Wheelset, result: Result, row: int, zeta: FloatArray) -> FloatArray:
    """Steady traction coefficient at the speed and on the rails of a row of an axle's result."""
    element = wheelset.with_slope(float(result["slope_scale"][row])).element
    friction = 0.5 * (result["friction_scale_left"][row] + result["friction_scale_right"][row])
    speed = max(abs(float(result["speed"][row])), element.minimum_speed)
    return element.at_creepage(zeta, speed=speed, friction_scale=friction)["traction_coefficient"]
