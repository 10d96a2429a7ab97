"""Rolling that is not steady, along a prescribed history of creepage."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from contactlib import kernel
from contactlib.base.quantities import (
    FINITE,
    FloatArray,
    Limits,
    checked,
    checked_number,
)
from contactlib.element.force_element import ForceElement, creepage_limits

TOLERANCE = 1e-7  # of the held traction over kinetic friction


def roll(
    element: ForceElement, *, creepage: ArrayLike, distance: ArrayLike, speed: float = 10.0
) -> FloatArray:
    """Creep force along a history of creepage, by a contact with memory.

    It begins in the steady state of the first creepage. Between its values the creepage changes
    evenly with the distance.

    Parameters
    ----------
    element : ForceElement
        Whether it has `memory` does not matter; its load is the nominal one.
    creepage : array_like, shape (n,)
        Longitudinal creepage [1].
    distance : array_like, shape (n,)
        Distance rolled [m], strictly increasing.
    speed : float, optional
        Forward speed [m/s]. It matters only if friction falls with slip speed or temperature, or
        where the contact slips by metres per second and follows 0.1 us later.
        Default: 10.

    Returns
    -------
    ndarray, shape (n,)
        Creep force [N].

    Raises
    ------
    ValueError
        If an argument is invalid, or the contact is a line shorter than four semi-widths.
    ArithmeticError
        If the integration does not meet its tolerance of 1e-7 of the force.

    Notes
    -----
    The equations are those of `fmu/kernel/memory.h`. Against half-spaces whose particles are
    followed through the contact, the rms error of q is at most 0.03 after steps of the creepage
    and while it grows. Single values err by up to 0.23 while a contact with strongly weakening
    friction breaks loose.

    Examples
    --------
    A step of the creepage from rest: the force of a sliding contact overshoots its steady value.

    >>> import contactlib as cl
    >>> model = cl.load_model("locomotive.toml")
    >>> element = model.wheelset.element
    >>> distance = np.linspace(0.0, 0.03, 301)
    >>> creepage = np.where(distance > 0.0, 3.0 * element.saturation_creepage, 0.0)
    >>> force = roll(element, creepage=creepage, distance=distance)
    >>> bool(force.max() > 1.02 * force[-1])
    True
    """
    creepages = np.atleast_1d(checked("creepage", creepage, FINITE))
    distances = np.atleast_1d(checked("distance", distance, FINITE))
    if creepages.ndim != 1 or creepages.shape != distances.shape:
        raise ValueError(
            f"creepage {creepages.shape} and distance {distances.shape}: both must have one "
            "dimension and the same length"
        )
    if not np.all(np.diff(distances) > 0.0):
        at = int(np.argmax(np.diff(distances) <= 0.0))
        raise ValueError(
            f"distance must be strictly increasing, but {float(distances[at + 1])!r} follows "
            f"{float(distances[at])!r}"
        )
    fastest = kernel.force_input_limits()["speed"].at_most
    speed = checked_number("speed", speed, Limits(at_least=element.minimum_speed, at_most=fastest))
    checked("creepage", creepages, creepage_limits(element, speed))
    parameters = {**element.parameters, **element.memory_parameters}
    native = kernel.NativeForceElement(element.table.native, parameters)
    return native.roll(creepages, distances, speed, TOLERANCE)
