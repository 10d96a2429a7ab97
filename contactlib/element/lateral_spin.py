"""Data of a force element's contact for lateral and spin force.

`fmu/kernel/lateral_spin_law.h` names the numbers, and `fmu/kernel/lateral_spin_force.c` uses them.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from contactlib import kernel
from contactlib.laws.hertz import Contact, EllipticContact
from contactlib.table.lateral_spin_table import (
    ASPECTS,
    lateral_spin_coefficients,
    lateral_spin_scales,
)

MAGIC, VERSION = b"PLANECON", 1
SPINNING = "an ellipse on the half-space with a/b from 1/8 to 8"


def lateral_spin_contact(contact: Contact, *, softens: bool) -> bytes:
    """Contents of an FMU's resource: lateral stiffness, and the effect of spin.

    Parameters
    ----------
    contact : LineContact or EllipticContact
    softens : bool
        Whether the table's law is one of strips, to which the softening of the half-space applies.
    """
    softening = contact.lateral_softening if softens else 0.0
    numbers = [contact.lateral_stiffness_ratio, softening]
    aspect = spinning_aspect(contact)
    if aspect is None:
        return kernel.framed(MAGIC, VERSION, np.array([*numbers, 0.0, 0.0, 0.0]).tobytes())
    return _spinning(*numbers, aspect, contact.poisson_ratio)


def spinning_aspect(contact: Contact) -> float | None:
    """The ratio a/b of a contact with spin, else None."""
    if not isinstance(contact, EllipticContact) or contact.theory != "half_space":
        return None
    aspect = contact.semi_axis_x / contact.semi_axis_y
    nearest = float(np.clip(aspect, ASPECTS[0], ASPECTS[-1]))
    return nearest if math.isclose(aspect, nearest, rel_tol=1e-9) else None  # to rounding


@lru_cache(maxsize=64)
def _spinning(stiffness_ratio: float, softening: float, aspect: float, nu: float) -> bytes:
    along, _, spin = lateral_spin_scales(aspect, nu)
    arm = spin / along / math.sqrt(aspect)  # scales of spin are in units of sqrt(a b)
    spread = math.sqrt((1.0 + aspect**-2) / 5.0)  # of Hertz's pressure
    place = np.log(aspect / ASPECTS[0]) / np.log(ASPECTS[1] / ASPECTS[0])
    first = int(np.clip(int(place) - 1, 0, len(ASPECTS) - 4))
    knots = np.arange(4.0)
    shares = [  # Lagrange's polynomials over ln(a/b)
        np.prod([(place - first - other) / (knot - other) for other in knots if other != knot])
        for knot in knots
    ]
    mixed = np.tensordot(shares, lateral_spin_coefficients(nu)[first : first + 4], 1)
    numbers = np.array([stiffness_ratio, softening, 1.0 / aspect, arm, spread])
    return kernel.framed(MAGIC, VERSION, np.concatenate([numbers, mixed.ravel()]).tobytes())
