"""Rolling of a line contact with a thin elastic layer between the bodies, solved by panels.

The layer adds L q to the relative displacement of two half-planes, where L [m/Pa] is its thickness
over its shear modulus. With lengths in a, tractions in f_d p0, x = zeta/zeta0 and lam = L E*/(2a),

    u(xi) = lam q(xi) + (1/pi) int q(s) ln|(1-s)/(xi-s)| ds,    stick: u = x (1 - xi).        (1)

Full stick on the unit interval, t from the stick boundary to the leading edge, has one parameter,

    Lam r(t) + (1/pi) int_0^1 r(s) ln|(1-s)/(t-s)| ds = 1 - t,    sigma(Lam) = (2/pi) int r.  (2)

A contact that slips up to c = 1 - d is p - g, with a g that vanishes where it slips: (2) with
Lam = lam/d and another right-hand side. Continuity at c gives the creepage X0 and the force q0 of
Coulomb friction. Friction that weakens over a vanishing slip lets the traction jump at c by J. The
energy that the layer releases there, lam J**2/2, is the fracture energy (pi/2) k_hat**2 p(c) of
Eq. (17), which does not depend on the layer, and the jump adds a multiple of r:

    x = X0 + k_hat t/sqrt(sigma),    q = q0 + k_hat t d sqrt(sigma),    t**4 = (1 + c)/(1 - c).  (3)

A panel's traction is a polynomial; the logarithm is integrated against it in closed form, by
Legendre functions of the second kind.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial.chebyshev import chebder, chebval, chebvander
from numpy.polynomial.legendre import legder, leggauss, legvander
from scipy.linalg import lu_factor, lu_solve

from contactlib.base.quantities import FloatArray
from contactlib.laws.strips import MIN_X, split_at

ORDER = 16  # of a panel's polynomial
FINE = 64  # nodes of the rule for a point that is not near the panel
NEAR = 1.02  # in half widths from a panel's middle: the recurrence for Q_n is exact enough
SMALLEST, GROWTH = 1e-10, 3.0  # of the panels: width at an end of the interval; ratio of neighbours
STRIPS = 24  # of an ellipse, on each side of the strip that just sticks
# Chebyshev nodes: error 2e-8 of X0 relative to 1 + X0, 2e-9 of q0 and sigma.
ANGLES, RATIOS = 28, 48


class Rule(NamedTuple):
    """Gauss's rules on a panel, and what follows from values at the nodes of the first."""

    nodes: FloatArray
    weights: FloatArray
    fine_nodes: FloatArray
    fine_weights: FloatArray
    coefficients: FloatArray  # of Legendre polynomials
    upsampled: FloatArray  # values at the fine nodes


@cache
def rule() -> Rule:
    """The rules of every panel, computed when the first layer is solved."""
    (nodes, weights), (fine_nodes, fine_weights) = leggauss(ORDER), leggauss(FINE)
    coefficients = (np.arange(ORDER) + 0.5)[:, None] * (legvander(nodes, ORDER - 1).T * weights)
    upsampled = legvander(fine_nodes, ORDER - 1) @ coefficients
    return Rule(nodes, weights, fine_nodes, fine_weights, coefficients, upsampled)


class Panels(NamedTuple):
    """Panels of the unit interval, their nodes, and the integrals of (2) over them."""

    front: int  # number of panels that are placed by their distance from 0, not from 1
    before: FloatArray  # distance of a panel from 0
    after: FloatArray  # from 1
    half: FloatArray  # half its width
    start: FloatArray  # distance of the nodes from 0, (n,)
    end: FloatArray  # from 1
    weight: FloatArray  # of an integral
    potential: FloatArray  # (1/pi) int r(s) ln|(1-s)/(t-s)| ds at the nodes, (n, n)
    at_start: FloatArray  # the potential at 0


def _legendre_q(z: FloatArray) -> FloatArray:
    """Legendre functions of the second kind, orders 0 to `ORDER`, (ORDER + 1, n)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        q = [0.5 * np.log(np.abs((1.0 + z) / (1.0 - z)))]
        q.append(z * q[0] - 1.0)
        for n in range(1, ORDER):
            q.append(((2 * n + 1) * z * q[n] - n * q[n - 1]) / (n + 1))
    return np.array(q)


def _log_moments(z: FloatArray) -> FloatArray:
    """Integrals of P_n(s) ln|z - s| over -1 < s < 1, (n, ORDER), for |z| up to `NEAR`."""
    q, order = _legendre_q(z), np.arange(1, ORDER)
    moments = np.empty((z.size, ORDER))
    with np.errstate(divide="ignore", invalid="ignore"):
        left, right = z + 1.0, z - 1.0
        moments[:, 0] = left * np.log(np.abs(left)) - right * np.log(np.abs(right)) - 2.0
        moments[:, 1:] = (2.0 * (q[2:] - q[:-2]) / (2 * order + 1)[:, None]).T
    edge = np.abs(z) == 1.0
    moments[edge, 0] = 2.0 * np.log(2.0) - 2.0
    moments[edge, 1:] = -2.0 / (order * (order + 1)) * z[edge, None] ** order
    return moments


@cache
def panels(first: float = SMALLEST, last: float = SMALLEST, growth: float = GROWTH) -> Panels:
    """Panels that grow in proportion to their distance from the nearer end."""
    nodes, weights, fine_nodes, fine_weights, coefficients, upsampled = rule()

    def edges(smallest: float) -> FloatArray:
        growing = [0.0, smallest]
        while growing[-1] * growth < 0.5 / np.sqrt(growth):
            growing.append(growing[-1] * growth)
        return np.array([*growing, 0.5])

    at_0, at_1 = edges(first), edges(last)
    front = at_0.size - 1
    half = np.concatenate([0.5 * np.diff(at_0), 0.5 * np.diff(at_1)[::-1]])
    before = np.concatenate([at_0[:-1], 1.0 - at_1[:0:-1]])
    after = np.concatenate([1.0 - at_0[1:], at_1[-2::-1]])
    start = (before[:, None] + half[:, None] * (1.0 + nodes)).ravel()
    end = (after[:, None] + half[:, None] * (1.0 - nodes)).ravel()
    to, to_end = np.append(start, [0.0, 1.0]), np.append(end, [1.0, 0.0])
    integral = np.empty((to.size, start.size))  # of r(s) ln|t - s|; last rows: t = 0, t = 1
    for k, size in enumerate(half):
        own = slice(k * ORDER, (k + 1) * ORDER)
        # Differences of distances from the end that is nearer to the panel lose no digit.
        z = (to - before[k]) / size - 1.0 if k < front else 1.0 - (to_end - after[k]) / size
        z[own] = nodes
        near = np.abs(z) <= NEAR
        log = np.empty((z.size, ORDER))
        log[near] = _log_moments(z[near]) @ coefficients
        log[~near] = np.log(np.abs(z[~near, None] - fine_nodes)) * fine_weights @ upsampled
        integral[:, own] = size * (log + np.log(size) * weights)
    weight = (half[:, None] * weights).ravel()
    potential, at_start = (integral[-1] - integral[:-2]) / np.pi, integral[-1] - integral[-2]
    return Panels(front, before, after, half, start, end, weight, potential, at_start / np.pi)


def between_nodes(
    values: FloatArray,
    start: FloatArray,
    end: FloatArray,
    grid: Panels | None = None,
    derivative: int = 0,
) -> FloatArray:
    """Values, or a derivative, at points by their distances from 0 and 1, each (n,)."""
    grid = grid or panels()
    front, count = grid.front, grid.half.size
    place = np.searchsorted(grid.before[:front], start, side="right") - 1
    back = count - np.searchsorted(grid.after[: front - 1 : -1], end, side="right")
    first = start <= end
    place = np.where(first, np.clip(place, 0, front - 1), np.clip(back, front, count - 1))
    half = grid.half[place]
    z = np.where(
        first, (start - grid.before[place]) / half - 1.0, 1.0 - (end - grid.after[place]) / half
    )
    series = values.reshape(-1, ORDER)[place] @ rule().coefficients.T
    series = legder(series, derivative, axis=1) / half[:, None] ** derivative
    basis = legvander(np.clip(z, -1.0, 1.0), ORDER - 1 - derivative)
    return np.asarray(np.einsum("ij,ij->i", basis, series))


def behind(values: FloatArray, distance: FloatArray) -> FloatArray:
    """Integral of r(s)/(s + distance) over the unit interval, at distances > 0 behind it, (n,)."""
    grid, fixed = panels(), rule()
    integral = np.zeros(distance.shape)
    for before, half, own in zip(grid.before, grid.half, values.reshape(-1, ORDER), strict=True):
        z = 1.0 + (before + distance) / half  # of the mirrored panel
        near = z <= NEAR
        mirrored = fixed.coefficients @ own * (-1.0) ** np.arange(ORDER)
        integral[near] += 2.0 * mirrored @ _legendre_q(z[near])[:ORDER]
        integral[~near] += (1.0 / (z[~near, None] + fixed.fine_nodes)) @ (
            fixed.fine_weights * (fixed.upsampled @ own)
        )
    return integral


class Stick(NamedTuple):
    """States of a line contact at one Lam, each at several stick boundaries, (n,)."""

    stiffness: float  # sigma, Eq. (2)
    creepage: FloatArray  # X0
    excess: FloatArray  # X0 over its limits without a layer and without bodies together
    slipped: FloatArray  # 1 - q0
    traction: FloatArray  # q0 at the panels' nodes, (n, nodes)
    full_stick: FloatArray  # r at the nodes, (nodes,)


def states(lam_over_d: float, angle: FloatArray) -> Stick:
    """Coulomb friction with a layer, at stick boundaries c = -cos(2 angle).

    Parameters
    ----------
    lam_over_d : float
        Lam = lam/d [1], above zero.
    angle : ndarray
        From 0, where the whole contact sticks, to pi/2, where it slips; d = 2 cos(angle)**2.
    """
    _, _, _, _, start, end, weight, potential, at_start = panels()
    factors = lu_factor(lam_over_d * np.eye(start.size) + potential)
    r = lu_solve(factors, end)
    d = 2.0 * np.cos(angle)[:, None] ** 2
    lead, trail = d * end, 2.0 * np.sin(angle)[:, None] ** 2 + d * start  # 1 - xi, 1 + xi
    sliding = np.sqrt(lead * trail)  # p
    # Potential of the traction p in -1 < s < c: that of the whole contact is (1 - xi**2)/2.
    slid = 0.5 * lead * trail / d - sliding @ potential.T
    g = lu_solve(factors, slid.T).T
    # q(c) = p(c): X0 r(0) = p + g(0), where (2) at t = 0 gives Lam r(0) and Lam g(0).
    stuck = np.sin(angle) ** 2  # X0 without a layer
    rest = stuck - sliding @ at_start - g @ at_start  # Lam g(0)
    left = r @ at_start  # 1 - Lam r(0)
    jump = np.sin(2.0 * angle)  # p(c)
    excess = (lam_over_d * jump * left + rest - stuck * (1.0 - left)) / (1.0 - left)
    creepage = stuck + lam_over_d * jump + excess
    traction = creepage[:, None] * r - g
    slipped = 2.0 / np.pi * d[:, 0] * ((sliding - traction) @ weight)
    return Stick(float(2.0 / np.pi * (r @ weight)), creepage, excess, slipped, traction, r)


class Interpolants(NamedTuple):
    """Chebyshev coefficients over 2 y - 1 and 2 w - 1 of what `states` gives.

    The angle is (pi/2) y**2, and Lam = (w/(1 - w))**3: square roots and logarithms at the ends of
    the ranges become smooth enough for a polynomial.
    """

    excess: FloatArray  # over p(c), (ANGLES, RATIOS)
    ratio: FloatArray  # q0 over sin(angle), (ANGLES, RATIOS)
    stiffness: FloatArray  # sigma (1 + pi Lam), (RATIOS,)


@cache
def interpolants() -> Interpolants:
    """The states of all stick boundaries and layers, solved once."""

    def nodes(n: int) -> tuple[FloatArray, FloatArray]:
        at = np.cos(np.pi * (np.arange(n) + 0.5) / n)
        return 0.5 * (1.0 + at), np.asarray(np.linalg.inv(chebvander(at, n - 1)), np.float64)

    y, from_angles = nodes(ANGLES)
    w, from_ratios = nodes(RATIOS)
    angle = 0.5 * np.pi * y**2
    excess, ratio = np.empty((ANGLES, RATIOS)), np.empty((ANGLES, RATIOS))
    stiffness = np.empty(RATIOS)
    for j, lam in enumerate((w / (1.0 - w)) ** 3):
        state = states(lam, angle)
        excess[:, j] = state.excess / np.sin(2.0 * angle)
        ratio[:, j] = (1.0 - state.slipped) / np.sin(angle)
        stiffness[j] = state.stiffness * (1.0 + np.pi * lam)
    return Interpolants(
        from_angles @ excess @ from_ratios.T,
        from_angles @ ratio @ from_ratios.T,
        from_ratios @ stiffness,
    )


def full_stick(lam_over_d: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Sigma of Eq. (2), and its derivative by ln(Lam)."""
    coefficients = interpolants().stiffness
    cubic = np.cbrt(lam_over_d)
    w = cubic / (1.0 + cubic)
    winkler = 1.0 / (1.0 + np.pi * lam_over_d)
    sigma = chebval(2.0 * w - 1.0, coefficients) * winkler
    rise = 2.0 / 3.0 * w * (1.0 - w) * chebval(2.0 * w - 1.0, chebder(coefficients)) * winkler
    return np.asarray(sigma), np.asarray(rise - sigma * np.pi * lam_over_d * winkler)


def _derivative(coefficients: FloatArray) -> FloatArray:
    """Chebyshev coefficients of the derivative along the first axis."""
    return np.asarray(chebder(coefficients))


class Layered(NamedTuple):
    """A line contact with a layer at the parameters t of Eq. (3), each (n,)."""

    creepage: FloatArray
    rise: FloatArray  # of the creepage by ln t
    ratio: FloatArray
    slope: FloatArray  # of the ratio by the creepage


def at_parameter(log_t: FloatArray, k_hat: FloatArray, lam: FloatArray) -> Layered:
    """Eq. (3) and its derivatives at ln t, (n,)."""
    table = interpolants()
    t = np.exp(log_t)
    m, s, _ = split_at(t, 0.0)
    root_m, root_s = np.sqrt(m), np.sqrt(s)
    lam_over_d = lam / (2.0 * s)  # its logarithm has the derivative 4 m by ln t
    cubic = np.cbrt(lam_over_d)
    y, w = np.sqrt(np.arctan2(root_m, root_s) * (2.0 / np.pi)), cubic / (1.0 + cubic)
    in_y, in_w = chebvander(2.0 * y - 1.0, ANGLES - 1), chebvander(2.0 * w - 1.0, RATIOS - 1)

    def at_state(coefficients: FloatArray) -> FloatArray:
        n, k = coefficients.shape
        value: FloatArray = np.einsum("ij,ij->i", in_y[:, :n] @ coefficients, in_w[:, :k])
        return value

    slip = 2.0 * root_m * root_s  # p(c), and the derivative of the angle by ln t
    excess = at_state(table.excess)
    excess_rise = 2.0 * slip / (np.pi * y) * at_state(_derivative(table.excess))
    excess_rise += 8.0 / 3.0 * m * w * (1.0 - w) * at_state(_derivative(table.excess.T).T)
    sigma, sigma_rise = full_stick(lam_over_d)
    jump = k_hat * t / np.sqrt(sigma)
    creepage = m + lam * t**2 + excess * slip + jump
    by_friction = 4.0 * m * s + 2.0 * lam * t**2
    by_friction += (excess_rise + 2.0 * (s - m) * excess) * slip  # dX0
    half = 2.0 * m * sigma_rise / sigma  # of sqrt(sigma), relative to it
    rise = by_friction + jump * (1.0 - half)
    ratio = root_m * at_state(table.ratio) + 2.0 * s * sigma * jump
    ratio_rise = by_friction + jump * (1.0 + half - 4.0 * m)  # in d sigma: dq0 = d sigma dX0
    return Layered(creepage, rise, ratio, 2.0 * s * sigma * ratio_rise / rise)


# A curve: its points at ln t, k_hat and lam.
AtParameter = Callable[[FloatArray, FloatArray, FloatArray], Layered]


def solve_layer(
    x: FloatArray,
    k_hat: FloatArray | float,
    lam: FloatArray | float,
    curve: AtParameter = at_parameter,
) -> FloatArray:
    """Solve a curve, Eq. (3), for ln t at x > 0, (n,), by Newton's method inside a bracket."""
    k_hat, lam = np.broadcast_to(k_hat, x.shape), np.broadcast_to(lam, x.shape)
    low, high = np.full(x.shape, -115.0), np.full(x.shape, 115.0)
    log_t = 0.5 * np.log(x / (1.0 + lam))
    moving = np.arange(x.size)
    for _ in range(200):
        at = log_t[moving]
        state = curve(at, k_hat[moving], lam[moving])
        off = state.creepage - x[moving]
        low[moving] = np.where(off <= 0.0, at, low[moving])
        high[moving] = np.where(off >= 0.0, at, high[moving])
        # In ln x, which is nearly linear in ln t far from the peak.
        newton = at - np.log(state.creepage / x[moving]) * state.creepage / state.rise
        # A converged step may land on an end of the bracket, which counts as inside.
        inside = (newton >= low[moving]) & (newton <= high[moving])
        new = np.where(inside, newton, 0.5 * (low[moving] + high[moving]))
        log_t[moving] = new
        done = np.abs(new - at) <= 4e-16 * np.maximum(1.0, np.abs(at))
        moving = moving[~(done | (np.abs(off) <= 1e-15 * x[moving]))]
        if not moving.size:
            break
    return log_t


def line_with_layer(
    x: FloatArray,
    k_hat: FloatArray | float,
    lam: FloatArray | float,
    curve: AtParameter = at_parameter,
) -> tuple[FloatArray, FloatArray]:
    """Traction ratio and slope of a line contact at x >= 0; arguments broadcast."""
    x, k_hat, lam = np.broadcast_arrays(x, k_hat, lam)
    shape = x.shape
    x, k_hat, lam = x.ravel(), k_hat.ravel(), lam.ravel()
    ratio, slope = np.zeros(x.size), 2.0 * full_stick(0.5 * lam)[0]
    rolls = np.flatnonzero(x > MIN_X)
    for part in np.array_split(rolls, 1 + rolls.size // 4096):  # to bound the memory
        k, share = k_hat[part], lam[part]
        state = curve(solve_layer(x[part], k, share, curve), k, share)
        ratio[part], slope[part] = state.ratio, state.slope
    return ratio.reshape(shape), slope.reshape(shape)


# Traction ratio and slope of a line contact at x, k_hat and lam.
LineLaw = Callable[[FloatArray, FloatArray, FloatArray], tuple[FloatArray, FloatArray]]


def ellipse_with_layer(
    x: FloatArray, k_hat: float, lam: float, line: LineLaw = line_with_layer
) -> tuple[FloatArray, FloatArray]:
    """Traction ratio and slope of an ellipse: Eq. (24) with Gauss's rule, on both sides of w = x.

    A strip of the relative width w is a line contact with x/w, k_hat/w and lam/w.
    """
    nodes, weights = leggauss(STRIPS)
    part = 0.5 * (1.0 + nodes)
    clustered = part * part * (3.0 - 2.0 * part)  # towards both ends
    weights = 3.0 * part * (1.0 - part) * weights
    split = np.arccos(np.minimum(x.ravel(), 1.0))[:, None]
    angle = np.hstack([split * clustered, split + (0.5 * np.pi - split) * clustered])
    weight = np.hstack([split * weights, (0.5 * np.pi - split) * weights])
    w = np.cos(angle)  # d(eta) = w d(angle)
    ratio, slope = line(x.ravel()[:, None] / w, k_hat / w, lam / w)
    force = 1.5 * np.sum(ratio * w**3 * weight, axis=1)  # Eq. (24)
    rate = 1.5 * np.sum(slope * w**2 * weight, axis=1)
    return force.reshape(x.shape), rate.reshape(x.shape)


class Line(NamedTuple):
    """One state of a line contact, with the traction q in c < xi < 1 at the panels' nodes."""

    x: float
    lam: float
    c: float
    d: float
    traction: FloatArray
    missing: FloatArray  # p - q


def line_state(x: float, k_hat: float, lam: float) -> Line:
    """State of a line contact at a creepage x > 0."""
    log_t = solve_layer(np.array([x]), k_hat, lam)
    m, s, _ = (float(v[0]) for v in split_at(np.exp(log_t), 0.0))
    state = states(lam / (2.0 * s), np.arctan(np.exp(2.0 * log_t)))
    grid = panels()
    traction = state.traction[0] + (x - state.creepage[0]) * state.full_stick
    sliding = np.sqrt(2.0 * s * grid.end * (2.0 * m + 2.0 * s * grid.start))
    return Line(x, lam, m - s, 2.0 * s, traction, sliding - traction)


def line_traction(xi: FloatArray, state: Line) -> FloatArray:
    """Traction q at positions in the contact, (n,); at c, that where the surface sticks."""
    q = np.sqrt((1.0 - xi) * (1.0 + xi))
    stick = xi >= state.c
    start, end = (xi[stick] - state.c) / state.d, (1.0 - xi[stick]) / state.d
    q[stick] = between_nodes(state.traction, start, end)
    return q


def line_slip_rate(xi: FloatArray, state: Line) -> FloatArray:
    """Slip per rolled distance over zeta0 at positions in the contact, (n,): x + du/d(xi)."""
    rate = np.zeros(xi.shape)
    slips = xi < state.c
    at = xi[slips]
    with np.errstate(divide="ignore"):
        layer = state.lam * at / np.sqrt((1.0 - at) * (1.0 + at))
    rate[slips] = state.x - at - layer - behind(state.missing, (state.c - at) / state.d) / np.pi
    return rate
