"""Figure of controllers with sensor errors."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from contactlib.figures.scenario import run_name
from contactlib.figures.style import add_caption, labelled, new_figure, paint, sized, styled

if TYPE_CHECKING:
    import xarray as xr

MARKS = ("o", "s", "D", "^", "v", "P")
CAPTION = (
    "Force used / available force while friction limits. Marks: mean over sequences of noise; "
    "bars: minimum to maximum. Each line is one error unknown to the controllers."
)


def sensor_errors(errors: xr.DataArray) -> Figure:
    """Limited utilisation of each controller, for each error of the sensors: a panel a scenario.

    Parameters
    ----------
    errors : xarray.DataArray
        From `contactlib.runs.sensor_errors`.
    """
    scenarios, names = errors.scenario.values, errors.controller.values
    count, labels = len(names), errors.error.values
    with styled():
        size = 1.6 + 3.4 * len(scenarios), 1.6 + 0.11 * len(labels) * (count + 1)
        common: dict[str, Any] = {"sharey": True, "sharex": True, "squeeze": False}
        figure, grid = new_figure(*size, ncols=len(scenarios), **common)
        colours = [paint.grey, paint.orange, paint.blue, paint.green]
        for axes, scenario in zip(grid[0], scenarios, strict=True):
            for i, name in enumerate(names):
                case = errors.sel(scenario=scenario, controller=name)
                mean = case.mean("noise").values
                ends = np.stack([mean - case.min("noise").values, case.max("noise").values - mean])
                ends = np.maximum(ends, 0.0)  # rounding
                place = np.arange(len(labels)) + 0.7 * ((i + 0.5) / count - 0.5)
                look: dict[str, Any] = {
                    "color": colours[i % len(colours)],
                    "fmt": MARKS[i % len(MARKS)],
                }
                look |= {"ms": 4.5, "lw": 1.2, "label": run_name(name)}
                axes.errorbar(mean, place, xerr=ends, **look)
            for line in np.arange(len(labels) - 1) + 0.5:
                axes.axhline(line, color=paint.mixed(28), lw=0.8)
            axes.grid(axis="y", visible=False)
            axes.set_title(str(scenario).replace("$", r"\$"), fontsize=sized(9))
            labelled(axes, "used while friction limits  [%]")
            axes.xaxis.set_major_locator(MaxNLocator(6, steps=(1, 2, 5, 10)))
        grid[0, 0].set_yticks(range(len(labels)), labels)
        grid[0, 0].invert_yaxis()
        grid[0, 0].tick_params(axis="y", length=0)
        lines = grid[0, 0].get_legend_handles_labels()
        figure.legend(*lines, loc="outside upper left", ncols=count)
        add_caption(figure, CAPTION)
    return figure
