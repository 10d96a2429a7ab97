"""What happens along a contact with a cohesive zone: its state at a creepage, traction and slip."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.optimize import brentq

from contactlib.friction import Weakening
from contactlib.laws.slip_zone import (
    enough_nodes,
    sliding_creepage,
    solve_slip_zones,
    weakening_length,
)
from contactlib.parameters import FloatArray


def find_state(
    x: float, *, k_hat: float, static_to_kinetic: float, weakening: Weakening
) -> tuple[float, float]:
    """Stick length and edge slip at a creepage x > 0."""

    def beyond(stick: float, slipped: float, edge: float) -> float:
        zones = solve_slip_zones(
            *(np.array([v]) for v in (stick, slipped, edge)),
            k_hat=np.array([k_hat]),
            static_to_kinetic=static_to_kinetic,
            weakening=weakening,
        )
        return float(0.5 * slipped + edge + zones.release[0] - x)

    if x < sliding_creepage(k_hat, static_to_kinetic, weakening):
        slipped = brentq(lambda v: beyond(2.0 - v, v, 0.0), 1e-9 * x, 2.0, xtol=1e-14, rtol=1e-14)
        return 2.0 - float(slipped), 0.0
    edge = brentq(lambda v: beyond(0.0, 2.0, v), 0.0, x, xtol=1e-14, rtol=1e-14)
    return 0.0, float(edge)


class Along(NamedTuple):
    """What happens along a contact; arrays of one shape."""

    shear_traction: FloatArray  # over f_d p0
    slip_rate: FloatArray  # per rolled distance, over zeta0
    slip: FloatArray  # over the weakening length


def along_contact(
    position: FloatArray,
    stick_length: float,
    edge_slip: float,
    *,
    k_hat: float,
    static_to_kinetic: float,
    weakening: Weakening,
) -> Along:
    """Traction and slip at places xi/a of a contact, (n,), the leading edge being +1."""
    state = (np.array([v]) for v in (stick_length, 2.0 - stick_length, edge_slip))
    zones = solve_slip_zones(
        *state,
        k_hat=np.array([k_hat]),
        static_to_kinetic=static_to_kinetic,
        weakening=weakening,
        nodes=2 * enough_nodes(k_hat, static_to_kinetic),  # to interpolate between them
    )
    y, h, weight = zones.distance[0], zones.intensity[0], zones.weight[0]
    inside = np.abs(position) <= 1.0
    behind = np.where(inside, 1.0 - stick_length - position, 0.0)  # the stick boundary
    slips = inside & (behind >= 0.0)
    to = np.sqrt(np.maximum(behind, 0.0))
    root = np.sqrt(stick_length + to**2)

    # Between the nodes: what is left without the leading powers is smooth in ln(y). Next to the
    # boundary the slip is too small to count.
    seen = y > 1e-5 * y[-1]
    log_y = np.log(y[seen])
    log_to = np.log(np.clip(to, y[seen][0], y[-1]))
    bracket = (zones.slip_rate[0] - edge_slip)[seen] / (_root(y, stick_length) * y)[seen]
    near = to * make_interp_spline(log_y, bracket, 5)(log_to)
    over_length = to**2 * make_interp_spline(log_y, (zones.slip[0] / y**2)[seen], 5)(log_to)
    beyond = to > y[-1]
    far = np.where(beyond, to, 2.0 * y[-1])[:, np.newaxis]
    push = (2.0 / np.pi) * (weight * h / (far**2 - y**2)).sum(axis=1)
    slip_rate = np.where(slips, root * np.where(beyond, to * (1.0 + push), near) + edge_slip, 0.0)
    length = weakening_length(np.array(k_hat), static_to_kinetic)
    slip = np.where(beyond, np.inf, over_length / length)

    pressure = np.sqrt(np.maximum(1.0 - position**2, 0.0))
    left = np.where(slips & ~beyond, weakening.fraction(np.where(beyond, 0.0, slip)), 0.0)
    sliding = pressure * (1.0 + (static_to_kinetic - 1.0) * left)
    # Stick zone: the traction in the law of sliding, less what stick takes off.
    ahead = np.maximum(-behind, 0.0)[:, np.newaxis]
    tip = np.where(ahead > 0.0, np.sqrt(ahead), 1.0)
    steep = 2.0 * h[0] * np.arctan2(y[-1], tip[:, 0]) / tip[:, 0]
    pull = (steep + 2.0 * (weight * (h - h[0]) / (tip**2 + y**2)).sum(axis=1)) / np.pi
    gap = np.sqrt(np.maximum(1.0 - position, 0.0) * ahead[:, 0])
    traction = np.where(slips, sliding, pressure - gap * (1.0 - pull))
    return Along(np.where(inside, traction, 0.0), slip_rate, np.where(slips, slip, 0.0))


def _root(y: FloatArray, stick_length: float) -> FloatArray:
    return np.asarray(np.sqrt(stick_length + y * y))
