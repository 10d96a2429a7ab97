"""The creepage at which measured points run through zero.

A creep curve is odd and nearly straight at zero. It is taken as a Gaussian process: q = b u + w(u),
u = x/(1 + x), x = |zeta - d|/zeta0, with a flat prior of the slope b and w''(u) white noise that
grows in proportion to u, so that the curve is the straighter the closer it is to zero. The
restricted likelihood, at its maximum over the variances of this noise and of the points' scatter,
tells how well a zero offset d explains the points. It needs no form of the law, and states by how
much more probable one explanation is than another: an offset, or an error of a single point.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import minimize_scalar

from contactlib.base.quantities import FloatArray

FEW = 10  # points; fewer determine neither an offset nor the scatter
NEAR = 3.0  # farthest point that counts, over zeta0
BINS = 150  # means of neighbouring points replace more points than that
EVIDENCE = 10.0  # twice the logarithm of the ratio of likelihoods
OFFSET = 0.05  # smallest offset that is doubted, over zeta0: less hardly matters
PLACES = np.linspace(-0.6, 0.6, 81)  # of the zero that are tried, over zeta0
SCATTER = 10.0 ** np.arange(-7.0, 0.1, 0.5)[:, None]  # variance of the points over the process's
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
    deviance = degrees * np.log(variance) + np.log(d).sum(axis=1) + np.log(information)
    return float(deviance.min())


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
    if np.count_nonzero(moved) < FEW or not traction.any():
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
