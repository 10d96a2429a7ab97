"""Runs of the wet patch as a batch of fixed steps, compiled by numba if it is there."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from wheelset_rival import compiled, control, is_wet, motion, start, tabulate

from contactlib.base.quantities import FloatArray

GAMMA = 1.0 - math.sqrt(0.5)  # of ROS2, which is L-stable with it


@compiled
def until_corner(run: Any, distance: float, speed: float) -> float:
    """Time to the next end of the patch at this speed."""
    if distance < run.patch_start:
        return float((run.patch_start - distance) / speed)
    return float((run.patch_end - distance) / speed) if distance < run.patch_end else math.inf


@compiled
def drive(run: Any, steps: int, per_sample: int, found: FloatArray, creepages: FloatArray) -> None:
    """One run in fixed steps by ROS2; fills in `OUTCOMES`, and the creepages if there is room.

    The two-stage linearly implicit Rosenbrock method of Verwer et al., SIAM J. Sci. Comput. 20
    (1999) 1456-1480. A step ends where the patch does.
    """
    memory = np.zeros(4)
    omega, speed = start(run, memory), run.speed
    length = run.sample_time / per_sample
    distance = work = largest = torque = 0.0
    dry, wet = tabulate(run.k_hat), tabulate(run.k_hat / math.sqrt(run.patch_friction))
    i, left = 0, 0.0
    while True:
        if left == 0.0:
            creepage = run.radius * omega / speed - 1.0
            largest = max(largest, abs(creepage))
            if i < creepages.size:
                creepages[i] = creepage
            if i == steps:
                break
            if i % per_sample == 0:
                torque = control(run, memory, run.radius * omega, speed)
            left = length
            i += 1
        h = min(left, until_corner(run, distance, speed))
        h = h if h < left * (1.0 - 1e-9) else left
        in_patch = is_wet(run, distance + 0.5 * h * speed)
        nodes, friction = (wet, run.patch_friction) if in_patch else (dry, 1.0)
        f0, f1, j00, j01, j10, j11, force = motion(run, nodes, omega, speed, torque, friction)
        # (I - gamma h J) k = f
        a = GAMMA * h
        e00, e11, e01, e10 = 1.0 - a * j00, 1.0 - a * j11, a * j01, a * j10
        inverse = 1.0 / (e00 * e11 - e01 * e10)
        k0, k1 = inverse * (e11 * f0 + e01 * f1), inverse * (e10 * f0 + e00 * f1)
        power = force * (run.radius * omega - speed)
        middle = omega + h * k0, speed + h * k1
        g0, g1, _, _, _, _, force = motion(run, nodes, *middle, torque, friction)
        power += force * (run.radius * middle[0] - middle[1])
        g0, g1 = g0 - 2.0 * k0, g1 - 2.0 * k1
        l0, l1 = inverse * (e11 * g0 + e01 * g1), inverse * (e10 * g0 + e00 * g1)
        way = speed + a * k1
        distance += h * (1.5 * way + 0.5 * (middle[1] - 2.0 * way + a * l1))
        omega += h * (1.5 * k0 + 0.5 * l0)
        speed += h * (1.5 * k1 + 0.5 * l1)
        work += 0.5 * h * power
        if h < left:  # exactly at a corner, and not before it by rounding
            distance = run.patch_end if in_patch else run.patch_start
        left = left - h if h < left else 0.0
    found[0], found[1], found[2], found[3] = distance, speed, largest, work


@compiled
def drive_many(runs: Any, steps: int, per_sample: int, found: FloatArray) -> None:
    """All runs, one after the other; `found` is (n, outcomes)."""
    no_creepages = np.empty(0)
    for i in range(runs.size):
        drive(runs[i], steps, per_sample, found[i], no_creepages)
