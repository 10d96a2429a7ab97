"""One wheelset under continuous control, integrated to high accuracy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from contactlib.kernel.bodies import memory_states
from contactlib.kernel.drivetrains import NativeFleet
from contactlib.kernel.library import ffi, library, pointer, struct_dtype

CHUNK = 4096  # rows that are fetched at once


class NativeLaw:
    """A continuous control law. Checks nothing."""

    def __init__(self, **parameters: float) -> None:
        library()
        self.struct = ffi.new("control_law *", parameters)

    def command(self, reference: float, creepage: float, integral_torque: float) -> Any:
        """Struct of the torque, its integral part's rate and their derivatives."""
        command = ffi.new("control_command *")
        library().control_law_command(self.struct, reference, creepage, integral_torque, command)
        return command


class NativeRun(NamedTuple):
    """Rows of a stretch of a run; its events by index of the crossing; whether one ended it."""

    rows: NDArray[np.void]
    events: list[tuple[int, float, NDArray[np.void]]]
    stopped: bool


def run_wheelset(
    fleet: NativeFleet,
    law: NativeLaw,
    first: Mapping[str, float],
    *,
    span: tuple[float, float],
    inputs: Sequence[Mapping[str, float]],
    crossings: Sequence[Mapping[str, float]] = (),
    interval: float = 0.0,
    tolerance: float,
    scale: Mapping[str, float],
) -> NativeRun:
    """Run a fleet of one wheelset over a stretch of time on which all inputs are linear.

    Parameters
    ----------
    fleet : NativeFleet
        One drivetrain with a rigid axle, without motor lag.
    law : NativeLaw
        Control law of the drive torque.
    first : mapping
        Members of the struct `run_row` at the start; with memory those of the contact too.
    span : tuple of float
        Start and end [s]; an end before the start runs backward.
    inputs : sequence of mapping
        Members of the struct `run_input` at both ends.
    crossings : sequence of mapping, optional
        Members of the struct `run_crossing` of each event.
    interval : float, optional
        Time between rows that are added to the integrator's steps [s]. Default: none.
    tolerance : float
        Relative error of a step in each member of `run_row` but the time; that of the slip stands
        in place of omega's.
    scale : mapping
        Sizes of these members, which are added to theirs there.

    Raises
    ------
    RuntimeError
        If the integrator gives up.
    """
    lib = library()
    given = {
        "law": law.struct[0],
        "start": span[0],
        "end": span[1],
        "from": dict(inputs[0]),
        "to": dict(inputs[1]),
        "interval": interval,
        "tolerance": tolerance,
        "scale": _row(scale),
        "crossings": len(crossings),
        "crossing": list(crossings),
    }
    stretch, row = ffi.new("run_stretch *", given), ffi.new("run_row *", _row(first))
    run = ffi.gc(lib.wheelset_run_begin(fleet.members, stretch, row), lib.wheelset_run_free)
    if run == ffi.NULL:
        raise MemoryError
    status, count = ffi.new("int *"), ffi.new("size_t *")
    found = ffi.new("run_event[]", lib.RUN_CROSSINGS)
    parts, events = [], []
    while status[0] == lib.RUN_GOES_ON:
        rows = np.empty(CHUNK, struct_dtype("run_row"))
        written = lib.wheelset_run_rows(run, CHUNK, pointer(rows, "run_row"), status, count, found)
        parts.append(rows[:written])
        for event in found[0 : count[0]]:
            place = np.frombuffer(ffi.buffer(ffi.addressof(event, "row")), rows.dtype)[0].copy()
            events.append((event.crossing, event.creepage, place))
    if status[0] == lib.RUN_FAILED:
        at = parts[-1]["time"][-1] if parts[-1].size else span[0]
        raise RuntimeError(f"the integrator does not meet the tolerance after {at:.6g} s")
    return NativeRun(np.concatenate(parts), events, status[0] == lib.RUN_STOPPED)


def _row(values: Mapping[str, float]) -> dict[str, Any]:
    """Members of the struct `run_row`, those of the memory in a struct of their own."""
    states = memory_states()
    return {
        **{name: value for name, value in values.items() if name not in states},
        "memory": {name: values.get(name, 0.0) for name in states},
    }
