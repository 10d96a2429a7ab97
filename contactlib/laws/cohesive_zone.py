"""The cohesive zone behind the stick boundary, where the surface slips and friction weakens.

The Carter-Griffith law puts a square-root singularity at the stick boundary; here the friction
f(u) itself acts on the slip zone and the traction stays bounded. Lengths are in units of the
semi-width a, tractions of f_d p0, the slip u of f_d a**2/R, creepage of zeta0. Two numbers define
the state: in mixed stick and slip the stick length epsilon = 1 - c > 0 and delta = 0; in full
slip epsilon = 0 and delta >= 0 is the slip rate at the leading edge.

With y = sqrt(c - s) behind the stick boundary (c = 1 in full slip) and e(s) the traction beyond
f_d p, the function h(y) = e/sqrt(1 - s) = (r - 1) phi(u/D) sqrt(2 - epsilon - y**2), continued
as an even one, gives the slip rate per rolled distance, the creepage and the force,

    sigma(y) = sqrt(epsilon + y**2) (y - (1/pi) PV int h(y') dy'/(y' - y)) + delta
    u(y) = int_0^y 2 y' sigma dy'
    x = 1 - epsilon/2 + delta + A,                 A = (1/pi) int h dy
    q = 1 - epsilon**2/4 + epsilon A + B,          B = (2/pi) int h y**2 dy

with r = f_s/f_d and the weakening length D = pi k_hat**2/(2 (r - 1)). The release A replaces the
Carter-Griffith law's singular term k_hat/sqrt(1 - c) in x.

The function h and the slip are polynomials in v on 0 < v < 1, collocated at Chebyshev's points,
with y = Y m(v) and m = v**2 (3 - 2 v). Slip grows like y**3 at the stick boundary, where h,
continued as an even function, has a kink in a derivative, and h ends like a square root at the
trailing edge. In v both are smooth to a high order, so few points suffice. The principal value of
each polynomial is found once. Friction has weakened completely at Y, so a zone of any length is
resolved.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.polynomial.legendre import leggauss

from contactlib.base.quantities import FloatArray
from contactlib.laws.friction import Weakening

ITERATIONS = 60
# Fraction of the drop in friction that is left at Y; the second if f(u) falls like a power of u.
NEGLIGIBLE, NEGLIGIBLE_IN_TAIL = 1e-13, 1e-10
BATCH = 32  # states solved at once


class ConvergenceError(RuntimeError):
    """The equations of the slip zone have no solution that the iteration found."""


class SlipZones(NamedTuple):
    """Slip zones of n states at N nodes; units as in the module's docstring."""

    release: FloatArray  # A, (n,)
    excess: FloatArray  # B, (n,)
    distance: FloatArray  # y, (n, N)
    intensity: FloatArray  # h, (n, N)
    slip_rate: FloatArray  # sigma, (n, N)
    slip: FloatArray  # u, (n, N)
    weight: FloatArray  # of the integral over 0 < y < Y, (n, N)


class _Rules(NamedTuple):
    """Collocation on 0 <= y <= 1 at n points in v; matrices act on values at the points."""

    place: FloatArray  # y, (n,)
    rest: FloatArray  # 1 - y, (n,)
    weight: FloatArray  # of the integral over all of it, (n,)
    running: FloatArray  # integral from 0 to each point, (n, n)
    principal: FloatArray  # (1/pi) PV int_{-1}^{1} h(|y'|) dy'/(y' - y) at each point, (n, n)
    sliding: FloatArray  # reduction of the slip by h in full slip, (n, n)


@cache
def _rules(n: int) -> _Rules:
    angle = 0.5 * np.pi * np.arange(n) / (n - 1)
    v, to_end = np.sin(angle) ** 2, np.sin(angle[::-1]) ** 2  # v + to_end = 1
    to_series = np.linalg.inv(chebyshev.chebvander(2.0 * v - 1.0, n - 1))
    place, rest, stretch = v**2 * (3.0 - 2.0 * v), to_end**2 * (1.0 + 2.0 * v), 6.0 * v * to_end
    integrals = 0.5 * chebyshev.chebint(to_series, lbnd=-1.0)
    running = chebyshev.chebvander(2.0 * v - 1.0, n) @ integrals * stretch

    principal = np.zeros((n, n))
    nodes, shares = leggauss(48)
    for i in range(1, n):
        # The integrand varies on the scale of the distance to the nearer end: v, 2 v, 4 v ...
        near = min(v[i], to_end[i]) or 1.0
        ends = np.concatenate([[0.0], near * 2.0 ** np.arange(-np.log2(near)), [1.0]])
        ends = np.unique(ends if near == v[i] else 1.0 - ends)
        half = 0.5 * np.diff(ends)[:, np.newaxis]
        at = (ends[:-1, np.newaxis] + half * (1.0 + nodes)).ravel()
        there = at**2 * (3.0 - 2.0 * at)
        kernel = 12.0 * place[i] * at * (1.0 - at) * (half * shares).ravel()
        kernel /= (there - place[i]) * (there + place[i])
        principal[i] = kernel @ chebyshev.chebvander(2.0 * at - 1.0, n - 1) @ to_series
        # A constant has a known principal value; at the end, where it has none, h is negligible.
        known = np.log(rest[i] / (1.0 + place[i])) if i < n - 1 else 0.0
        principal[i, i] += known - kernel.sum()
    principal /= np.pi
    sliding = running * (2.0 * place**2) @ principal
    return _Rules(place, rest, running[-1], running, principal, sliding)


def between_nodes(place: FloatArray, values: FloatArray) -> FloatArray:
    """Functions given at the nodes, (m, n), at y/Y = `place`, (p,); beyond 1 the last values."""
    v = 0.5 - np.sin(np.arcsin(1.0 - 2.0 * np.minimum(place, 1.0)) / 3.0)
    n = values.shape[1]
    at_nodes = chebyshev.chebvander(-np.cos(np.pi * np.arange(n) / (n - 1)), n - 1)
    series = np.linalg.solve(at_nodes, values.T)
    return np.asarray((chebyshev.chebvander(2.0 * v - 1.0, n - 1) @ series).T)


def weakening_length(k_hat: FloatArray, static_to_kinetic: float) -> FloatArray:
    """D = Delta R/(f_d a**2), from Eq. (17)."""
    return np.asarray(0.5 * np.pi * k_hat**2 / (static_to_kinetic - 1.0))


@cache
def _reach(weakening: Weakening) -> float:
    """Slip over the weakening length where the drop is complete; infinite if it never is."""
    for negligible, largest in ((NEGLIGIBLE, 10.0), (NEGLIGIBLE_IN_TAIL, 20.0)):
        for v in 2.0 ** np.arange(0.0, largest, 0.125):
            if np.all(np.abs(weakening.fraction(np.array([v, 1.5 * v, 10.0 * v]))) < negligible):
                return float(v)
    return float(np.inf)


def enough_nodes(k_hat: float, static_to_kinetic: float, weakening: Weakening) -> int:
    """Number of nodes that gives q to 1e-9 for an exponential weakening, to 2e-6 for kinks."""
    if weakening.kinks:
        return 162
    if (k_hat / (static_to_kinetic - 1.0)) ** 2 > 0.2:
        return 32
    return 48 if static_to_kinetic < 2.0 else 56 if static_to_kinetic < 4.0 else 72


def solve_cohesive_zones(
    stick_length: FloatArray,
    slip_length: FloatArray,
    edge_slip: FloatArray,
    *,
    k_hat: FloatArray,
    static_to_kinetic: float,
    weakening: Weakening,
    nodes: int | None = None,
) -> SlipZones:
    """Solve the slip zone at stick lengths epsilon, edge slip rates delta and k_hat, each (n,).

    The slip length 2 - epsilon is given as well, with all its digits where it is small.

    Raises
    ------
    ConvergenceError
        If the iteration does not converge, or ends where the surface would slip backwards.
    """
    nodes = nodes or enough_nodes(float(k_hat.min()), static_to_kinetic, weakening)
    length, reach = weakening_length(k_hat, static_to_kinetic), _reach(weakening)
    first = _first_end(
        stick_length, slip_length, edge_slip, k_hat, static_to_kinetic, reach * length
    )
    end = np.minimum(np.sqrt(slip_length), first)
    state = (stick_length, slip_length, edge_slip, k_hat, end)
    # States of full slip have the same matrices, so they are solved together.
    order = np.argsort(stick_length > 0.0, kind="stable")
    cuts = np.searchsorted(stick_length[order] > 0.0, True)
    groups = [
        group[i : i + BATCH]
        for group in (order[:cuts], order[cuts:])
        for i in range(0, group.size, BATCH)
    ]
    parts = [
        _solve_batch(
            tuple(v[group, np.newaxis] for v in state), static_to_kinetic, weakening, nodes
        )
        for group in groups
    ]
    back = np.argsort(order, kind="stable")
    return SlipZones(*(np.concatenate(arrays)[back] for arrays in zip(*parts, strict=True)))


def _solve_batch(
    state: tuple[FloatArray, ...], ratio: float, weakening: Weakening, nodes: int
) -> SlipZones:
    """Stick length, slip length, edge slip, k_hat and the likely Y as columns, (n, 1)."""
    stick, slipped, edge, k_hat, end = state
    length, reach = weakening_length(k_hat, ratio), _reach(weakening)
    whole = np.sqrt(slipped)  # y at the trailing edge
    while True:
        zones = _newton(stick, slipped, edge, end, k_hat, ratio, weakening, nodes)
        early = (end < whole) & (zones.slip[:, -1:] < 0.9 * reach * length)
        if not early.any():
            return zones
        end = np.where(early, np.minimum(1.4 * end, whole), end)


def _first_end(
    stick: FloatArray,
    slipped: FloatArray,
    edge: FloatArray,
    k_hat: FloatArray,
    ratio: float,
    slip: FloatArray,
) -> FloatArray:
    """Approximate place y where `slip` is reached, by the slip of the Carter-Griffith law."""
    if not np.isfinite(slip).all():
        return np.full_like(stick, np.inf)
    zone = np.pi * (k_hat / (ratio - 1.0)) ** 2
    release = k_hat * (slipped / (stick + zone)) ** 0.25 / (1.0 + edge / np.sqrt(zone))
    low, high = np.zeros_like(stick), np.full_like(stick, 2.0)
    for _ in range(50):
        y = 0.5 * (low + high)
        root = np.sqrt(stick + y * y)
        # Integral of 2 y (root (y + release/y) + edge) with root at its mean square.
        u = edge * y * y + 2.0 * release * y * np.sqrt(stick + y * y / 3.0) + y**3 * root / 2.0
        low, high = np.where(u < slip, y, low), np.where(u < slip, high, y)
    return high


def _newton(
    stick: FloatArray,
    slipped: FloatArray,
    edge: FloatArray,
    end: FloatArray,
    k_hat: FloatArray,
    ratio: float,
    weakening: Weakening,
    nodes: int,
) -> SlipZones:
    """Newton's method for h at the nodes, with a line search."""
    rules, length = _rules(nodes), weakening_length(k_hat, ratio)
    y = end * rules.place
    # 2 - epsilon - y**2, without loss of digits at the trailing edge.
    gap = np.maximum(slipped - end**2, 0.0) + end**2 * rules.rest * (1.0 + rules.place)
    full = (ratio - 1.0) * np.sqrt(gap)
    root = np.sqrt(stick + y * y)
    strain = 2.0 * y * root * end  # factor on the bracket of sigma in the integral for u
    sliding = (strain * y) @ rules.running.T + edge * y * y  # slip for h = 0
    if stick.any():
        running = rules.running * -strain[:, np.newaxis, :]
        by_h = (running.reshape(-1, nodes) @ rules.principal).reshape(running.shape)
    else:
        by_h = -(end**3)[:, :, np.newaxis] * rules.sliding

    def slip(h: FloatArray) -> FloatArray:
        return np.asarray(sliding + np.einsum("nij,nj->ni", by_h, h))

    # At the stick boundary u is zero but for rounding. Below zero f continues smoothly and bounded,
    # as Newton's method would jump to and fro over a kink.
    at_zero = float(weakening.slope(np.zeros(1))[0])

    def fraction(u: FloatArray) -> FloatArray:
        values = weakening.fraction(np.maximum(u, 0.0) / length)
        below = u < 0.0
        if below.any():
            v = (u / length)[below]
            values[below] += at_zero * v / (1.0 - v)
        return values

    def fraction_slope(u: FloatArray) -> FloatArray:
        values = weakening.slope(np.maximum(u, 0.0) / length)
        below = u < 0.0
        if below.any():
            values[below] = at_zero / (1.0 - (u / length)[below]) ** 2
        return values

    def residual(h: FloatArray, u: FloatArray) -> FloatArray:
        return np.asarray(h - full * fraction(u))

    # Start from a zone of about the right length: y**2 root ~ D/h.
    zone = length / ((ratio - 1.0) * np.sqrt(0.5 * slipped))
    start = sliding + 0.5 * length * y * y * np.sqrt(stick + zone ** (2.0 / 3.0)) / zone
    h = full * weakening.fraction(start / length)
    u = slip(h)
    left = residual(h, u)
    matrices, diagonal = np.empty_like(by_h), np.arange(nodes)  # allocated once, to save time
    tolerance = 1e-12 * full[:, :1]
    for _ in range(ITERATIONS):
        error = np.abs(left).max(axis=1, keepdims=True)
        open_ = (error > tolerance)[:, 0]
        if not open_.any():
            break
        falling = -full * fraction_slope(u)
        matrix = matrices[: np.count_nonzero(open_)]
        rows = by_h if open_.all() else by_h[open_]
        np.multiply((falling / length)[open_][:, :, np.newaxis], rows, out=matrix)
        matrix[:, diagonal, diagonal] += 1.0
        step = np.zeros_like(h)
        step[open_] = -np.linalg.solve(matrix, left[open_, :, np.newaxis])[:, :, 0]
        share = np.ones_like(error)
        for _ in range(12):
            new_h = h + share * step
            new_u = slip(new_h)
            new_left = residual(new_h, new_u)
            worse = np.abs(new_left).max(axis=1, keepdims=True) > (1.0 - 0.3 * share) * error
            if not (worse & (error > tolerance)).any():
                break
            share = np.where(worse, 0.5 * share, share)
        h, u, left = new_h, new_u, new_left
    slip_rate = root * (y - h @ rules.principal.T) + edge
    backwards = slip_rate.min(axis=1) < -1e-3 * slip_rate.max(axis=1)
    failed = (np.abs(left).max(axis=1) > 1e-10 * full[:, 0]) | backwards
    if failed.any():
        i = int(np.argmax(failed))
        raise ConvergenceError(
            f"the slip zone at stick length {stick[i, 0]:.4g} a, edge slip rate {edge[i, 0]:.4g}, "
            f"k_hat {k_hat[i, 0]:.4g}, static_to_kinetic {ratio:.4g} does not converge: "
            + ("the surface would slip backwards, residual" if backwards[i] else "the residual is")
            + f" {np.abs(left[i]).max():.2e} after {ITERATIONS} iterations; "
            f"more than {nodes} nodes may help"
        )
    weight = end * rules.weight
    release = (2.0 / np.pi) * (weight * h).sum(axis=1)
    excess = (4.0 / np.pi) * (weight * h * y * y).sum(axis=1)
    return SlipZones(release, excess, y, h, slip_rate, u, weight)


def sliding_creepage(k_hat: float, static_to_kinetic: float, weakening: Weakening) -> float:
    """Creepage x* at which full slip begins."""
    zones = solve_cohesive_zones(
        np.zeros(1),
        np.array([2.0]),
        np.zeros(1),
        k_hat=np.array([k_hat]),
        static_to_kinetic=static_to_kinetic,
        weakening=weakening,
    )
    return float(1.0 + zones.release[0])
