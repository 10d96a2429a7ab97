"""Runs of the locomotive: Exudyn moves the bodies, contactlib gives the wheels' forces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import exudyn
import numpy as np

import contactlib as cl
from contactlib.base.quantities import POSITIVE, FloatArray, checked_number

from .formulas import Formulas
from .system import build
from .vehicle import AXLES, COORDINATES, SHAFT, SPIN, Forces, Locomotive, Motion
from .wheels import Element, Source, inputs


class Drive(Protocol):
    """Source of the motors' torques, such as `Motors`."""

    sample_time: float

    def sample(self, time: float, omega: FloatArray, speed: float) -> None:
        """See the wheels' angular velocities [rad/s] and the speed [m/s]."""

    def step(self, step: float) -> FloatArray:
        """Torque of each axle over the next step [N.m]."""


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
    torque, friction : ndarray
        Torque of each motor over the step after a row [N.m], friction scale of each wheel [1].
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
    friction: FloatArray
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


def simulate(
    locomotive: Locomotive,
    drive: Drive,
    *,
    duration: float,
    step: float,
    speed: float = 10.0,
    source: Source | None = None,
    held: bool = False,
    implicit: bool = False,
    rails: cl.Track | None = None,
) -> Run:
    """Run the locomotive from pure rolling.

    Parameters
    ----------
    locomotive : Locomotive
        Vehicle, wheelsets and track.
    drive : Drive
        Torques of the motors.
    duration, step, speed : float
        Duration and step [s], and speed at the start [m/s].
    source : Source, optional
        Source of the wheels' forces. Default: contactlib's force element.
    held : bool, optional
        Whether the outer forces are found once, at the start of a step, and held over it, instead
        of inside Exudyn's integrator.
    implicit : bool, optional
        Whether Exudyn integrates with its generalized-alpha method instead of Runge and Kutta's,
        which needs fewer calls. It takes stiff forces, but held ones half a step late.
    rails : Track, optional
        Friction along the track, and its recovery by the slip work of the axles. Default: dry.

    Raises
    ------
    ValueError
        If a value is out of range, or the step is no whole fraction of the drive's sample time.
    RuntimeError
        If Exudyn gives up.
    """
    for name, value in (("duration", duration), ("step", step), ("speed", speed)):
        checked_number(name, value, POSITIVE)
    source = Element(locomotive) if source is None else source
    formulas = Formulas(locomotive)
    steps = round(duration / step)
    samples = min(drive.sample_time / step, float(steps + 1))
    per_sample = max(1, round(samples))
    if abs(samples - per_sample) > 1e-6:
        raise ValueError(
            f"step = {step!r} s must be a whole fraction of the drive's sample time, "
            f"{drive.sample_time!r} s"
        )
    at = locomotive.motion(np.zeros_like(locomotive.reference), locomotive.start(speed)).distance
    state = cl.vehicle.RailState(cl.Track() if rails is None else rails, at)
    rows: list[tuple[FloatArray, ...]] = []
    # Exudyn needs the first accelerations before the first step.
    now = {
        "torque": np.zeros(AXLES),
        "friction": state.friction(at),
        "outer": np.zeros(COORDINATES),
    }

    def found(q: FloatArray, rates: FloatArray) -> FloatArray:
        _, given = formulas.wheels(q, rates)
        of_wheels = source.forces(given, now["friction"], len(rows) * step, step)
        return formulas.outer_forces(q, rates, of_wheels, now["torque"])

    def before_step(mbs: Any, time: float) -> bool:
        row = len(rows)
        q = np.array(mbs.systemData.GetODE2Coordinates())
        rates = np.array(mbs.systemData.GetODE2Coordinates_t())
        distance, given = formulas.wheels(q, rates)
        omega, speed, _, across, turning = given
        if row % per_sample == 0:
            drive.sample(row * step, rates[SPIN], float(speed.mean()))
        now["torque"], now["friction"] = drive.step(step), state.friction(distance)
        rows.append((q, rates, now["torque"], now["friction"]))
        if held or state.cleans:
            of_wheels = creep, lateral, moment = source.forces(
                given, now["friction"], row * step, step
            )
            slip = locomotive.wheel.radius * omega - speed
            power = creep * slip - lateral * across - moment * turning
            state.slide(distance, power / speed)
        if held:
            now["outer"] = formulas.outer_forces(q, rates, of_wheels, now["torque"])
        return True

    mbs = build(
        locomotive,
        speed,
        (lambda q, rates: now["outer"]) if held else found,
    )
    mbs.SetPreStepUserFunction(before_step)
    settings = exudyn.SimulationSettings()
    settings.timeIntegration.numberOfSteps = steps
    settings.timeIntegration.endTime = steps * step
    settings.timeIntegration.verboseMode = 0
    settings.solution.file.write = False
    settings.timeIntegration.newton.useModifiedNewton = True
    solvers = exudyn.DynamicSolverType
    solver = solvers.GeneralizedAlpha if implicit else solvers.RK44
    if not mbs.SolveDynamic(settings, solverType=solver):
        raise RuntimeError(f"Exudyn gave up at {len(rows) * step:.6g} s")
    before_step(mbs, steps * step)  # the last row
    q, rates, torque, friction = (np.array(part) for part in zip(*rows, strict=True))
    motion = locomotive.motion(q, rates)
    forces = Element(locomotive).forces(inputs(locomotive.wheel, motion), friction, 0.0, step)
    time = np.arange(steps + 1, dtype=np.float64) * step
    return Run(locomotive, time, q, rates, torque, friction, motion, forces)
