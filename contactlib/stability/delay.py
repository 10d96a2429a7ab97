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
SLOW = 1e9  # longest lag or relaxation in samples, as rounding hides the effect of one sample
MAX_SAMPLES = 10_000  # of delay: the number of coefficients
MAX_ROOTS = 1000  # of delay where the loop has a state or root for each


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
    relaxation: float = 0.0,
    sample_time: float = 0.0,
) -> Window:
    """All gains Kp with which u = -Kp y stabilises y = g/(s - p) u with delay, lag and hold.

    The result is exact. Without sampling a root i w of (s - p)(1 + lag s) + g Kp exp(-delay s)
    requires

        atan2(w, p) = w delay + atan(w lag),   (g Kp)**2 = (p**2 + w**2)(1 + (w lag)**2),

    and for a delay alone p delay = theta/tan(theta) and g Kp = p/cos(theta), theta = w delay. With
    a relaxation length sigma, that is, a time tau = sigma/V, the wheel slips away more slowly: with
    s - p/(1 + tau s) instead of s - p, which for small p tau compensates the same time of delay.
    With sampling, y is read every `sample_time`, the control is held in between, and `delay` (a
    whole number of samples or not) is the time from reading to acting.

    Parameters
    ----------
    pole, gain : float
        p [1/s] and g [1/(N.m.s)]. With g = 1 the result is the range of g Kp [1/s].
    delay, lag, relaxation, sample_time : float
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
    soft, step = _time("relaxation", relaxation), _time("sample_time", sample_time)
    longest = MAX_SAMPLES if soft == 0.0 else MAX_ROOTS
    slowest = {"delay": (tau, longest), "lag": (slow, SLOW), "relaxation": (soft, SLOW)}
    for name, (time, limit) in slowest.items():
        if time > limit * step > 0.0:
            raise ValueError(
                f"{name} = {time!r} is out of range: must be <= {limit:g} times "
                f"sample_time = {step!r}"
            )
    loop = (p, tau, slow, soft)
    highest = _sampled(*loop, step) if step > 0.0 else _continuous(*loop)
    return Window(p / g, max(p, highest) / g)


def _time(name: str, value: float) -> float:
    """Check a time of the loop [s]; tiny ones count as zero."""
    time = checked_number(name, value, TIMES)
    return time if time > NO_TIME else 0.0


def _continuous(pole: float, delay: float, lag: float, relaxation: float) -> float:
    """Largest g Kp [1/s], or `pole` if no gain does."""
    if pole * (delay + lag - relaxation) >= 1.0:
        return pole
    if delay == 0.0:  # the phase never reaches -180 degrees
        return math.inf

    def lead(w: float) -> float:
        """Phase distance to -180 degrees."""
        turned = math.atan2(w, pole + w**2 * relaxation) + math.atan(w * relaxation)
        return turned - w * delay - math.atan(w * lag)

    # It rises from zero (or falls from pi) and then keeps falling, to below zero at w = pi/delay,
    # with relaxation at 1.5 pi/delay.
    top = (1.5 if relaxation > 0.0 else 1.0) * math.pi / delay
    low = 0.5 * top
    while lead(low) <= 0.0:
        low *= 0.5
        if low < 1e-9 * top:  # lost in rounding, as pole * (delay + lag) is so close to 1
            return pole
    w = float(brentq(lead, low, top, xtol=1e-15 * top, rtol=1e-14))
    stiffness = math.hypot(pole + w**2 * relaxation, w) / math.hypot(1.0, w * relaxation)
    return stiffness * math.hypot(1.0, w * lag)


def sampled_loop(
    pole: float, delay: float, lag: float, relaxation: float, sample_time: float
) -> tuple[FloatArray, FloatArray]:
    """Pulse transfer function of 1/(s - p/(1 + relaxation s)) behind a hold, a delay and a lag.

    Returns
    -------
    numerator, denominator : ndarray
        Polynomials in z, highest power first. With whole = floor(delay/h) samples of delay the
        denominator is z**(whole + 1) times the plant's, so that of the closed loop is
        denominator + g Kp numerator.
    """
    whole = math.floor(delay / sample_time + 1e-9)
    part = max(delay - whole * sample_time, 0.0)  # delay of the control within its interval
    n = 1 + (relaxation > 0.0) + (lag > 0.0)  # creepage, relaxed creepage, torque
    a, b = np.zeros((n, n)), np.zeros(n)
    if relaxation > 0.0:
        a[0, 1], a[1, 0], a[1, 1] = pole, 1.0 / relaxation, -1.0 / relaxation
    else:
        a[0, 0] = pole
    if lag > 0.0:
        a[0, -1], a[-1, -1], b[-1] = 1.0, -1.0 / lag, 1.0 / lag
    else:
        b[0] = 1.0

    def held(time: float) -> tuple[FloatArray, FloatArray]:
        """exp(A t) and the integral of exp(A s) b ds from 0 to t."""
        block = np.zeros((n + 1, n + 1))
        block[:n, :n], block[:n, n] = a, b
        found = expm(block * time)
        return found[:n, :n], found[:n, n]

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


def _sampled(pole: float, delay: float, lag: float, relaxation: float, sample_time: float) -> float:
    """Largest g Kp [1/s], or `pole` if no gain does."""
    # No gain stabilises from p delay = 1 on, except with relaxation; and the window's ends are at
    # most a factor coth(p sample_time/2) apart, which rounding turns into 1 beyond 40.
    growth = pole
    if relaxation > 0.0 and pole > 0.0:  # s (1 + relaxation s) = p
        growth = 2.0 * pole / (1.0 + math.sqrt(1.0 + 4.0 * pole * relaxation))
    if pole * (delay - relaxation) >= 1.0 or growth * sample_time > 40.0:
        return pole
    numerator, denominator = sampled_loop(pole, delay, lag, relaxation, sample_time)
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
    highest = float(next((k for k in gains if k > pole), pole))
    if relaxation > 0.0 and pole > 0.0:  # a second root may stay outside
        closed = denominator.copy()
        closed[-len(numerator) :] += math.sqrt(pole * highest) * numerator
        if float(np.abs(np.roots(closed)).max()) >= 1.0:
            return pole
    return highest


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
