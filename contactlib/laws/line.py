"""The Carter-Griffith law of a line contact in its own parameter.

Source: Ciavarella, Romano & Barber, "Rolling of a cylinder with slip-dependent friction: the
Carter solution revisited". With m = (1 + c/a)/2 and t = (m/(1 - m))**(1/4), their Eqs. (18) and
(19) become, for s = 1 - m = 1/(1 + t**4) and y = k_hat t,

    x = m + y,    q = m (1 + s) + 2 y s,    dq/dx = 2 s (1 - 4 m y/(y + 4 m s)),

sums of positive terms for x > 0 (but for the sign change of dq/dx at the peak), so every digit
survives from x = 1e-12 to the far tail. x grows strictly with t: one root, found in ln(t).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from contactlib.parameters import FloatArray

SMALLEST, LARGEST = 1e-100, 1e100  # x below which all is linear, and from which all slips
SMALLEST_K_HAT = 1e-60  # below it no digit differs from Coulomb friction


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

    `k_hat` is zero, or at least `SMALLEST_K_HAT` with the shape of `x`.
    """
    if (
        np.ndim(k_hat) == 0 and k_hat == 0.0
    ):  # Carter: stick until x = 1, then y = x - 1 is pure sliding
        m = np.minimum(x, 1.0)
        return Split(m, 1.0 - m, x - m)
    linear = x < SMALLEST
    given, x = x, np.clip(x, SMALLEST, LARGEST)
    # x is a sum of m and y, so at the root neither exceeds x and one is at least x/2.
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
        # A converged step may land on a bracket end: that is still inside.
        inside = (newton >= lower) & (newton <= upper)
        step = np.where(inside, newton, 0.5 * (lower + upper)) - log_t
        log_t = log_t + step
        # Rounding is reached in ln(t), or in x where x hardly depends on t.
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
