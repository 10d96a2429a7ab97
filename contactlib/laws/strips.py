"""Kalker's strip theory: an elliptic contact as line contacts side by side.

Source: Ciavarella, Romano & Barber, "Rolling of a cylinder with slip-dependent friction: the
Carter solution revisited", Sec. 4. A strip at eta has the relative width w = sqrt(1 - eta**2) and
is a line contact with x/w and k_hat/w in place of x and k_hat. Its Eq. (23),

    x = w m + k_hat t,    m = t**4/(1 + t**4),    s = 1 - m,

is solved for the width instead of t: w = (x - k_hat t)/m needs no iteration. So the sums of
Eq. (24) are taken over ln(t), from the strip in the middle (w = 1) to the rim (w = 0, k_hat t =
x), by the double-exponential rule, which is at home with the square root at the middle and with
the thin layers of a small k_hat at either end.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np

from contactlib.laws.line import Split
from contactlib.parameters import FloatArray

NODES = 192  # gives every digit for k_hat >= SMALLEST_K_HAT
SMALLEST_K_HAT = 1e-12  # below it, Coulomb friction is nearer than 2e-12
NOTHING = 1e-100  # share of stick or slip that no digit knows of


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
        At least `SMALLEST_K_HAT`.
    middle : Split
        The strip in the middle, (n,).
    rim : tuple of float and Split, optional
        Relative half-width and state of the narrowest strip to count; all strips if left out.
    """
    m1, s1, _ = middle
    mixed = (m1 > NOTHING) & (s1 > NOTHING)  # else all strips only stick, or only slip
    ratio = np.where(m1 > NOTHING, 1.0, 0.75 * np.pi * np.minimum(x, 1.0))
    slope = np.where(m1 > NOTHING, 0.0, 0.75 * np.pi)
    m1, s1, y1, x = (v[mixed, np.newaxis] for v in (*middle, x))
    rule = double_exponential(NODES, 3.85, 3.1)  # longer where the square root is: at the middle
    # m of the last strip, in units of the middle one's; at no width k_hat t = x.
    last = np.zeros_like(x) if rim is None else rim[0] * rim[1].m[mixed, np.newaxis]
    span = np.log1p((m1 - last) / y1)  # of ln(t)
    grown = np.expm1(span * rule.from_start)
    fourth = m1 / s1 * (1.0 + grown) ** 4  # t**4
    m, s = fourth / (1.0 + fourth), 1.0 / (1.0 + fourth)
    y = y1 * (1.0 + grown)
    left = last - (x - last) * np.expm1(-span * rule.from_end)  # x - k_hat t
    w = left / m  # Eq. (23)
    # 1 - w in positive terms, as it vanishes at the middle.
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
