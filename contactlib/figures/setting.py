"""The parameters behind a figure, in words for its caption."""

from __future__ import annotations

import math

from contactlib.drivetrain import Drivetrain
from contactlib.wheelset import Wheelset


def setting(wheelset: Wheelset, speed: float | None = None) -> str:
    """The parameters behind a figure, for its caption."""
    element, friction = wheelset.element, wheelset.element.friction
    parts = [] if element.table.one_axis else [f"k_hat {element.k_hat:.3g}"]
    parts += [
        f"zeta0 {100.0 * element.saturation_creepage:.3g} %",
        f"f_d {friction.kinetic:.3g}",
        f"$P$ {1e-3 * element.contact.normal_load:.4g} kN",
        f"$r$ {wheelset.radius:.3g} m",
        f"$J$ {wheelset.inertia:.4g} kg m$^2$",
        f"$b$ {wheelset.damping:.3g} N m s",
    ]
    if friction.slip_rate_decay > 0.0:
        parts += [
            f"slip-rate residual {friction.slip_rate_residual:.3g}",
            f"decay {friction.slip_rate_decay:.3g} s/m",
        ]
    if wheelset.mass is not None:
        parts.append(f"$M$ {1e-3 * wheelset.mass:.4g} t")
    if speed is not None:
        parts.append(f"$V$ {speed:.3g} m/s{' (held)' if wheelset.speed_held else ''}")
    elif wheelset.speed_held:
        parts.append("$V$ held")
    return _listed(parts)


def drivetrain_setting(drivetrain: Drivetrain) -> str:
    """The parameters of what is driven."""
    parts = []
    if drivetrain.motor_lag > 0.0:
        parts.append(f"motor lag {1e3 * drivetrain.motor_lag:.3g} ms")
    if drivetrain.relaxation_length > 0.0:
        parts.append(f"relaxation length {1e3 * drivetrain.relaxation_length:.3g} mm")
    if drivetrain.axle is not None:
        hertz = drivetrain.torsional_frequency / (2.0 * math.pi)
        damping = 100.0 * drivetrain.torsional_damping_ratio
        parts.append(f"axle {hertz:.3g} Hz, {damping:.2g} % of critical")
    more = _listed(parts) if parts else ""
    return f"{setting(drivetrain.wheelset)} {more[:1].upper()}{more[1:]}".rstrip()


def _listed(parts: list[str]) -> str:
    """A number and its unit stay on one line."""
    return ", ".join(part.replace(" ", "\u00a0") for part in parts) + "."
