"""What measured points let doubt: the zero of their creepage, and whether they are one curve.

A creep curve is odd and nearly straight at zero. It is taken as a Gaussian process: q = b u + w(u),
u = x/(1 + x), x = |zeta - d|/zeta0, with a flat prior of the slope b and w''(u) white noise that
grows in proportion to u, so that the curve is the straighter the closer it is to zero. The
restricted likelihood, at its maximum over the variances of this noise and of the points' scatter,
tells how well a zero offset d explains the points. It needs no form of the law, and states by how
much more probable one explanation is than another: an offset, or an error of a single point.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from contactlib.base.quantities import FloatArray

if TYPE_CHECKING:
    from contactlib.laws.traction_data import TractionData

FEW = 10  # points; fewer determine neither an offset nor the scatter
NEAR = 3.0  # farthest point that counts, over zeta0
BINS = 150  # means of neighbouring points replace more points than that
EVIDENCE = 10.0  # twice the logarithm of the ratio of likelihoods
OFFSET = 0.05  # smallest offset that is doubted, over zeta0: less changes the slope by less
PLACES = np.linspace(-0.6, 0.6, 81)  # of the zero that are tried, over zeta0
SCATTER = 10.0 ** np.arange(-7.0, 0.1, 0.5)[:, None]  # variance of the points over the process's
APART = 0.03  # root mean square of a systematic residual, over the largest traction coefficient
F_RATIO = 12.0  # of its two coefficients: probability of some 1e-5 by chance, for 20 points
GROUP = 4  # points


def unlikelihood(creepage: FloatArray, traction: FloatArray, scale: float, offset: float) -> float:
    """-2 ln of the restricted likelihood of points whose zero is at `offset`."""
    x = np.abs(creepage - offset) / scale
    u = x / (1.0 + x)
    q = traction * np.sign(creepage - offset) / np.abs(traction).max()
    least = np.minimum.outer(u, u)
    product, total = np.multiply.outer(u, u), np.add.outer(u, u)
    kernel = least**3 * (product / 3.0 - total * least / 4.0 + least**2 / 5.0)
    variances, directions = np.linalg.eigh(kernel)
    u, q = u @ directions, q @ directions
    d = np.maximum(variances, 0.0) + SCATTER  # a row for each ratio of the variances
    information = (u * u / d).sum(axis=1)
    rest = q - np.multiply.outer((u * q / d).sum(axis=1) / information, u)
    degrees = q.size - 1
    variance = np.maximum((rest * rest / d).sum(axis=1) / degrees, 1e-30)
    found = degrees * np.log(variance) + np.log(d).sum(axis=1) + np.log(information)
    return float(found.min())


def carter_scale(creepage: FloatArray, traction: FloatArray) -> float:
    """Saturation creepage of the best Carter law among 200 within the range of points above 0."""
    candidates = np.geomspace(creepage.min(), creepage.max(), 200)
    q = 1.0 - np.maximum(1.0 - creepage / candidates[:, None], 0.0) ** 2
    explained = (q @ traction) ** 2 / (q * q).sum(axis=1)  # with the best friction for each
    return float(candidates[np.argmax(explained)])


def zero_offset(
    creepage: FloatArray, traction: FloatArray, suspect: int | None = None
) -> float | None:
    """Creepage [1] at which the points run through zero, if that is not zero, beyond doubt.

    Parameters
    ----------
    creepage, traction : ndarray
        The points [1], of either sign.
    suspect : int, optional
        A point whose error could explain them as well: then the better explanation counts.
    """
    moved = creepage != 0.0
    if np.count_nonzero(moved) < FEW:
        return None
    scale = carter_scale(np.abs(creepage[moved]), (traction * np.sign(creepage))[moved])
    place = np.flatnonzero(np.abs(creepage) <= NEAR * scale)
    if place.size < GROUP:
        return None
    zeta, mu = creepage[place], traction[place]
    if place.size > BINS:
        parts = np.array_split(np.argsort(zeta), BINS)
        zeta, mu = (np.array([row[part].mean() for part in parts]) for row in (zeta, mu))

    def against(offset: float) -> float:
        return unlikelihood(zeta, mu, scale, offset * scale)

    best, step = min(PLACES.tolist(), key=against), float(PLACES[1] - PLACES[0])
    within = best - step, best + step
    best = float(minimize_scalar(against, bounds=within, options={"xatol": 1e-3}).x)
    small = abs(best) < OFFSET and suspect is None  # which explains a point that is off, however
    if small or against(0.0) - against(best) < EVIDENCE:
        return None
    if suspect in place and place.size <= BINS:
        others = place != suspect
        rest = zeta[others], mu[others]
        if unlikelihood(*rest, scale, 0.0) < against(best):
            return None
    return best * scale


def shift_of(offset: float) -> str:
    """Sentence on points that run through zero at another creepage [1]."""
    sign, by = ("subtract", "from") if offset > 0.0 else ("add", "to")
    return (
        f"the points do not run through zero: their traction vanishes at a creepage of "
        f"{100 * offset:.2g} %; does the wheel's diameter have an error? to remove this offset, "
        f"{sign} {100 * abs(offset):.2g} % {by} every creepage"
    )


def doubts_of(
    data: TractionData, residual: Callable[[TractionData], FloatArray], suspect: int | None = None
) -> list[str]:
    """A sentence on each doubt of points: their offset, and whether they are one curve.

    Parameters
    ----------
    data : TractionData
        The points.
    residual : callable
        Residuals of the curve through given points: measured less fitted traction coefficient [1].
    suspect : int, optional
        As for `zero_offset`.
    """
    offset, several = zero_offset(data.creepage, data.traction_coefficient, suspect), None
    for _ in range(2):  # curves that differ by side also look like an offset
        shifted = data if offset is None else data.shifted(-offset)
        several = systematic_residual(shifted, residual(shifted))
        if offset is None or several is None:
            break
        offset = zero_offset(data.creepage, data.traction_coefficient / several[1], suspect)
    found = [] if offset is None else [shift_of(offset)]
    return found if several is None else [*found, several[0]]


def systematic_residual(data: TractionData, residual: FloatArray) -> tuple[str, FloatArray] | None:
    """Sentence on points that are several curves: by side, by speed, or by place in the file.

    With it comes the factor of each point's curve on the common one.

    Parameters
    ----------
    data : TractionData
        The points.
    residual : ndarray
        Their traction coefficient less that of the curve [1].
    """
    creepage, speed, side = data.creepage, data.speed, np.where(data.creepage < 0.0, -1.0, 1.0)
    residual = side * residual
    fitted = side * data.traction_coefficient - residual
    kinds = [(creepage < 0.0, "in traction", "in braking", "keep the rows of one side")]
    if speed is not None and speed.min() < speed.max():
        fast = speed > np.sqrt(speed.min() * speed.max())
        of_speed = "keep the rows of one speed, or fit a law whose friction falls with slip speed"
        kinds.append((fast, _at(speed[~fast]), _at(speed[fast]), of_speed))
    later = np.arange(creepage.size) >= creepage.size // 2
    halves = "of the first half of the rows", "of the second half", "keep the rows of one curve"
    kinds.append((later, *halves))
    for second, one, other, remedy in kinds:
        off = _apart(np.abs(creepage), fitted, residual, second)
        if off is not None:
            text = (
                f"the residuals are systematic: the points {one} are on average "
                f"{100 * off[0]:+.2g} % off the curve, those {other} {100 * off[1]:+.2g} %; are "
                f"they one curve? if not, {remedy}"
            )
            return text, 1.0 + np.where(second, off[1], off[0])
    return None


def _at(speed: FloatArray) -> str:
    low, high = f"{speed.min():.3g}", f"{speed.max():.3g}"
    return f"at {low} m/s" if low == high else f"at {low} to {high} m/s"


def _apart(
    creepage: FloatArray, fitted: FloatArray, residual: FloatArray, second: NDArray[np.bool_]
) -> tuple[float, float] | None:
    """Mean residuals of two groups over the curve, if the groups are apart where both are."""
    groups = ~second, second
    if min(int(group.sum()) for group in groups) < GROUP:
        return None
    low = max(float(creepage[group].min()) for group in groups)
    high = min(float(creepage[group].max()) for group in groups)
    both = (creepage >= low) & (creepage <= high)
    if min(int((group & both).sum()) for group in groups) < GROUP:
        return None
    q, r = fitted[both], residual[both]
    sign = np.where(second[both], -1.0, 1.0)
    place = np.log(np.maximum(creepage[both], 1e-3 * creepage.max()))
    place = (place - place.mean()) / (place.std() or 1.0)
    shape = np.column_stack([sign * q, sign * q * place])
    explained = shape @ np.linalg.lstsq(shape, r)[0]
    between, within = float(np.sum(explained**2)), float(np.sum((r - explained) ** 2))
    degrees = max(r.size - 2, 1)
    if np.sqrt(between / r.size) < APART * np.abs(fitted).max():
        return None
    if between / 2.0 < F_RATIO * within / degrees:
        return None
    means = [float(np.sum((r * q)[part]) / np.sum((q * q)[part])) for part in (sign > 0, sign < 0)]
    return means[0], means[1]
