"""Controllers of many wheelsets made of single ones.

A stacked controller has arrays in place of fields that differ, one element for each wheelset. As
controllers are elementwise, its torques equal those of the single controllers to the last bit.
Derived values are stacked too instead of being computed again. Controllers that keep a state in
themselves are copied instead, one for each wheelset.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Hashable, Sequence
from contextlib import suppress
from dataclasses import fields, is_dataclass
from typing import Any, NamedTuple

import numpy as np

from contactlib.base.quantities import FloatArray, Parameters, as_number, cached_names, shown
from contactlib.base.text import USERS_ERRORS, explained
from contactlib.traction.interface import (
    Command,
    Controller,
    Measurement,
    SampledController,
    TractionController,
)

ROUNDING = 1e-9  # torque beyond the demand / demand that counts as rounding


def structure(value: Any) -> Hashable:
    """Key that is equal for values that can be stacked: everything but their numbers."""
    kind: Any = type(value)
    if isinstance(value, SampledController):
        return (SampledController,)
    if kind is float or value is None:
        return (kind,)
    if isinstance(value, tuple):
        return kind, *map(structure, value)
    if is_dataclass(value):
        return kind, *map(structure, _parts(value).values())
    return value if isinstance(value, Hashable) else id(value)


def stacked(controllers: Sequence[Controller]) -> TractionController:
    """Stack the controllers of many wheelsets into one.

    Parameters
    ----------
    controllers : sequence of SampledController or TractionController
        Checked controllers of one `structure` and one sample time.

    Raises
    ------
    ValueError
        If a controller that is not one of contactlib's cannot be copied.
    """
    first = controllers[0]
    whole: Any
    if isinstance(first, SampledController):
        whole = Copies(controllers)
    else:
        whole = _stacked(controllers)
        if whole is not first:
            object.__setattr__(whole, "sample_time", first.sample_time)
        elif not isinstance(first, Parameters):  # it may keep something in itself
            whole = _copy(first)
    stacked: TractionController = whole
    return stacked


def _stacked(values: Sequence[Any]) -> Any:
    first = values[0]
    if all(value is first for value in values):
        return first
    if isinstance(first, float):
        same = all(value == first for value in values)
        return first if same else np.array(values, dtype=np.float64)
    if isinstance(first, tuple):
        return tuple(_stacked(parts) for parts in zip(*values, strict=True))
    if is_dataclass(first):
        whole: Any = object.__new__(type(first))
        parts = [_parts(value) for value in values]
        for name in parts[0]:
            # Bypass the checks, which refuse arrays: each element has been checked.
            whole.__dict__[name] = _stacked([part[name] for part in parts])
        return whole
    return first


def _parts(value: Any) -> dict[str, Any]:
    """Fields and derived values of a dataclass, by name."""
    kind: Any = type(value)
    names = (*(field.name for field in fields(kind)), *sorted(cached_names(kind)))
    return {name: getattr(value, name) for name in names}


class CopiesMemory(NamedTuple):
    """Memory of sampled controllers: a copy for each wheelset, and the number of the sample."""

    controllers: list[SampledController]
    sample: int


class Copies:
    """Sampled controllers of many wheelsets as one `TractionController`."""

    def __init__(self, controllers: Sequence[Any]) -> None:
        self._controllers: Sequence[SampledController] = controllers
        self.sample_time = float(controllers[0].sample_time)

    def start(self, measurement: Measurement[FloatArray], torque: Any) -> CopiesMemory:
        """Copy the controllers and reset the copies."""
        copies = [_copy(control) for control in self._controllers]
        torques = np.broadcast_to(np.asarray(torque, dtype=np.float64), len(copies)).tolist()
        for control, seen, given in zip(copies, _each(measurement), torques, strict=True):
            try:
                control.reset(seen, given)
            except USERS_ERRORS as error:
                raise explained(f"{type(control).__name__}.reset", error) from error
        return CopiesMemory(copies, 0)

    def sample(
        self, measurement: Measurement[FloatArray], memory: CopiesMemory
    ) -> tuple[FloatArray | Command[FloatArray], CopiesMemory]:
        """Torques [N.m] of the copies, or their commands, and the memory."""
        time = memory.sample * self.sample_time
        commands = [
            _command(control, seen, time)
            for control, seen in zip(memory.controllers, _each(measurement), strict=True)
        ]
        both = Command(*np.array(commands).T)
        return both if both.sand.any() else both.torque, memory._replace(sample=memory.sample + 1)


def _copy(control: Any) -> Any:
    """Copy an object, and into the copy what stands in its class and may change."""
    known: dict[int, Any] = {}
    try:
        copied = copy.deepcopy(control, known)
    except Exception as error:
        raise ValueError(
            f"{type(control).__name__} cannot be copied, and every run works on a copy: {error}"
            "; what cannot be copied must not be kept in the object"
        ) from error
    held = {
        name: attribute
        for kind in type(control).__mro__[::-1]
        for name, attribute in vars(kind).items()
    }
    for name, value in held.items() if hasattr(copied, "__dict__") else ():
        if not (name.startswith("__") or hasattr(value, "__get__")):
            with suppress(Exception):  # what cannot be copied, such as a lock, stays in the class
                if (own := copy.deepcopy(value, known)) is not value:
                    vars(copied).setdefault(name, own)
    return copied


def _each(measurement: Measurement[Any]) -> list[Measurement[float]]:
    if all(type(part) is float for part in measurement[:4]):
        return [measurement]
    rows = [np.atleast_1d(part).tolist() for part in measurement[:4]]
    count = len(rows[0])
    speeds = np.reshape(measurement.wheel_speeds, (-1, count)).T.tolist()
    axles = np.broadcast_to(measurement.axle, count).tolist()
    columns = zip(*rows, map(tuple, speeds), axles, strict=True)
    return [Measurement(*column) for column in columns]


def _command(control: SampledController, seen: Measurement[float], time: float) -> Command[float]:
    """Command of one controller, checked; zero for a run whose numbers have overflowed."""
    if not all(map(math.isfinite, (*seen[:4], *seen.wheel_speeds))):
        return Command(0.0)
    what, demand = f"{type(control).__name__}.torque", seen.demand
    try:
        answer: Any = control.torque(seen)
    except USERS_ERRORS as error:
        raise explained(f"{what} at {time:.6g} s", error) from error
    answer, part = answer if isinstance(answer, Command) else (answer, 0.0)
    number, sand = as_number(answer), as_number(part, "biuf")
    if sand is None or not 0.0 <= sand <= 1.0:
        raise ValueError(f"{what} at {time:.6g} s returned sand = {shown(part)}: must be 0 to 1")
    low, high = min(demand, 0.0), max(demand, 0.0)
    slack = ROUNDING * max(high - low, 1.0)
    if number is None or not low - slack <= number <= high + slack:
        hint = "; a return is missing" if answer is None else ""
        raise ValueError(
            f"{what} at {time:.6g} s returned {shown(answer)}: it must return one number between 0 "
            f"and the demand, {demand:.6g} N.m{hint}"
        )
    return Command(min(max(number, low), high), sand)
