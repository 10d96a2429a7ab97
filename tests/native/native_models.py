"""Models of the kernel, as an FMU steps them."""

from __future__ import annotations

import warnings
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

import contactlib as cl
from contactlib import kernel
from contactlib.export.description import Description
from contactlib.files.model import Missing


def with_memory(model: cl.Model, memory: bool = True) -> cl.Model:
    """The model whose contacts have memory, or have none."""
    element = replace(model.wheelset.element, memory=memory)
    if isinstance(model.wheelset, Missing):  # a wheel's creep force only
        known: Any = Missing(model.wheelset.lacking, element=element, radius=element.radius)
        return replace(model, wheelset=known)
    return replace(model, wheelset=replace(model.wheelset, element=element))


def shifted_curve(shift: float) -> cl.MeasuredCurve:
    """A measured curve whose creepages are wrong by a shift, so that it rises in an S."""
    zeta = np.geomspace(0.02, 4.0, 40) * 1e-2
    traction = 0.3 * np.tanh(zeta / 0.006)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", cl.InputWarning)  # which doubts the shift
        return cl.MeasuredCurve(zeta + shift, traction, smoothing=1e-9)


def with_shift(model: cl.Model, shift: float) -> cl.Model:
    """The model with such a curve."""
    wheelset, curve = model.wheelset, shifted_curve(shift)
    contact = wheelset.element.contact
    element = cl.ForceElement.from_curve(curve, contact, radius=wheelset.radius)
    return replace(model, wheelset=replace(wheelset, element=element))


def native(description: Description, **start: float) -> kernel.NativeModel:
    contact = description.native_contact
    values = {**description.start_values, **start}
    return kernel.NativeModel(description.kind, contact, values)


def steady_memory(element: cl.ForceElement, *, omega: float, speed: float) -> dict[str, float]:
    """States of a contact with memory in steady rolling under nominal load."""
    given = {"omega": omega, "speed": speed, "normal_load": element.axle_load}
    inputs = np.zeros((), kernel.struct_dtype("force_element_input"))
    for name, value in {**given, "friction_scale": 1.0}.items():
        inputs[name] = value
    contact = kernel.NativeForceElement(element.native_contact, element.rolling_parameters)
    found = contact.evaluate(inputs)
    names = {"held_force": "steady_force", "unslipped": "sticking", "outer_force": "steady_outer"}
    return {state: float(found[name]) for state, name in names.items()}


def difference_quotient(
    model: kernel.NativeModel, unknowns: list[str], name: str, step: float
) -> tuple[np.ndarray, np.ndarray]:
    """Derivative of the unknowns by Richardson's extrapolation, and how far its last two differ."""
    middle = model.get(name)[0]

    def at(value: float) -> np.ndarray:
        model.set(**{name: value})
        model.evaluate()
        return np.array(model.get(*unknowns))

    rows = []
    for h in step * 0.5 ** np.arange(4):
        rows.append((at(middle + h) - at(middle - h)) / (2.0 * h))
    at(middle)
    for order in (4.0, 16.0):
        rows = [(order * b - a) / (order - 1.0) for a, b in pairwise(rows)]
    return rows[-1], np.abs(rows[-1] - rows[-2])
