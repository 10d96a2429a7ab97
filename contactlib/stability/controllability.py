"""Whether creep control can hold a point of the falling branch at all, before it is tried."""

from __future__ import annotations

from typing import Literal, NamedTuple

from contactlib.stability.delay import Window, proportional_window, sampled_delay

# Of the window's ends. Behind a pure delay it is met up to p tau = 0.306, where the best gain's
# largest sensitivity is 2; the middle of the window may then be wrong by two, either way.
ROBUST_RATIO = 4.5


class Controllability(NamedTuple):
    """What a loop can do about an unstable pole.

    Attributes
    ----------
    p_tau : float
        Pole times the loop's whole delay, `sampled_delay` [1]: an estimate.
    verdict : str
        ``holds``; ``not robust`` if the window's ends are within a factor of 4.5, which is about
        p_tau > 0.3, with every gain about a factor of two from instability; ``impossible`` if
        there is no gain. From the exact window.
    window : Window
        Gains Kp that hold [N.m].
    text : str
        One line that says so and names the numbers.
    """

    p_tau: float
    verdict: Literal["holds", "not robust", "impossible"]
    window: Window
    text: str


def controllability(
    pole: float,
    *,
    gain: float = 1.0,
    delay: float = 0.0,
    lag: float = 0.0,
    relaxation: float = 0.0,
    sample_time: float = 0.0,
) -> Controllability:
    """Whether, and how comfortably, proportional creep control holds g/(s - p).

    That is the wheelset at held speed. Set free it needs a little more than the smallest of these
    gains: `creep_control_gain`.

    Parameters
    ----------
    pole : float
        p, such as that of `worst_pole` [1/s].
    gain : float, optional
        g = r/(J V) [1/(N.m.s)]. Left out, the window is that of g Kp [1/s].
    delay, lag, relaxation, sample_time : float, optional
        In the loop, as in `proportional_window` [s].

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
        pole, gain, delay=delay, lag=lag, relaxation=relaxation, sample_time=sample_time
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
        for name, time in (
            ("delay", delay),
            ("lag", lag),
            ("relaxation", relaxation),
            ("sampling", sample_time),
        )
        if time > 0.0
    )
    text = f"{verdict}: pole {pole:.4g} 1/s, {loop or 'no delay'}, p tau {p_tau:.2f}; {gains}"
    return Controllability(p_tau, verdict, window, text)
