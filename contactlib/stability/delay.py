"""What delay, lag and sampling leave of the gains that hold the plant g/(s - p).

The smallest gain is that of a static balance, g Kp = p, whatever is in the loop. The largest is
the first at which a root comes to the imaginary axis (or, sampled, to the unit circle). Beyond a
certain delay there is none between them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.optimize import brentq

from contactlib.parameters import FloatArray, Limits, checked_number
from contactlib.stability import ranges

RATES = Limits(at_least=-1e9, at_most=1e9)  # [1/s]
TIMES = Limits(at_least=0.0, at_most=1e6)  # [s]
NO_TIME = 1e-12  # [s]; what is shorter is taken for none
SLOW = 1e9  # samples: beyond, rounding leaves nothing of what one sample does
MOST_SAMPLES = 10_000  # of delay: as many coefficients are worked with
MOST_ROOTS = 1000  # the same where all roots are found


class Window(NamedTuple):
    """Proportional gains that hold the plant: all between the two [N.m].

    The upper one may be infinite. Where there are none, `highest` is not above `lowest`.
    """

    lowest: float
    highest: float

    @property
    def empty(self) -> bool:
        """Whether no gain holds."""
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
    """All gains Kp with which u = -Kp y holds y = g/(s - p) u behind a delay, a lag and a hold.

    Exact. Without sampling a root i w of (s - p)(1 + lag s) + g Kp exp(-delay s) asks for

        atan2(w, p) = w delay + atan(w lag),   (g Kp)**2 = (p**2 + w**2)(1 + (w lag)**2),

    for a delay alone p delay = theta/tan(theta) and g Kp = p/cos(theta), theta = w delay. A contact
    that relaxes over a way sigma in the time tau = sigma/V runs away more slowly, by
    s - p/(1 + tau s) instead of s - p, and if p tau is small forgives as much of the delay. With
    sampling, y is read every `sample_time`, the control is held in between, and `delay` (any, a
    whole number of samples or not) is that from reading to acting.

    Parameters
    ----------
    pole, gain : float
        p [1/s] and g [1/(N.m.s)]. With g = 1 the answer is that for g Kp [1/s].
    delay, lag, relaxation, sample_time : float
        [s].

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
    g = checked_number("gain", gain, ranges.POSITIVE)
    tau, slow = _time("delay", delay), _time("lag", lag)
    soft, step = _time("relaxation", relaxation), _time("sample_time", sample_time)
    longest = MOST_SAMPLES if soft == 0.0 else MOST_ROOTS
    slowest = {"delay": (tau, longest), "lag": (slow, SLOW), "relaxation": (soft, SLOW)}
    for name, (time, most) in slowest.items():
        if time > most * step > 0.0:
            raise ValueError(
                f"{name} = {time!r} is out of range: must be <= {most:g} times "
                f"sample_time = {step!r}"
            )
    loop = (p, tau, slow, soft)
    highest = _sampled(*loop, step) if step > 0.0 else _continuous(*loop)
    return Window(p / g, max(p, highest) / g)


def _time(name: str, value: float) -> float:
    """A time of the loop [s]."""
    time = checked_number(name, value, TIMES)
    return time if time > NO_TIME else 0.0


def _continuous(pole: float, delay: float, lag: float, relaxation: float) -> float:
    """Largest g Kp [1/s], or `pole` if there is none."""
    if pole * (delay + lag - relaxation) >= 1.0:
        return pole
    if delay == 0.0:  # the phase never gets to -180 degrees
        return math.inf

    def lead(w: float) -> float:
        """Phase left to -180 degrees."""
        turned = math.atan2(w, pole + w**2 * relaxation) + math.atan(w * relaxation)
        return turned - w * delay - math.atan(w * lag)

    # It rises from zero (or falls from pi) and then falls for good, to below zero by w = pi/delay,
    # or half as much again.
    top = (1.5 if relaxation > 0.0 else 1.0) * math.pi / delay
    low = 0.5 * top
    while lead(low) <= 0.0:
        low *= 0.5
        if low < 1e-9 * top:  # lost in rounding, so near is pole * (delay + lag) to 1
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
    part = max(delay - whole * sample_time, 0.0)  # the control acts this late in its interval
    n = 1 + (relaxation > 0.0) + (lag > 0.0)  # creepage, what the contact knows of it, torque
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
    """Largest g Kp [1/s], or `pole` if there is none."""
    # No gain holds from p delay = 1 on, whatever else is in the loop, but for a contact that
    # relaxes meanwhile; and the window's ends are at most a factor coth(p sample_time/2) apart, of
    # which rounding leaves nothing beyond 40.
    growth = pole
    if relaxation > 0.0 and pole > 0.0:  # s (1 + relaxation s) = p
        growth = 2.0 * pole / (1.0 + math.sqrt(1.0 + 4.0 * pole * relaxation))
    if pole * (delay - relaxation) >= 1.0 or growth * sample_time > 40.0:
        return pole
    numerator, denominator = sampled_loop(pole, delay, lag, relaxation, sample_time)
    plant, late = denominator[: len(numerator)], len(denominator) - len(numerator)

    def needed(angle: FloatArray) -> NDArray[np.complex128]:
        """Loop gain that puts a root at exp(i angle); a real one if it can be."""
        z = np.exp(1j * angle)
        return np.asarray(-(z**late) * np.polyval(plant, z) / np.polyval(numerator, z))

    def phase(angle: float) -> float:
        return float(needed(np.asarray(angle)).imag)

    # It grows along the circle from p at z = 1. The delay alone turns it by `late` times the
    # angle, so it is real again by 4 pi/late. That is the first root on the circle beyond p, and
    # those there are at p go inwards if, and only if, it starts out below the real axis.
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
    if relaxation > 0.0 and pole > 0.0:  # a second root may be outside all the way
        closed = denominator.copy()
        closed[-len(numerator) :] += math.sqrt(pole * highest) * numerator
        if float(np.abs(np.roots(closed)).max()) >= 1.0:
            return pole
    return highest


def delay_limit(pole: float, *, robust: bool = False) -> float:
    """Longest delay with which any gain holds a pole p > 0: 1/p, robustly 0.3/p [s].

    Beyond 1/p there is no gain at all. Up to 0.3/p there is one whose largest sensitivity is
    about 2, and that may be wrong by a factor of two. Infinite for a pole that is not unstable.
    """
    p = checked_number("pole", pole, ranges.REAL)
    return math.inf if p <= 0.0 else (0.3 if robust else 1.0) / p


def sampled_delay(*, delay: float = 0.0, lag: float = 0.0, sample_time: float = 0.0) -> float:
    """Delay that the loop feels: delay + lag + half a sample of the hold [s].

    An estimate, to be held against `delay_limit`; `proportional_window` is exact.
    """
    parts = {"delay": delay, "lag": lag, "sample_time": sample_time}
    total = [checked_number(name, value, ranges.NOT_NEGATIVE) for name, value in parts.items()]
    return total[0] + total[1] + 0.5 * total[2]
