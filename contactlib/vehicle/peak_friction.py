"""Friction that gives a wheel a largest traction coefficient, as rails in `"adhesion"` need.

The peak of the steady creep force depends on the friction factor, on the speed if friction falls
with slip speed or temperature, and on the load and the initial slope. The kernel interpolates the
factor over the peak's traction coefficient in the logarithms of all four (fmu/kernel/track.h). It
is smooth in these but where static friction, which the law does not contain, limits the force. So
there are two branches, without that limit and where it always acts, and the larger factor holds.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from contactlib import kernel
from contactlib.base.quantities import FloatArray
from contactlib.element.force_element import ForceElement
from contactlib.vehicle.track import UNCHANGED, Profile, Track

SPEEDS = 0.1 * 2.0 ** (np.arange(16) / 1.5)  # [m/s]
LOADS = 2.0 ** np.arange(-2, 2)  # over the nominal one
RATIOS = 1.4, 1.6  # between neighbouring coefficients and slopes, at most
LARGEST = 100.0  # friction factor
UNLIMITED = 1e3  # static over kinetic friction where it limits no force
FRICTION = "static_friction", "kinetic_friction", "weakening_length"
ACCURACY = 1e-6  # of the traction coefficient
TRIALS = 40


def with_peaks(track: Track, element: ForceElement, *, loaded: bool) -> Track:
    """The track with what gives the kernel the factors for a contact.

    Parameters
    ----------
    track : Track
        A track whose unit is ``"adhesion"``.
    element : ForceElement
        Contact of both wheels.
    loaded : bool
        Whether loads differ from the nominal one.

    Raises
    ------
    ValueError
        If the contact cannot reach one of the coefficients.
    """
    low, high = (
        choose(number for side in track.given for number in side.value) for choose in (min, max)
    )
    if track.varied != UNCHANGED:  # runs with other variations share a map
        ratio = math.log(RATIOS[0])
        low, high = (
            math.exp(ratio * end)
            for end in (math.floor(math.log(low) / ratio), math.ceil(math.log(high) / ratio))
        )
    axes = (
        _places(low, high, RATIOS[0]),
        SPEEDS if element.friction.falls_with_slip_speed else SPEEDS[:1],
        element.axle_load * (LOADS if loaded else np.ones(1)),
        _places(min(track.slope.value), max(track.slope.value), RATIOS[1]),
    )
    table, contact = element.table.native, tuple(element.parameters.items())
    return replace(track, peaks=_map(table, contact, *(tuple(axis.tolist()) for axis in axes)))


def at_speed(track: Track, element: ForceElement, speed: float) -> Track:
    """The track in factors, where they depend on it at a speed [m/s] and the nominal load."""
    if track.unit != "adhesion":
        return track
    contact, at = element.parameters, (abs(speed), element.axle_load, track.slope.value[0])

    def factors(side: Profile) -> Profile:
        given = [np.array(number) for number in (side.value, *at)]
        return Profile(side.at, tuple(_factors(element.table.native, contact, *given).tolist()))

    left, right = map(factors, track.given)
    return replace(
        track,
        unit="factor",
        peaks=None,
        varied=UNCHANGED,
        friction_left=left,
        friction_right=None if left == right else right,
    )


def _places(low: float, high: float, ratio: float) -> FloatArray:
    """Places from the lowest to the highest number, evenly spaced in their logarithms."""
    return np.geomspace(low, high, 1 + math.ceil(math.log(high / low) / math.log(ratio)))


@lru_cache(maxsize=256)
def _map(
    table: Any, contact: Sequence[tuple[str, float]], *axes: tuple[float, ...]
) -> kernel.NativePeaks:
    """Map over axes of coefficient, speed, load and slope."""
    grid = np.meshgrid(*axes, indexing="ij")
    logs = [np.log(axis) for axis in axes]
    found = [_factors(table, branch, *grid) / grid[0] for branch in _branches(table, dict(contact))]
    return kernel.NativePeaks(
        tuple(log[0].item() for log in logs),
        tuple(log[1].item() - log[0].item() if log.size > 1 else 1.0 for log in logs),
        np.stack(found),
    )


def _branches(table: Any, contact: Mapping[str, float]) -> list[Mapping[str, float]]:
    """Contacts of the same k_hat without the limit of static friction, and always at it."""
    static, kinetic, length = (contact[name] for name in FRICTION)
    if table.struct.one_axis or length == 0.0 or static == kinetic:
        return [contact]
    drop = UNLIMITED * kinetic
    high = {
        "static_friction": kinetic + drop,
        "weakening_length": length * (static - kinetic) / drop,
    }
    return [{**contact, **high}, {**contact, "weakening_length": UNLIMITED**2 * length}]


def _factors(
    table: Any,
    contact: Mapping[str, float],
    number: FloatArray,
    speed: FloatArray,
    load: FloatArray,
    slope: FloatArray,
) -> FloatArray:
    """Friction factors for largest traction coefficients; arguments broadcast. Secant method."""
    shape = np.broadcast_shapes(*(np.shape(x) for x in (number, speed, load, slope)))
    given = [np.broadcast_to(x, shape).ravel() for x in (number, speed, load, slope)]
    number, speed, load, slope = given
    fleet = kernel.NativeFleet([kernel.NativeMember(table, contact, {}, {})])
    inputs = np.zeros(number.size, kernel.drivetrain_dtype("input"))
    member = np.zeros(number.size, np.intp)
    inputs["load_left"] = inputs["load_right"] = 0.5 * load
    inputs["slope"] = slope
    log = np.minimum(np.log(number / contact["kinetic_friction"]), np.log(LARGEST))
    before, error_before = log, np.zeros(log.size)
    for _ in range(TRIALS):
        inputs["friction_left"] = inputs["friction_right"] = np.exp(log)
        force = fleet.peak(inputs, speed, member)
        error = np.log(force / (load * number))
        if (np.abs(error) < ACCURACY).all():
            return np.exp(log).reshape(shape)
        if (short := (log == np.log(LARGEST)) & (error < 0.0)).any():
            i = int(np.argmax(short))
            raise ValueError(
                f"track.friction = {number[i]:g} with track.unit = 'adhesion' is out of range: "
                f"must be <= {number[i] * math.exp(error[i]):.3g}, what this contact reaches at "
                f"{speed[i]:g} m/s with {LARGEST:g} times its friction"
            )
        moved = log != before
        rise = np.divide(error - error_before, log - before, out=np.ones_like(log), where=moved)
        before, error_before = log, error
        log = np.minimum(log - error / np.clip(rise, 0.2, 1.2), np.log(LARGEST))
    raise RuntimeError(f"no friction factor gives the traction coefficients {number!r}")
