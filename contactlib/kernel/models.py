"""The models that an FMU can contain, and their lists of variables."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any, NamedTuple

from contactlib.base.quantities import Limits
from contactlib.kernel.library import ffi, library
from contactlib.kernel.tables import NativeContact

MODEL_KINDS = ("force_element", "wheelset", "wheelset_body", "creep_forces", "vehicle")
GIVEN = ("fixed_parameter", "tunable_parameter", "input", "state")  # roles with a start value


class Variable(NamedTuple):
    """One entry of a model's list of variables."""

    name: str
    unit: str
    description: str
    role: str
    limits: Limits
    part: str  # "always", or when the variable is part of the model; see fmu/fmi/variable.h

    @property
    def boolean(self) -> bool:
        """Whether the variable is a truth value."""
        return self.unit == "Boolean"


@cache
def model_variables(kind: str) -> tuple[Variable, ...]:
    """List of variables of a kind of model; the index is the FMI value reference."""
    model = _model(kind)
    roles, parts = (ffi.typeof(name).elements for name in ("variable_role", "variable_part"))

    def text(cdata: Any) -> str:
        return str(ffi.string(cdata).decode())

    return tuple(
        Variable(
            text(v.name),
            text(v.unit),
            text(v.description),
            roles[v.role].lower(),
            Limits(at_least=v.minimum, at_most=v.maximum),
            parts[v.part].lower(),
        )
        for v in (model.variables[i] for i in range(model.count))
    )


def _model(kind: str) -> Any:
    if kind not in MODEL_KINDS:
        raise ValueError(f"kind = {kind!r} must be one of: {', '.join(MODEL_KINDS)}")
    return library().model_of(kind.encode())


class NativeModel:
    """The model in an FMU, without FMI: values by name, steps and directional derivatives.

    It checks names but no values. Of several wheels, or axles of a vehicle, ``omega[2]`` is the
    second one's variable; ``omega`` sets all of them, and gets the first.
    """

    def __init__(
        self, kind: str, table: NativeContact, start: Mapping[str, float], wheels: int = 1
    ) -> None:
        self._lib, self._model, self._table = library(), _model(kind), table.own()
        variables = model_variables(kind)
        self._entries = {v.name: self._model.variables + i for i, v in enumerate(variables)}
        self._wheels, self._values = wheels, ffi.new("model_values[]", wheels)
        # Entry of a variable, and its wheels, by every name that was given.
        self._places = {name: (entry, range(wheels)) for name, entry in self._entries.items()}
        self.set(**start)
        self._together = wheels if self._model.is_vehicle else 1
        self.evaluate()

    def _place(self, name: str) -> tuple[Any, range]:
        """Entry of a variable, and its wheels."""
        if name not in self._places:
            found = re.fullmatch(r"(.+)\[(\d+)\](.*)", name)
            wheel = -1 if found is None else int(found[2]) - 1
            if found is None or not 0 <= wheel < self._wheels:
                raise KeyError(name)
            self._places[name] = self._entries[found[1] + found[3]], range(wheel, wheel + 1)
        return self._places[name]

    def set(self, **values: float) -> None:
        """Set variables of any role; outputs do not change before `evaluate`."""
        for name, value in values.items():
            entry, wheels = self._place(name)
            for wheel in wheels:
                self._lib.model_set(entry, self._values + wheel, float(value))

    def get(self, *names: str) -> list[float]:
        """Values of the named variables."""
        places = [self._place(name) for name in names]
        return [self._lib.model_get(entry, self._values + wheels[0]) for entry, wheels in places]

    def begin(self) -> None:
        """End the initialization: settle what the start values leave open."""
        self._lib.model_begin(self._model, self._table.struct, self._values, self._wheels)
        self.evaluate()

    def evaluate(self) -> None:
        """Calculate outputs and derivatives from everything else."""
        self._lib.model_evaluate(self._model, self._table.struct, self._values, self._wheels)

    def advance(self, step: float, tolerance: float = 1e-6) -> None:
        """Advance the states by one step with the inputs held.

        Raises
        ------
        RuntimeError
            If the integrator gives up.
        """
        given = self._table.struct, self._values, self._wheels, step, tolerance
        error = self._lib.model_advance(self._model, *given, ffi.new("size_t *"))
        if error != ffi.NULL:
            raise RuntimeError(ffi.string(error).decode())
        self.evaluate()

    @property
    def held_tolerance(self) -> float:
        """Tolerance of the last step, larger than requested if the wheel oscillates too often."""
        return float(self._values[0].held_tolerance)

    def explicit_step(self) -> float:
        """Largest step with which an explicit solver is stable at zero slip [s]."""
        return float(self._lib.model_explicit_step(self._model, self._table.struct, self._values))

    def tangent(self, unknowns: Sequence[str], direction: Mapping[str, float]) -> list[float]:
        """Changes of the unknowns when the other variables change along a direction."""
        n = self._together
        moved, change = ffi.new("model_values[]", n), ffi.new("model_values[]", n)
        for name, value in direction.items():
            entry, wheels = self._place(name)
            for wheel in wheels[:n]:
                self._lib.model_set(entry, moved + wheel, float(value))
        given = self._table.struct, self._values, moved, n, 1, change
        self._lib.model_tangent(self._model, *given)
        places = [self._place(name) for name in unknowns]
        return [self._lib.model_get(entry, change + wheels[0]) for entry, wheels in places]
