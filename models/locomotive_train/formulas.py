"""The formulas of motion and outer forces for one state, recorded as a list of operations.

For so few numbers NumPy takes most of its time in its calls. CasADi records the formulas with
arrays of symbols and evaluates them many times as fast.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi
import numpy as np

from contactlib.base.quantities import FloatArray

from .system import outer_forces
from .vehicle import AXLES, COORDINATES, Forces, Locomotive
from .wheels import inputs

Arrays = tuple[FloatArray, ...]


class Recorded:
    """A function of arrays, recorded as operations on numbers.

    Parameters
    ----------
    function : callable
        Function of arrays that returns several. It must work on arrays of objects, and may have no
        branch that depends on their values.
    *shapes : tuple of int
        Shape of each argument.
    """

    def __init__(self, function: Callable[..., Arrays], *shapes: tuple[int, ...]) -> None:
        symbols = [casadi.SX.sym("argument", int(np.prod(shape))) for shape in shapes]
        arrays = [np.empty(shape, dtype=object) for shape in shapes]
        for array, symbol in zip(arrays, symbols, strict=True):
            array.ravel()[:] = casadi.vertsplit(symbol)
        results = function(*arrays)
        columns = [casadi.vertcat(*result.ravel()) for result in results]
        evaluated = casadi.Function("recorded", symbols, columns, {"cse": True})
        self._arguments = [np.zeros(shape) for shape in shapes]
        self._results = [np.zeros(result.shape) for result in results]
        buffer: Any
        buffer, self._evaluate = evaluated.buffer()
        self._buffer = buffer  # which must outlive the calls
        for i, argument in enumerate(self._arguments):
            buffer.set_arg(i, argument.data)
        for i, result in enumerate(self._results):
            buffer.set_res(i, result.data)

    def __call__(self, *given: FloatArray) -> Arrays:
        """Results at these arguments."""
        for argument, value in zip(self._arguments, given, strict=True):
            argument[...] = value
        self._evaluate()
        return tuple(result.copy() for result in self._results)


class Formulas:
    """Recorded formulas of a locomotive."""

    def __init__(self, locomotive: Locomotive) -> None:
        def wheels(q: FloatArray, rates: FloatArray) -> Arrays:
            motion = locomotive.motion(q, rates)
            return motion.distance, inputs(locomotive.wheel, motion)

        def outer(q: FloatArray, rates: FloatArray, forces: Forces, torque: FloatArray) -> Arrays:
            motion = locomotive.motion(q, rates)
            return (outer_forces(locomotive, q, rates, motion, forces, torque),)

        state = (COORDINATES,), (COORDINATES,)
        self._wheels = Recorded(wheels, *state)
        self._outer = Recorded(outer, *state, (3, AXLES, 2), (AXLES,))

    def wheels(self, q: FloatArray, rates: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Distances of the axles along the track [m], and `inputs` of the wheels."""
        distance, given = self._wheels(q, rates)
        return distance, given

    def outer_forces(
        self, q: FloatArray, rates: FloatArray, forces: Forces, torque: FloatArray
    ) -> FloatArray:
        """See `system.outer_forces`."""
        (found,) = self._outer(q, rates, forces, torque)
        return found
