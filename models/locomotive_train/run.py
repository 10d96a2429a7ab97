"""Runs of the locomotive: Exudyn moves the bodies, one FMU gives the forces of eight wheels."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import exudyn
import fmpy
import numpy as np
from fmpy.fmi3 import FMU3Slave

import contactlib as cl
from contactlib.base.quantities import FloatArray

from .system import build, outer_forces
from .vehicle import AXLES, COORDINATES, SHAFT, SPIN, Forces, Locomotive, Motion

INPUTS = ("omega", "speed", "normal_load", "lateral_velocity", "spin_velocity", "friction_scale")
OUTPUTS = ("creep_force", "lateral_force", "spin_moment")


@dataclass(frozen=True, eq=False)
class Run:
    """A run, by rows; forces are those at the rows, by the law.

    Attributes
    ----------
    locomotive : Locomotive
        What ran.
    time : ndarray
        Times of the rows [s].
    coordinates, rates : ndarray
        q and its rates at the rows.
    torque : ndarray
        Torque of each motor over the step after a row [N.m].
    motion : Motion
        Motion of the wheels at the rows.
    forces : ndarray
        Creep forces, lateral forces [N] and spin moments [N.m] of the wheels, in this order.
    """

    locomotive: Locomotive
    time: FloatArray
    coordinates: FloatArray
    rates: FloatArray
    torque: FloatArray
    motion: Motion
    forces: Forces

    @property
    def creepage(self) -> FloatArray:
        """Mean creepage of each axle's wheels [1]."""
        return np.asarray((self.motion.slip / self.motion.speed).mean(axis=-1))

    @property
    def creep_force(self) -> FloatArray:
        """Creep force of each axle [N]."""
        return np.asarray(self.forces[0].sum(axis=-1))

    @property
    def load(self) -> FloatArray:
        """Load of each axle [N]."""
        return np.asarray(self.motion.load.sum(axis=-1))

    @property
    def shaft_torque(self) -> FloatArray:
        """Torque in the hollow shaft of each axle [N.m]."""
        v, q, rates = self.locomotive.vehicle, self.coordinates, self.rates
        twist, twisting = q[:, SHAFT] - q[:, SPIN], rates[:, SHAFT] - rates[:, SPIN]
        return np.asarray(v.quill_stiffness * twist + v.quill_damping * twisting)


def inputs(element: cl.ForceElement, motion: Motion) -> FloatArray:
    """Inputs of the force element at each wheel, in the order of INPUTS.

    The element has one radius: its `omega` is the one that gives the true slip.
    """
    omega = (motion.speed + motion.slip) / element.radius
    rest = motion.speed, motion.load, motion.lateral_velocity, motion.spin_velocity
    return np.stack([omega, *rest, np.ones_like(omega)])


@contextmanager
def wheels(
    locomotive: Locomotive, fmu: str | os.PathLike[str]
) -> Iterator[Callable[[Motion, float, float], Forces]]:
    """Mean forces over a step, of a motion, a time and a step, by an implicit FMU of eight wheels.

    They are those that the element would have found inside an iteration.
    """
    folder = fmpy.extract(str(fmu))
    description = fmpy.read_model_description(folder)
    reference = {v.name: v.valueReference for v in description.modelVariables}
    given, outputs = ([reference[name] for name in names] for names in (INPUTS, OUTPUTS))
    # The two wheels of an axle push alike. Within a step neither the quill nor the primary
    # springs answer: what moves is the wheelset alone.
    mass = locomotive.vehicle.wheelset_mass
    inverse = 2.0 * (locomotive.wheelset.radius**2 / locomotive.wheel_inertia + 1.0 / mass)
    tool: Any = FMU3Slave(
        guid=description.guid,
        unzipDirectory=folder,
        modelIdentifier=description.modelName,
        instanceName="wheels",
    )

    def forces(motion: Motion, time: float, step: float) -> Forces:
        tool.setFloat64(given, inputs(locomotive.wheel, motion).ravel())
        tool.doStep(time, step)
        found = tool.getFloat64(outputs, nValues=len(OUTPUTS) * AXLES * 2)
        return np.reshape(found, (len(OUTPUTS), AXLES, 2))

    tool.instantiate()
    tool.enterInitializationMode(startTime=0.0)
    tool.setFloat64([reference["effective_inverse_mass"]], [inverse])
    tool.exitInitializationMode()
    try:
        yield forces
    finally:
        tool.terminate()
        tool.freeInstance()
        shutil.rmtree(folder, ignore_errors=True)


def simulate(
    locomotive: Locomotive,
    fmu: str | os.PathLike[str],
    torque: cl.Profile,
    *,
    duration: float,
    step: float,
    speed: float = 10.0,
) -> Run:
    """Run the locomotive from pure rolling; Exudyn holds the outer forces over each step.

    Parameters
    ----------
    locomotive : Locomotive
        Vehicle, wheelsets and track.
    fmu : path
        Its force element, exported with ``implicit=True, fmi_version=3, wheels=8``.
    torque : Profile
        Torque of every motor over time, at the axle [N.m].
    duration, step, speed : float
        Duration and step [s], and speed at the start [m/s].

    Raises
    ------
    RuntimeError
        If Exudyn gives up.
    """
    steps = round(duration / step)
    rows: list[tuple[FloatArray, ...]] = []
    outer = np.zeros(COORDINATES)  # Exudyn needs the first accelerations before the first step

    with wheels(locomotive, fmu) as wheel_forces:

        def before_step(mbs: Any, time: float) -> bool:
            q = np.array(mbs.systemData.GetODE2Coordinates())
            rates = np.array(mbs.systemData.GetODE2Coordinates_t())
            time = len(rows) * step
            driven = np.full(AXLES, torque(time + 0.5 * step))
            rows.append((q, rates, driven))
            motion = locomotive.motion(q, rates)
            found = wheel_forces(motion, time, step)
            outer[:] = outer_forces(locomotive, q, rates, motion, found, driven)
            return True

        mbs = build(locomotive, speed, lambda: outer)
        mbs.SetPreStepUserFunction(before_step)
        settings = exudyn.SimulationSettings()
        settings.timeIntegration.numberOfSteps = steps
        settings.timeIntegration.endTime = steps * step
        settings.timeIntegration.verboseMode = 0
        settings.solution.file.write = False
        if not mbs.SolveDynamic(settings, solverType=exudyn.DynamicSolverType.RK44):
            raise RuntimeError(f"Exudyn gave up at {len(rows) * step:.6g} s")
        before_step(mbs, steps * step)  # the last row
    q, rates, driven = (np.array(part) for part in zip(*rows, strict=True))
    motion = locomotive.motion(q, rates)
    given = dict(zip(INPUTS, inputs(locomotive.wheel, motion), strict=True))
    given["axle_load"] = given.pop("normal_load")  # the name that Python has for the FMU's
    at_rows = locomotive.wheel.evaluate(**given)
    forces = np.stack([at_rows[name] for name in OUTPUTS])
    time = np.arange(steps + 1, dtype=np.float64) * step
    return Run(locomotive, time, q, rates, driven, motion, forces)
