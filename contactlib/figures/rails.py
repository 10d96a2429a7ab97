"""Friction behind a log over the distance, and slip speeds measured and replayed."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from contactlib.figures.style import add_caption, name_lines, new_figure, paint, sized, styled
from contactlib.logs import RailsEstimate
from contactlib.runs.result import Result

KMH = 3.6


def rails_from_log(
    estimate: RailsEstimate, replayed: Result | None = None, *, title: str = "", caption: str = ""
) -> Figure:
    """Friction along the rails with its band, grey where the log tells a bound at most.

    Parameters
    ----------
    estimate : RailsEstimate
        From `contactlib.logs.estimate_rails`.
    replayed : Result, optional
        Run of the scenario on the estimated rails; its slip speeds are drawn beside the log's.
    title, caption : str, optional
        Texts above and below.
    """
    kinetic = estimate.scenario.drivetrain.wheelset.element.friction.kinetic
    place, known = estimate.place, estimate.informative
    low, median, high = (kinetic * part for part in (estimate.low, estimate.median, estimate.high))
    axles, rows = estimate.met.shape[1], estimate.rows
    radius = estimate.scenario.drivetrain.wheelset.radius
    with styled():
        look = {"height_ratios": [2.2] + [1.0] * axles}
        figure, panels = new_figure(
            9.6, 3.2 + 1.2 * axles, nrows=1 + axles, ncols=1, sharex=True, gridspec_kw=look
        )
        figure.suptitle(title.replace("$", r"\$"), x=0.01, ha="left", fontsize=sized(12))
        top = panels[0]
        top.fill_between(place, low, high, where=~known, step="mid", color=paint.mixed(28), lw=0.0)
        top.fill_between(
            place, low, high, where=known, step="mid", color=paint.blue, alpha=0.3, lw=0.0
        )
        top.plot(place, np.where(known, median, np.nan), color=paint.blue, label="_")
        largest = float(np.max(high[known])) if known.any() else float(low.max())
        top.set(ylabel="friction [1]", ylim=(0.0, 1.15 * max(largest, float(low.max()))))
        for axle, axes in enumerate(panels[1:]):
            at = rows.distance - estimate.scenario.position[axle]
            slip = KMH * (radius * rows.omega[:, axle] - rows.speed)
            axes.plot(at, slip, color=paint.orange, lw=1.4, label=f"axle {axle + 1}")
            if replayed is not None:
                one = replayed.axle(axle + 1) if replayed.axles > 1 else replayed
                there = (one["distance"] >= at[0]) & (one["distance"] <= at[-1])
                slip = KMH * one["slip_velocity"][there]
                axes.plot(one["distance"][there], slip, color=paint.blue, lw=0.9, label="replayed")
        panels[len(panels) // 2].set_ylabel("slip speed [km/h]")
        panels[-1].set_xlabel("distance [m]")
        panels[-1].set_xlim(place[0], place[-1])
        figure.align_ylabels(panels)
        add_caption(figure, caption)
        name_lines(figure)
    return figure
