"""The cohesive zone with a thin elastic layer between the bodies: springs that snap.

Units are those of `laws.layer`, whose Eq. (1) holds in the whole contact if the slip u is added to
the left side. In the slip zone the traction is q = p (1 + rho phi(u/D)), rho = f_s/f_d - 1. The
layer alone, springs of the compliance lam, follows the falling friction only while

    S = lam rho p/D <= 1/max(-phi').                                                        (1)

A softer one lets go at once: it snaps from rest to a slip v D. A layer of finite thickness decides
when. It does so where the energy of both states is equal, which in springs is

    v**2/(2 S) = int_0^v phi - v phi(v),    q(c) = p (1 + rho (phi(v) + v/S)).              (2)

For a given stick boundary c the traction in the stick zone and the creepage are linear in that of
the slip zone, so Newton's method has the slip at the nodes of the slip zone as its only unknown.
Both zones consist of panels that grow from c. A layer that sticks nowhere would be infinitely
strained at the leading edge, where p begins like a square root: so there always is a stick zone.

Creepage and force, over those of Coulomb friction at the same ln t, t**4 = (1 + c)/(1 - c), are
smooth between the two places where S = 1, and become constant towards both ends. Over the strips
of an ellipse (x/w, k_hat/w, lam/w) S is proportional to w. So Chebyshev series on panels in ln t,
whose ends move with S = 1, and in a variable over w, give all strips.
"""

from __future__ import annotations

from functools import cache, lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.polynomial.chebyshev import chebder, chebpts1, chebvander
from numpy.polynomial.legendre import leggauss
from scipy.linalg import lu_factor, lu_solve
from scipy.optimize import brentq

from contactlib.base.quantities import FloatArray
from contactlib.laws import layer
from contactlib.laws.cohesive_zone import ConvergenceError, weakening_length
from contactlib.laws.friction import Weakening
from contactlib.laws.layer import Layered
from contactlib.laws.strips import split_at

GRID = (1e-8, 1e-4, 9.0)  # panels: width at the stick boundary, at the other end, growth
ITERATIONS = 60
DEGREE, WIDTHS = 13, 8  # of the series in ln t; curves over w of an ellipse, in each part
TOLERANCE = {"line": 1e-7, "elliptic": 1e-6}
NARROWEST = 0.03  # of the strips: those beyond have a share of 1e-6 in the force


@cache
def _areas(weakening: Weakening) -> tuple[FloatArray, FloatArray]:
    """Values of v, and the integral of phi up to them."""
    v = np.concatenate([[0.0], np.geomspace(1e-4, 1e7, 2000)])
    nodes, weights = leggauss(6)
    half = 0.5 * np.diff(v)[:, None]
    steps = (half * weights * weakening.fraction(v[:-1, None] + half * (1.0 + nodes))).sum(axis=1)
    return v, np.concatenate([[0.0], np.cumsum(steps)])


def snap(softness: float, weakening: Weakening) -> tuple[float, float]:
    """Sudden slip v over D and (q(c)/p - 1)/rho, Eq. (2), at S = `softness`; 0 and 1 for none."""
    v, area = _areas(weakening)
    # The chord of the energy from v = 0 is lowest where it touches.
    i = 1 + int(np.argmin(0.5 * v[1:] / softness + area[1:] / v[1:]))
    if i == 1:
        return 0.0, 1.0
    nodes, weights = leggauss(6)

    def left(to: float) -> float:
        half = 0.5 * (to - v[i - 1])
        more = half * weights @ weakening.fraction(v[i - 1] + half * (1.0 + nodes))
        phi = float(weakening.fraction(np.array(to)))
        return float(area[i - 1] + more - to * phi - 0.5 * to**2 / softness)  # Eq. (2)

    slip = v[i]
    if i + 1 < v.size and left(v[i - 1]) * left(v[i + 1]) < 0.0:
        slip = brentq(left, v[i - 1], v[i + 1], xtol=1e-13 * v[i], rtol=1e-14)
    strength = float(weakening.fraction(np.array(slip))) + slip / softness
    return (float(slip), strength) if strength < 1.0 else (0.0, 1.0)


class Zones(NamedTuple):
    """A state: both zones at the nodes of `layer.panels(*GRID)`, counted from c."""

    creepage: float
    ratio: float
    stuck: FloatArray  # traction in the stick zone
    slip: FloatArray  # u/D in the slip zone
    snap: float  # v


def solve_zones(
    log_t: float, k_hat: float, lam: float, static_to_kinetic: float, weakening: Weakening
) -> Zones:
    """State of a line contact at a stick boundary.

    Raises
    ------
    ConvergenceError
        If the iteration does not converge, or ends where springs would snap inside the slip zone.
    """
    grid = layer.panels(*GRID)
    start, end, weight, potential = grid.start, grid.end, grid.weight, grid.potential
    m, s, _ = (float(v) for v in split_at(np.exp(log_t), 0.0))
    d, behind = 2.0 * s, 2.0 * m  # lengths of the zones
    rho, length = static_to_kinetic - 1.0, float(weakening_length(np.array(k_hat), static_to_kinetic))
    lead = d + behind * start  # 1 - xi in the slip zone
    pressure = np.sqrt(lead * behind * end)
    edge = np.sqrt(d * behind)
    sudden, strength = snap(lam * rho * edge / length, weakening)
    # Traction at one zone's nodes to the potential at the other's.
    onto_stick = behind * weight / np.pi * np.log1p(d * end[:, None] / (d * start[:, None] + behind * start))
    onto_slip = d * weight / np.pi * np.log(d * end / (d * start + behind * start[:, None]))
    onto_edge = behind * weight / np.pi * np.log1p(d / (behind * start))
    factors = lu_factor(lam * np.eye(start.size) + d * potential)
    solved = lu_solve(factors, np.column_stack([d * end, onto_stick]))
    full_stick, response = solved[:, 0], solved[:, 1:]  # q = x full_stick - response @ q behind
    # The stick zone ends where q = q(c): x = at_rest + by_slip @ q behind.
    left = d * (1.0 - grid.at_start @ full_stick)
    at_rest = lam * edge * (1.0 + rho * strength) / left
    by_slip = (onto_edge - d * grid.at_start @ response) / left
    # Eq. (1) of `laws.layer` in the slip zone: u = x lead - (matrix without x) q.
    follow = lead - onto_slip @ full_stick
    matrix = behind * (potential - grid.at_start) + onto_edge - onto_slip @ response
    matrix -= np.outer(follow, by_slip)
    matrix[np.diag_indices_from(matrix)] += lam
    coulomb = (follow * at_rest - matrix @ pressure) / length
    matrix *= rho * pressure / length
    softness = lam * rho * pressure / length
    u = np.maximum(coulomb, sudden)
    off = u - coulomb + matrix @ weakening.fraction(np.maximum(u, 0.0))
    scale = 1.0 + 1e-3 * np.abs(coulomb).max()
    for _ in range(ITERATIONS):
        error = np.abs(off).max()
        if error <= 1e-12 * scale:
            break
        step = matrix * weakening.slope(np.maximum(u, 0.0))
        step[np.diag_indices_from(step)] += 1.0
        change = -np.linalg.solve(step, off)
        for share in 0.5 ** np.arange(12.0):
            new = np.maximum(u + share * change, 0.0)
            new_off = new - coulomb + matrix @ weakening.fraction(new)
            if np.abs(new_off).max() < (1.0 - 0.3 * share) * error:
                break
        u, off = new, new_off
    unstable = (-softness * weakening.slope(u) > 1.0 + 1e-6).any()
    if np.abs(off).max() > 1e-9 * scale or unstable:
        raise ConvergenceError(
            f"the slip zone at stick length {d:.4g} a, k_hat {k_hat:.4g}, layer_ratio {lam:.4g}, "
            f"static_to_kinetic {static_to_kinetic:.4g} does not converge: "
            + ("springs would snap inside it, " if unstable else "")
            + f"residual {np.abs(off).max():.2e}"
        )
    q = pressure * (1.0 + rho * weakening.fraction(u))
    creepage = float(at_rest + by_slip @ q)
    stuck = creepage * full_stick - response @ q
    ratio = float(2.0 / np.pi * (d * weight @ stuck + behind * weight @ q))
    return Zones(creepage, ratio, stuck, u, sudden)
