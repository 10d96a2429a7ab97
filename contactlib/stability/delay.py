"""Gains that stabilise the plant g/(s - p) in a loop with delay, lag and sampling.

The smallest gain is that of the static balance, g Kp = p, for any loop. The largest is the first
at which a root reaches the imaginary axis (the unit circle if sampled). Beyond a certain delay
there is no gain between them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.optimize import brentq

from contactlib.base.quantities import (
    MODERATE,
    MODERATE_NOT_NEGATIVE,
    MODERATE_POSITIVE,
    FloatArray,
    Limits,
    checked_number,
)

RATES = Limits(at_least=-1e9, at_most=1e9)  # [1/s]
TIMES = Limits(at_least=0.0, at_most=1e6)  # [s]
NO_TIME = 1e-12  # shorter times count as zero [s]
SLOW = 1e9  # longest lag in samples, as rounding hides the effect of one sample
MAX_SAMPLES = 10_000  # of delay: the number of coefficients


class Window(NamedTuple):
    """Range of the proportional gains that stabilise the plant [N.m].

    `highest` may be infinite. If there is no such gain, `highest` is not above `lowest`.
    """

    lowest: float
    highest: float

    @property
    def empty(self) -> bool:
        """Whether no gain stabilises the plant."""
        return not self.lowest < self.highest


def proportional_window(
    pole: float,
    gain: float = 1.0,
    *,
    delay: float = 0.0,
    lag: float = 0.0,
    sample_time: float = 0.0,
) -> Window:
    """All gains Kp with which u = -Kp y stabilises y = g/(s - p) u with delay, lag and hold.

    The result is exact. Without sampling a root i w of (s - p)(1 + lag s) + g Kp exp(-delay s)
    requires

        atan2(w, p) = w delay + atan(w lag),   (g Kp)**2 = (p**2 + w**2)(1 + (w lag)**2),

    and for a delay alone p delay = theta/tan(theta) and g Kp = p/cos(theta), theta = w delay. With
    sampling, y is read every `sample_time`, the control is held in between, and `delay` (a whole
    number of samples or not) is the time from reading to acting. The lag of a contact with memory
    does not enter, because it nearly vanishes on the falling branch.

    Parameters
    ----------
    pole, gain : float
        p [1/s] and g [1/(N.m.s)]. With g = 1 the result is the range of g Kp [1/s].
    delay, lag, sample_time : float
        Times of the loop [s]; zero if absent.

    Returns
    -------
    Window
        Empty, both ends p/g, if there is no such gain.

    Raises
    ------
    ValueError
        If a value is out of range.
    """
    p = checked_number("pole", pole, RATES)
    g = checked_number("gain", gain, MODERATE_POSITIVE)
    tau, slow = _time("delay", delay), _time("lag", lag)
    step = _time("sample_time", sample_time)
    for name, time, limit in (("delay", tau, MAX_SAMPLES), ("lag", slow, SLOW)):
        if time > limit * step > 0.0:
            raise ValueError(
                f"{name} = {time!r} is out of range: must be <= {limit:g} times "
                f"sample_time = {step!r}"
            )
    highest = _sampled(p, tau, slow, step) if step > 0.0 else _continuous(p, tau, slow)
    return Window(p / g, max(p, highest) / g)


def _time(name: str, value: float) -> float:
    """Check a time of the loop [s]; tiny ones count as zero."""
    time = checked_number(name, value, TIMES)
    return time if time > NO_TIME else 0.0


def _continuous(pole: float, delay: float, lag: float) -> float:
    """Largest g Kp [1/s], or `pole` if no gain does."""
    if pole * (delay + lag) >= 1.0:
        return pole
    if delay == 0.0:  # the phase never reaches -180 degrees
        return math.inf

    def lead(w: float) -> float:
        """Phase distance to -180 degrees."""
        return math.atan2(w, pole) - w * delay - math.atan(w * lag)

    # It rises from zero (or falls from pi) and then keeps falling, to below zero at w = pi/delay.
    top = math.pi / delay
    low = 0.5 * top
    while lead(low) <= 0.0:
        low *= 0.5
        if low < 1e-9 * top:  # lost in rounding, as pole * (delay + lag) is so close to 1
            return pole
    w = float(brentq(lead, low, top, xtol=1e-15 * top, rtol=1e-14))
    return math.hypot(pole, w) * math.hypot(1.0, w * lag)


def sampled_loop(
    pole: float, delay: float, lag: float, sample_time: float
) -> tuple[FloatArray, FloatArray]:
    """Pulse transfer function of 1/(s - p) behind a hold, a delay and a lag.

    Returns
    -------
    numerator, denominator : ndarray
        Polynomials in z, highest power first. With whole = floor(delay/h) samples of delay the
        denominator is z**(whole + 1) times the plant's, so that of the closed loop is
        denominator + g Kp numerator.
    """
    whole = math.floor(delay / sample_time + 1e-9)
    part = max(delay - whole * sample_time, 0.0)  # delay of the control within its interval
    if lag > 0.0:  # creepage, torque
        a, b = np.array([[pole, 1.0], [0.0, -1.0 / lag]]), np.array([0.0, 1.0 / lag])
    else:
        a, b = np.array([[pole]]), np.array([1.0])
    n = len(b)

    def held(time: float) -> tuple[FloatArray, FloatArray]:
        """exp(A t) and the integral of exp(A s) b ds from 0 to t."""
        block = np.zeros((n + 1, n + 1))
        block[:n, :n], block[:n, n] = a, b
        exponential = expm(block * time)
        return exponential[:n, :n], exponential[:n, n]

    step, _ = held(sample_time)
    rest, new = held(sample_time - part)
    old = rest @ held(part)[1]
    plant = np.poly(step)

    def response(forcing: FloatArray) -> FloatArray:
        """Numerator of (1, 0, ..) (z - step)**-1 forcing, by the determinant lemma."""
        output = np.zeros(n)
        output[0] = 1.0
        return np.asarray((np.poly(step - np.outer(forcing, output)) - plant)[1:])

    numerator = np.append(response(new), 0.0) + np.append(0.0, response(old))
    return numerator, np.append(plant, np.zeros(whole + 1))


def _sampled(pole: float, delay: float, lag: float, sample_time: float) -> float:
    """Largest g Kp [1/s], or `pole` if no gain does."""
    # No gain stabilises from p delay = 1 on; and the window's ends are at most a factor
    # coth(p sample_time/2) apart, which rounding turns into 1 beyond 40.
    if pole * delay >= 1.0 or pole * sample_time > 40.0:
        return pole
    numerator, denominator = sampled_loop(pole, delay, lag, sample_time)
    plant, late = denominator[: len(numerator)], len(denominator) - len(numerator)

    def needed(angle: FloatArray) -> NDArray[np.complex128]:
        """Loop gain that puts a root at exp(i angle); only a real one is possible."""
        z = np.exp(1j * angle)
        return np.asarray(-(z**late) * np.polyval(plant, z) / np.polyval(numerator, z))

    def phase(angle: float) -> float:
        return float(needed(np.asarray(angle)).imag)

    # The gain grows along the circle from p at z = 1. The delay alone turns it by `late` times the
    # angle, so it is real again by 4 pi/late: there the first root after p reaches the circle. The
    # roots on the circle at p move inwards if and only if the gain starts below the real axis.
    top = math.pi * min(1.0, 4.0 / late)
    angles = top * np.append(np.geomspace(1e-6, 2e-3, 200), np.arange(2, 512) / 512.0)
    values = needed(angles).imag
    if values[0] >= 0.0:
        return pole
    crossings = [
        brentq(phase, angles[i], angles[i + 1], xtol=1e-15, rtol=1e-14)
        for i in np.flatnonzero(values[:-1] * values[1:] < 0.0)
    ]
    gains = needed(np.array([*crossings, math.pi])).real
    return float(next((k for k in gains if k > pole), pole))


def delay_limit(pole: float, *, robust: bool = False) -> float:
    """Longest delay with which a gain can stabilise a pole p > 0: 1/p, robustly 0.3/p [s].

    Up to 0.3/p there is a gain with a largest sensitivity of about 2, which may be wrong by a
    factor of two. The limit is infinite for a pole that is not unstable.
    """
    p = checked_number("pole", pole, MODERATE)
    return math.inf if p <= 0.0 else (0.3 if robust else 1.0) / p


def sampled_delay(*, delay: float = 0.0, lag: float = 0.0, sample_time: float = 0.0) -> float:
    """Effective delay of a loop: delay + lag + half a sample of the hold [s].

    An estimate for comparison with `delay_limit`; `proportional_window` is exact.
    """
    parts = {"delay": delay, "lag": lag, "sample_time": sample_time}
    total = [checked_number(name, value, MODERATE_NOT_NEGATIVE) for name, value in parts.items()]
    return total[0] + total[1] + 0.5 * total[2]
