"""Runs side by side as an animation: the point on the creep curve, which moves with friction."""

from __future__ import annotations

import io
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from PIL import Image

from contactlib.base.quantities import Limits, checked_number
from contactlib.base.writing import write_whole
from contactlib.figures.scenario import FASTEST_RIM, IN_SI, Units, _drawn, _limits, run_name
from contactlib.figures.style import labelled, new_figure, paint, styled
from contactlib.figures.vehicle import curve_at
from contactlib.runs.result import Result
from contactlib.vehicle.wheelset import Wheelset

RATE, TRAIL = 10, 1.0  # frames in a second of the animation; its time that the path shows [s]
DPI, COLOURS = 80.0, 64  # so that four runs take about 1 MB
SECONDS = Limits(at_least=1.0, at_most=60.0)


def animate_runs(
    results: Mapping[str, Result],
    wheelset: Wheelset,
    path: str | os.PathLike[str],
    *,
    title: str = "",
    seconds: float = 12.0,
    units: Units = IN_SI,
) -> Path:
    """Write a GIF of runs of one scenario: for each its creep curve above its speeds.

    The curve is that of steady rolling at the speed and on the rails of the moment. The dot, filled
    on the rising and hollow on the falling branch, is creep force over load; a line is its path in
    the last second. Of a vehicle it is the first axle.

    Parameters
    ----------
    results, title, units
        As for `comparison`.
    wheelset : Wheelset
        Wheelset of the scenario's drivetrain.
    path : path
        File.
    seconds : float, optional
        Duration of the animation, to which that of the runs is scaled [s], from 1 to 60.
    """
    seconds = checked_number("seconds", seconds, SECONDS)
    zeta0, slowest = wheelset.element.saturation_creepage, wheelset.element.minimum_speed
    runs = _drawn([run.axle(1) for run in results.values()], "time", slowest, units)
    times = np.linspace(*_limits(runs, "time"), round(RATE * seconds))
    trail = TRAIL / seconds * float(np.ptp(times))
    signals = [
        (
            np.maximum(np.abs(run.creepage), 0.1 * zeta0),
            np.abs(run.result["creep_force"]) / run.result["axle_load"],
            units.per_speed * (run.result["speed"] + run.result["slip_velocity"]),
            units.per_speed * run.result["speed"],
        )
        for run in runs
    ]
    farthest, strongest, rim, vehicle = (
        max(float(np.nanmax(one)) for one in values) for values in zip(*signals, strict=True)
    )
    zeta = np.geomspace(0.1 * zeta0, max(2.0 * farthest, 20.0 * zeta0), 300)
    look: dict[str, Any] = {"animated": True}
    with styled({"figure.dpi": DPI}):
        shape: dict[str, Any] = {"nrows": 2, "ncols": len(runs), "squeeze": False}
        figure, grid = new_figure(3.0 * len(runs), 5.0, sharex="row", sharey="row", **shape)
        for (upper, lower), name in zip(grid.T, results, strict=True):
            upper.plot([], [], color=paint.blue, label="creep curve", **look)
            upper.plot([], [], color=paint.grey, lw=1.0, **look)
            upper.plot([], [], "o", ms=7, color=paint.ink, **look)
            lower.plot([], [], color=paint.orange, lw=1.5, label="wheel rim", **look)
            lower.plot([], [], color=paint.ink, lw=1.3, label="vehicle", **look)
            labelled(upper, "creepage", title=run_name(name), log="x", steps=(1.0,))
            labelled(lower, "time  [s]", xlim=(times[0], times[-1]))
        upper.set(xlim=(zeta[0], zeta[-1]), ylim=(0.0, 1.1 * strongest))
        lower.set(ylim=(0.0, 1.1 * min(rim, FASTEST_RIM * vehicle)))
        labelled(grid[0, 0], y="traction coefficient")
        labelled(grid[1, 0], y=f"speed  [{units.speed}]")
        handles = [*upper.lines[:1], *lower.lines]
        figure.legend(handles=handles, loc="outside lower left", ncols=3)
        figure.suptitle(title.replace("$", r"\$"), x=0.01, ha="left")
        canvas: Any = FigureCanvasAgg(figure)
        canvas.draw()
        still, frames = canvas.copy_from_bbox(figure.bbox), []
        for time in times:
            canvas.restore_region(still)
            for column, run, (x, y, *speeds) in zip(grid.T, runs, signals, strict=True):
                end = int(np.searchsorted(run.at, time, side="right"))
                past = slice(int(np.searchsorted(run.at, time - trail)), end)
                curve, trace, dot, *lines = (line for axes in column for line in axes.lines)
                curve.set_data(zeta, curve_at(wheelset, run.result, end - 1, zeta))
                trace.set_data(x[past], y[past])
                dot.set_data(x[end - 1 : end], y[end - 1 : end])
                falls = run.result["falling_branch"][end - 1] > 0.0
                dot.set_markerfacecolor(paint.paper if falls else paint.ink)
                for line, values in zip(lines, speeds, strict=True):
                    line.set_data(run.at[:end], values[:end])
                for line in (curve, trace, dot, *lines):
                    line.axes.draw_artist(line)
            picture = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")
            frames.append(picture.quantize(COLOURS))
    file = io.BytesIO()
    timing: dict[str, Any] = {"duration": 1000 // RATE, "loop": 0}
    frames[0].save(file, "GIF", save_all=True, append_images=frames[1:], **timing)
    return write_whole(path, file.getvalue())
