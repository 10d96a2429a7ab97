"""Gains of creep control that stabilise an operating point on the falling branch.

They follow from the linearisation in `contactlib.vehicle.wheelset`. From drive torque to creepage a
wheelset is the reduced plant g/(s - p), up to the slow change of the vehicle's speed, with
g = r/(J V) and p the fast pole.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal, NamedTuple, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contactlib.base.quantities import (
    FINITE,
    MODERATE,
    MODERATE_NOT_NEGATIVE,
    MODERATE_POSITIVE,
    checked,
    checked_number,
    common_shape,
)
from contactlib.stability.delay import Window, proportional_window, sampled_delay
from contactlib.stability.poles import fast_pole
from contactlib.vehicle.conditions import Conditions, GivenConditions, OperatingPoint
from contactlib.vehicle.creep_curve import CreepCurve
from contactlib.vehicle.wheelset import Wheelset


def creep_control_gain(wheelset: Wheelset, point: OperatingPoint) -> float:
    """Minimum gain Kp of T = T0 + Kp (zeta_ref - zeta) that stabilises `point` [N.m].

    The larger of two bounds, from the determinant and the trace of the closed loop; zero or less
    where the point is stable at constant torque. Infinite where no gain stabilises it: with
    damping, and a resistance that does not grow with speed, a faster vehicle gets less torque from
    the drive, has less creepage, and on the falling branch thereby more force, which accelerates it
    further. Without damping the vehicle is indifferent to its speed, and the trace decides.

    Where friction does not fall with slip speed the two bounds are, with F' = dF/dV,

        r |Q'| (1 + b (1 + zeta)/(r**2 F')) - b V/r,
        r |Q'| (1 + J (1 + zeta)/(M r**2)) - (V/r) (b + J F'/M),

    and at held speed both become r |Q'| - b V/r. Damping thus raises the gain of a free wheelset.
    Memory of the contact does not change it: at the limit nothing moves, so the contact rolls
    steadily.

    Examples
    --------
    The gain of the shipped locomotive over that at held speed, at the steepest fall, for
    b = 0, 5 (the file's), 50 and 200 N.m.s/rad:

    >>> from dataclasses import replace
    >>> from contactlib import load_model, worst_pole
    >>> free = load_model("locomotive.toml").wheelset
    >>> zeta = worst_pole(replace(free, mass=None), speed=10.0).creepage
    >>> for b in (0.0, 5.0, 50.0, 200.0):
    ...     gains = [
    ...         creep_control_gain(body, body.balanced(creepage=zeta, speed=10.0))
    ...         for body in (replace(free, damping=b, mass=m) for m in (free.mass, None))
    ...     ]
    ...     print(f"{gains[0] / gains[1]:.2f}")
    1.01
    1.16
    2.59
    7.43
    """
    at = wheelset.conditions(
        speed=point.speed, axle_load=point.axle_load, friction_scale=point.friction_scale
    )
    return float(CreepCurve(wheelset, at).minimum_gain(point.creepage))


class ReducedPlant(NamedTuple):
    """Transfer function from drive torque to creepage about an operating point.

    G = g/(s - p) prod (s - z_i)/(s - p_i); zeros and further poles are those of a contact with
    memory.

    Attributes
    ----------
    pole, gain : float
        p [1/s] and g [1/(N.m.s)].
    zeros, poles : tuple of complex
        z_i and p_i [1/s]; none without memory.
    """

    pole: float
    gain: float
    zeros: tuple[complex, ...] = ()
    poles: tuple[complex, ...] = ()


def reduced_plant(
    wheelset: Wheelset,
    creepage: float,
    at: Conditions | None = None,
    **given: Unpack[GivenConditions],
) -> ReducedPlant:
    """Fast pole at an operating point, and g = r/(J V); exact for a held speed.

    Zeros and further poles of a contact with memory are those at held speed, on the side of a
    slip-away: see `Wheelset.jacobians`.

    Parameters
    ----------
    wheelset : Wheelset
        The wheelset.
    creepage : float
        Creepage of the operating point [1].
    at, **given
        Conditions, as `Wheelset.conditions` takes them: ``speed`` [m/s], and others if they are not
        nominal.

    Raises
    ------
    ValueError
        If a value is out of range, or the wheel vibrates on a contact with memory.
    """
    at = wheelset.conditions(at, **given)
    zeta = checked_number("creepage", creepage, FINITE)
    pole = float(fast_pole(wheelset, zeta, **at.contact))
    gain = wheelset.radius / (wheelset.inertia * at.speed)
    if not wheelset.element.memory:
        return ReducedPlant(pole, gain)
    matrix = replace(wheelset, mass=None).jacobians(zeta, **at.contact)
    if (matrix[:-1, -1] == 0.0).all():  # no force depends on the unslipped part
        matrix = matrix[:-1, :-1]
    zeros = np.linalg.eigvals(matrix[1:, 1:])
    all_poles = np.linalg.eigvals(matrix)
    own = int(np.argmin(np.abs(all_poles - pole)))
    if all_poles[own].imag != 0.0:
        raise ValueError(
            f"creepage = {zeta!r}, speed = {at.speed!r}: the wheel vibrates on its contact, so "
            "that the plant has no real pole there; Wheelset.linearize has its states"
        )
    poles = np.delete(all_poles, own)
    return ReducedPlant(pole, gain, tuple(zeros.tolist()), tuple(poles.tolist()))


def pi_stable(
    pole: ArrayLike,
    gain: ArrayLike,
    proportional: ArrayLike,
    integral: ArrayLike = 0.0,
    lag: ArrayLike = 0.0,
) -> NDArray[np.bool_]:
    """Whether Kp + Ki/s with a first-order lag tau stabilises the plant g/(s - p).

    The characteristic polynomial is tau s**3 + (1 - p tau) s**2 + (g Kp - p) s + g Ki, so Routh's
    criterion requires p tau < 1, g Kp > p and 0 < g Ki < (1 - p tau)(g Kp - p)/tau. Without
    integral action there is no last condition. All arguments broadcast.

    Parameters
    ----------
    pole, gain : array_like
        p [1/s], g > 0 [1/(N.m.s)].
    proportional, integral : array_like
        Kp [N.m], Ki [N.m/s]; positive gains drive the creepage to its reference.
    lag : array_like
        Time constant tau of the actuator [s].

    Raises
    ------
    ValueError
        If a value is out of range.
    """
    p, kp = (
        checked(name, value, MODERATE)
        for name, value in (("pole", pole), ("proportional", proportional))
    )
    g, ki = checked("gain", gain, MODERATE_POSITIVE), checked("integral", integral, MODERATE)
    tau = checked("lag", lag, MODERATE_NOT_NEGATIVE)
    common_shape({"pole": p, "gain": g, "proportional": kp, "integral": ki, "lag": tau})
    room = (1.0 - p * tau) * (g * kp - p) > tau * g * ki
    return np.asarray((p * tau < 1.0) & (g * kp > p) & (ki >= 0.0) & room)


# Smallest ratio of the window's ends that counts as robust. With a pure delay it is reached at
# p tau = 0.306, where the best gain's largest sensitivity is 2, and the middle of the window may be
# wrong by a factor of two either way.
ROBUST_RATIO = 4.5


class Controllability(NamedTuple):
    """Whether a loop can stabilise an unstable pole.

    Attributes
    ----------
    p_tau : float
        Pole times the effective delay of the loop, `sampled_delay` [1]: an estimate.
    verdict : str
        ``holds``; ``not robust`` if the ends of the exact window are within a factor of 4.5, about
        p_tau > 0.3, so that every gain is about a factor of two from instability; ``impossible``
        if there is no gain.
    window : Window
        Gains Kp that stabilise [N.m].
    text : str
        Verdict and numbers in one line.
    """

    p_tau: float
    verdict: Literal["holds", "not robust", "impossible"]
    window: Window
    text: str


def controllability(
    pole: float,
    *,
    gain: float = 1.0,
    zeros: Sequence[complex] = (),
    poles: Sequence[complex] = (),
    delay: float = 0.0,
    lag: float = 0.0,
    sample_time: float = 0.0,
) -> Controllability:
    """Whether, and with which margin, proportional creep control stabilises `ReducedPlant`.

    The plant is the wheelset at held speed. A free wheelset with a damped drive may need several
    times the smallest of these gains: `creep_control_gain`.

    Parameters
    ----------
    pole : float
        p, such as that of `worst_pole` [1/s].
    gain : float, optional
        g = r/(J V) [1/(N.m.s)]. Default: 1, so that the window is that of g Kp [1/s].
    zeros, poles : sequence of complex, optional
        Of a contact with memory, as in `proportional_window` [1/s].
    delay, lag, sample_time : float, optional
        Times of the loop, as in `proportional_window` [s].

    Raises
    ------
    ValueError
        If a value is out of range.

    Examples
    --------
    >>> print(controllability(70.0, delay=9e-3).text)
    not robust: pole 70 1/s, delay 9 ms, p tau 0.63; g Kp must lie between 70 and 132.8 1/s
    """
    window = proportional_window(
        pole, gain, zeros, poles, delay=delay, lag=lag, sample_time=sample_time
    )
    p_tau = pole * sampled_delay(delay=delay, lag=lag, sample_time=sample_time)
    low, high = window.lowest * gain, window.highest * gain  # g Kp
    verdict: Literal["holds", "not robust", "impossible"] = "holds"
    if window.empty:
        verdict, gains = "impossible", "no gain holds"
    else:
        if high < ROBUST_RATIO * low:
            verdict = "not robust"
        gains = f"g Kp must lie between {max(low, 0.0):.4g} and {high:.4g} 1/s"
    loop = ", ".join(
        f"{name} {1e3 * time:.4g} ms"
        for name, time in (("delay", delay), ("lag", lag), ("sampling", sample_time))
        if time > 0.0
    )
    text = f"{verdict}: pole {pole:.4g} 1/s, {loop or 'no delay'}, p tau {p_tau:.2f}; {gains}"
    return Controllability(p_tau, verdict, window, text)
