"""Elements and wheelsets with friction that falls with slip speed as well."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import contactlib as cl


def falling(element: cl.ForceElement, residual: float = 0.4, decay: float = 0.6) -> cl.ForceElement:
    """Element whose friction falls to `residual` of itself; by heat if that is 0."""
    fall: dict[str, Any] = {"slip_rate_residual": residual, "slip_rate_decay": decay}
    if residual == 0.0:
        fall = {"softening_temperature": 600.0}
    friction = replace(element.friction, **fall)
    return replace(element, friction=friction)


def with_falling(wheelset: cl.Wheelset, residual: float = 0.4, decay: float = 0.6) -> cl.Wheelset:
    return replace(wheelset, element=falling(wheelset.element, residual, decay))
