"""Co-simulation of a wheelset with an external creep force, exchanged at fixed steps.

At every step the master passes velocities, receives a force and moves the body under it. The same
loop with the kernel instead of an FMU shows the error of the FMU, and `simulate` the error of the
exchange.
"""

from __future__ import annotations

import os
import shutil
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple, Protocol, Self

import numpy as np

from contactlib import kernel
from contactlib.base.lazy import optional_library
from contactlib.base.quantities import POSITIVE, checked_number
from contactlib.element.force_element import ForceElement, creepage_limits
from contactlib.runs.derived_columns import continuous_result
from contactlib.runs.result import Result
from contactlib.vehicle.continuous_control import ContinuousController
from contactlib.vehicle.creep_curve import CreepCurve
from contactlib.vehicle.wheelset import Wheelset

MAX_STEPS = 100_000_000  # more than a day at 1 ms


class Contact(NamedTuple):
    """Creep force on the body [N], and creepage for the controller [1]."""

    creep_force: float
    creepage: float


class ForceSource(Protocol):
    """Source of the creep force for given velocities."""

    def exchange(
        self, time: float, step: float, omega: float, speed: float, load: float, scale: float
    ) -> Contact:
        """Return the force for the step from `time`, from the state at its start."""


class KernelSource:
    """The force element of this process."""

    def __init__(self, element: ForceElement) -> None:
        self._native = element.native

    def exchange(
        self, time: float, step: float, omega: float, speed: float, load: float, scale: float
    ) -> Contact:
        """Return the force for the step from `time`, from the state at its start."""
        contact = self._native.evaluate_one(omega, speed, load, scale)
        return Contact(contact.creep_force, contact.creepage)


class FmuSource:
    """The force element as an FMI 2.0 co-simulation FMU, run by FMPy.

    A context manager: it unpacks and starts the FMU, and terminates and removes it. Log messages of
    the FMU, such as that its step is too long, become a RuntimeWarning.

    Parameters
    ----------
    path : path
        The FMU.
    wheels : int, optional
        Number of equal wheels; the FMU is one of them. Default: 1.

    Raises
    ------
    RuntimeError
        If the FMU reports an error; the message contains its log.
    """

    INPUTS = ("omega", "speed", "normal_load", "friction_scale")
    OUTPUTS = ("creep_force", "creepage")

    def __init__(self, path: str | os.PathLike[str], *, wheels: int = 1) -> None:
        self._path, self._wheels = Path(path), wheels
        self._messages: list[str] = []

    def __enter__(self) -> Self:
        fmpy, fmi2 = optional_library("fmpy"), optional_library("fmpy.fmi2")
        description = fmpy.read_model_description(str(self._path))
        references = {v.name: v.valueReference for v in description.modelVariables}
        self._inputs = [references[name] for name in self.INPUTS]
        self._outputs = [references[name] for name in self.OUTPUTS]
        self._folder = fmpy.extract(str(self._path))

        def log(environment: Any, name: bytes, status: int, category: bytes, text: bytes) -> None:
            self._messages.append(text.decode(errors="replace"))

        self._callbacks = fmi2.fmi2CallbackFunctions()
        self._callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(log)
        self._fmu = fmi2.FMU2Slave(
            guid=description.guid,
            unzipDirectory=self._folder,
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName="creep_force",
        )
        try:
            self._run(self._fmu.instantiate, callbacks=self._callbacks)
            self._run(self._fmu.setupExperiment, startTime=0.0)
            self._run(self._fmu.enterInitializationMode)
            self._run(self._fmu.exitInitializationMode)
        except BaseException:
            shutil.rmtree(self._folder, ignore_errors=True)
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if error is None:
            self._fmu.terminate()
        self._fmu.freeInstance()
        shutil.rmtree(self._folder, ignore_errors=True)

    def _run(self, function: Callable[..., Any], *args: Any, **named: Any) -> Any:
        try:
            result = function(*args, **named)
        except optional_library("fmpy.fmi1").FMICallException as error:
            reason = "; ".join(self._messages) or str(error)
            raise RuntimeError(f"{self._path}: {reason}") from None
        while self._messages:
            warnings.warn(f"{self._path}: {self._messages.pop(0)}", RuntimeWarning, stacklevel=3)
        return result

    def exchange(
        self, time: float, step: float, omega: float, speed: float, load: float, scale: float
    ) -> Contact:
        """Return the force for the step from `time`, from the state at its start."""
        self._run(self._fmu.setReal, self._inputs, [omega, speed, load / self._wheels, scale])
        self._run(self._fmu.doStep, currentCommunicationPoint=time, communicationStepSize=step)
        force, creepage = self._run(self._fmu.getReal, self._outputs)
        return Contact(self._wheels * force, creepage)


def cosimulate(
    wheelset: Wheelset,
    source: ForceSource,
    controller: ContinuousController,
    *,
    duration: float,
    step: float,
    initial_speed: float,
    initial_creepage: float,
    progress: Callable[[float], object] = lambda part: None,
) -> Result:
    """Step the body under nominal load with the force held over each step.

    The method is explicit and of first order in `step`. The creep force makes the coupling stiff:
    `step` times the slip pole must stay below 2.

    Parameters
    ----------
    wheelset : Wheelset
        The body.
    source : ForceSource
        Source of the creep force.
    controller : TorqueControl or CreepControl
        Continuous controller, evaluated once per step.
    duration, step : float
        Duration and communication step [s].
    initial_speed, initial_creepage : float
        State at the start [m/s, 1].
    progress : callable, optional
        Called with the fraction of `duration` that is done, from 0 to 1.

    Raises
    ------
    ValueError
        If a value is out of range, the steps are too many, or so long that the numbers overflow.
    RuntimeError
        If the source reports an error.
    """
    duration = checked_number("duration", duration, POSITIVE)
    step = checked_number("step", step, POSITIVE)
    if duration / step > MAX_STEPS:
        raise ValueError(
            f"duration = {duration!r} is out of range: must be <= {MAX_STEPS} times step = {step!r}"
        )
    limits = kernel.wheelset_limits()
    slowest = wheelset.element.minimum_speed
    speed = checked_number(
        "initial_speed", initial_speed, replace(limits["speed"], at_least=slowest)
    )
    reachable = creepage_limits(wheelset.element, speed, "initial_speed")
    creepage = checked_number("initial_creepage", initial_creepage, reachable)
    n = max(1, round(duration / step))
    time = step * np.arange(n + 1, dtype=np.float64)
    reference = controller.reference(time)
    load = wheelset.element.normal_load
    start = float(CreepCurve(wheelset, speed=speed).torque(creepage))
    omega = (1.0 + creepage) * speed / wheelset.radius
    memory, law = controller.start(start), controller.native
    omegas, speeds, torques = np.empty(n + 1), np.empty(n + 1), np.empty(n + 1)
    for i, (t, target) in enumerate(zip(time.tolist(), reference.tolist(), strict=True)):
        contact = source.exchange(t, step, omega, speed, load, 1.0)
        command = law.command(target, contact.creepage, memory)
        omegas[i], speeds[i], torques[i] = omega, speed, command.torque
        rates = wheelset.native.motion(
            omega, speed, command.torque, 0.0, kernel.contact_with_force(contact.creep_force)
        )
        omega += step * rates.omega_rate
        speed += step * rates.speed_rate
        memory += step * command.memory_rate
        if i % 1000 == 0:
            progress(i / n)
    if not (limits["omega"].allow_all(omegas) and limits["speed"].allow_all(speeds)):
        raise ValueError(
            f"step = {step!r}, initial_speed = {initial_speed!r}, initial_creepage = "
            f"{initial_creepage!r}: the coupling does not converge, so the step must be shorter"
        )
    columns = {
        "time": time,
        "omega": omegas,
        "speed": speeds,
        "drive_torque": torques,
        "reference": reference,
        "normal_load": np.full(n + 1, load),
        "friction_scale": np.ones(n + 1),
        "resistance_force": np.zeros(n + 1),
    }
    return continuous_result(wheelset, controller, columns)
