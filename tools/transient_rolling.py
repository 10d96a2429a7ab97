"""Rolling contact of half-spaces while the creepages change: the reference solver of memory.

Two bodies of equal material touch in a Hertzian ellipse and roll. The creepages follow any history
of the rolled distance, and the slip of every particle is followed from the leading edge to the
trailing edge, so nothing is assumed to be steady. It never runs in a simulation.

Variables: lengths over the semi-axis a along rolling, creepages over zeta0 = 2 f_d p0/E*, tractions
over f_d p0, forces over f_d P, slip distances over a zeta0, spin over zeta0/a. X points in the
rolling direction, Y to the left; creepages have the sign of the force on the wheel that they cause.
Displacement by tractions (Cerruti), and slip of the particle that is at X now, per rolled distance:

    u = 1/(2 pi (1 - nu)) int K p dA + lam p,
    K = [1 - nu sin^2, nu cos sin; nu cos sin, 1 - nu cos^2] / r,
    s = (x - phi Y, y + phi X) - Du/Ds,

with the angle of the line from source to receiver against X, and lam = L E*/(2 a) for a layer of
compliance L between the bodies. Traction opposes slip, and is at most
sqrt(1 - X^2 - (Y a/b)^2) (1 + (f_s/f_d - 1) exp(-u_s/D)), where u_s is the slip distance of the
particle since the leading edge and D = pi k_hat^2/(2 (f_s/f_d - 1)).

Method. Rows lie between Chebyshev points of Y and are divided, from the leading edge on, into
elements of one length h; the last one takes the rest. Traction is constant on an element, and
displacement is taken at its centre. The contact rolls by h in a step, so every particle moves on by
one element and nothing is interpolated. A particle that enters has rolled half a step since it met
the leading edge. Each step solves stick and slip by Newton's method for the projection of the
traction onto its bound, with the weakening implicit; where strength snaps, slip and weakening grow
by turns. Forces are of first order in h, as the traction begins like a root at the leading edge,
and two grids are extrapolated.

Error. Steady forces of 32 and 64 elements along and 12 rows, extrapolated: 0.003 of q where part of
the contact sticks, 0.001 where it slides, against `half_space`. A step of zero rolled distance is
Mindlin's problem to 0.002.
"""

from __future__ import annotations

import copy
import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from contactlib.base.quantities import FloatArray
from contactlib.base.writing import package_folder, write_whole

GRIDS = (32, 64)  # elements along the longest chord
ROWS = 6  # across half of the contact


@dataclass(frozen=True)
class Moment:
    """State of the contact: tractions, displacements and slip distances of its particles."""

    traction: FloatArray  # (components, elements)
    displacement: FloatArray
    at_edge: FloatArray  # (components, rows)
    slipped: FloatArray  # (elements,)
    sliding: NDArray[np.bool_]


class Contact:
    """The discretised ellipse.

    Parameters
    ----------
    a_over_b, poisson_ratio : float
    columns, rows : int
        Elements along the longest chord; rows across half of the contact.
    components : str
        Tractions that are solved: "x", "y" or "xy".
    symmetry : {"x", "y", ""}
        The force that is even across the contact, so that half of it is solved; "" for none.
    layer : float
        Displacement by a layer between the bodies over that by E* on a length of 2 a, L E*/(2 a).
    line : bool
        A line contact of the length 2 b, whose pressure is the same at every Y.
    """

    def __init__(
        self,
        a_over_b: float,
        poisson_ratio: float,
        columns: int,
        rows: int,
        components: str = "xy",
        symmetry: str = "",
        layer: float = 0.0,
        line: bool = False,
    ) -> None:
        nu, b, count = poisson_ratio, 1.0 / a_over_b, len(components)
        self.step, self.components, self.symmetry = 2.0 / columns, components, symmetry
        borders = b * np.cos(np.arange(2 * rows + 1) * np.pi / (2 * rows))
        across, height = 0.5 * (borders[:-1] + borders[1:]), -np.diff(borders)
        chords = np.ones(2 * rows) if line else np.sqrt(1.0 - (across / b) ** 2)
        numbers = np.maximum(np.rint(2.0 * chords / self.step).astype(int), 1)
        ends = [
            w - self.step * np.r_[:n, 2.0 * w / self.step]
            for w, n in zip(chords, numbers, strict=True)
        ]
        x = np.concatenate([0.5 * (e[:-1] + e[1:]) for e in ends])
        length = np.concatenate([-np.diff(e) for e in ends])
        y, width = np.repeat(across, numbers), np.repeat(height, numbers)
        area = [w * np.arcsin(np.clip(e / w, -1.0, 1.0)) for w, e in zip(chords, ends, strict=True)]
        root = [np.sqrt(np.maximum(w * w - e * e, 0.0)) for w, e in zip(chords, ends, strict=True)]
        under = [0.5 * (w * s + e * r) for w, s, e, r in zip(chords, area, ends, root, strict=True)]
        pressure = -np.concatenate([np.diff(u) for u in under]) / length
        weight = length * width
        weight /= weight @ pressure
        first = np.cumsum(numbers) - numbers

        # Displacements at the centres of the elements, and at the leading edge of each row.
        at_x, at_y = np.r_[x, chords][:, None], np.r_[y, across][:, None]
        plain = along = mixed = np.zeros((at_x.size, x.size))
        for i in (-1, 1):
            for j in (-1, 1):
                dx, dy = at_x - x + 0.5 * i * length, at_y - y + 0.5 * j * width
                # The integrals of 1/r, dx^2/r^3 and dx dy/r^3 over a rectangle.
                of_x = dx * np.arcsinh(dy / np.abs(dx).clip(1e-300))
                of_y = dy * np.arcsinh(dx / np.abs(dy).clip(1e-300))
                plain = plain + i * j * (of_x + of_y)
                along = along + i * j * of_y
                mixed = mixed - i * j * np.hypot(dx, dy)
        kernel = {
            "xx": (1.0 - nu) * plain + nu * along,
            "yy": plain - nu * along,
            "xy": nu * mixed,
            "yx": nu * mixed,
        }
        half = 2 if symmetry else 1
        size, lines = x.size // half, chords.size // half
        mirror = np.concatenate(np.split(np.arange(x.size), first[1:])[::-1])
        kept = np.r_[:size, x.size : x.size + lines]
        blocks = []
        for to in components:
            for source in components:
                block = kernel[to + source]
                if symmetry:
                    block = block + (1.0 if source == symmetry else -1.0) * block[:, mirror]
                blocks.append(block[kept, :size] / (2.0 * np.pi * (1.0 - nu)))
        split = [blocks[i : i + count] for i in range(0, len(blocks), count)]
        self.influence = np.block([[part[:size] for part in row] for row in split])
        self.influence += layer * np.eye(count * size)
        self.at_edge = np.block([[part[size:] for part in row] for row in split])
        self.x, self.y, self.pressure = x[:size], y[:size], pressure[:size]
        self.half_length, self.growth = 0.5 * length[:size], 0.5 if line else 1.0 / 3.0
        self.outline = np.zeros(size) if line else (y[:size] / b) ** 2
        self.weight, self.first = weight[:size] * half, first[:lines]
        # A particle comes from the element ahead, and from the edge half a step ago.
        self.ahead = np.arange(size) - 1
        entering = np.zeros((lines, size))
        entering[np.arange(lines), self.first] = 0.5
        self.change = np.kron(np.eye(count), entering.T) @ self.at_edge - self.influence
        self.scale = 1.0 / np.abs(np.diag(self.change)).mean()
        self.rolled = self.x[self.ahead] - self.x  # not h for the last element of a row
        self.rolled[self.first] = 0.5 * self.step
        one, nothing = np.ones(size), np.zeros(size)
        rigid = {"x": (one, nothing, -self.y), "y": (nothing, one, self.x)}
        self.rigid = np.stack([rigid[name] for name in components], axis=1)

    def set_load(self, ratio: float) -> None:
        """Set the load over the grid's; semi-axes and pressures grow with it as Hertz's do."""
        square = ratio ** (2.0 * self.growth) - self.outline
        chord = np.sqrt(np.maximum(square, 1e-300))
        borders = [np.clip((self.x + i * self.half_length) / chord, -1.0, 1.0) for i in (-1, 1)]
        under = [np.arcsin(at) + at * np.sqrt(1.0 - at * at) for at in borders]
        self.pressure = chord**2 * (under[1] - under[0]) / (4.0 * self.half_length)

    def at_rest(self) -> Moment:
        """State without tractions."""
        count, size = len(self.components), self.x.size
        return Moment(
            np.zeros((count, size)),
            np.zeros((count, size)),
            np.zeros((count, self.first.size)),
            np.zeros(size),
            np.zeros(size, dtype=bool),
        )

    def forces(self, state: Moment) -> FloatArray:
        """Forces and moment (q_x, q_y, m) on the wheel, over f_d P and f_d P a."""
        p = dict(zip(self.components, state.traction, strict=True))
        nothing = np.zeros_like(self.x)
        if self.symmetry:  # the halves of the other force cancel
            p = {self.symmetry: p[self.symmetry]}
        along, across = p.get("x", nothing), p.get("y", nothing)
        moment = self.x * across - (nothing if self.symmetry else self.y * along)
        return np.array([self.weight @ part for part in (along, across, moment)])

    def roll(
        self, state: Moment, creepage: FloatArray, excess: float = 0.0, decay: float = 1.0
    ) -> Moment:
        """State after one more step.

        Parameters
        ----------
        state : Moment
        creepage : array_like, shape (3,)
            Normalized creepages x and y and the spin during the step.
        excess, decay : float
            f_s/f_d - 1, and D.

        Raises
        ------
        ArithmeticError
            If Newton's method finds no solution.
        """
        count, size = state.traction.shape
        before = state.displacement[:, self.ahead]
        before[:, self.first] = 0.5 * state.at_edge
        slipped = state.slipped[self.ahead]
        slipped[self.first] = 0.0
        rigid = np.tensordot(np.asarray(creepage, dtype=float), self.rigid, 1) * self.rolled
        slipped[self.pressure == 0.0] = 0.0
        fixed, p = rigid + before, state.traction

        def weakened(length: FloatArray) -> FloatArray:
            return np.asarray(excess * np.exp(-(slipped + length) / decay))

        found = self._solve(p, fixed, lambda length: (weakened(length), 1.0 / decay))
        if found is None:
            # Strength snaps. With that of the slip before, slip and weakening grow by turns.
            length = np.zeros(size)
            for _ in range(500):
                left = weakened(length)
                found = self._solve(p, fixed, functools.partial(_held, left))
                if found is None:
                    break
                p, more = found[0], np.maximum(found[2], length)
                if np.abs(weakened(more) - left).max() < 1e-7:
                    break
                length = more
        if found is None:
            raise ArithmeticError("no equilibrium found")
        p, slides, length = found
        return Moment(
            p,
            (self.influence @ p.ravel()).reshape(count, size),
            (self.at_edge @ p.ravel()).reshape(count, -1),
            np.where(slides, slipped + length, slipped),
            slides,
        )

    def _solve(
        self,
        p: FloatArray,
        fixed: FloatArray,
        excess: Callable[[FloatArray], tuple[FloatArray, float]],
    ) -> tuple[FloatArray, NDArray[np.bool_], FloatArray] | None:
        """Give tractions, which elements slide, and their slip, by Newton's method.

        `excess` gives what slips leave of f_s/f_d - 1, and the rate of its logarithm's fall.
        """
        count, size = p.shape
        scale, change = self.scale, self.change

        def look(p: FloatArray) -> tuple[Any, ...]:
            slip = fixed + (change @ p.ravel()).reshape(count, size)
            trial, length = p + scale * slip, np.hypot(slip[0], slip[1:].sum(0))
            strength = np.hypot(trial[0], trial[1:].sum(0)).clip(1e-300)
            left, fall = excess(length)
            bound = self.pressure * (1.0 + left)
            slides, e = strength > bound, trial / strength
            residual = np.where(slides, p - bound * e, -scale * slip)
            return residual, slip, length, strength, bound, self.pressure * left * fall, slides, e

        found = look(p)
        for iteration in range(50):
            residual, slip, length, strength, bound, fall, slides, e = found
            if np.abs(residual).max() < (1e-9 if iteration < 20 else 1e-7):
                return p, slides, length
            jacobian = -scale * change
            at = np.flatnonzero(slides)
            steps = change.reshape(count, size, -1)[:, at]
            along = slip[:, at] / length[at].clip(1e-300)
            by_length = (along[:, :, None] * steps).sum(0) * fall[at][:, None]
            unit = np.eye(count * size).reshape(count, size, -1)[:, at]
            trial_by = unit + scale * steps
            trial_by -= e[:, at, None] * (e[:, at, None] * trial_by).sum(0)
            turn = (bound / strength)[at]
            rows = unit + e[:, at, None] * by_length - turn[:, None] * trial_by
            jacobian.reshape(count, size, -1)[:, at] = rows
            *_, delta, info = lapack.dgesv(jacobian, -residual.reshape(-1, 1))
            if info:
                return None
            norm, part = np.linalg.norm(residual), 1.0
            for _ in range(5):  # sets that change for ever need shorter steps
                found = look(p + part * delta.reshape(count, size))
                if np.linalg.norm(found[0]) < norm:
                    break
                part *= 0.4
            p = p + part * delta.reshape(count, size)
        return None


def _held(left: FloatArray, _: FloatArray) -> tuple[FloatArray, float]:
    return left, 0.0


@functools.lru_cache(maxsize=16)
def contact(
    a_over_b: float,
    poisson_ratio: float,
    columns: int,
    rows: int,
    components: str = "xy",
    symmetry: str = "",
    layer: float = 0.0,
    line: bool = False,
) -> Contact:
    """Give a discretised ellipse, made once."""
    return Contact(a_over_b, poisson_ratio, columns, rows, components, symmetry, layer, line)


# Histories of x against the rolled distance that the guide draws, and where they end.
HISTORIES: dict[str, tuple[Callable[[float], float], float]] = {
    "step": (lambda s: 2.0 if s > 0.0 else 0.0, 3.0),
    "release": (lambda s: 0.4 if s > 0.0 else 3.0, 4.0),
    "ramp": (lambda s: s, 3.0),
    "swing": (lambda s: 1.3 + 0.3 * np.sin(1.5 * s), 12.0),
}


def history(
    x: Callable[[float], float],
    end: float,
    *,
    a_over_b: float = 1.4,
    poisson_ratio: float = 0.28,
    excess: float = 0.0,
    k_hat: float = 0.0,
    component: str = "x",
    layer: float = 0.0,
    line: bool = False,
    grids: tuple[int, int] = GRIDS,
    load: Callable[[float], float] = lambda s: 1.0,
) -> tuple[FloatArray, FloatArray]:
    """Give rolled distances and forces, extrapolated, from the steady state of x(0).

    `component` is the direction of creepage and force; the other traction is left out. The second
    grid must have twice the columns of the first. `load` is the part of the largest load at a
    distance; lengths, creepages and forces are scaled by the largest.
    """
    decay = np.pi * k_hat**2 / (2.0 * excess) if excess else 1.0
    way, forces = "xy".index(component), []
    for columns in grids:
        made = contact(a_over_b, poisson_ratio, columns, ROWS, component, component, layer, line)
        grid = copy.copy(made)  # whose load changes
        state, q, creepage = grid.at_rest(), [0.0], np.zeros(3)
        for i in range(-round(8.0 / grid.step) if x(0.0) else 0, round(end / grid.step)):
            creepage[way] = x(max(i + 0.5, 0.0) * grid.step)
            grid.set_load(load(max(i + 0.5, 0.0) * grid.step))
            state = grid.roll(state, creepage, excess, decay)
            if i == -1:
                q = [grid.forces(state)[way]]
            if i >= 0:
                q.append(grid.forces(state)[way])
        forces.append(np.array(q)[:: columns // grids[0]])
    n = min(forces[0].size, forces[1].size)
    distance = np.arange(n, dtype=np.float64) * (2.0 / grids[0])
    return distance, np.asarray(2.0 * forces[1][:n] - forces[0][:n])


def write_histories() -> None:
    """Solve the histories with k_hat = 0.3 and f_s/f_d = 11/7 for the guide; takes seconds."""
    lines = [
        "# q against the distance rolled, over a, by tools/transient_rolling.py. Ellipse on a",
        "# half-space, a/b = 1.4, nu = 0.28, k_hat of strips 0.3, f_s/f_d = 11/7.",
        "history,distance,q",
    ]
    for name, (x, end) in HISTORIES.items():
        s, q = history(x, end, excess=4 / 7, k_hat=0.3)
        lines += [f"{name},{at:g},{force:.4f}" for at, force in zip(s, q, strict=True)]
    path = package_folder("models") / "transient_rolling.csv"
    write_whole(path, ("\n".join(lines) + "\n").encode())


if __name__ == "__main__":
    write_histories()
