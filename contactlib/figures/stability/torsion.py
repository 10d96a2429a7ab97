"""Wheels that vibrate against each other on an elastic axle: which amplitudes persist."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.optimize import brentq

from contactlib import kernel
from contactlib.base.quantities import FloatArray
from contactlib.figures.stability.steepest import steepest_fall
from contactlib.figures.style import (
    DASHED,
    add_caption,
    dot,
    labelled,
    new_figure,
    note,
    paint,
    percent,
    setting,
    styled,
)
from contactlib.stability.torsion import (
    bistable_range,
    effective_slope,
    torsional_state,
    torsional_threshold,
)
from contactlib.vehicle.conditions import OperatingPoint
from contactlib.vehicle.drivetrain import Axle, Drivetrain
from contactlib.vehicle.wheelset import Wheelset

FREQUENCY, DAMPING_RATIO = 50.0, 0.01  # chosen for the axle that is drawn [Hz, 1]
MEANS = 37  # mean creepages of the bifurcation diagram
SIMULATED = (0.7, 1.0, 1.4, 1.75, 2.1, 2.6)  # mean creepages / creepage of the steepest fall
KICKS = (0.05, 1.5)  # initial amplitudes of the runs / mean creepage
STEP, CYCLES = 2.5e-4, 150  # step and length of a run [s, 1]
AMPLITUDE = "amplitude of a wheel's creepage  [%]"
LAST = 10  # cycles at the end of a run from which its amplitude is read
TIGHT = 0.3  # gain of the mean creepage's control / gain that corrects an error within one step


def torsion_figure(wheelset: Wheelset, speed: float) -> Figure:
    """Effective slope over the amplitude; persistent amplitudes over the mean creepage."""
    drivetrain = Drivetrain(wheelset, axle=drawn_axle(wheelset))
    with styled(paint.hatched):
        figure, (left, right) = new_figure(9.2, 5.2, ncols=2)
        both = bistable_range(drivetrain, speed=speed)
        _slopes(left, drivetrain, speed, both)
        _amplitudes(right, drivetrain, speed, both)
        add_caption(
            figure,
            f"Axle of {FREQUENCY:g} Hz and {100.0 * drivetrain.torsional_damping_ratio:.3g} % of "
            "critical damping (chosen); the mean creepage is held. The amplitude grows where the "
            "effective slope of the force falls more steeply than the damping $2 D \\omega_t$ "
            f"allows. Circles: simulated, after {CYCLES} cycles. Rolling is taken as steady. "
            f"{setting(wheelset, speed)}",
        )
    return figure


def drawn_axle(wheelset: Wheelset) -> Axle:
    """An axle on which the wheels vibrate at 50 Hz, with 1 % of critical damping."""
    omega = 2.0 * np.pi * FREQUENCY
    damping = 0.25 * (2.0 * DAMPING_RATIO * omega * wheelset.inertia - wheelset.damping)
    return Axle(stiffness=0.25 * omega**2 * wheelset.inertia, damping=max(0.0, damping))


def simulated_amplitudes(
    drivetrain: Drivetrain, points: list[OperatingPoint], kicks: FloatArray
) -> FloatArray:
    """Largest |zeta_left - zeta_right|/2 at the end of runs that start with amplitudes `kicks`.

    The kernel steps all runs at once; a tight sampled controller holds their mean creepages.
    """
    wheelset = drivetrain.wheelset
    fleet = kernel.NativeFleet([drivetrain.member()] * len(points))
    inputs = np.zeros(len(points), kernel.drivetrain_dtype("input"))
    states = np.zeros(len(points), kernel.drivetrain_dtype("state"))
    mean, torque, speed = (
        np.array([getattr(point, name) for point in points])
        for name in ("creepage", "drive_torque", "speed")
    )
    inputs["resistance_force"] = [point.resistance_force for point in points]
    inputs["load_left"] = inputs["load_right"] = [0.5 * point.axle_load for point in points]
    inputs["friction_left"] = inputs["friction_right"] = [p.friction_scale for p in points]
    inputs["slope"] = 1.0
    states["speed"] = speed
    states["omega_left"] = states["omega_right"] = [point.omega for point in points]
    states["twist"] = 2.0 * speed * kicks / (wheelset.radius * drivetrain.torsional_frequency)
    gain = TIGHT * wheelset.inertia * speed / (wheelset.radius * STEP)  # g Kp = TIGHT/STEP
    substeps = np.zeros(len(points))
    period = 2.0 * np.pi / drivetrain.torsional_frequency
    steps, last = (round(cycles * period / STEP) for cycles in (CYCLES, LAST))
    largest = np.zeros(len(points))
    for i in range(steps):
        left, right = (
            wheelset.radius * states[f"omega_{side}"] / states["speed"] - 1.0
            for side in ("left", "right")
        )
        if i >= steps - last:
            largest = np.maximum(largest, 0.5 * np.abs(left - right))
        inputs["commanded_torque"] = torque + gain * (mean - 0.5 * (left + right))
        fleet.advance(inputs, states, 0.0, STEP, 1e-6, substeps)
    return largest


def _slopes(
    axes: Axes, drivetrain: Drivetrain, speed: float, both: tuple[float, float] | None
) -> None:
    wheelset = drivetrain.wheelset
    steepest = steepest_fall(wheelset, speed).creepage
    means = (steepest, 2.0 * steepest, 3.0 * steepest)
    if both is not None and np.isfinite(both[1]):
        means = (steepest, 0.5 * (both[0] + both[1]), 1.15 * both[1])
    amplitude = np.linspace(0.0, 2.2 * means[1], 241)
    limit = -1e-3 * torsional_threshold(drivetrain, speed=speed)
    top = -0.65e-3 * wheelset.balanced(creepage=steepest, speed=speed).creep_force_slope
    bottom, end = -0.55 * top, 0.0
    for mean, (color, width) in zip(means, paint.three, strict=True):
        point = wheelset.balanced(creepage=mean, speed=speed)
        fall = -1e-3 * effective_slope(wheelset, point, amplitude)
        name = f"at {100.0 * mean:.2g} % mean creepage"
        axes.plot(amplitude, fall, color=color, lw=width, label=name)
        leaves = np.flatnonzero(fall < bottom)
        end = max(end, float(amplitude[leaves[0] if leaves.size else -1]))
        for cycle in torsional_state(drivetrain, point).limit_cycles:
            if cycle.amplitude < amplitude[-1]:
                dot(axes, cycle.amplitude, limit, stable=cycle.stable)
    axes.axhline(limit, color=paint.ink, lw=1.2, ls=DASHED)
    look: dict[str, Any] = {"xycoords": ("axes fraction", "data"), "ha": "right"}
    note(axes, r"$2 D \omega_t$: the amplitude grows above", (1.0, limit), (-2, 5), **look)
    axes.axhline(0.0, color=paint.ink, lw=0.9)
    limits: dict[str, Any] = {"xlim": (0.0, end), "ylim": (bottom, top)}
    force = "effective fall of a wheel's force $-N$  [kN]"
    labelled(axes, AMPLITUDE, force, "Effective slope; dots: limit cycles", legend={}, **limits)
    per_second = 1e3 * 2.0 * wheelset.radius**2 / (wheelset.inertia * speed)
    ways = partial(np.multiply, per_second), partial(np.multiply, 1.0 / per_second)
    rates = axes.secondary_yaxis("right", functions=ways)
    rates.set_ylabel(r"$-r^2 N/(J_w V)$  [1/s]")


def _amplitudes(
    axes: Axes, drivetrain: Drivetrain, speed: float, both: tuple[float, float] | None
) -> None:
    wheelset = drivetrain.wheelset
    steepest = steepest_fall(wheelset, speed).creepage
    far = 3.0 * steepest
    if both is not None:  # to its end; one without an end, far enough to see where it begins
        far = max(far, 1.12 * both[1] if np.isfinite(both[1]) else 2.0 * both[0])
    means = _means(drivetrain, speed, steepest, far, both)
    if both is not None:
        shaded: dict[str, Any] = {"facecolor": paint.shade, "hatch": "//", "lw": 0.0, "zorder": 0}
        text = f"bistable, {percent(both[0])} to {percent(min(both[1], far))}"
        axes.axvspan(both[0], min(both[1], far), label=text, **shaded)
    states = [
        torsional_state(drivetrain, wheelset.balanced(creepage=float(z), speed=speed))
        for z in means
    ]
    rest = np.array([state.equilibrium_stable for state in states])
    kinds = ((True, paint.blue, "-", "stable"), (False, paint.orange, DASHED, "unstable"))
    largest = 0.0
    for kept, color, style, name in kinds:
        sizes = np.array([_size(state.limit_cycles, kept) for state in states])
        there = np.isfinite(sizes)
        resting = np.where(rest == kept, 0.0, np.nan)
        # The legend names what is drawn: limit cycles or, without any, the state of rest.
        labels = (name, None) if there.any() else (None, name)
        if there.any():
            axes.plot(means[there], sizes[there], color=color, ls=style, label=labels[0])
        if (rest == kept).any():
            look: dict[str, Any] = {"color": color, "ls": style, "label": labels[1]}
            axes.plot(means, resting, lw=3.0, clip_on=False, **look)
        largest = max(largest, float(sizes[there].max(initial=0.0)))
    parts = np.array(SIMULATED)
    beyond = np.maximum(parts - 1.0, 0.0) * 0.5 * (far / steepest - 3.0)  # over the whole axis
    centres = np.repeat(steepest * (parts + beyond), len(KICKS))
    kicks = centres * np.tile(KICKS, len(SIMULATED))
    points = [wheelset.balanced(creepage=float(z), speed=speed) for z in centres]
    amplitudes = simulated_amplitudes(drivetrain, points, kicks)
    line: dict[str, Any] = {"ls": "none", "marker": "o", "color": paint.ink, "mfc": "none", "ms": 7}
    axes.plot(centres, amplitudes, label="simulated", clip_on=False, zorder=6, **line)
    top = 1.35 * max(largest, float(amplitudes.max()))
    limits: dict[str, Any] = {"xlim": (means[0], means[-1]), "ylim": (0.0, top)}
    title = "Amplitudes that persist"
    labelled(axes, "mean creepage  [%]", AMPLITUDE, title, legend={}, **limits)


def _means(
    drivetrain: Drivetrain,
    speed: float,
    steepest: float,
    far: float,
    both: tuple[float, float] | None,
) -> FloatArray:
    """Mean creepages, closely spaced where amplitudes begin and end."""
    wheelset = drivetrain.wheelset
    limit = torsional_threshold(drivetrain, speed=speed)

    def excess(creepage: float) -> float:
        return 0.5 * wheelset.balanced(creepage=creepage, speed=speed).creep_force_slope - limit

    means = np.linspace(0.5 * steepest, far, MEANS)
    close = (means[1] - means[0]) * np.array([1e-4, 0.03, 0.15, 0.5])
    parts = [means]
    if excess(float(means[0])) > 0.0 > excess(steepest):
        parts.append(brentq(excess, float(means[0]), steepest) + close)
    if both is not None:
        parts += [both[0] + close, both[1] - close]
    values = np.unique(np.concatenate(parts))
    return values[values <= far]


def _size(cycles: Any, stable: bool) -> float:
    """Amplitude of the largest stable or unstable limit cycle; nan without any."""
    return max((c.amplitude for c in cycles if c.stable == stable), default=float("nan"))
