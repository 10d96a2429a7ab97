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

INPUTS = (
    "omega",
    "speed",
    "normal_load",
    "friction_scale",
    "lateral_velocity",
    "spin_velocity",
)
OUTPUTS = ("creep_force", "lateral_force", "spin_moment")
WHEELS = 2 * AXLES


def inputs(element: cl.ForceElement, motion: Motion, friction: FloatArray) -> dict[str, FloatArray]:
    """Inputs of the force element at each wheel, by name.

    The element has one radius: its `omega` is the one that gives the true slip.
    """
    values = (
        (motion.speed + motion.slip) / element.radius,
        motion.speed,
        motion.load,
        friction,
        motion.lateral_velocity,
        motion.spin_velocity,
    )
    return dict(zip(INPUTS, values, strict=True))


class Source(Protocol):
    """Source of the wheels' forces."""

    def forces(self, motion: Motion, friction: FloatArray, time: float, step: float) -> Forces:
        """Forces at a motion, or their means over a step from it [N, N, N.m]."""


class Element:
    """The force element of this process, evaluated for all wheels at once."""

    def __init__(self, locomotive: Locomotive) -> None:
        self._element = locomotive.wheel

    def forces(self, motion: Motion, friction: FloatArray, time: float, step: float) -> Forces:
        """Forces at a motion of one time or of many; it takes no steps."""
        found = self._element.evaluate(**inputs(self._element, motion, friction))
        return found["creep_force"], found["lateral_force"], found["spin_moment"]


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
        self._in, self._out = ([reference[n] for n in names] for names in (INPUTS, OUTPUTS))
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

    def forces(self, motion: Motion, friction: FloatArray, time: float, step: float) -> Forces:
        """Forces at the motion, or their means over the step."""
        given = inputs(self._element, motion, friction).values()
        self._fmu.setFloat64(self._in, np.concatenate([np.ravel(v) for v in given]).tolist())
        if not self._exchange:
            self._fmu.doStep(time, step)
        found = self._fmu.getFloat64(self._out, len(OUTPUTS) * WHEELS)
        creep, lateral, moment = np.reshape(found, (len(OUTPUTS), AXLES, 2))
        return creep, lateral, moment

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *unused: object) -> None:
        self._fmu.terminate()
        self._fmu.freeInstance()
        shutil.rmtree(self._folder, ignore_errors=True)
