"""Steady rolling contact of half-spaces on a grid: the reference solver of lateral and spin force.

Two bodies of equal material touch in a Hertzian ellipse and roll steadily. The creepages are
given; unknown are the tangential tractions, which nowhere exceed friction times pressure and
oppose the slip where they reach it. Nothing is assumed about strips, so the solver shows what a
law in strips leaves out. It never runs in a simulation.

Variables: lengths in sqrt(a b), forces in f_d N, creepages times G a b/(f_d N) (spin times
another sqrt(a b)), friction over its kinetic value f_d, slip distance times G sqrt(a b)/(f_d N).
Signs are Kalker's: creepages are wheel minus rail, so xi is negative in traction; x points in the
rolling direction, y to the left; forces act on the wheel. The linear theory then is f_x = -c11
xi, f_y = -c22 eta - c23 phi, m_z = c23 eta - c33 phi. Slip, and displacement by traction
(Cerruti):

    s = (xi - phi y, eta + phi x) - du/dx,   u = (3/(2 pi^2)) int K p dA,
    K = [1 - nu sin^2, nu cos sin; nu cos sin, 1 - nu cos^2] / r

with the angle of the line from source to receiver against x, and the traction's bound |p| <=
sqrt(1 - (x/a)^2 - (y/b)^2) (1 + (f_s/f_d - 1) exp(-u_s/Delta)), where u_s is the slip distance
since the leading edge. A thin elastic layer between the bodies adds lam p to the displacement, in
the units of `contactlib.laws.layer`.

Method. Rows lie at Chebyshev nodes y = b cos(t_j) and span their chord, nodes at x = a sin(t_j)
cos(k h), h = pi/(columns + 1). So no staircase follows the edge, and traction, which vanishes
there like a square root, is sin(t_j) times a sine series of the angle along the chord. With that
series along and Chebyshev polynomials across, du/dx is a smooth double integral: in polar
coordinates around the receiver r dr cancels 1/r, and the root singularity of dp/dx is the weight
of Chebyshev quadrature on each chord. Slip is collocated half an interval ahead of the nodes,
which carries the condition of a bounded traction at the leading edge, and extrapolated linearly
to them (taken as it is there it would be of first order, as in CONTACT). Stick requires s = 0; slip
requires s against p. Newton's method solves both, with the two tractions unknown where the grid
sticks and the traction's angle where it slides (and its length, if friction weakens); the sets
are updated in each step, and a case that does not converge is approached along its own direction.

Error. Between order 3/2 (the root at the edge of stick) and 2 in h; two grids are extrapolated by
2. Against CONTACT (a/b 0.5 to 2, nu = 0.28; largest and root mean square of f_x, f_y, m_z): 0.0016
and 0.0005 without spin, 0.006 and 0.0014 with spin on the default grids, at some 20 ms a case;
0.0011, 0.0004, 0.008 and 0.0012 on ((23, 12), (31, 16)). Without spin the latter is at most
twice the uncertainty of CONTACT's values. With spin the rest is irregular: where the centre of
rotation lies inside a sliding contact the traction's direction jumps, and the nodes see that only
at their places. Weakening friction needs nodes inside its process zone: on ((47, 8), (71, 8)) 0.006
for a zone of 0.1 a and 0.0025 for 0.4 a or more.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial.chebyshev import chebvander
from numpy.typing import ArrayLike, NDArray

from contactlib.base.quantities import FloatArray

# Two grids (columns, rows), extrapolated as the square of 1/(columns + 1).
GRIDS = ((15, 12), (23, 12))


@dataclass(frozen=True)
class Rolling:
    """A steady state on the grid, in the module's variables.

    Attributes
    ----------
    forces : ndarray, shape (3,)
        f_x, f_y and m_z on the wheel.
    traction, slip : ndarray, shape (2, nodes)
        Traction on the wheel over the peak pressure times f_d; slip of the wheel.
    sliding : ndarray of bool, shape (nodes,)
    """

    forces: FloatArray
    traction: FloatArray
    slip: FloatArray
    sliding: NDArray[np.bool_]


class Grid:
    """The discretised ellipse: influence of tractions on slip, kept for any number of cases.

    Parameters
    ----------
    a_over_b, poisson_ratio : float
    columns, rows : int
        Nodes along each chord; number of chords.
    layer_ratio : float
        lam = L G/(2 (1 - nu) a) of a layer of the shear compliance L. Default: 0, no layer.

    Attributes
    ----------
    x, y, hertz, weight : ndarray, shape (rows * columns,)
        Places, Hertz pressure over its peak, and the force of a unit traction at each node.
    """

    def __init__(
        self,
        a_over_b: float,
        poisson_ratio: float,
        columns: int,
        rows: int,
        layer_ratio: float = 0.0,
    ) -> None:
        a, b = np.sqrt(a_over_b), 1 / np.sqrt(a_over_b)
        step = np.pi / (columns + 1)
        along, across = step * np.arange(1, columns + 1), np.pi / rows * (np.arange(rows) + 0.5)
        half_chord = np.sin(across)[:, None]
        x, ahead = a * half_chord * np.cos(along), a * half_chord * np.cos(along - step / 2)
        self.shape = (rows, columns)
        self.x, self.y = x.ravel(), np.repeat(b * np.cos(across), columns)
        self.hertz = (half_chord * np.sin(along)).ravel()

        order = np.arange(rows)
        to_chebyshev = np.cos(np.outer(order, across)) * np.where(order == 0, 1, 2)[:, None] / rows
        fejer = np.where(order % 2 == 0, 2 / (1.0 - order**2 + (order == 1)), 0) @ to_chebyshev
        self.weight = (1.5 / np.pi * step * fejer[:, None] * self.hertz.reshape(self.shape)).ravel()
        zero = np.zeros_like(self.weight)
        self.resultants = np.array(
            [
                np.r_[self.weight, zero],
                np.r_[zero, self.weight],
                np.r_[-self.y * self.weight, self.x * self.weight],
            ]
        )

        plain, cos2, cos_sin = 1.5 / np.pi**2 * _influence(a, b, columns, rows, to_chebyshev)
        nu, size = poisson_ratio, rows * columns
        influence = -np.block(
            [[(1 - nu) * plain + nu * cos2, nu * cos_sin], [nu * cos_sin, plain - nu * cos2]]
        )
        if layer_ratio > 0.0:
            # du/dx of the layer, ahead of the nodes, from the derivative of the sine series.
            mode, place = np.arange(1, columns + 1), along - step / 2
            to_sines = 2 / (columns + 1) * np.sin(np.outer(mode, along))
            rate = -(mode * np.cos(np.outer(place, mode))) @ to_sines / np.sin(place)[:, None]
            layer = 3 * layer_ratio * (1 - nu) / np.pi / half_chord[:, 0]
            influence -= np.kron(np.eye(2), np.kron(np.diag(layer), rate))
        rigid = np.zeros((3, 2, size))
        rigid[0, 0] = rigid[1, 1] = 1
        rigid[2] = -self.y, ahead.ravel()

        self.influence_ahead, self.rigid_ahead = influence, rigid.reshape(3, 2 * size)
        self.interval = -np.diff(x, axis=1, prepend=a * half_chord).ravel()

        # From the collocation points, along each row, to its nodes.
        extrapolation = np.eye(size).reshape(rows, columns, rows, columns)
        ratio = (ahead - x)[:, 1:] / (ahead[:, :-1] - ahead[:, 1:])
        row, column = np.meshgrid(np.arange(rows), np.arange(1, columns), indexing="ij")
        extrapolation[row, column, row, column] += ratio
        extrapolation[row, column, row, column - 1] -= ratio
        to_nodes = extrapolation.reshape(size, size)
        self.influence = np.vstack([to_nodes @ part for part in np.vsplit(influence, 2)])
        self.rigid = (rigid @ to_nodes.T).reshape(3, 2 * size)
        self._stick = -np.linalg.solve(self.influence, self.rigid.T)

    def solve(
        self,
        creepage: ArrayLike,
        *,
        static_ratio: float = 1.0,
        weakening_length: float = 1.0,
        start: Rolling | None = None,
    ) -> Rolling:
        """Solve one case.

        Parameters
        ----------
        creepage : array_like, shape (3,)
            xi, eta and phi in the module's variables.
        static_ratio : float
            f_s/f_d. Default: 1, Coulomb's friction.
        weakening_length : float
            Delta in the module's variables.
        start : Rolling, optional
            A state nearby. Default: full stick, cut off at the bound.

        Raises
        ------
        ValueError
            If a creepage is not finite.
        ArithmeticError
            If no equilibrium is found.
        """
        creepage = np.asarray(creepage, dtype=float)
        if not np.isfinite(creepage).all():
            raise ValueError(f"creepage is {creepage.tolist()}: it must be finite")
        friction = (static_ratio - 1, weakening_length)
        found = self._newton(creepage, friction, start) if start else None
        found = found or self._newton(creepage, friction, None)
        # From a smaller or a larger creepage, in steps that adapt.
        for factor in (0.6, 1.6, 0.3, 3.0):
            if found:
                return found
            state, step = self._newton(factor * creepage, friction, None), 1 - factor
            while state and factor != 1 and abs(step) > 0.002:
                target = 1.0 if abs(1 - factor) <= abs(step) else factor + step
                closer = self._newton(target * creepage, friction, state)
                step *= 1.5 if closer else 0.5
                state, factor = (closer, target) if closer else (state, factor)
            found = state if factor == 1 else None
        if found:
            return found
        raise ArithmeticError(f"no equilibrium found for the creepages {creepage.tolist()}")

    def _newton(
        self, creepage: FloatArray, friction: tuple[float, float], start: Rolling | None
    ) -> Rolling | None:
        size, hertz, influence = self.hertz.size, self.hertz, self.influence
        rigid, rigid_ahead = creepage @ self.rigid, creepage @ self.rigid_ahead
        excess = friction[0]
        if start:
            p, sliding = start.traction, start.sliding
        else:
            p = (self._stick @ creepage).reshape(2, size)
            bound, magnitude = hertz * (1 + excess), np.hypot(*p)
            sliding = magnitude > bound
            p = np.where(sliding, p * bound / magnitude.clip(1e-300), p)
        forces = self.resultants @ p.ravel()
        for _ in range(30):
            slip = (rigid + influence @ p.ravel()).reshape(2, size)
            stick, slide = np.flatnonzero(~sliding), np.flatnonzero(sliding)
            strength = np.hypot(*p[:, slide])
            e = p[:, slide] / strength

            basis = stick, slide, e, strength, bool(excess)
            change_of_slip = _by_unknowns(influence, *basis)
            across = (
                change_of_slip[slide] * e[1][:, None] - change_of_slip[slide + size] * e[0][:, None]
            )
            # The slip's length instead of its part against p: equal at last, and never too small.
            both, turns = np.r_[stick, stick + size], np.arange(slide.size)
            across[turns, both.size + turns] -= np.hypot(*slip[:, slide])
            jacobian = [change_of_slip[both], across]
            residual = [slip.ravel()[both], slip[0, slide] * e[1] - slip[1, slide] * e[0]]
            if excess:
                bound, d_bound = self._bound(p, rigid_ahead, friction)
                strengthen = -_by_unknowns(d_bound[slide], *basis)
                strengthen[turns, both.size + slide.size + turns] += 1
                jacobian.append(strengthen)
                residual.append(strength - bound[slide])
            change = np.linalg.solve(np.vstack(jacobian), -np.concatenate(residual))
            stuck, angle, stronger = np.split(change, [both.size, both.size + slide.size])
            angle = angle.clip(-1, 1)
            if excess:
                low, high = hertz[slide], hertz[slide] * (1 + excess)
                strength = (strength + stronger).clip(low, high)
            p = p.copy()
            p[:, stick] += stuck.reshape(2, -1)
            p[:, slide] = strength * (e * np.cos(angle) + np.array([-e[1], e[0]]) * np.sin(angle))
            slip = (rigid + influence @ p.ravel()).reshape(2, size)
            bound = self._bound(p, rigid_ahead, friction)[0] if excess else hertz
            magnitude = np.hypot(*p)
            stops = sliding & ((slip * p).sum(axis=0) > 0)
            # Both at once would make more cases circle.
            starts = ~sliding & (magnitude > bound * (1 + 1e-12)) & ~stops.any()
            p[:, starts] *= bound[starts] / magnitude[starts]
            sliding = (sliding | starts) & ~stops
            before, forces = forces, self.resultants @ p.ravel()
            settled = not (starts.any() or stops.any())
            if settled and np.abs(np.r_[angle, stronger]).max(initial=0) < 1e-4:
                return Rolling(forces, p, slip, sliding)
        # A node or two may change sides for ever; that matters only if the forces change.
        return Rolling(forces, p, slip, sliding) if np.abs(forces - before).max() < 2e-4 else None

    def _bound(
        self, p: FloatArray, rigid_ahead: FloatArray, friction: tuple[float, float]
    ) -> tuple[FloatArray, FloatArray]:
        """Give the bound that weakening friction leaves, and its derivative by the tractions."""
        slip = (rigid_ahead + self.influence_ahead @ p.ravel()).reshape(2, -1)
        speed = np.hypot(*slip)
        direction = slip / speed.clip(1e-300)
        distance = (speed * self.interval).reshape(self.shape).cumsum(axis=1).ravel()
        left = friction[0] * np.exp(-distance / friction[1])
        x_part, y_part = np.vsplit(self.influence_ahead, 2)
        change = self.interval[:, None] * (
            direction[0][:, None] * x_part + direction[1][:, None] * y_part
        )
        change = change.reshape(*self.shape, -1).cumsum(axis=1).reshape(change.shape)
        return self.hertz * (1 + left), -(self.hertz * left / friction[1])[:, None] * change


def _influence(a: float, b: float, columns: int, rows: int, to_chebyshev: FloatArray) -> FloatArray:
    """Give du/dx ahead of the nodes for unit tractions at them, by 1/r, cos^2/r and cos sin/r."""
    step = np.pi / (columns + 1)
    along, across = step * np.arange(1, columns + 1), np.pi / rows * (np.arange(rows) + 0.5)
    mode = np.arange(1, columns + 1)
    to_sines = 2 / (columns + 1) * np.sin(np.outer(mode, along))
    points = max(256, 8 * columns)
    chord = np.cos((np.arange(points) + 0.5) * np.pi / points)
    result = np.empty((3, rows, columns, rows, columns))
    upper = (rows + 1) // 2
    for j in range(upper):
        for i in range(columns):
            x0, y0 = np.sin(across[j]) * np.cos(along[i] - step / 2), np.cos(across[j])
            edge = np.sin(across[j]) * np.sin(along[i] - step / 2)
            # Near the edge the chords change quickly as they turn past its tangent.
            narrow = np.sqrt(edge)
            directions = int(max(64, 60 / narrow, 20 * max(a / b, b / a)))
            turn = (np.arange(directions) + 0.5) * np.pi / directions
            angle = np.arctan2(narrow * np.sin(turn), np.cos(turn)) + np.arctan2(x0, -y0)
            d_angle = narrow / (np.cos(turn) ** 2 + edge * np.sin(turn) ** 2) * np.pi / directions
            cos, sin = np.cos(angle), np.sin(angle)
            stretch = np.hypot(a * cos, b * sin)
            middle = x0 * cos + y0 * sin
            place = np.hypot(edge, middle)[:, None] * chord - middle[:, None]
            y = np.clip((y0 + place * sin[:, None]).ravel(), -1, 1)
            half_chord = np.sqrt(1 - y**2)
            t = np.clip((x0 + place * cos[:, None]).ravel() / half_chord.clip(1e-300), -1, 1)
            t_modes, y_modes = chebvander(t, columns).T[1:], chebvander(y, rows - 1).T * half_chord
            scale = d_angle * np.pi / points / (stretch * a)
            for kernel, factor in enumerate(
                (np.ones(directions), (a * cos / stretch) ** 2, a * b * cos * sin / stretch**2)
            ):
                modes = -mode[:, None] * ((t_modes * np.repeat(scale * factor, points)) @ y_modes.T)
                result[kernel, j, i] = (to_sines.T @ modes @ to_chebyshev).T / np.sin(across)[
                    :, None
                ]
    mirrored = result[:, : rows - upper, :, ::-1] * np.array([1, 1, -1])[:, None, None, None, None]
    result[:, upper:] = mirrored[:, ::-1]
    return result.reshape(3, rows * columns, rows * columns)


def _by_unknowns(
    matrix: FloatArray, stick: Any, slide: Any, e: FloatArray, strength: FloatArray, weakens: bool
) -> FloatArray:
    """Give the derivatives by tractions that stick, and by angle and length of those that slide."""
    size = matrix.shape[1] // 2
    at_x, at_y = matrix[:, slide], matrix[:, slide + size]
    parts = [
        matrix[:, stick],
        matrix[:, stick + size],
        at_y * (strength * e[0]) - at_x * (strength * e[1]),
    ]
    return np.hstack(parts + [at_x * e[0] + at_y * e[1]] * weakens)


@functools.lru_cache(maxsize=8)
def _grid(
    a_over_b: float, poisson_ratio: float, columns: int, rows: int, layer_ratio: float
) -> Grid:
    return Grid(a_over_b, poisson_ratio, columns, rows, layer_ratio)


def rolling_forces(
    creepages: ArrayLike,
    *,
    a_over_b: float,
    poisson_ratio: float,
    static_ratio: float = 1.0,
    weakening_length: float = 1.0,
    layer_ratio: float = 0.0,
    grids: tuple[tuple[int, int], tuple[int, int]] = GRIDS,
) -> FloatArray:
    """Give the forces of one case or of many, extrapolated from two grids.

    Parameters
    ----------
    creepages : array_like, shape (..., 3)
        xi, eta and phi in the module's variables. Each case starts from the one before, so
        neighbours should be alike.
    a_over_b, poisson_ratio : float
    static_ratio : float
        f_s/f_d. Default: 1, Coulomb's friction.
    weakening_length : float
        Delta in the module's variables.
    layer_ratio : float
        lam of a layer between the bodies, as for `Grid`. Default: 0, no layer.
    grids : pair of (columns, rows)
        The coarse and the fine grid.

    Returns
    -------
    ndarray, shape (..., 3)
        f_x, f_y and m_z on the wheel; NaN where no equilibrium was found.
    """
    creepages = np.asarray(creepages, dtype=float)
    cases = creepages.reshape(-1, 3)
    coarse, fine = np.empty_like(cases), np.empty_like(cases)
    for (columns, rows), forces in zip(grids, (coarse, fine), strict=True):
        grid, state = _grid(a_over_b, poisson_ratio, columns, rows, layer_ratio), None
        for i, case in enumerate(cases):
            try:
                state = grid.solve(
                    case, static_ratio=static_ratio, weakening_length=weakening_length, start=state
                )
                forces[i] = state.forces
            except ArithmeticError:
                forces[i] = np.nan
    ratio = ((grids[1][0] + 1) / (grids[0][0] + 1)) ** 2
    return (fine + (fine - coarse) / (ratio - 1)).reshape(creepages.shape)
