"""The steepest point of the falling branch, about which figures of stability are drawn."""

from __future__ import annotations

from contactlib.stability import worst_pole
from contactlib.vehicle.creep_curve import WorstPole, flattening
from contactlib.vehicle.wheelset import Wheelset


def steepest_fall(wheelset: Wheelset, speed: float) -> WorstPole:
    """Steepest point of the falling branch at a speed [m/s].

    Raises
    ------
    ValueError
        If the wheel slips away at no creepage.
    """
    worst = worst_pole(wheelset, speed=speed)
    if worst.pole <= 0.0:
        raise ValueError(
            f"at {speed:g} m/s the wheel is stable at every creepage under constant torque; "
            f"{flattening(wheelset)}"
        )
    return worst
