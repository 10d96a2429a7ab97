"""A measured creep curve, smoothed to a curve with one peak.

The curve is q = S(u), u = x/(1 + x), x = zeta/zeta0: a cubic B-spline on equal cells from zero to
the largest measured creepage. Its coefficients increase up to one of them and decrease after it. A
B-spline changes direction no more often than its coefficients do, so the curve has one peak for any
scatter. The coefficients minimize

    mean (S(u_i) - mu_i)**2 + smoothing cells**3 sum (second difference of the coefficients)**2,

which for a smooth curve is the mean square error plus smoothing times the integral of S''**2, with
u over its largest value. The sum continues with a constant after the last coefficient, which equals
the one before: beyond the points the curve levels off within one cell, by a sixth of its last
change from coefficient to coefficient, and stays at that level. For a given place of the maximum
coefficient this is least squares in the coefficients' differences, each with a given sign; the fit
chooses the best place.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import BSpline, PPoly
from scipy.optimize import lsq_linear

from contactlib.base.quantities import (
    FINITE,
    POSITIVE,
    FloatArray,
    Limits,
    checked,
    checked_number,
    checked_whole,
    warn,
)
from contactlib.laws.contact_law import Peak
from contactlib.laws.data_doubts import doubts_of
from contactlib.laws.traction_data import TractionData
from contactlib.laws.zero_offset import FEW, carter_scale

CELLS = Limits(at_least=2, at_most=128)
SMOOTHING = Limits(above=0.0, at_most=1e9)
# A point is an outlier if its distance from the curve through the others exceeds these fractions of
# the maximum traction coefficient and of the scatter. Fewer points do not determine the scatter.
ASTRAY, SCATTERS = 0.1, 8.0
RISING = 0.005  # of a curve that has no peak yet, in its last cell


@dataclass(frozen=True, eq=False, init=False)
class MeasuredCurve:
    """A creep force law made from measured points.

    Parameters
    ----------
    creepage : array_like
        zeta [1], one number per point. Points of negative creepage are mirrored, as the curve is
        odd.
    traction_coefficient : array_like
        Q/P [1], one number per point.
    kinetic : float, optional
        f_d, the traction coefficient at a traction ratio of 1 [1]. Default: that of the curve at
        the largest measured creepage.
    saturation_creepage : float, optional
        zeta0, the creepage at a normalized creepage of 1, at most a million times more or less than
        the largest measured one [1]. Default: that of Carter's law (k_hat
        is zero) fitted to the points.
    cells : int
        Number of the spline's cells, from 2 to 128.
    smoothing : float
        Weight of the curve's bending relative to its mean square residual [1], above zero and at
        most 1e9.
    speed : array_like, optional
        Running speed [m/s], one number per point or one for all. The curve is one for all speeds:
        they serve only to doubt points that are curves of several speeds.
    name : str
        Name of the points in `summary` and warnings.

    Attributes
    ----------
    kinetic, saturation_creepage : float
        The two scales: ``traction_ratio(x) * kinetic`` over ``x * saturation_creepage`` is the
        measured curve, `traction_coefficient`.
    summary : str
        Number and range of the points, fit residual, and level beyond the points.
    points : TractionData
        The points, with all creepages above zero.

    Raises
    ------
    ValueError
        If a number is out of its range, fewer than four points have a creepage, a point's traction
        coefficient and creepage are of opposite sign, or the curve is not above zero at the largest
        creepage and beyond.

    Warns
    -----
    InputWarning
        If the points do not run through zero, one of them is an outlier, the residuals are
        systematic by side, by speed or by place in the file, or the points end before the peak.

    Notes
    -----
    Curvature is continuous for x > 0. The default `smoothing` was chosen on the 151 points of
    models/eurosprinter_engel1998.csv by tenfold cross-validation: up to this value the root mean
    square error of the prediction is 0.0257 (that of the fit is 0.0244), ten times this value gives
    1 % more and a hundred times 4 % more. Below the smallest measured creepage only the smoothing
    determines the curve. Beyond the largest it levels off at once: it neither falls to zero nor
    rises to a peak that was not measured.

    Examples
    --------
    >>> zeta = np.linspace(0.0, 0.1, 41)
    >>> curve = MeasuredCurve(zeta, 0.3 * np.tanh(zeta / 0.01) * np.exp(-zeta / 0.2))
    >>> round(curve.traction_coefficient(0.02).item(), 2)
    0.26
    """

    kinetic: float
    saturation_creepage: float
    summary: str
    points: TractionData = field(repr=False)
    _curve: PPoly = field(repr=False)

    def __init__(
        self,
        creepage: ArrayLike,
        traction_coefficient: ArrayLike,
        *,
        kinetic: float | None = None,
        saturation_creepage: float | None = None,
        cells: int = 16,
        smoothing: float = 1e-7,
        speed: ArrayLike | None = None,
        name: str = "measured points",
    ) -> None:
        data = TractionData(creepage, traction_coefficient, speed)
        smoothing = checked_number("MeasuredCurve.smoothing", smoothing, SMOOTHING)
        number = checked_whole("MeasuredCurve.cells", cells, CELLS)
        points = data.mirrored()  # without those at zero: the curve passes it by itself
        zeta, mu = points.creepage, points.traction_coefficient
        if zeta.size < 4:
            raise ValueError("MeasuredCurve needs at least 4 points with a creepage")
        scale = carter_scale(zeta, mu) if saturation_creepage is None else saturation_creepage
        last = float(zeta.max())
        limits = Limits(at_least=1e-6 * last, at_most=1e6 * last, given=("creepage", last))
        scale = checked_number("MeasuredCurve.saturation_creepage", scale, limits)
        u = zeta / (zeta + scale)
        curve = _smooth(u, mu, number, smoothing)
        end = float(curve(min(1.0, curve.x[-1])))
        if end <= 0.0:
            raise ValueError(
                f"the curve would not stay above zero beyond the points, which end at "
                f"{mu[zeta.argmax()]:.4g} at {100 * last:.4g} %"
            )
        level = float(curve(u.max())) if kinetic is None else kinetic
        level = checked_number("MeasuredCurve.kinetic", level, POSITIVE)
        fitted = curve(u)
        miss = np.abs(fitted - mu)
        summary = (
            f"{name}: {data.creepage.size} points, {100 * np.abs(data.creepage).min():.4g} to "
            f"{100 * last:.4g} %; the curve differs by at most {miss.max():.2g} (at "
            f"{100 * zeta[miss.argmax()]:.4g} %), rms {np.sqrt(np.mean(miss**2)):.2g}; beyond "
            f"{100 * last:.4g} % it levels off at {end:.4g}"
        )
        if data.speed is not None:
            summary += (
                f"; the speeds, {data.speed.min():.4g} to {data.speed.max():.4g} m/s, do not "
                "enter it"
            )
        stray, off = None, 0.0
        if miss.max() > 0.2 * ASTRAY * np.abs(mu).max() and zeta.size >= FEW:
            stray, off = _stray(u, mu, miss, number, smoothing)

        def residual(data: TractionData) -> FloatArray:
            size = np.abs(data.creepage)
            part, side = size / (size + scale), np.where(data.creepage < 0.0, -1.0, 1.0)
            ratio = side * data.traction_coefficient
            return np.asarray(side * (ratio - _smooth(part, ratio, number, smoothing)(part)))

        doubts = doubts_of(data, residual, stray)
        if stray is not None and not doubts:
            doubts = [
                f"the point of {mu[stray]:.4g} at {100 * zeta[stray]:.4g} % is {off:.2g} off the "
                "curve through the others; is it a typing error?"
            ]
        for text in doubts:
            warn(f"{name}: {text}")
        if end - curve(u.max() * (1.0 - 1.0 / number)) > RISING * end:
            warn(
                f"{name}: the points still rise at {100 * last:.4g} %, the last of them: the curve "
                f"has no peak and levels off at {end:.4g}"
            )
        with np.errstate(over="ignore"):
            curve.c /= level
        if not np.isfinite(curve.c).all():
            raise ValueError(
                f"MeasuredCurve.kinetic = {level!r} is too small for a traction coefficient of "
                f"{np.abs(mu).max():g}"
            )
        object.__setattr__(self, "saturation_creepage", scale)
        object.__setattr__(self, "kinetic", level)
        object.__setattr__(self, "summary", summary)
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "_curve", curve)

    @classmethod
    def from_csv(
        cls,
        path: str | os.PathLike[str],
        *,
        columns: Sequence[str | int] | None = None,
        creepage_unit: str | None = None,
        load: float | None = None,
        **options: Any,
    ) -> MeasuredCurve:
        """Smooth the points of a CSV file as `contactlib.TractionData.from_csv` reads it.

        Parameters
        ----------
        path : path
            The file.
        columns, creepage_unit, load : optional
            As for `contactlib.TractionData.from_csv`.
        **options
            Keywords of `MeasuredCurve`. Default of `name`: that of the file.

        Raises
        ------
        ValueError
            If the file or its points are not valid; the message names the file.
        OSError
            If the file cannot be read.
        """
        data = TractionData.from_csv(path, columns=columns, creepage_unit=creepage_unit, load=load)
        try:
            return cls(
                data.creepage,
                data.traction_coefficient,
                speed=data.speed,
                **{"name": Path(path).name, **options},
            )
        except ValueError as error:
            raise ValueError(f"{os.fspath(path)}: {error}") from None

    def traction_ratio(self, normalized_creepage: ArrayLike) -> FloatArray:
        """Traction ratio q at x, for any shape of finite x; odd in x.

        Raises
        ------
        ValueError
            If a creepage is not a finite real number.
        """
        x = checked("normalized_creepage", normalized_creepage, FINITE)
        return np.asarray(np.sign(x) * self._at(np.abs(x) / (1.0 + np.abs(x))))

    def slope(self, normalized_creepage: ArrayLike) -> FloatArray:
        """Slope dq/dx at x, for any shape of finite x; even in x.

        Raises
        ------
        ValueError
            If a creepage is not a finite real number.
        """
        x = np.abs(checked("normalized_creepage", normalized_creepage, FINITE))
        with np.errstate(over="ignore"):
            return np.asarray(self._at(x / (1.0 + x), 1) / (1.0 + x) ** 2)

    def _at(self, u: FloatArray, derivative: int = 0) -> FloatArray:
        """S, or its derivative, which is zero where the spline has levelled off."""
        return np.asarray(self._curve(np.minimum(u, self._curve.x[-1]), derivative))

    def traction_coefficient(self, creepage: ArrayLike) -> FloatArray:
        """Traction coefficient Q/P at creepages [1], for any shape; odd in the creepage.

        Raises
        ------
        ValueError
            If a creepage is not a finite real number.
        """
        zeta = checked("creepage", creepage, FINITE)
        part = np.abs(zeta) / (np.abs(zeta) + self.saturation_creepage)
        return np.asarray(np.sign(zeta) * self.kinetic * self._at(part))

    @property
    def scales(self) -> dict[str, float]:
        """Parameters of the curve in its table: peak, kinetic coefficient and zeta0."""
        peak = self.kinetic * max(1.0, self.peak.traction_ratio)
        return {"peak": peak, "kinetic": self.kinetic, "zeta0": self.saturation_creepage}

    @cached_property
    def peak(self) -> Peak:
        """Maximum of the curve; at infinite creepage if it never falls."""
        stationary = self._curve.derivative().roots(extrapolate=False)
        u = np.append(1.0, stationary[np.isfinite(stationary) & (stationary < 1.0)])
        values = self._at(u)
        values[1:] -= 1e-9 * values[0]  # rounding where it has levelled off is no peak
        top = float(u[np.argmax(values)])
        x = top / (1.0 - top) if top < 1.0 else np.inf
        return Peak(float(x), float(self._at(np.array(top))))


def _smooth(u: FloatArray, mu: FloatArray, cells: int, smoothing: float) -> PPoly:
    """The spline S(u) of the module's docstring, in powers of u on each cell and the one beyond."""
    knots = np.arange(-3, cells + 5) * (u.max() / cells)
    # The coefficients c are sums of their differences d; S(0) = 0 sets c[1] = (d[0] - d[1])/6. The
    # difference of the last two that the points touch, and of those beyond, is zero.
    sums = np.tri(cells + 4, cells + 1, -1)
    origin = np.zeros(cells + 1)
    origin[:2] = np.array([1.0, -1.0]) / 6.0
    coefficients = sums - sums[1] + origin
    points = BSpline.design_matrix(u, knots, 3).toarray() @ coefficients / np.sqrt(len(mu))
    bends = np.sqrt(smoothing * cells**3) * (np.eye(cells + 1, k=1) - np.eye(cells + 1))
    system = np.vstack([points, bends])
    target = np.concatenate([mu / np.sqrt(len(mu)), np.zeros(cells + 1)])
    rises = np.tri(cells + 2, cells + 1, -1, dtype=bool)
    best = min(
        (
            lsq_linear(
                system,
                target,
                bounds=(np.where(up, 0.0, -np.inf), np.where(up, np.inf, 0.0)),
                method="bvls",
            )
            for up in rises
        ),
        key=lambda solution: solution.cost,
    )
    curve = PPoly.from_spline((knots, coefficients @ best.x, 3))
    inside = PPoly(curve.c[:, 3:-3], curve.x[3:-3])
    inside.c[3, 0] = 0.0  # it is zero up to rounding
    return inside


def _stray(
    u: FloatArray, mu: FloatArray, miss: FloatArray, cells: int, smoothing: float
) -> tuple[int | None, float]:
    """The outlier, if any, and its distance from the curve through the other points."""
    candidates = []
    for i in np.argsort(miss)[-3:].tolist():  # the curve may miss its neighbours by more
        rest = np.delete(u, i), np.delete(mu, i)
        curve = _smooth(*rest, cells, smoothing)
        scatter = float(np.sqrt(np.mean((curve(rest[0]) - rest[1]) ** 2)))
        candidates.append((scatter, i, abs(float(curve(min(u[i], curve.x[-1]))) - float(mu[i]))))
    scatter, i, off = min(candidates)
    return (i if off > max(SCATTERS * scatter, ASTRAY * np.abs(mu).max()) else None), off
