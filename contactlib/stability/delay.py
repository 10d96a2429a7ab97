"""Gains that stabilise the plant g/(s - p) in a loop with delay, lag and sampling.

A contact with memory adds zeros and poles to the plant. The smallest gain is that of the static
balance, g Kp = p without memory, for any loop. The largest is the first
at which a root reaches the imaginary axis (the unit circle if sampled). Beyond a certain delay
there is no gain between them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
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
    zeros: Sequence[complex] = (),
    poles: Sequence[complex] = (),
    *,
    delay: float = 0.0,
    lag: float = 0.0,
    sample_time: float = 0.0,
) -> Window:
    """All gains Kp with which u = -Kp y stabilises y = G(s) u with delay, lag and hold.

    G = g/(s - p) prod (s - z_i)/(s - p_i), whose zeros and further poles are those of a contact
    with memory. The result is exact. Without sampling a root i w of the loop requires, for
    G = g/(s - p),

        atan2(w, p) = w delay + atan(w lag),   (g Kp)**2 = (p**2 + w**2)(1 + (w lag)**2),

    and for a delay alone p delay = theta/tan(theta) and g Kp = p/cos(theta), theta = w delay. With
    sampling, y is read every `sample_time`, the control is held in between, and `delay` (a whole
    number of samples or not) is the time from reading to acting.

    Parameters
    ----------
    pole, gain : float
        p [1/s] and g [1/(N.m.s)]. With g = 1 the result is the range of g Kp [1/s].
    zeros, poles : sequence of complex, optional
        z_i and p_i, as many and with negative real parts, as `reduced_plant` gives them [1/s].
    delay, lag, sample_time : float
        Times of the loop [s]; zero if absent.

    Returns
    -------
    Window
        Empty, both ends the smallest gain, if there is no such gain.

    Raises
    ------
    ValueError
        If a value is out of range.
    """
    p = checked_number("pole", pole, RATES)
    g = checked_number("gain", gain, MODERATE_POSITIVE)
    memory = _memory(zeros, poles)
    tau, slow = _time("delay", delay), _time("lag", lag)
    step = _time("sample_time", sample_time)
    for name, time, limit in (("delay", tau, MAX_SAMPLES), ("lag", slow, SLOW)):
        if time > limit * step > 0.0:
            raise ValueError(
                f"{name} = {time!r} is out of range: must be <= {limit:g} times "
                f"sample_time = {step!r}"
            )
    lowest = p * memory.static
    find = _continuous(p, memory, tau, slow)
    if step > 0.0:
        find = _sampled(p, memory, tau, slow, step)
    return Window(lowest / g, max(lowest, find) / g)


class _Memory(NamedTuple):
    """Zeros and poles that a contact with memory adds to the plant [1/s]."""

    zeros: NDArray[np.complex128]
    poles: NDArray[np.complex128]

    @property
    def static(self) -> float:
        """Inverse of their factor at zero frequency [1]."""
        return float(np.prod(self.poles / self.zeros).real)

    @property
    def lead(self) -> float:
        """Time by which their factor leads at zero frequency [s]."""
        return float((np.sum(1.0 / self.poles) - np.sum(1.0 / self.zeros)).real)

    def inverse(self, w: float) -> complex:
        """Inverse of their factor at an angular frequency."""
        return complex(np.prod((1j * w - self.poles) / (1j * w - self.zeros)))


def _memory(zeros: Sequence[complex], poles: Sequence[complex]) -> _Memory:
    """Check them."""
    memory = _Memory(*(np.asarray(v, dtype=np.complex128) for v in (zeros, poles)))
    if memory.zeros.shape != memory.poles.shape or memory.zeros.ndim != 1:
        raise ValueError(f"zeros = {zeros!r} must be as many as poles = {poles!r}")
    for name, values in zip(memory._fields, memory, strict=True):
        if not (np.isfinite(values).all() and (values.real < 0.0).all()):
            raise ValueError(f"{name} = {values.tolist()!r} must have negative real parts")
    return memory


def _time(name: str, value: float) -> float:
    """Check a time of the loop [s]; tiny ones count as zero."""
    time = checked_number(name, value, TIMES)
    return time if time > NO_TIME else 0.0


def _continuous(pole: float, memory: _Memory, delay: float, lag: float) -> float:
    """Largest g Kp [1/s], or the smallest if no gain does."""
    least = pole * memory.static
    if pole * (delay + lag - memory.lead) >= 1.0:
        return least
    if delay == 0.0 and not memory.zeros.size:  # the phase never reaches -180 degrees
        return math.inf

    def lead(w: float) -> float:
        """Phase distance to -180 degrees."""
        ahead = float(np.sum(np.angle(1j * w - memory.zeros) - np.angle(1j * w - memory.poles)))
        return math.atan2(w, pole) - w * delay - math.atan(w * lag) + ahead

    if delay == 0.0:
        return math.inf if lead(1e9 * max(1.0, abs(pole))) > -1e-9 else least
    # It rises from zero (or falls from pi) and then keeps falling, to below zero at w = pi/delay.
    top = math.pi / delay
    low = 0.5 * top
    while lead(low) <= 0.0:
        low *= 0.5
        if low < 1e-9 * pole:  # lost in rounding, as pole * (delay + lag) is so close to 1
            return least
    w = float(brentq(lead, low, top, xtol=1e-15 * top, rtol=1e-14))
    return math.hypot(pole, w) * math.hypot(1.0, w * lag) * abs(memory.inverse(w))


def sampled_loop(
    pole: float, memory: _Memory, delay: float, lag: float, sample_time: float
) -> tuple[FloatArray, FloatArray]:
    """Pulse transfer function of 1/(s - p) and a memory behind a hold, a delay and a lag.

    Returns
    -------
    numerator, denominator : ndarray
        Polynomials in z, highest power first. With whole = floor(delay/h) samples of delay the
        denominator is z**(whole + 1) times the plant's, so that of the closed loop is
        denominator + g Kp numerator.
    """
    whole = math.floor(delay / sample_time + 1e-9)
    part = max(delay - whole * sample_time, 0.0)  # delay of the control within its interval
    denominator = np.poly([pole, *memory.poles]).real
    a = np.eye(len(denominator) - 1, k=-1)  # companion form
    a[0] = -denominator[1:]
    b, output = np.eye(len(a))[0], np.atleast_1d(np.poly(memory.zeros)).real
    if lag > 0.0:  # the torque follows its command
        a = np.block([[a, b[:, np.newaxis]], [np.zeros(len(b)), -1.0 / lag]])
        b, output = np.append(0.0 * b, 1.0 / lag), np.append(output, 0.0)
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
        """Numerator of output (z - step)**-1 forcing, by the determinant lemma."""
        return np.asarray((np.poly(step - np.outer(forcing, output)) - plant)[1:])

    numerator = np.append(response(new), 0.0) + np.append(0.0, response(old))
    return numerator, np.append(plant, np.zeros(whole + 1))


def _sampled(pole: float, memory: _Memory, delay: float, lag: float, sample_time: float) -> float:
    """Largest g Kp [1/s], or the smallest if no gain does."""
    least = pole * memory.static
    # No gain stabilises from p delay = 1 on; and the window's ends are at most a factor
    # coth(p sample_time/2) apart, which rounding turns into 1 beyond 40.
    if pole * (delay - max(memory.lead, 0.0)) >= 1.0 or pole * sample_time > 40.0:
        return least
    numerator, denominator = sampled_loop(pole, memory, delay, lag, sample_time)
    plant, late = denominator[: len(numerator)], len(denominator) - len(numerator)

    def needed(angle: FloatArray) -> NDArray[np.complex128]:
        """Loop gain that puts a root at exp(i angle); only a real one is possible."""
        z = np.exp(1j * angle)
        return np.asarray(-(z**late) * np.polyval(plant, z) / np.polyval(numerator, z))

    def phase(angle: float) -> float:
        return float(needed(np.asarray(angle)).imag)

    # The gain grows along the circle from the least at z = 1. The delay alone turns it by `late`
    # times the angle, so it is real again by 4 pi/late: there the first root after it reaches the
    # circle. The roots on the circle there move inwards if and only if the gain starts below the
    # real axis.
    top = math.pi * min(1.0, 4.0 / late)
    angles = top * np.append(np.geomspace(1e-6, 2e-3, 200), np.arange(2, 512) / 512.0)
    values = needed(angles).imag
    if values[0] >= 0.0:
        return least
    crossings = [
        brentq(phase, angles[i], angles[i + 1], xtol=1e-15, rtol=1e-14)
        for i in np.flatnonzero(values[:-1] * values[1:] < 0.0)
    ]
    gains = needed(np.array([*crossings, math.pi])).real
    return float(next((k for k in gains if k > least), least))


def delay_limit(
    pole: float,
    zeros: Sequence[complex] = (),
    poles: Sequence[complex] = (),
    *,
    robust: bool = False,
) -> float:
    """Longest delay with which a gain can stabilise a pole p > 0: 1/p, robustly 0.3/p [s].

    Up to 0.3/p there is a gain with a largest sensitivity of about 2, which may be wrong by a
    factor of two. The limit is infinite for a pole that is not unstable. The zeros and poles of a
    contact with memory, as in `proportional_window`, lengthen 1/p by their lead
    sum(1/p_i) - sum(1/z_i).
    """
    p, memory = checked_number("pole", pole, MODERATE), _memory(zeros, poles)
    return math.inf if p <= 0.0 else (0.3 if robust else 1.0) * (1.0 / p + memory.lead)


def sampled_delay(*, delay: float = 0.0, lag: float = 0.0, sample_time: float = 0.0) -> float:
    """Effective delay of a loop: delay + lag + half a sample of the hold [s].

    An estimate for comparison with `delay_limit`; `proportional_window` is exact.
    """
    parts = {"delay": delay, "lag": lag, "sample_time": sample_time}
    total = [checked_number(name, value, MODERATE_NOT_NEGATIVE) for name, value in parts.items()]
    return total[0] + total[1] + 0.5 * total[2]
