"""Responses of python-control's systems that step over no pulse."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from contactlib.parameters import FINITE, POSITIVE, Limits, checked, checked_number
from contactlib.profile import Profile

if TYPE_CHECKING:
    from control import NonlinearIOSystem, TimeResponseData

MOST_ROWS = 10_000_000
ROWS = 1001  # of a response, if no interval is asked for


def response(
    system: NonlinearIOSystem,
    inputs: Mapping[str, float | Profile],
    *,
    initial_state: ArrayLike,
    duration: float,
    output_interval: float | None = None,
    tolerance: float = 1e-8,
) -> TimeResponseData:
    """Response of a continuous system, integrated from corner to corner of its inputs.

    `control.input_output_response` hands its solver one long interval, and a stiff solver at rest
    steps over a short pulse in it. Here each stretch on which all inputs are straight is an
    interval of its own.

    Parameters
    ----------
    system : control.NonlinearIOSystem
        With named inputs, such as `Wheelset.to_nlsys` and `creep_control_system` give.
    inputs : mapping of str to float or Profile
        Every input of the system over time, by name.
    initial_state : array_like
        At time zero.
    duration : float
        [s].
    output_interval : float, optional
        Rows are this grid and the corners [s]; a thousandth of `duration` if left out.
    tolerance : float, optional
        Relative tolerance of the solver (Radau) [1].

    Returns
    -------
    control.TimeResponseData
        A jump of an input has one row, from it on.

    Raises
    ------
    ValueError
        If the system is sampled, an input is missing or unknown, or a value is out of range.
    RuntimeError
        If the solver gives up.
    """
    import control

    if not system.isctime():
        raise ValueError(f"system.dt = {system.dt!r}: the system is sampled, it has no corners")
    if set(inputs) != set(system.input_labels):
        wanted = ", ".join(system.input_labels)
        raise ValueError(f"inputs = {sorted(inputs)!r} must be those of the system: {wanted}")
    duration = checked_number("duration", duration, Limits(at_least=1e-9))
    tolerance = checked_number("tolerance", tolerance, Limits(at_least=1e-12, at_most=1e-2))
    interval = duration / (ROWS - 1) if output_interval is None else output_interval
    interval = checked_number("output_interval", interval, POSITIVE)
    if duration / interval > MOST_ROWS:
        raise ValueError(
            f"output_interval = {interval!r} is out of range: must be >= duration = {duration!r} "
            f"over {MOST_ROWS}"
        )
    given = {name: inputs[name] for name in system.input_labels}
    profiles = [
        value
        if isinstance(value, Profile)
        else Profile.of(checked_number(f"inputs[{name!r}]", value, FINITE))
        for name, value in given.items()
    ]
    corners = {0.0, float(duration)}
    corners.update(t for profile in profiles for t in profile.at if 0.0 < t < duration)
    state = checked("initial_state", initial_state, FINITE)
    if state.shape != (system.nstates,):
        raise ValueError(
            f"initial_state has the shape {state.shape}: it must have one number for each of "
            f"{system.nstates} states"
        )
    scale = np.maximum(np.abs(state), 1e-3)
    grid = interval * np.arange(1, int(np.ceil(duration / interval)))

    parts: list[Any] = []
    for start, end in pairwise(sorted(corners)):
        inside = grid[(grid > start) & (grid < end)]
        part = control.input_output_response(
            system,
            timepts=np.array([start, end]),
            inputs=np.array([profile.on(start, end) for profile in profiles]),
            initial_state=state,
            evaluation_times=np.concatenate([[start], inside, [end]]),
            squeeze=False,
            solve_ivp_method="Radau",
            solve_ivp_kwargs={"rtol": tolerance, "atol": tolerance * scale},
        )
        state = part.states[:, -1]
        parts.append(part)

    def joined(name: str) -> Any:
        rows = [getattr(part, name)[..., :-1] for part in parts[:-1]]
        return np.concatenate([*rows, getattr(parts[-1], name)], axis=-1)

    return control.TimeResponseData(
        joined("time"),
        joined("outputs"),
        joined("states"),
        joined("inputs"),
        issiso=False,
        output_labels=system.output_labels,
        state_labels=system.state_labels,
        input_labels=system.input_labels,
        sysname=system.name,
    )
