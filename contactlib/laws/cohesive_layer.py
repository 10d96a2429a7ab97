"""States of the cohesive zone with a thin elastic layer between the bodies: springs that snap.

Units are those of `laws.layer`, whose Eq. (1) holds in the whole contact if the slip u is added to
the left side. In the slip zone the traction is q = p (1 + rho phi(u/D)), rho = f_s/f_d - 1. The
layer alone, springs of the compliance lam, follows the falling friction only while

    S = lam rho p/D <= 1,    if phi'(0) = -1 is the steepest.                                (1)

A softer one lets go at once: it snaps from rest to a slip v D. A layer of finite thickness decides
when. It does so where the energy of both states is equal, which in springs is

    v**2/(2 S) = int_0^v phi - v phi(v),    q(c) = p (1 + rho (phi(v) + v/S)).              (2)

For a given stick boundary c the traction in the stick zone and the creepage are linear in that of
the slip zone, so Newton's method has the slip at the nodes of the slip zone as its only unknown,
and what is linear is the same for every k_hat. Both zones consist of panels that grow from c. A
layer that sticks nowhere would be infinitely strained at the leading edge, where p begins like a
square root: so there always is a stick zone.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial.legendre import leggauss
from scipy.linalg import lu_factor, lu_solve
from scipy.optimize import brentq

from contactlib.base.quantities import FloatArray
from contactlib.laws import layer
from contactlib.laws.cohesive_zone import ConvergenceError, weakening_length
from contactlib.laws.friction import Weakening
from contactlib.laws.strips import split_at

ITERATIONS = 60


class Accuracy(NamedTuple):
    """Panels by their width at the stick boundary, at the other end, and growth; residuals."""

    grid: tuple[float, float, float]
    residual: float  # ends the iteration
    accepted: float


FINE = Accuracy((1e-8, 1e-4, 9.0), 1e-12, 1e-9)
QUICK = Accuracy((1e-4, 1e-2, 9.0), 1e-6, 1e-5)  # errs by 1e-5 where lam is at least 1e-4


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
    """A state: both zones at the nodes of the accuracy's panels, counted from c."""

    creepage: float
    ratio: float
    stuck: FloatArray  # traction in the stick zone
    slip: FloatArray  # u/D in the slip zone
    snap: float  # v


def _newton(
    u: FloatArray,
    coulomb: FloatArray,
    matrix: FloatArray,
    weakening: Weakening,
    tolerance: float,
) -> tuple[FloatArray, FloatArray]:
    """Solve u + matrix @ phi(u) = `coulomb` for u >= 0 with a line search; u and what is left."""
    off = u - coulomb + matrix @ weakening.fraction(u)
    for _ in range(ITERATIONS):
        error = np.abs(off).max()
        if error <= tolerance:
            break
        step = matrix * weakening.slope(u)
        step[np.diag_indices_from(step)] += 1.0
        change = -np.linalg.solve(step, off)
        for share in 0.5 ** np.arange(12.0):
            new = np.maximum(u + share * change, 0.0)
            new_off = new - coulomb + matrix @ weakening.fraction(new)
            if np.abs(new_off).max() < (1.0 - 0.3 * share) * error:
                break
        u, off = new, new_off
    return u, off


def solve_zones(
    log_t: float,
    k_hats: FloatArray,
    lam: float,
    static_to_kinetic: float,
    weakening: Weakening,
    accuracy: Accuracy = FINE,
    near: list[Zones] | None = None,
) -> list[Zones]:
    """States of line contacts with several k_hat at a stick boundary, from states near them.

    Raises
    ------
    ConvergenceError
        If the iteration does not converge, or ends where springs would snap inside the slip zone.
    """
    grid = layer.panels(*accuracy.grid)
    start, end, weight, potential = grid.start, grid.end, grid.weight, grid.potential
    m, s, _ = (float(v) for v in split_at(np.exp(log_t), 0.0))
    d, behind = 2.0 * s, 2.0 * m  # lengths of the zones
    rho = static_to_kinetic - 1.0
    lead = d + behind * start  # 1 - xi in the slip zone
    pressure = np.sqrt(lead * behind * end)
    edge = np.sqrt(d * behind)
    # Traction at one zone's nodes to the potential at the other's.
    apart = d * start[:, None] + behind * start
    onto_stick = behind * weight / np.pi * np.log1p(d * end[:, None] / apart)
    onto_slip = d * weight / np.pi * np.log(d * end / apart.T)
    onto_edge = behind * weight / np.pi * np.log1p(d / (behind * start))
    factors = lu_factor(lam * np.eye(start.size) + d * potential)
    solved = lu_solve(factors, np.column_stack([d * end, onto_stick]))
    full_stick, response = solved[:, 0], solved[:, 1:]  # q = x full_stick - response @ q behind
    # The stick zone ends where q = q(c): x = at_rest + by_slip @ q behind.
    left = d * (1.0 - grid.at_start @ full_stick)
    by_slip = (onto_edge - d * grid.at_start @ response) / left
    # Eq. (1) of `laws.layer` in the slip zone: u = x lead - (matrix without x) q.
    follow = lead - onto_slip @ full_stick
    matrix = behind * (potential - grid.at_start) + onto_edge - onto_slip @ response
    matrix -= np.outer(follow, by_slip)
    matrix[np.diag_indices_from(matrix)] += lam
    sliding, falling = matrix @ pressure, matrix * (rho * pressure)

    def state(k_hat: float, length: float, start: FloatArray | None) -> Zones:
        sudden, strength = snap(lam * rho * edge / length, weakening)
        at_rest = lam * edge * (1.0 + rho * strength) / left
        coulomb = (follow * at_rest - sliding) / length
        scale = 1.0 + 1e-3 * np.abs(coulomb).max()
        law = (falling / length, weakening, accuracy.residual * scale)
        allowed = accuracy.accepted * scale
        start = coulomb if start is None else start
        u, off = _newton(np.maximum(start, sudden), coulomb, *law)
        if np.abs(off).max() > allowed and lam < 1.0:  # start from a softer layer
            softer = (4.0 * lam, static_to_kinetic, weakening, accuracy)
            start = solve_zones(log_t, np.array([k_hat]), *softer)[0].slip
            u, off = _newton(np.maximum(start, sudden), coulomb, *law)
        softness = lam * rho * pressure / length
        unstable = (-softness * weakening.slope(u) > 1.0 + 1e-6).any()
        if np.abs(off).max() > allowed or unstable:
            raise ConvergenceError(
                f"the slip zone at stick length {d:.4g} a, k_hat {k_hat:.4g}, layer_ratio "
                f"{lam:.4g}, static_to_kinetic {static_to_kinetic:.4g} does not converge: "
                + ("springs would snap inside it, " if unstable else "")
                + f"residual {np.abs(off).max():.2e}"
            )
        q = pressure * (1.0 + rho * weakening.fraction(u))
        creepage = float(at_rest + by_slip @ q)
        stuck = creepage * full_stick - response @ q
        ratio = float(2.0 / np.pi * (d * weight @ stuck + behind * weight @ q))
        return Zones(creepage, ratio, stuck, u, sudden)

    lengths = weakening_length(k_hats, static_to_kinetic)
    starts = [None] * lengths.size if near is None else [zones.slip for zones in near]
    return [
        state(float(k), float(length), start)
        for k, length, start in zip(k_hats, lengths, starts, strict=True)
    ]
