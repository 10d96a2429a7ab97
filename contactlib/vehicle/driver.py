"""A driver who keeps the speed limits of a line, uphill and downhill."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from contactlib.base.quantities import Parameters, Quantity


@dataclass(frozen=True, kw_only=True)
class Driver(Parameters):
    """Driver who demands at most what keeps the track's speed limits, and brakes for them.

    The driver aims at a speed u below the highest one v_p from which the deceleration a_p keeps
    all limits ahead, and knows the running resistance and the grade: the demand is at most the
    torque for the acceleration

        dv_p/dt + (u - v)/T >= -a,    u = v_p - min(0.3 m/s, v_p/20),    a_p = 0.85 a,

    so that 15 % of the largest deceleration a is left for corrections. Braking begins the lag T_b
    of the brake before the place where v_p begins to fall, and T is 4 T_b, at least 2 s. The driver
    plans with the nominal friction of a brake's pads. If rails or brake give less than is demanded,
    limits are exceeded: see the outcome ``overspeed``.

    Parameters
    ----------
    deceleration : float
        Largest deceleration a that the driver demands to keep a limit, resistance and grade
        included [m/s2].

    Raises
    ------
    ValueError
        If a value is out of range.
    """

    deceleration: Annotated[float, Quantity("m/s2", above=0.0, at_most=10.0, usual=(0.1, 1.5))]
