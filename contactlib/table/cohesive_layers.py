"""Layers in the table of a cohesive law, from the states of line contacts.

`laws.cohesive_layer` solves all k_hat of one layer and one stick boundary together, so the tens of
thousands of states of a table take half a millisecond each. An ellipse consists of strips, line
contacts with x/w, k_hat/w and lam/w: its table is made from one of line contacts up to a larger
k_hat, beyond which friction in the narrow strips that are left hardly falls.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from scipy.interpolate import CubicSpline

from contactlib import kernel
from contactlib.base.quantities import FloatArray
from contactlib.laws import layer
from contactlib.laws.cohesive import CohesiveZone
from contactlib.laws.cohesive_layer import QUICK, Zones, solve_zones
from contactlib.laws.cohesive_zone import ConvergenceError
from contactlib.laws.friction import EXPONENTIAL
from contactlib.table.building import (
    LAYER_CELLS,
    Layers,
    Sampler,
    between_layers,
    layer_error,
    layer_table,
    spline_layers,
)

CELLS = (96, 20, 32)  # of line contacts, along u, sqrt(k_hat) and w of fmu/kernel/creep_table.h
STRIPS = 2  # largest sqrt(k_hat) of the strips over that of their ellipse
SPACING = (0.1, 0.25)  # of the states of a curve in ln t: up to 2.3, and beyond
MIN_LAYER = 1e-4  # with a thinner one a curve is that of this layer
NO_LAYER = 1e-10

Curve = Callable[[FloatArray], FloatArray]  # traction ratio over normalized creepage


def _boundaries(lam: float) -> FloatArray:
    """Stick boundaries ln t of a curve: a thin layer sticks in next to nothing where all slips."""
    last = max(4.5, 0.5 * np.log(300.0 / lam))
    return np.concatenate([np.arange(-3.2, 2.3, SPACING[0]), np.arange(2.3, last, SPACING[1])])


def _solve_curves(k_hats: FloatArray, lam: float, ratio: float) -> list[Curve]:
    """Curves of line contacts with one layer."""
    states: list[Zones] | None = None
    log_t = _boundaries(lam)
    points = np.linspace(log_t[0], log_t[-1], 800)
    solved = np.empty((2, log_t.size, k_hats.size))
    for i, v in enumerate(log_t.tolist()):
        states = solve_zones(v, k_hats, lam, ratio, EXPONENTIAL, QUICK, states)
        solved[:, i] = np.transpose([(state.creepage, state.ratio) for state in states])
    # Over those of Coulomb friction, creepage and force are smooth and level off at both ends.
    base, at = (layer.at_parameter(t, 0.0 * t, 0.0 * t + lam) for t in (log_t, points))
    log_x = CubicSpline(log_t, np.log(solved[0] / base.creepage[:, None]))(points)
    log_x += np.log(at.creepage)[:, None]
    q = CubicSpline(log_t, solved[1] / base.ratio[:, None])(points) * at.ratio[:, None]
    if not (np.diff(log_x, axis=0) > 0.0).all():
        raise ConvergenceError(
            f"creepage does not grow along the curve at layer_ratio {lam:.4g}, "
            f"static_to_kinetic {ratio:.4g}"
        )

    def value(spline: CubicSpline, x: FloatArray) -> FloatArray:
        log_x = np.log(x)
        inside = np.clip(log_x, spline.x[0], spline.x[-1])
        q, beyond = spline(inside), np.exp(log_x - inside)
        return np.asarray(
            np.where(beyond < 1.0, q * beyond, 1.0 + (q - 1.0) * np.maximum(beyond, 1.0) ** -1.5)
        )

    return [partial(value, CubicSpline(x, y)) for x, y in zip(log_x.T, q.T, strict=True)]


def _of_lines(sampler: Sampler, ratio: float, cells: tuple[int, int, int], done: float) -> Layers:
    """Layers of line contacts, with the largest error at states off the nodes."""

    def curves(k_hats: FloatArray, lam: float) -> list[Curve]:
        def clean(x: FloatArray) -> FloatArray:
            return layer.line_with_layer(x, 0.0, lam)[0]

        return [clean, *_solve_curves(k_hats[1:], lam, ratio)]

    def initial_slope(lam: float) -> float:
        return 2.0 * float(layer.full_stick(np.array(0.5 * lam))[0])

    layers = spline_layers(sampler, cells, curves, (0.0, 0.8 * done), MIN_LAYER, initial_slope)
    table, (k_hats, lams) = layer_table(sampler, layers), between_layers(sampler, layers)

    def error(lam: float) -> float:
        errors = []
        for log_t in np.linspace(-2.9, _boundaries(lam)[-1] - 0.1, 18).tolist():
            states = solve_zones(log_t, k_hats, lam, ratio, EXPONENTIAL, QUICK)
            x, q = np.transpose([(state.creepage, state.ratio) for state in states])
            errors.append(np.abs(table.traction_ratio(x, k_hats, np.array([lam])) - q).max())
        return float(max(errors))

    solved = [lam for lam in lams if lam > MIN_LAYER]
    return layers._replace(error=max(sampler.rows(error, solved, 0.8 * done, done)))


def cohesive_layers(
    contact: str, static_to_kinetic: float, progress: Callable[[float], object]
) -> Layers:
    """Layers of the law with the exponential weakening; `progress` gets the fraction done.

    Raises
    ------
    ConvergenceError
        If a state has no solution that the iteration finds, or creepage does not grow along a
        curve.
    """
    options = {"contact": contact, "static_to_kinetic": static_to_kinetic}
    sampler, strips = (Sampler(CohesiveZone, options, progress) for _ in range(2))
    if contact == "line":
        return _of_lines(sampler, static_to_kinetic, CELLS, 1.0)
    strips.k_max *= STRIPS**2
    of_lines = _of_lines(strips, static_to_kinetic, (CELLS[0], STRIPS * CELLS[1], CELLS[2]), 0.9)
    lines, max_layer = layer_table(strips, of_lines), kernel.library().MAX_LAYER_RATIO

    def line(x: FloatArray, k_hat: FloatArray, lam: FloatArray) -> tuple[FloatArray, FloatArray]:
        held = np.minimum(k_hat, strips.k_max), np.clip(lam, NO_LAYER, max_layer)
        return lines.evaluate(x, *(np.broadcast_to(v, x.shape) for v in held))

    def ellipse(k_hat: float, lam: float, x: FloatArray) -> FloatArray:
        return layer.ellipse_with_layer(x, k_hat, lam, line)[0]

    def curves(k_hats: FloatArray, lam: float) -> list[Curve]:
        return [partial(ellipse, k_hat, lam) for k_hat in k_hats.tolist()]

    def initial_slope(lam: float) -> float:
        return float(layer.ellipse_with_layer(np.zeros(1), 1.0, lam, line)[1][0])

    layers = spline_layers(sampler, LAYER_CELLS, curves, (0.9, 0.98), initial_slope=initial_slope)
    off = layer_error(sampler, layers, curves, (0.98, 1.0))
    return layers._replace(error=of_lines.error + off)
