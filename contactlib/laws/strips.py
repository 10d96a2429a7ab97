"""The Carter-Griffith law of a line contact, and the ellipse as line contacts side by side.

Source: Ciavarella, Romano & Barber, "Rolling of a cylinder with slip-dependent friction: the
Carter solution revisited". With m = (1 + c/a)/2 and t = (m/(1 - m))**(1/4), their Eqs. (18) and
(19) become, for s = 1 - m = 1/(1 + t**4) and y = k_hat t,

    x = m + y,    q = m (1 + s) + 2 y s,    dq/dx = 2 s (1 - 4 m y/(y + 4 m s)),

sums of positive terms for x > 0 (except dq/dx, which changes sign at the peak), so no digit is lost
from x = 1e-12 to the far tail. x grows strictly with t: there is one root, found in ln(t).

An ellipse is Kalker's strip theory, Sec. 4. A strip at eta has the relative width
w = sqrt(1 - eta**2) and is a line contact with x/w and k_hat/w in place of x and k_hat. Its
Eq. (23),

    x = w m + k_hat t,    m = t**4/(1 + t**4),    s = 1 - m,

is solved for the width instead of t: w = (x - k_hat t)/m needs no iteration. So the sums of
Eq. (24) are integrals over ln(t), from the strip in the middle (w = 1) to the rim (w = 0, k_hat t =
x), by the double-exponential rule, which handles the square root at the middle and the thin layers
of a small k_hat at both ends.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np

from contactlib.base.quantities import FloatArray

MIN_X, MAX_X = 1e-100, 1e100  # x below which the law is linear; x of full slip
MIN_LINE_K_HAT = 1e-60  # below it the law equals Coulomb friction to the last digit
NODES = 192  # for full accuracy at k_hat >= MIN_ELLIPSE_K_HAT
MIN_ELLIPSE_K_HAT = 1e-12  # below it, Coulomb friction differs by less than 2e-12
NOTHING = 1e-100  # fraction of stick or slip that changes no digit


class Split(NamedTuple):
    """Stick measure m, its complement s = 1 - m, and y = k_hat t, at x = m + y."""

    m: FloatArray
    s: FloatArray
    y: FloatArray


def split_at(t: FloatArray, k_hat: float | FloatArray) -> Split:
    """Split at the parameter t > 0."""
    with np.errstate(over="ignore", divide="ignore"):
        small = t < 1.0
        power = np.where(small, t, 1.0 / t) ** 4
        m = np.where(small, power, 1.0) / (1.0 + power)
        s = np.where(small, 1.0, power) / (1.0 + power)
    return Split(m, s, k_hat * t)


def solve_split(x: FloatArray, k_hat: float | FloatArray) -> Split:
    """Solve x = m + y for x >= 0: Newton's method in ln(t), kept inside a bracket.

    `k_hat` is zero, or at least `MIN_LINE_K_HAT` with the shape of `x`.
    """
    if np.ndim(k_hat) == 0 and k_hat == 0.0:  # Carter: stick until x = 1, then y = x - 1 slides
        m = np.minimum(x, 1.0)
        return Split(m, 1.0 - m, x - m)
    linear = x < MIN_X
    given, x = x, np.clip(x, MIN_X, MAX_X)
    # x = m + y, so at the root neither exceeds x and one is at least x/2.
    with np.errstate(divide="ignore"):
        carter = np.where(x < 1.0, x / np.where(x < 1.0, 1.0 - x, 1.0), np.inf) ** 0.25
        half = np.where(x < 2.0, x / np.where(x < 2.0, 2.0 - x, 1.0), np.inf) ** 0.25
        upper = np.log(np.minimum(carter, x / k_hat))
        lower = np.log(np.maximum(np.minimum(half, x / (2.0 * k_hat)), (x - 1.0) / k_hat))
    log_t = 0.5 * (lower + upper)
    for _ in range(200):
        m, s, y = split_at(np.exp(log_t), k_hat)
        residual = (m - x) + y
        lower = np.where(residual <= 0.0, log_t, lower)
        upper = np.where(residual >= 0.0, log_t, upper)
        newton = log_t - residual / (4.0 * m * s + y)
        # A converged step may land on an end of the bracket, which counts as inside.
        inside = (newton >= lower) & (newton <= upper)
        step = np.where(inside, newton, 0.5 * (lower + upper)) - log_t
        log_t = log_t + step
        # Stop at rounding in ln(t), or in x where x hardly depends on t.
        small = np.abs(step) <= 4e-16 * np.maximum(1.0, np.abs(log_t))
        if np.all(linear | small | (np.abs(residual) <= 4e-16 * x)):
            break
    m, s, y = split_at(np.exp(log_t), k_hat)
    return Split(np.where(linear, 0.0, m), np.where(linear, 1.0, s), np.where(linear, given, y))


def line_values(split: Split) -> tuple[FloatArray, FloatArray]:
    """Traction ratio and slope of a line contact."""
    m, s, y = split
    stretch = y + 4.0 * m * s  # dx/d(ln t)
    share = np.divide(m * y, stretch, out=np.zeros_like(m), where=stretch > 0.0)
    ratio = m * (1.0 + s) + 2.0 * (y * s)  # Eq. (18)
    return np.asarray(ratio), np.asarray(2.0 * s * (1.0 - 4.0 * share))


class Rule(NamedTuple):
    """Nodes in (0, 1) by their distance from either end, and weights, each (n,)."""

    from_start: FloatArray
    from_end: FloatArray
    weight: FloatArray


@cache
def double_exponential(n: int, start: float, end: float) -> Rule:
    """Takahasi and Mori's rule on (0, 1): the trapezoidal rule in v, -start <= v <= end.

    A node is 1/(1 + exp(-pi sinh v)).
    """
    v = np.linspace(-start, end, n)
    grown = np.pi * np.sinh(v)
    from_start, from_end = 1.0 / (1.0 + np.exp(-grown)), 1.0 / (1.0 + np.exp(grown))
    weight = (v[1] - v[0]) * np.pi * np.cosh(v) * from_start * from_end
    return Rule(from_start, from_end, weight)


def griffith_ellipse(
    x: FloatArray, k_hat: float, middle: Split, rim: tuple[float, Split] | None = None
) -> tuple[FloatArray, FloatArray]:
    """Traction ratio and slope of the Carter-Griffith law on an ellipse.

    Parameters
    ----------
    x : ndarray
        Normalized creepages, above zero, (n,).
    k_hat : float
        At least `MIN_ELLIPSE_K_HAT`.
    middle : Split
        The strip in the middle, (n,).
    rim : tuple of float and Split, optional
        Relative half-width and state of the narrowest strip to include. Default: all strips.
    """
    m1, s1, _ = middle
    mixed = (m1 > NOTHING) & (s1 > NOTHING)  # else all strips only stick, or only slip
    ratio = np.where(m1 > NOTHING, 1.0, 0.75 * np.pi * np.minimum(x, 1.0))
    slope = np.where(m1 > NOTHING, 0.0, 0.75 * np.pi)
    m1, s1, y1, x = (v[mixed, np.newaxis] for v in (*middle, x))
    rule = double_exponential(NODES, 3.85, 3.1)  # longer at the middle, where the square root is
    # w m of the last strip; zero at the rim, where k_hat t = x.
    last = np.zeros_like(x) if rim is None else rim[0] * rim[1].m[mixed, np.newaxis]
    span = np.log1p((m1 - last) / y1)  # of ln(t)
    grown = np.expm1(span * rule.from_start)
    fourth = m1 / s1 * (1.0 + grown) ** 4  # t**4
    m, s = fourth / (1.0 + fourth), 1.0 / (1.0 + fourth)
    y = y1 * (1.0 + grown)
    left = last - (x - last) * np.expm1(-span * rule.from_end)  # x - k_hat t
    w = left / m  # Eq. (23)
    # 1 - w as a sum of positive terms, as it vanishes at the middle.
    shrunk = -np.expm1(-4.0 * span * rule.from_start)
    narrowing = y1 * grown + s1 / m1 * (m1 * shrunk + y1 * grown * (1.0 - shrunk))
    by_log_t = y / m + 4.0 * left / fourth  # -dw/d(ln t)
    d_eta = w * by_log_t / np.sqrt(narrowing * (1.0 + w)) * span * rule.weight
    force = w * w * m * (1.0 + s) + 2.0 * w * y * s
    ratio[mixed] = 1.5 * np.sum(force * d_eta, axis=1)  # Eq. (24)
    bend = 4.0 * m * y / (y + 4.0 * w * m * s)
    slope[mixed] = 1.5 * np.sum(2.0 * w * s * (1.0 - bend) * d_eta, axis=1)
    return ratio, slope


def carter_ellipse(x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Traction ratio and slope for Coulomb friction: strips with w > x stick in part."""
    x = np.minimum(x, 1.0)
    eta = np.sqrt((1.0 - x) * (1.0 + x))  # of the strip whose stick zone just vanishes
    angle = np.arctan2(eta, x)
    sticking = x * (eta * x + angle) - x * x * eta  # integral of 2 x w - x**2
    rest = x * x / (1.0 + eta)  # 1 - eta
    sliding = rest * rest * (1.0 - rest / 3.0)  # integral of w**2
    return 1.5 * (sticking + sliding), 1.5 * (angle - x * eta)
