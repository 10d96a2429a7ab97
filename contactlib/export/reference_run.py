"""The reference run that an FMU carries: what it gives for given inputs, by the kernel itself."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from contactlib import kernel
from contactlib.export.description import Description
from contactlib.parameters import FloatArray


class Experiment(NamedTuple):
    """Length and communication step of the reference run [s]."""

    stop: float
    step: float


EXPERIMENTS = {
    "force_element": Experiment(2.0, 5e-3),
    "wheelset": Experiment(4.0, 1e-2),
    "wheelset_body": Experiment(4.0, 1e-2),
}


def reference_inputs(description: Description) -> dict[str, FloatArray]:
    """Inputs by name at the communication points, with ``time`` [s] first.

    They lead through both branches: the creepage of the force element swings from traction to
    braking far past the peak, the drive torque of the wheelset passes what the contact can take
    and comes back.
    """
    stop, step = EXPERIMENTS[description.kind]
    time = step * np.arange(round(stop / step) + 1, dtype=np.float64)
    element = description.model.wheelset.element
    start, swing = description.start_values, np.sin(2.0 * np.pi * time / stop)
    sliding = element.friction.kinetic * element.contact.normal_load
    pulse = np.sin(np.pi * time / stop) ** 2
    columns = {
        "omega": start["omega"] * (1.0 + 6.0 * element.saturation_creepage * swing**3),
        "speed": start["speed"] * (1.0 - 0.2 * time / stop),
        "normal_load": element.contact.normal_load * (1.0 + 0.1 * np.sin(15.0 * time)),
        "friction_scale": 1.0 - 0.3 * pulse**4,
        "drive_torque": element.radius * sliding * (0.9 + 0.4 * pulse),
        "resistance_force": 0.1 * sliding * pulse,
        "creep_force": sliding * (0.9 + 0.2 * pulse),
    }
    if description.kind == "force_element":
        columns["omega"] *= columns["speed"] / start["speed"]
    names = [v.name for v in description.of_role("input")]
    return {"time": time, **{name: columns[name] for name in names}}


def reference_run(description: Description) -> bytes:
    """documentation/reference_run.csv: inputs and outputs at the communication points.

    The outputs of a row belong to its inputs; a step is made with the inputs of the row before.
    """
    inputs = reference_inputs(description)
    time = inputs.pop("time")
    element = description.model.wheelset.element
    native = kernel.NativeModel(description.kind, element.table.native, description.start_values)
    outputs = [v.name for v in description.variables if v.causality == "output"]
    lines = [",".join(["time", *inputs, *outputs])]
    for i, t in enumerate(time.tolist()):
        if i > 0:
            native.advance(t - float(time[i - 1]))
        row = {name: float(column[i]) for name, column in inputs.items()}
        native.set(**row)
        native.evaluate()
        lines.append(",".join(map(repr, [t, *row.values(), *native.get(*outputs)])))
    return ("\n".join(lines) + "\n").encode()
