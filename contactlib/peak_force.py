"""The largest creep force that a contact can transmit, where and as it is."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from contactlib import kernel
from contactlib.element import ForceElement
from contactlib.parameters import FloatArray, checked

HALVINGS = 30


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
    arrays = [checked(name, value, limits[name]) for name, value in given.items()]
    other = friction_scale if other_friction_scale is None else other_friction_scale
    arrays.append(checked("other_friction_scale", other, limits["friction_scale"]))
    if not element.friction.falls_with_slip_speed:
        arrays[0] = np.ones_like(arrays[0])  # such a contact does not know the speed
    rows = np.stack(np.broadcast_arrays(*arrays), axis=-1)
    cases, place = np.unique(rows.reshape(-1, 4), axis=0, return_inverse=True)
    return np.asarray(_largest(element, cases)[place].reshape(rows.shape[:-1]))


def _largest(element: ForceElement, cases: FloatArray) -> FloatArray:
    """Largest force of each row (speed, load, friction scales of the wheels)."""
    inputs = np.zeros((2, len(cases)), dtype=kernel.force_input_dtype())
    inputs["speed"], inputs["normal_load"] = cases[:, 0], cases[:, 1]
    inputs["friction_scale"] = cases[:, 2:].T

    def force(slip: FloatArray) -> tuple[FloatArray, FloatArray]:
        inputs["omega"] = (inputs["speed"] + slip) / element.radius
        record = element.native.evaluate(inputs)
        return record["creep_force"].mean(axis=0), record["force_gradient"].mean(axis=0)

    inputs["omega"] = inputs["speed"] / element.radius
    rolling = element.native.evaluate(inputs)
    # Slip speed at the saturation creepage: zeta0 times the creepage's reference speed.
    units = rolling["saturation_creepage"] * element.radius / rolling["creepage_by_omega"]
    unit = units.max(axis=0)
    # Friction that falls at once leaves the zeta0 of its residual; a law may rise forever.
    first = 0.01 * element.friction.slip_rate_residual
    near = np.geomspace(first, 10.0, round(16.0 * np.log10(10.0 / first)))
    grid = np.concatenate([[0.0], near, np.geomspace(30.0, 1e8, 14)])
    largest, best = np.zeros(len(cases)), np.zeros(len(cases), dtype=int)
    for i, x in enumerate(grid):
        found, _ = force(x * unit)
        best[found > largest] = i
        largest = np.maximum(largest, found)
    low = grid[np.maximum(best - 1, 0)] * unit
    high = grid[np.minimum(best + 1, len(grid) - 1)] * unit
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        found, gradient = force(middle)
        largest = np.maximum(largest, found)
        low = np.where(gradient > 0.0, middle, low)
        high = np.where(gradient > 0.0, high, middle)
    return largest
