"""The largest creep force that a contact can transmit, where and as it is."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from contactlib import kernel
from contactlib.element import ForceElement
from contactlib.parameters import FloatArray, checked, common_shape

NEAR, FAR = 40, 14  # slip speeds that are tried up to 10 zeta0, and beyond
GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
CUTS = 40


def available_force(
    element: ForceElement,
    *,
    speed: ArrayLike,
    normal_load: ArrayLike | None = None,
    friction_scale: ArrayLike = 1.0,
    other_friction_scale: ArrayLike | None = None,
) -> FloatArray:
    """Largest |creep force| over all creepages at given speeds [N]; arguments broadcast.

    If friction falls with slip speed, the force peaks the lower the faster the vehicle is: the
    creepage of the peak is then more slip speed. Braking and driving have the same peak.

    Parameters
    ----------
    element : ForceElement
        The contact.
    speed : array_like
        Forward velocity [m/s].
    normal_load : array_like, optional
        [N]; the contact's nominal load if left out.
    friction_scale : array_like, optional
        Multiplies both friction coefficients [1].
    other_friction_scale : array_like, optional
        That of the other wheel of a wheelset [1], whose contact the element then is: each wheel has
        half of the load, and both have one creepage, so at most one of them is at its own peak.

    Returns
    -------
    ndarray
        Of the shape to which the arguments broadcast; right to 1e-9 of itself, and 1e-8 low for a
        law that rises forever.

    Raises
    ------
    ValueError
        If a value is not finite or out of its range, such as a negative load.

    Examples
    --------
    >>> import contactlib as cl
    >>> locomotive = cl.load_model("locomotive.toml").wheelset.element
    >>> (available_force(locomotive, speed=[5.0, 20.0], friction_scale=[1.0, 0.5]) / 1e3).round(2)
    array([52.59, 28.39])
    """
    limits = kernel.force_input_limits()
    given = {
        "speed": speed,
        "normal_load": element.contact.normal_load if normal_load is None else normal_load,
        "friction_scale": friction_scale,
    }
    arrays = {name: checked(name, value, limits[name]) for name, value in given.items()}
    other = friction_scale if other_friction_scale is None else other_friction_scale
    arrays["other_friction_scale"] = checked(
        "other_friction_scale", other, limits["friction_scale"]
    )
    shape = common_shape(arrays)
    if not element.friction.falls_with_slip_speed:
        arrays["speed"] = np.ones(())  # such a contact does not know the speed
    rows = np.stack([np.broadcast_to(array, shape) for array in arrays.values()], axis=-1)
    cases, place = np.unique(rows.reshape(-1, 4), axis=0, return_inverse=True)
    return np.asarray(_largest(element, cases)[place].reshape(rows.shape[:-1]))


def _largest(element: ForceElement, cases: FloatArray) -> FloatArray:
    """Largest force of each row (speed, load, friction scales of the wheels)."""
    inputs = np.zeros((2, len(cases)), dtype=kernel.force_input_dtype())
    inputs["speed"], inputs["normal_load"] = cases[:, 0], cases[:, 1]
    inputs["friction_scale"] = cases[:, 2:].T

    def force(slip: FloatArray) -> FloatArray:
        inputs["omega"] = (inputs["speed"] + slip) / element.radius
        found = element.native.evaluate(inputs)["creep_force"]
        return np.asarray(0.5 * (found[0] + found[1]))

    inputs["omega"] = inputs["speed"] / element.radius
    rolling = element.native.evaluate(inputs)
    # Slip speed at the saturation creepage: zeta0 times the creepage's reference speed.
    units = rolling["saturation_creepage"] * element.radius / rolling["creepage_by_omega"]
    return largest_force(force, units.max(axis=0), element.friction.slip_rate_residual)


def largest_force(
    force: Callable[[FloatArray], FloatArray], unit: FloatArray, residual: ArrayLike
) -> FloatArray:
    """Largest force over all slip speeds, of many contacts at once.

    Parameters
    ----------
    force : callable
        Forces [N] at slip speeds [m/s], both of the shape of `unit`.
    unit : ndarray
        Slip speeds at the saturation creepage, about [m/s].
    residual : array_like
        Part of friction that is left at high slip speeds [1]; broadcasts with `unit`.

    Returns
    -------
    ndarray
        Of the shape of `unit`; right to 1e-9 of itself [N].
    """
    # Friction that falls at once leaves the zeta0 of its residual; a law may rise forever.
    first = np.log(0.01 * np.asarray(residual, dtype=np.float64))
    near = [np.exp(first + part * (np.log(10.0) - first)) for part in np.linspace(0.0, 1.0, NEAR)]
    grid = [np.zeros_like(first), *near, *np.geomspace(30.0, 1e8, FAR)]
    largest, low, high = np.zeros_like(unit), np.zeros_like(unit), grid[1] * unit
    for i, x in enumerate(grid):
        found = force(x * unit)
        better = found > largest
        low = np.where(better, grid[max(i - 1, 0)] * unit, low)
        high = np.where(better, grid[min(i + 1, len(grid) - 1)] * unit, high)
        largest = np.maximum(largest, found)
    # Golden section: values only, as the peak may be a corner, where friction is at its limit.
    left, right = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    at_left, at_right = force(left), force(right)
    for _ in range(CUTS):
        largest = np.maximum(largest, np.maximum(at_left, at_right))
        down = at_left >= at_right
        low, high = np.where(down, low, left), np.where(down, right, high)
        new = np.where(down, high - GOLDEN * (high - low), low + GOLDEN * (high - low))
        found = force(new)
        left, right = np.where(down, new, right), np.where(down, left, new)
        at_left, at_right = np.where(down, found, at_right), np.where(down, at_left, found)
    return np.asarray(np.maximum(largest, np.maximum(at_left, at_right)))
