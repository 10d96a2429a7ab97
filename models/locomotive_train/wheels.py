"""Creep forces of the eight wheels, from contactlib in Python or from instances of its FMU."""

from __future__ import annotations

import shutil
from typing import Any, Protocol, Self

import fmpy
import numpy as np
from fmpy.fmi2 import FMU2Model, FMU2Slave

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


class Instances:
    """An instance of the exported force element for each wheel; a context manager, which ends them.

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
        self._fmus: list[Any] = []
        for wheel in range(2 * AXLES):
            one = (FMU2Model if exchange else FMU2Slave)(
                guid=description.guid,
                unzipDirectory=self._folder,
                modelIdentifier=description.modelName,
                instanceName=f"wheel{wheel}",
            )
            one.instantiate()
            one.setupExperiment(startTime=0.0)
            one.enterInitializationMode()
            if not exchange:
                one.setReal([reference["effective_inverse_mass"]], [inverse])
            one.exitInitializationMode()
            if exchange:
                one.enterContinuousTimeMode()
            self._fmus.append(one)

    def forces(self, motion: Motion, friction: FloatArray, time: float, step: float) -> Forces:
        """Forces at the motion, or their means over the step."""
        given = np.stack(list(inputs(self._element, motion, friction).values()), axis=-1)
        found = []
        for one, values in zip(self._fmus, given.reshape(-1, len(INPUTS)).tolist(), strict=True):
            one.setReal(self._in, values)
            if not self._exchange:
                one.doStep(time, step)
            found.append(one.getReal(self._out))
        creep, lateral, moment = np.array(found).reshape(AXLES, 2, 3).transpose(2, 0, 1)
        return creep, lateral, moment

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *unused: object) -> None:
        for one in self._fmus:
            one.terminate()
            one.freeInstance()
        shutil.rmtree(self._folder, ignore_errors=True)
