"""The cohesive zone with a thin elastic layer between the bodies: springs that snap.

Units are those of `laws.layer`, whose Eq. (1) holds in the whole contact if the slip u is added to
the left side. In the slip zone the traction is q = p (1 + rho phi(u/D)), rho = f_s/f_d - 1. The
layer alone, springs of the compliance lam, follows the falling friction only while

    S = lam rho p/D <= 1,    if phi'(0) = -1 is the steepest.                                (1)

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

from dataclasses import dataclass
from functools import cache, lru_cache
from itertools import pairwise
from typing import Annotated, NamedTuple

import numpy as np
from numpy.polynomial.chebyshev import chebder, chebpts1, chebvander
from numpy.polynomial.legendre import leggauss
from scipy.linalg import lu_factor, lu_solve
from scipy.optimize import brentq

from contactlib.base.quantities import FloatArray, Quantity
from contactlib.laws import layer
from contactlib.laws.cohesive import MAX_X, Along, CohesiveZone
from contactlib.laws.cohesive_zone import ConvergenceError, weakening_length
from contactlib.laws.friction import Weakening
from contactlib.laws.layer import Layered
from contactlib.laws.strips import split_at

GRID = (1e-8, 1e-4, 9.0)  # panels: width at the stick boundary, at the other end, growth
ITERATIONS = 60
DEGREE, WIDTHS = 11, 8  # of the series in ln t; curves over w of an ellipse, in each part
TOLERANCE = {"line": 5e-7, "elliptic": 1e-5}
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
    rho = static_to_kinetic - 1.0
    length = float(weakening_length(np.array(k_hat), static_to_kinetic))
    lead = d + behind * start  # 1 - xi in the slip zone
    pressure = np.sqrt(lead * behind * end)
    edge = np.sqrt(d * behind)
    sudden, strength = snap(lam * rho * edge / length, weakening)
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
    scale = 1.0 + 1e-3 * np.abs(coulomb).max()
    u, off = _newton(np.maximum(coulomb, sudden), coulomb, matrix, weakening, 1e-12 * scale)
    if np.abs(off).max() > 1e-9 * scale and lam < 1.0:  # start from a softer layer
        law = (k_hat, 4.0 * lam, static_to_kinetic, weakening)
        near = np.maximum(solve_zones(log_t, *law).slip, sudden)
        u, off = _newton(near, coulomb, matrix, weakening, 1e-12 * scale)
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


class _Family(NamedTuple):
    """Curves of strips that all snap somewhere, or nowhere.

    Attributes
    ----------
    snaps : bool
        Whether springs snap somewhere, so that there is a place ln t = y with S = 1.
    span : tuple of float
        Range of y, where S(y) = cosh(2 y), or sin(y**2) without a snap.
    ends : ndarray
        Ends of the panels in ln t, from and to a + b y, (p, 2, 2).
    series : ndarray
        Chebyshev series of creepage and ratio over those of Coulomb friction, for n curves:
        (p, 2, DEGREE + 1, n).
    """

    snaps: bool
    span: tuple[float, float]
    ends: FloatArray
    series: FloatArray

    def at(self, log_t: FloatArray, softness: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Both quotients and their derivatives by ln t, (2, n) each, at S of the middle."""
        y = np.clip(_border(softness, self.snaps), *self.span)
        ends = self.ends[:, :, 0] + self.ends[:, :, 1] * y[:, None, None]  # (n, p, 2)
        panel = np.clip((ends[:, :, 0] <= log_t[:, None]).sum(axis=1) - 1, 0, len(self.ends) - 1)
        low, high = ends[np.arange(y.size), panel].T
        place = (2.0 * log_t - low - high) / (high - low)
        inside = np.abs(place) <= 1.0
        in_t = chebvander(np.clip(place, -1.0, 1.0), DEGREE)
        width = self.span[1] - self.span[0]
        in_y = chebvander((2.0 * y - sum(self.span)) / (width or 1.0), self.series.shape[3] - 1)
        value, rise = np.empty((2, y.size)), np.empty((2, y.size))
        for i in np.unique(panel):
            here = panel == i
            over_t = np.einsum("cij,nj->cin", self.series[i], in_y[here])
            value[:, here] = np.einsum("ni,cin->cn", in_t[here], over_t)
            rise[:, here] = np.einsum("ni,cin->cn", in_t[here, :-1], chebder(over_t, axis=1))
        rise *= 2.0 / (high - low) * inside
        # Beyond the last panel the force tends to f_d P like x**-1.5, where x grows like t**2.
        beyond = place > 1.0
        fall = np.exp(-3.0 * (log_t - high)[beyond])
        value[1, beyond] = 1.0 + (value[1, beyond] - 1.0) * fall
        rise[1, beyond] = -3.0 * (value[1, beyond] - 1.0)
        return value, rise


def _border(softness: FloatArray, snaps: bool) -> FloatArray:
    """The variable y, from S = `softness` in the middle of a strip."""
    if snaps:  # S(ln t) is that of the middle over cosh(2 ln t)
        return np.asarray(0.5 * np.arccosh(np.maximum(softness, 1.0)))
    return np.asarray(np.sqrt(np.arcsin(np.minimum(softness, 1.0))))  # dense at narrow strips


class LayerCurve(NamedTuple):
    """Creep curves of all strips of a contact, as functions of ln t."""

    lam: float
    softness: float  # S in the middle of the strip w = 1
    families: list[_Family]

    def at(self, log_t: FloatArray, k_hat: FloatArray, lam: FloatArray) -> Layered:
        """Points of strips with lam = `self.lam`/w; their k_hat follows."""
        base = layer.at_parameter(log_t, np.zeros_like(lam), lam)
        softness = self.softness * self.lam / lam
        value, rise = np.empty((2, lam.size)), np.empty((2, lam.size))
        for family in self.families:
            here = (softness > 1.0) == family.snaps
            if len(self.families) == 1:
                here = np.ones_like(here)
            value[:, here], rise[:, here] = family.at(log_t[here], softness[here])
        creepage, ratio = base.creepage * value[0], base.ratio * value[1]
        d_creepage = base.rise * value[0] + base.creepage * rise[0]
        d_ratio = base.slope * base.rise * value[1] + base.ratio * rise[1]
        return Layered(creepage, d_creepage, ratio, d_ratio / d_creepage)


@lru_cache(maxsize=16)
def solve_curve(
    k_hat: float, lam: float, static_to_kinetic: float, contact: str, weakening: Weakening
) -> LayerCurve:
    """The curve of a line contact, or those of the strips of an ellipse.

    Raises
    ------
    ConvergenceError
        If a state has no solution that the iteration finds, or creepage does not grow with c.
    """
    law = (k_hat, lam, static_to_kinetic, contact, weakening)
    length = float(weakening_length(np.array(k_hat), static_to_kinetic))
    steepest = float(-weakening.slope(np.linspace(0.0, 3.0, 301)).min())
    softness = lam * (static_to_kinetic - 1.0) / length * steepest
    narrowest = NARROWEST * softness if contact == "elliptic" else softness
    families = []
    if narrowest <= 1.0:
        families.append(_solve_family(*law, softness, False, (narrowest, min(softness, 1.0))))
    if softness > 1.0:
        families.append(_solve_family(*law, softness, True, (max(narrowest, 1.0), softness)))
    return LayerCurve(lam, softness, families)


def _solve_family(
    k_hat: float,
    lam: float,
    static_to_kinetic: float,
    contact: str,
    weakening: Weakening,
    softness: float,
    snaps: bool,
    between: tuple[float, float],
) -> _Family:
    n = WIDTHS if between[1] > between[0] else 1
    low, high = sorted(float(v) for v in _border(np.array(between), snaps))
    y = 0.5 * (low + high) + 0.5 * (high - low) * chebpts1(n)
    widths = (np.cosh(2.0 * y) if snaps else np.sin(y * y)) / softness if n > 1 else np.ones(1)
    length = float(weakening_length(np.array(k_hat), static_to_kinetic))
    # Where all slip is far below D, and far above.
    first = min(-2.0, np.log(1e-7 * length / lam) / 6.0, np.log(1e-7 * length) / 10.0)
    last = max(3.0, 0.5 * np.log(2e5 * length / (static_to_kinetic * lam)))
    if snaps:
        first, last = first - high, last + high
    outer = np.array([0.0, 0.15, 0.4, 1.0])
    todo = []
    for a, b in pairwise(outer):  # from +-y to the first and the last end
        todo.append(((first * b, b - 1.0), (first * a, a - 1.0)))
        todo.append(((last * a, 1.0 - a), (last * b, 1.0 - b)))
    if snaps:
        todo += [((0.0, -1.0), (0.0, 0.0)), ((0.0, 0.0), (0.0, 1.0))]
    else:  # no place to follow
        todo = [((a, 0.0), (b, 0.0)) for (a, _), (b, _) in todo]
    place = chebpts1(DEGREE + 1)
    to_t = np.linalg.inv(chebvander(place, DEGREE))
    to_y = np.linalg.inv(chebvander(chebpts1(n), n - 1))
    done = []
    while todo:
        (a0, a1), (b0, b1) = panel = todo.pop()
        found = np.empty((2, DEGREE + 1, n))
        for j, w in enumerate(widths):
            start, end = a0 + a1 * y[j], b0 + b1 * y[j]
            log_t = 0.5 * (start + end) + 0.5 * (end - start) * place
            base = layer.at_parameter(log_t, np.zeros_like(log_t), np.full_like(log_t, lam / w))
            states = [
                solve_zones(float(v), k_hat / w, lam / w, static_to_kinetic, weakening)
                for v in log_t
            ]
            x = np.array([state.creepage for state in states])
            if not (np.diff(x) > 0.0).all():
                raise ConvergenceError(
                    f"creepage does not grow along the curve at k_hat {k_hat:.4g}, layer_ratio "
                    f"{lam:.4g}, static_to_kinetic {static_to_kinetic:.4g}"
                )
            found[:, :, j] = x / base.creepage, [s.ratio for s in states] / base.ratio
        series = to_t @ found
        if np.abs(series[:, -2:]).max() > TOLERANCE[contact] and b0 - a0 + abs(b1 - a1) > 0.02:
            middle = (0.5 * (a0 + b0), 0.5 * (a1 + b1))
            todo += [(panel[0], middle), (middle, panel[1])]
        else:
            done.append((panel, series @ to_y.T))
    done.sort(key=lambda item: item[0][0][0] + item[0][0][1] * high)
    return _Family(
        snaps,
        (low, high),
        np.array([panel for panel, _ in done]),
        np.array([series for _, series in done]),
    )


def along_zones(
    position: FloatArray,
    log_t: float,
    k_hat: float,
    lam: float,
    static_to_kinetic: float,
    weakening: Weakening,
) -> Along:
    """Traction and slip at places xi/a of a contact, (n,)."""
    grid = layer.panels(*GRID)
    state = solve_zones(log_t, k_hat, lam, static_to_kinetic, weakening)
    m, s, _ = (float(v) for v in split_at(np.exp(log_t), 0.0))
    ahead, behind = position - (m - s), (m - s) - position
    sticks, slips = (ahead >= 0.0) & (position <= 1.0), (behind > 0.0) & (position >= -1.0)
    along = np.zeros((3, position.size))
    along[0, sticks] = layer.between_nodes(
        state.stuck, ahead[sticks] / (2.0 * s), (1.0 - position[sticks]) / (2.0 * s), grid
    )
    place = behind[slips] / (2.0 * m), (1.0 + position[slips]) / (2.0 * m)
    slip = np.maximum(layer.between_nodes(state.slip, *place, grid), 0.0)
    pressure = np.sqrt((1.0 - position[slips]) * (1.0 + position[slips]))
    along[0, slips] = pressure * (1.0 + (static_to_kinetic - 1.0) * weakening.fraction(slip))
    length = float(weakening_length(np.array(k_hat), static_to_kinetic))
    along[1, slips] = layer.between_nodes(state.slip, *place, grid, 1) * length / (2.0 * m)
    along[2, slips] = slip
    return Along(*along)


@dataclass(frozen=True, kw_only=True)
class CohesiveZoneWithLayer(CohesiveZone):
    """The law of `CohesiveZone` with a layer of ``layer_ratio`` lam = L E*/(2 a) [1].

    The first use solves a curve, within seconds for a line contact and up to a minute for an
    ellipse.

    Raises
    ------
    ConvergenceError
        On use, if a state has no solution that the iteration finds, creepage does not grow along
        the curve, or a layer would snap inside the slip zone, which the exponential never causes.
    """

    layer_ratio: Annotated[float, Quantity("1", at_least=1e-7, at_most=100.0)]

    _limit = None
    sliding_creepage = np.inf  # some stick always remains
    carter_at_zero = False
    corner = None

    @property
    def _layer_curve(self) -> LayerCurve:
        return solve_curve(
            self.k_hat, self.layer_ratio, self.static_to_kinetic, self.contact, self.weakening
        )

    def _evaluate(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        solve = layer.line_with_layer if self.contact == "line" else layer.ellipse_with_layer
        return solve(np.minimum(x, MAX_X), self.k_hat, self.layer_ratio, self._layer_curve.at)

    def _log_t(self, x: float, w: float) -> float:
        """State of a strip of relative half-width w, ln t of `laws.layer`."""
        at, lam = np.array([min(abs(x), MAX_X) / w]), self.layer_ratio / w
        return float(layer.solve_layer(at, self.k_hat / w, lam, self._layer_curve.at)[0])

    def _stick_length(self, x: FloatArray, w: FloatArray) -> FloatArray:
        pairs = zip(x.flat, w.flat, strict=True)
        log_t = np.array([self._log_t(*pair) for pair in pairs])
        return (2.0 * split_at(np.exp(log_t), 0.0).s).reshape(x.shape)

    def _along_strip(self, position: FloatArray, x: float, w: float) -> Along:
        log_t, ratio = self._log_t(x, w), self.static_to_kinetic
        lam = self.layer_ratio / w
        return along_zones(position, log_t, self.k_hat / w, lam, ratio, self.weakening)
