"""Steady rolling contact of elliptic half-spaces, solved on a grid: the witness of the plane law.

Two bodies of equal material touch in a Hertzian ellipse and roll steadily. The creepages are given; wanted
are the tangential tractions, which nowhere exceed friction times pressure and oppose the slip where they
reach it. Nothing is assumed about strips, so the solver shows what a law in strips leaves out.

Variables: lengths in sqrt(a b), forces in f_d N, creepages times G a b/(f_d N) (spin times another sqrt(a b)),
friction divided by the kinetic coefficient f_d. Signs are those of Kalker: creepages are wheel minus rail,
so xi is negative in traction; x points in the rolling direction, y to the left, forces act on the wheel.
Then the linear theory is f_x = -c11 xi, f_y = -c22 eta - c23 phi, m_z = c23 eta - c33 phi, and the slip is

    s = (xi - phi y, eta + phi x) - du/dx,   pi u = (3/2 pi) int K p dA   (Cerruti),
    K = [(1 - nu) + nu cos^2, nu cos sin; nu cos sin, (1 - nu) + nu sin^2] / r

with the angle between x and the line from source to receiver, and |p| <= sqrt(1 - (x/a)^2 - (y/b)^2) f(u).

Method. Rows lie at Chebyshev nodes y = b cos(phi_j) and span their chord, nodes at x = a sin(phi_j) cos(k h),
h = pi/(columns + 1). So no staircase follows the edge, and traction, which vanishes there like a square root,
is sin(phi_j) times a sine series in the angle. Interpolated by that series along the row and by Chebyshev
polynomials across, its slip is a smooth double integral: around a receiver in polar coordinates, r dr cancels
1/r, du/dx becomes the integral of dp/dx, and the root singularity of dp/dx is the Jacobian of Chebyshev
quadrature along each chord. The slip is collocated half an interval ahead of the nodes, which carries the
condition of a bounded traction at the leading edge, and extrapolated linearly to them (with only the first
value this would be first order, as in CONTACT). Stick wants s = 0; slip wants s against p. Newton's method
solves both, with two unknowns where the grid sticks and the traction's angle alone where it slides; the sets
are updated in each step, and a case that does not converge is approached along its own direction.

Error. Second order in the interval, so two grids are extrapolated. What remains is irregular: where spin puts
the centre of rotation inside a sliding contact, the traction's direction jumps there, and the rows see it only
at their places.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

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

    forces: Array
    traction: Array
    slip: Array
    sliding: NDArray[np.bool_]


class Grid:
    """The discretised ellipse: influence of tractions on slip, kept for any number of cases.

    Parameters
    ----------
    a_over_b, poisson_ratio : float
    columns, rows : int
        Nodes along each chord; number of chords.

    Attributes
    ----------
    x, y, bound, weight : ndarray, shape (rows * columns,)
        Places, Hertz pressure over its peak, and the force of a unit traction at each node.
    """

    def __init__(self, a_over_b: float, poisson_ratio: float, columns: int, rows: int) -> None:
        a, b = np.sqrt(a_over_b), 1 / np.sqrt(a_over_b)
        step = np.pi / (columns + 1)
        along, across = step * np.arange(1, columns + 1), np.pi / rows * (np.arange(rows) + 0.5)
        half_chord = np.sin(across)[:, None]
        x, ahead = a * half_chord * np.cos(along), a * half_chord * np.cos(along - step / 2)
        self.shape = (rows, columns)
        self.x, self.y = x.ravel(), np.repeat(b * np.cos(across), columns)
        self.bound = (half_chord * np.sin(along)).ravel()

        order = np.arange(rows)
        to_chebyshev = np.cos(np.outer(order, across)) * np.where(order == 0, 1, 2)[:, None] / rows
        fejer = np.where(order % 2 == 0, 2 / (1.0 - order**2 + (order == 1)), 0) @ to_chebyshev
        self.weight = (1.5 / np.pi * step * fejer[:, None] * self.bound.reshape(self.shape)).ravel()
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
        rigid = np.zeros((3, 2, size))
        rigid[0, 0] = rigid[1, 1] = 1
        rigid[2] = -self.y, ahead.ravel()

        # From the collocation points, along each row, to its nodes.
        extrapolate = np.eye(size).reshape(rows, columns, rows, columns)
        ratio = (ahead - x)[:, 1:] / (ahead[:, :-1] - ahead[:, 1:])
        row, column = np.meshgrid(np.arange(rows), np.arange(1, columns), indexing="ij")
        extrapolate[row, column, row, column] += ratio
        extrapolate[row, column, row, column - 1] -= ratio
        extrapolate = extrapolate.reshape(size, size)
        self.influence = np.vstack([extrapolate @ part for part in np.vsplit(influence, 2)])
        self.rigid = (rigid @ extrapolate.T).reshape(3, 2 * size)
        self._stick = -np.linalg.solve(self.influence, self.rigid.T)

    def solve(self, creepage: ArrayLike, start: Rolling | None = None) -> Rolling:
        """Solve one case with Coulomb friction.

        Parameters
        ----------
        creepage : array_like, shape (3,)
            xi, eta and phi in the module's variables.
        start : Rolling, optional
            A state nearby. Default: full stick, cut off at the bound.

        Raises
        ------
        ArithmeticError
            If no equilibrium is found.
        """
        creepage = np.asarray(creepage, dtype=float)
        found = (self._newton(creepage, start) if start else None) or self._newton(creepage, None)
        # From a smaller or a larger creepage, in steps that adapt.
        for factor in (0.6, 1.6, 0.3, 3.0):
            if found:
                return found
            state, step = self._newton(factor * creepage, None), 1 - factor
            while state and factor != 1 and abs(step) > 0.002:
                target = 1.0 if abs(1 - factor) <= abs(step) else factor + step
                closer = self._newton(target * creepage, state)
                step *= 1.5 if closer else 0.5
                state, factor = (closer, target) if closer else (state, factor)
            found = state if factor == 1 else None
        if found:
            return found
        raise ArithmeticError(
            f"half_space: no equilibrium found for the creepages {creepage.tolist()}"
        )

    def _newton(self, creepage: Array, start: Rolling | None) -> Rolling | None:
        size, bound, influence = self.bound.size, self.bound, self.influence
        rigid = creepage @ self.rigid
        if start:
            p, sliding = start.traction, start.sliding
        else:
            p = (self._stick @ creepage).reshape(2, size)
            sliding = np.hypot(*p) > bound
            p = np.where(sliding, p * bound / np.hypot(*p).clip(1e-300), p)
        for _ in range(30):
            slip = (rigid + influence @ p.ravel()).reshape(2, size)
            stick, slide = np.flatnonzero(~sliding), np.flatnonzero(sliding)
            both = np.r_[stick, stick + size]
            e = p[:, slide] / bound[slide]
            turn = influence[:, slide] * (-bound[slide] * e[1]) + influence[:, slide + size] * (
                bound[slide] * e[0]
            )
            jacobian = np.empty((both.size + slide.size,) * 2)
            jacobian[: both.size, : both.size] = influence[np.ix_(both, both)]
            jacobian[: both.size, both.size :] = turn[both]
            for right, source in (
                (slice(None, both.size), influence[:, both]),
                (slice(both.size, None), turn),
            ):
                jacobian[both.size :, right] = (
                    source[slide] * e[1][:, None] - source[slide + size] * e[0][:, None]
                )
            # The slip's length instead of its part against p: the same at the solution, and never too small.
            diagonal = both.size + np.arange(slide.size)
            jacobian[diagonal, diagonal] -= np.hypot(*slip[:, slide])
            across = slip[0, slide] * e[1] - slip[1, slide] * e[0]
            change = np.linalg.solve(jacobian, -np.r_[slip.ravel()[both], across])
            angle = change[both.size :].clip(-1, 1)
            p = p.copy()
            p[:, stick] += change[: both.size].reshape(2, -1)
            p[:, slide] = bound[slide] * (
                e * np.cos(angle) + np.array([-e[1], e[0]]) * np.sin(angle)
            )
            slip = (rigid + influence @ p.ravel()).reshape(2, size)
            length = np.hypot(*p)
            starts = ~sliding & (length > bound * (1 + 1e-12))
            stops = sliding & ((slip * p).sum(axis=0) > 0)
            p[:, starts] *= bound[starts] / length[starts]
            sliding = (sliding | starts) & ~stops
            if not (starts.any() or stops.any()) and np.abs(angle).max(initial=0) < 1e-4:
                return Rolling(self.resultants @ p.ravel(), p, slip, sliding)
        return None


def _influence(a: float, b: float, columns: int, rows: int, to_chebyshev: Array) -> Array:
    """Give du/dx at the collocation points for unit tractions at the nodes, for 1, cos^2 and cos sin, each over r."""
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
            # Near the edge the chords change quickly as they turn.
            directions = 2 * int(max(64, 0.2 * columns / edge, 10 * max(a / b, b / a)))
            angle = (np.arange(directions) + 0.5) * np.pi / directions
            cos, sin = np.cos(angle), np.sin(angle)
            stretch = np.hypot(a * cos, b * sin)
            middle = x0 * cos + y0 * sin
            place = np.hypot(edge, middle)[:, None] * chord - middle[:, None]
            y = np.clip((y0 + place * sin[:, None]).ravel(), -1, 1)
            half_chord = np.sqrt(1 - y**2)
            t = np.clip((x0 + place * cos[:, None]).ravel() / half_chord.clip(1e-300), -1, 1)
            t_modes, y_modes = _chebyshev(t, columns + 1)[1:], _chebyshev(y, rows) * half_chord
            scale = np.pi / directions * np.pi / points / (stretch * a)
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


def _chebyshev(t: Array, count: int) -> Array:
    values = np.ones((count, t.size))
    values[1:2] = t
    for k in range(2, count):
        values[k] = 2 * t * values[k - 1] - values[k - 2]
    return values


@functools.lru_cache(maxsize=8)
def _grid(a_over_b: float, poisson_ratio: float, columns: int, rows: int) -> Grid:
    return Grid(a_over_b, poisson_ratio, columns, rows)


def rolling_forces(
    creepages: ArrayLike,
    *,
    a_over_b: float,
    poisson_ratio: float,
    grids: tuple[tuple[int, int], tuple[int, int]] = GRIDS,
) -> Array:
    """Give the forces of one case or of many, extrapolated from two grids.

    Parameters
    ----------
    creepages : array_like, shape (..., 3)
        xi, eta and phi in the module's variables. Neighbours in this order should be alike: each case
        starts from the one before.
    a_over_b, poisson_ratio : float
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
        grid, state = _grid(a_over_b, poisson_ratio, columns, rows), None
        for i, case in enumerate(cases):
            try:
                state = grid.solve(case, state)
                forces[i] = state.forces
            except ArithmeticError:
                forces[i] = np.nan
    ratio = ((grids[1][0] + 1) / (grids[0][0] + 1)) ** 2
    return (fine + (fine - coarse) / (ratio - 1)).reshape(creepages.shape)
