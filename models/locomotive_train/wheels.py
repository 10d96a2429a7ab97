"""Creep forces of the eight wheels, from contactlib in Python or from its FMU."""

from __future__ import annotations

import shutil
from typing import Any, Protocol, Self

import fmpy
import numpy as np
from fmpy.fmi3 import FMU3Model, FMU3Slave

import contactlib as cl
from contactlib.base.quantities import FloatArray

from .vehicle import AXLES, Forces, Locomotive, Motion

INPUTS = ("omega", "speed", "normal_load", "lateral_velocity", "spin_velocity", "friction_scale")
OUTPUTS = ("creep_force", "lateral_force", "spin_moment")


def inputs(element: cl.ForceElement, motion: Motion) -> FloatArray:
    """Inputs of the force element at each wheel without friction, in the order of INPUTS.

    The element has one radius: its `omega` is the one that gives the true slip.
    """
    omega = (motion.speed + motion.slip) / element.radius
    rest = motion.speed, motion.load, motion.lateral_velocity, motion.spin_velocity
    return np.stack([omega, *rest])


class Source(Protocol):
    """Source of the wheels' forces."""

    def forces(self, given: FloatArray, friction: FloatArray, time: float, step: float) -> Forces:
        """Forces at these inputs, or their means over a step from there [N, N, N.m]."""


class Element:
    """The force element of this process, evaluated for all wheels at once."""

    def __init__(self, locomotive: Locomotive) -> None:
        self._element = locomotive.wheel

    def forces(self, given: FloatArray, friction: FloatArray, time: float, step: float) -> Forces:
        """Forces at these inputs, of one time or of many; it takes no steps."""
        found = self._element.evaluate(**dict(zip(INPUTS, [*given, friction], strict=True)))
        return np.stack([found[name] for name in OUTPUTS])


class Values:
    """Values of array variables, and the arguments by which FMI's functions reach them."""

    def __init__(self, references: list[int]) -> None:
        self.array = np.zeros((len(references), AXLES, 2))
        variables = np.ctypeslib.as_ctypes(np.array(references, dtype=np.uint32))
        values = np.ctypeslib.as_ctypes(self.array.ravel())  # the same memory
        self.arguments = variables, len(references), values, self.array.size


class Fmu:
    """The exported force element with eight wheels; a context manager, which ends it.

    In co-simulation the element is implicit: it returns the means over a step of the force that it
    would have found inside an iteration. In model exchange it returns the force at the inputs.
    """

    def __init__(self, locomotive: Locomotive, fmu: str, *, exchange: bool = False) -> None:
        self._element, self._exchange = locomotive.wheel, exchange
        self._folder = fmpy.extract(fmu)
        description = fmpy.read_model_description(self._folder)
        reference = {v.name: v.valueReference for v in description.modelVariables}
        self._inputs = Values([reference[name] for name in INPUTS])
        self._outputs = Values([reference[name] for name in OUTPUTS])
        # The two wheels of an axle push alike. Within a step neither the quill nor the primary
        # springs answer: what moves is the wheelset alone.
        mass = locomotive.vehicle.wheelset_mass
        inverse = 2.0 * (locomotive.wheelset.radius**2 / locomotive.wheel_inertia + 1.0 / mass)
        self._fmu: Any = (FMU3Model if exchange else FMU3Slave)(
            guid=description.guid,
            unzipDirectory=self._folder,
            modelIdentifier=description.modelName,
            instanceName="wheels",
        )
        self._fmu.instantiate()
        self._fmu.enterInitializationMode(startTime=0.0)
        if not exchange:
            self._fmu.setFloat64([reference["effective_inverse_mass"]], [inverse])
        self._fmu.exitInitializationMode()
        if exchange:
            self._fmu.enterContinuousTimeMode()

    def forces(self, given: FloatArray, friction: FloatArray, time: float, step: float) -> Forces:
        """Forces at these inputs, or their means over the step."""
        self._inputs.array[:-1], self._inputs.array[-1] = given, friction
        self._fmu.fmi3SetFloat64(self._fmu.component, *self._inputs.arguments)
        if not self._exchange:
            self._fmu.doStep(time, step)
        self._fmu.fmi3GetFloat64(self._fmu.component, *self._outputs.arguments)
        return self._outputs.array.copy()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *unused: object) -> None:
        self._fmu.terminate()
        self._fmu.freeInstance()
        shutil.rmtree(self._folder, ignore_errors=True)
