"""What a loop tolerates: gain, phase, delay, and both at once (disk margin)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from contactlib.control_systems.loci import growth_rate
from contactlib.parameters import FloatArray

if TYPE_CHECKING:
    from control import StateSpace

POINTS = 2000  # frequencies; the margins lie between them by a cubic spline
BEYOND = 300.0  # how far they go past the slowest and the fastest pole or zero


class Margins(NamedTuple):
    """What a stable loop tolerates.

    Attributes
    ----------
    gain_lower, gain_upper : float
        Factors on the gain between which the loop stays stable [1]. A loop that holds an unstable
        point has a lower one above zero.
    phase : float
        Least phase lag that ends stability [rad].
    crossover : float
        Angular frequency at which the gain of the loop is one, at the delay margin [rad/s].
    delay : float
        Least additional delay that ends stability [s].
    sensitivity_peak : float
        M_s = max |1/(1 + L)|, one over the least distance to -1 [1].
    disk : float
        Disk margin alpha of (S - T)/2 [1].
    disk_gain : float
        Factor by which the gain may rise or fall [1], whatever the phase does within `disk_phase`.
    disk_phase : float
        [rad], likewise.
    """

    gain_lower: float
    gain_upper: float
    phase: float
    crossover: float
    delay: float
    sensitivity_peak: float
    disk: float
    disk_gain: float
    disk_phase: float


def margins(loop: StateSpace) -> Margins:
    """Margins of an open loop, on a grid of frequencies that covers all its poles and zeros.

    Notes
    -----
    python-control finds them in the frequency response. From the coefficients of the transfer
    function, its other way, it misses crossovers of a sampled loop.

    Raises
    ------
    ValueError
        If the closed loop is not stable: a margin says nothing there.
    """
    import control

    growth = growth_rate(control.feedback(loop, 1.0).poles(), loop.dt)
    if growth >= 0.0:
        raise ValueError(
            f"the closed loop is not stable, so it has no margins: a pole grows by {growth:.6g} 1/s"
        )
    omega = frequencies(loop)
    response = control.frd(loop, omega, smooth=True)
    found = control.stability_margins(response, returnall=True)
    gains, phases, distances, _, crossovers, _ = map(np.ravel, found)  # one comes as a scalar
    ends = np.array([loop(1.0 if loop.dt else 0.0, warn_infinite=False)])
    if loop.dt:
        ends = np.append(ends, loop(-1.0))  # at half the sampling frequency
    reached = np.isfinite(ends) & (ends.real < 0.0)
    gains = np.append(gains, -1.0 / ends.real[reached])
    lags = np.mod(np.radians(phases), 2.0 * math.pi)  # to -1, clockwise
    delays = lags / crossovers
    first = int(np.argmin(delays)) if delays.size else 0
    to_minus_one = control.disk_margins(loop, omega, skew=1.0)[0]  # that of S is a distance
    distances = np.append(np.append(distances, np.abs(1.0 + ends[np.isfinite(ends)])), to_minus_one)
    disk, disk_gain, disk_phase = control.disk_margins(loop, np.append(0.0, omega))
    return Margins(
        gain_lower=float(gains[gains < 1.0].max(initial=0.0)),
        gain_upper=float(gains[gains > 1.0].min(initial=math.inf)),
        phase=float(lags.min(initial=math.inf)),
        crossover=float(crossovers[first]) if delays.size else math.nan,
        delay=float(delays[first]) if delays.size else math.inf,
        sensitivity_peak=1.0 / float(distances.min()),
        disk=float(disk),
        disk_gain=float(control.db2mag(disk_gain)),
        disk_phase=math.radians(float(disk_phase)),
    )


def frequencies(loop: StateSpace) -> FloatArray:
    """Angular frequencies that cover what a loop and its closed loop do [rad/s]."""
    import control

    features = np.concatenate([loop.poles(), loop.zeros(), control.feedback(loop, 1.0).poles()])
    if loop.dt:
        features = np.log(features[np.abs(features) > 1e-9]) / loop.dt
    sizes = np.abs(features)
    sizes = sizes[sizes > 1e-9 * sizes.max()]
    slowest, fastest = sizes.min() / BEYOND, sizes.max() * BEYOND
    if loop.dt:
        fastest = math.pi / loop.dt
    return np.geomspace(min(slowest, 0.1 * fastest), fastest, POINTS)
