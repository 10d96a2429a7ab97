"""A run of an FMU, which a saved state can part: the second part in another process.

    python fmu_run.py FOLDER STATE FIRST COUNT

takes STATE over, makes COUNT steps from number FIRST on and prints what came out as hexadecimal
numbers, which keep every bit. It does not depend on contactlib.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

from fmu_instance import Instance

STEP = 2e-2  # long enough for the wheelset to take substeps
OUTPUTS = {
    "CreepForceElement": ("creep_force", "creepage", "normalized_creepage", "force_gradient"),
    "Wheelset": ("omega", "speed", "creep_force", "falling_branch"),
    "WheelsetBody": ("omega", "speed"),
    "Vehicle": ("omega", "speed", "creep_force", "axle_load", "friction"),
    "CreepForces": ("force_x", "force_y", "spin_moment", "utilisation"),
}


def inputs(fmu: Instance, number: int, phase: float = 0.0) -> dict[str, float]:
    """Inputs of a step: over the peak and back, in traction and braking."""
    wave = math.sin(0.02 * number + phase)
    values = {
        "omega": 20.0 + 0.7 * wave,
        "speed": 10.0,
        "lateral_velocity": 0.1 * wave,
        "creepage_x": -0.07 * wave,
        "spin": wave,
        "drive_torque": 3e4 * wave,
        "motor_torque": 3e4 * wave,
        "creep_force": 5e4 * math.sin(0.02 * number),
    }
    given = {v.name for v in fmu.description.modelVariables if v.causality == "input"}
    return {name: value for name, value in values.items() if name in given}


def run(fmu: Instance, first: int, count: int, *, every: int = 1, phase: float = 0.0) -> list[str]:
    """Outputs after steps, every bit of them; inputs and outputs `every` so many steps."""
    names = OUTPUTS[fmu.description.modelName]
    rows = []
    for number in range(first, first + count):
        if number % every == 0:
            fmu.set(**inputs(fmu, number, phase))
        fmu.step(STEP * number, STEP)
        if number % every == 0:
            rows.append(" ".join(map(float.hex, fmu.get(*names))))
    return rows


if __name__ == "__main__":
    folder, state, first, count = sys.argv[1:]
    with Instance(Path(folder)) as fmu:
        fmu.start()
        fmu.restore(Path(state).read_bytes())
        print("\n".join(run(fmu, int(first), int(count))))
