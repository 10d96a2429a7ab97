"""The creep curve of a line contact with a cohesive zone, as a function of creepage.

`laws.cohesive_zone` solves states of given stick length or edge slip rate. On each of four
stretches of the curve the release A and the excess B are smooth functions of a parameter v, so each
stretch is cut into panels until a Chebyshev series of fixed degree is accurate enough:

    rear    mixed slip, small slip zone: L = 2 - epsilon = v**2; the series are of A/L and B/L
    front   mixed slip, small stick zone: epsilon = v**2, v < 0, as A and B have epsilon**2
            ln(epsilon)
    slip    full slip: delta = v
    tail    far out: delta = 1/v**2, v < 0

The point at a given creepage is then found by Newton's method in its panel.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev

from contactlib.base.quantities import FloatArray
from contactlib.laws.cohesive_zone import (
    ConvergenceError,
    enough_nodes,
    solve_cohesive_zones,
    weakening_length,
)
from contactlib.laws.friction import Weakening

DEGREE = 15
NOISE = 1e-9  # largest accepted error of the states themselves
KINKED = (1e-9, 1e-6)  # tolerance and noise if the weakening has kinks
MAX_PANELS, NARROWEST = 200, 1e-3  # number of panels; width over that of the first panels
REAR, FRONT, SLIP, TAIL = range(4)


class State(NamedTuple):
    """Points of the curve, all of one shape."""

    stick_length: FloatArray  # epsilon
    edge_slip: FloatArray  # delta
    traction_ratio: FloatArray  # q
    slope: FloatArray  # dq/dx


# Stick length c0 + c1 v**2 and edge slip c2 v + c3/v**2 of each stretch.
_SHAPES = np.array(
    [[2.0, -1.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
)


def _regime(kind: FloatArray, v: FloatArray) -> tuple[FloatArray, ...]:
    """Stick length, slipping length, edge slip; derivatives of the first and last by v."""
    c0, c1, c2, c3 = _SHAPES.T[:, kind]
    square = v * v
    stick = c0 + c1 * square
    slipped = (2.0 - c0) - c1 * square
    inverse = c3 / np.where(c3 > 0.0, square, 1.0)
    return (
        stick,
        slipped,
        c2 * v + inverse,
        2.0 * c1 * v,
        c2 - 2.0 * inverse / np.where(c3 > 0.0, v, 1.0),
    )


class SlipCurve(NamedTuple):
    """Creep curve of a line contact as panels in rising creepage.

    Attributes
    ----------
    kind, low, high : ndarray
        Stretch and ends in v of the panels, (p,).
    coefficients : ndarray
        Chebyshev series of A and B, or of A/L and B/L at the rear, (p, DEGREE + 1, 2).
    """

    kind: FloatArray
    low: FloatArray
    high: FloatArray
    coefficients: FloatArray

    @classmethod
    def solve(
        cls,
        k_hats: FloatArray,
        static_to_kinetic: float,
        weakening: Weakening,
        tolerance: float = 1e-11,
    ) -> list[SlipCurve]:
        """Curves at several k_hat that share their panels, resolved to `tolerance`.

        If the weakening has kinks, they are resolved to 2e-6.

        Raises
        ------
        ConvergenceError
            If a state has no solution, the series do not converge, or creepage does not grow
            along a curve, so that it would not be a function of creepage.
        """
        law = (k_hats, static_to_kinetic, weakening)
        fewest = enough_nodes(float(k_hats.min()), static_to_kinetic, weakening)
        if weakening.kinks:
            return cls._resolve(*law, fewest, *KINKED)
        for nodes in (fewest, 3 * fewest // 2, 9 * fewest // 4, 27 * fewest // 8):
            try:
                return cls._resolve(*law, nodes, tolerance, NOISE)
            except ConvergenceError as error:
                failure = error  # more nodes may help
        raise failure

    @classmethod
    def _resolve(
        cls,
        k_hats: FloatArray,
        static_to_kinetic: float,
        weakening: Weakening,
        nodes: int,
        tolerance: float,
        noise: float,
    ) -> list[SlipCurve]:
        panels = _stretches(k_hats, static_to_kinetic)
        narrowest = NARROWEST * min(high - low for _, low, high in panels)
        before = np.full(len(panels), np.inf)
        done: list[tuple[int, float, float]] = []
        series: list[FloatArray] = []
        while panels:
            coefficients = _series(panels, k_hats, static_to_kinetic, weakening, nodes)
            # The last terms estimate the truncation error. If a cut has not made them much smaller,
            # they are noise of the states.
            rest = np.abs(coefficients[:, :, -2:]).max(axis=(0, 2, 3))
            good = (rest <= tolerance) | ((rest > 0.2 * before) & (rest <= noise))
            done += [p for p, ok in zip(panels, good, strict=True) if ok]
            series += list(np.moveaxis(coefficients[:, good], 0, 1))
            panels = [h for p, ok in zip(panels, good, strict=True) if not ok for h in _halves(p)]
            before = np.repeat(rest[~good], 2)
            lost = any(high - low < narrowest for _, low, high in panels)
            if lost or len(panels) + len(done) > MAX_PANELS:
                raise ConvergenceError(
                    f"the creep curve from k_hat {k_hats.min():.4g} to {k_hats.max():.4g}, "
                    f"static_to_kinetic {static_to_kinetic:.4g} is not resolved to {tolerance} "
                    f"with {nodes} nodes: the weakening law is too rough or its zone too short"
                )
        order = sorted(range(len(done)), key=lambda i: done[i])
        kind, low, high = (np.array(column) for column in zip(*sorted(done), strict=True))
        curves = [
            cls(kind, low, high, np.array([series[i][j] for i in order]))
            for j in range(k_hats.size)
        ]
        for curve, k_hat in zip(curves, k_hats, strict=True):
            if not (np.diff(curve.borders()) > 0.0).all():
                raise ConvergenceError(
                    f"creepage does not grow along the curve at k_hat {k_hat:.4g}, "
                    f"static_to_kinetic {static_to_kinetic:.4g}: there are several steady states"
                )
        return curves

    def borders(self) -> FloatArray:
        """Creepages x between the panels, (p - 1,)."""
        rest = (self.kind[1:], self.low[1:], self.high[1:])
        return _points(
            *rest, np.moveaxis(self.coefficients[1:], 0, -1), np.full(len(self.kind) - 1, -1.0)
        )[0]

    @property
    def sliding_creepage(self) -> float:
        """Creepage x at which full slip begins."""
        first_slip = int(np.argmax(self.kind == SLIP))
        return float(self.borders()[first_slip - 1])

    def at(self, x: FloatArray) -> State:
        """Points of the curve at creepages x > 0, (n,)."""
        borders = self.borders()
        panel = np.searchsorted(borders, x, side="right")
        ends = np.concatenate([[0.0], borders, [np.inf]])
        return find_points(
            self.kind[panel],
            self.low[panel],
            self.high[panel],
            np.ascontiguousarray(np.moveaxis(self.coefficients[panel], 0, -1)),
            (ends[panel], ends[panel + 1]),
            x,
        )


def _points(
    kind: FloatArray, low: FloatArray, high: FloatArray, coefficients: FloatArray, place: FloatArray
) -> tuple[FloatArray, ...]:
    """x, q, dx/dv, dq/dv, v, stick length and edge slip at places in [-1, 1] of panels, (n,)."""
    v = 0.5 * (low + high) + 0.5 * (high - low) * place
    stick, slipped, edge, d_stick, d_edge = _regime(kind, v)
    (a, b), slopes = _clenshaw(coefficients, place)
    d_a, d_b = slopes * (2.0 / (high - low))
    rear = kind == REAR
    scale, d_scale = np.where(rear, slipped, 1.0), np.where(rear, -d_stick, 0.0)
    a, d_a = a * scale, d_a * scale + a * d_scale
    b, d_b = b * scale, d_b * scale + b * d_scale
    x = 0.5 * slipped + edge + a
    q = slipped - 0.25 * slipped**2 + stick * a + b  # 1 - stick**2/4 + ...
    d_x = d_edge - 0.5 * d_stick + d_a
    d_q = -0.5 * stick * d_stick + stick * d_a + d_stick * a + d_b
    return x, q, d_x, d_q, v, stick, edge


def find_points(
    kind: FloatArray,
    low: FloatArray,
    high: FloatArray,
    coefficients: FloatArray,
    ends: tuple[FloatArray, FloatArray],
    x: FloatArray,
) -> State:
    """Points at creepages x > 0, (n,), in the given panels, whose ends in x are given.

    The coefficients have the shape (DEGREE + 1, 2, n), in the order of their use.
    """
    tail, first, last = kind == TAIL, (kind == REAR) & (low == 0.0), (kind == FRONT) & (high == 0.0)
    # Start from x linear in v, or in v**2 at either end of the mixed regime.
    with np.errstate(invalid="ignore"):
        part = np.clip((x - ends[0]) / (ends[1] - ends[0]), 0.0, 1.0)
    part = np.where(first, np.sqrt(part), np.where(last, 1.0 - np.sqrt(1.0 - part), part))
    far = np.where(tail, -1.0 / np.sqrt(np.maximum(x - 1.0, 1.0)), 0.5 * (low + high))
    far = np.clip((2.0 * far - low - high) / (high - low), -1.0, 1.0)
    place = np.where(tail, far, 2.0 * part - 1.0)
    lower, upper = np.full_like(x, -1.0), np.ones_like(x)
    for _ in range(60):
        x_here, _, d_x, _, v, _, _ = _points(kind, low, high, coefficients, place)
        d_x = d_x * 0.5 * (high - low)
        # In the tail x is nearly 1/v**2: take the root of v**2 x instead.
        off = np.where(tail, v * v * (x_here - x), x_here - x)
        rate = np.where(tail, v * v * d_x + v * (high - low) * (x_here - x), d_x)
        lower, upper = np.where(off <= 0.0, place, lower), np.where(off >= 0.0, place, upper)
        new = place - off / np.where(rate > 0.0, rate, np.inf)
        new = np.where((new >= lower) & (new <= upper), new, 0.5 * (lower + upper))
        step = np.abs(new - place)
        place = new
        if (step <= 1e-7).all():  # second-order convergence: this was the last step
            break
    _, q, d_x, d_q, _, stick, edge = _points(kind, low, high, coefficients, place)
    return State(stick, edge, q, d_q / d_x)


def _stretches(k_hats: FloatArray, static_to_kinetic: float) -> list[tuple[int, float, float]]:
    """First panels: kind, low and high end in v."""
    lengths = weakening_length(k_hats, static_to_kinetic)
    # Scales at which stick length or edge slip equal the weakening zone.
    shortest = float(lengths.min()) / max(1.0, static_to_kinetic - 1.0)
    near, far = 0.5 * min(1.0, shortest) ** (2.0 / 3.0), max(4.0, 20.0 * float(lengths.max()))
    stuck, slid = _steps(np.sqrt(near), 1.0), _steps(near, far)
    return [
        *((REAR, low, high) for low, high in pairwise([0.0, *stuck])),
        *((FRONT, -high, -low) for low, high in pairwise([0.0, *stuck])),
        *((SLIP, low, high) for low, high in pairwise([0.0, *slid])),
        (TAIL, -1.0 / np.sqrt(far), 0.0),
    ]


def _steps(low: float, high: float) -> FloatArray:
    """Ends of panels, each about five times as far as the last."""
    return np.geomspace(low, high, 1 + max(1, round(np.log(high / low) / np.log(5.0))))


def _series(
    panels: list[tuple[int, float, float]],
    k_hats: FloatArray,
    static_to_kinetic: float,
    weakening: Weakening,
    nodes: int,
) -> FloatArray:
    """Chebyshev coefficients of the two functions, (k_hats, panels, DEGREE + 1, 2)."""
    places = chebyshev.chebpts1(DEGREE + 1)
    kind, low, high = (np.array(column)[:, np.newaxis] for column in zip(*panels, strict=True))
    v = 0.5 * (low + high) + 0.5 * (high - low) * places
    kind = np.broadcast_to(kind, v.shape)
    stick, slipped, edge, _, _ = _regime(kind, v)
    shape = (k_hats.size, *v.shape)
    zones = solve_cohesive_zones(
        *(np.broadcast_to(state, shape).ravel() for state in (stick, slipped, edge)),
        k_hat=np.repeat(k_hats, v.size),
        static_to_kinetic=static_to_kinetic,
        weakening=weakening,
        nodes=nodes,
    )
    scale = np.where(kind == REAR, slipped, 1.0)[:, :, np.newaxis]
    values = np.stack([zones.release, zones.excess], axis=-1).reshape(*shape, 2) / scale
    to_series = np.linalg.inv(chebyshev.chebvander(places, DEGREE))
    series = np.asarray(np.einsum("ij,kpjc->kpic", to_series, values))
    # At the end of stick A and B have zero slope in v: enforce it, or dq/dx is noise over noise.
    last = (kind[:, 0] == FRONT) & (high[:, 0] == 0.0)
    series[:, last, 1] -= np.einsum("i,kpic->kpc", np.arange(DEGREE + 1.0) ** 2, series[:, last])
    return series


def _clenshaw(series: FloatArray, place: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Values and derivatives of two Chebyshev series per point, (DEGREE + 1, 2, n) at (n,)."""
    twice = 2.0 * place
    value, last, d_value, d_last = (np.zeros_like(series[0]) for _ in range(4))
    for term in series[:0:-1]:
        d_value, d_last = 2.0 * value + twice * d_value - d_last, d_value
        value, last = term + twice * value - last, value
    return series[0] + place * value - last, value + place * d_value - d_last


def _halves(panel: tuple[int, float, float]) -> list[tuple[int, float, float]]:
    """Cut a panel in the middle, or at the geometric mean if its ends differ much in size."""
    kind, low, high = panel
    middle = 0.5 * (low + high)
    if low * high > 0.0 and max(low / high, high / low) > 4.0:
        middle = np.copysign(np.sqrt(low * high), low)
    return [(kind, low, middle), (kind, middle, high)]
