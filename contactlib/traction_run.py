"""One run of a scenario, with all of its rows: `contactlib.fleet` of one wheelset."""

from __future__ import annotations

from collections.abc import Callable
from types import MappingProxyType

import numpy as np

from contactlib.element import REFERENCE_SPEED, creepage_limits
from contactlib.fleet import UNITS, Runs, timing
from contactlib.parameters import FINITE, FloatArray, Limits, checked, checked_number
from contactlib.scenario import Scenario
from contactlib.simulation import Result
from contactlib.traction import TractionController
from contactlib.traction.sensors import INDEX, checked_whole

TOLERANCE = Limits(at_least=1e-12, at_most=1e-2)


def run_scenario(
    scenario: Scenario,
    controller: str | TractionController,
    *,
    initial_creepage: float | None = None,
    index: int = 0,
    step: float | None = None,
    tolerance: float = 1e-8,
    progress: Callable[[float], object] = lambda part: None,
) -> Result:
    """Drive a scenario under one controller.

    Parameters
    ----------
    scenario : Scenario
        Vehicle, track, demand and sensors.
    controller : str or TractionController
        One of the scenario's by its name, or any other.
    initial_creepage : float, optional
        [1]. Left out, the run starts steady under the first demand, and rolling if it starts at
        standstill or backward.
    index : int, optional
        The sensors' noise is drawn from their seed and this: a place among many runs.
    step : float, optional
        Time between rows, and for which friction is held [s]; rounded down to a whole part of the
        sample time. The sample time, but at most 5 ms and a twentieth of the axle's vibration, if
        left out.
    tolerance : float, optional
        Relative error of each of the integrator's substeps [1].
    progress : callable, optional
        Is told the part of the duration that is done, from 0 to 1.

    Returns
    -------
    Result
        Signals of `UNITS`, to the last whole step of the duration. Rows are `step` apart; torques
        are those of the step that follows.

    Raises
    ------
    ValueError
        If a value is out of range, the scenario has no controller of this name, the delay is not a
        whole number of samples, no steady state has the first demand, or the controller asks for
        no finite torque.
    RuntimeError
        If the integrator gives up.
    """
    control = scenario.controller(controller) if isinstance(controller, str) else controller
    tolerance = checked_number("tolerance", tolerance, TOLERANCE)
    index = checked_whole("index", index, INDEX)
    element, speed = scenario.drivetrain.wheelset.element, abs(scenario.initial_speed)
    if initial_creepage is not None:
        reachable = creepage_limits(element, max(speed, element.minimum_speed), REFERENCE_SPEED)
        initial_creepage = checked_number("initial_creepage", initial_creepage, reachable)
    when = timing(scenario, control, step)
    runs = Runs(
        [scenario], control, when, index=[index], tolerance=tolerance, creepage=initial_creepage
    )
    for error in runs.refused.values():
        raise error
    found: dict[str, list[FloatArray]] = {name: [] for name in UNITS}
    done = 0
    for block in runs.blocks():
        if runs.failed[0]:
            name = f"torque of {type(control).__name__} before {block.time[-1]:.6g} s"
            checked(name, block["commanded_torque"], FINITE)
            raise RuntimeError(f"the integrator gave up before {block.time[-1]:.6g} s")
        for name, parts in found.items():
            parts.append(np.array(block[name][:, 0]))
        done += block.time.size
        progress(done / when.rows)
    signals = {name: np.concatenate(parts) for name, parts in found.items()}
    return Result(when.times(0, when.rows), MappingProxyType(signals), MappingProxyType(UNITS))
