"""Steady rolling in full stick of an elliptic contact: the problem behind Kalker's coefficients.

`python tools/stick_rolling.py` solves it for the polynomials in `fmu/kernel/creep_coefficients.h`;
tests solve it too.

Both bodies are half-spaces of one material. By Cerruti's solution the tractions p on the ellipse
displace their surfaces against each other by

    pi G u_x = int [ ((1-nu)/r + nu dx**2/r**3) p_x + nu dx dy/r**3 p_y ] dA
    pi G u_y = int [ nu dx dy/r**3 p_x + ((1-nu)/r + nu dy**2/r**3) p_y ] dA

Where nothing slips, a surface point collects the creepages xi, eta and the spin phi while it
passes through: du_x/dx = xi - phi y and du_y/dx = eta + phi x. Integrated,

    u_x = xi x - phi x y + f_x(y),    u_y = eta x + phi x**2/2 + f_y(y),

where f_x and f_y, unknown constants of each row y, leave the tractions free to vanish where the
material enters, x = +w(y). Forces and moment are then, with a b = 1 and G = 1,

    F_x = -c11 xi,    F_y = -c22 eta - c23 phi,    M_z = c23 eta - c33 phi.

In the coordinates X = x/a and Y = y/b, in which the ellipse is the unit circle, w = sqrt(1-Y**2)
and the tractions are

    p = (w - X)/sqrt(w**2 - X**2) * (polynomial in X and Y + w * another one).

The factor in front vanishes at the leading edge and has the trailing edge's singularity. The
second polynomial is what makes the series converge fast: where the two edges meet the traction
has terms that are odd in w. The integrals are sums over chords through the point, with
Gauss-Chebyshev quadrature along each chord, which takes up the root, and the trapezoidal rule over
the angle. The displacements are matched by least squares at more points than there are unknowns.
Poisson's ratio does not enter the integrals.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.polynomial.chebyshev import chebfit, chebvander
from numpy.typing import NDArray

from contactlib.base.quantities import FloatArray
from contactlib.base.writing import package_folder, write_whole

BoolArray = NDArray[np.bool_]
DEGREE = 16  # of the polynomials


class Influence(NamedTuple):
    """What the base functions of the tractions do on one ellipse with a b = 1.

    `kernels` holds the integrals of p/r, p dx**2/r**3 and p dx dy/r**3 at points x, y: its shape
    is (3, rows, points of a row, functions). `moments` holds the integrals of p, x p and y p, and
    `even` marks the functions that are even in y.
    """

    x: FloatArray
    y: FloatArray
    kernels: FloatArray
    moments: FloatArray
    even: BoolArray


class StickCoefficients(NamedTuple):
    """Kalker's coefficients; c32 is c23 as found from the moment."""

    c11: float
    c22: float
    c23: float
    c32: float
    c33: float


def influence(a_over_b: float, degree: int = DEGREE) -> Influence:
    """Integrate the base functions over the ellipse; a few seconds, and 0.1 s with degree 8."""
    a, b = np.sqrt(a_over_b), 1.0 / np.sqrt(a_over_b)
    chords, chord_points = int(15 * degree * max(a, b) ** 0.5), 4 * degree
    # Chebyshev points of X/w on each row; rows of Y < 0 follow from the symmetry.
    y = np.cos((np.arange(3 * degree) + 0.5) * np.pi / (6 * degree))[:, np.newaxis]
    x = np.sqrt(1.0 - y * y) * np.cos((np.arange(2 * degree) + 0.5) * np.pi / (2 * degree))
    y = np.broadcast_to(y, x.shape)
    # The angle phi lies between those of the circle and of the ellipse, so that neither
    # crowds: the direction is (cos/sqrt(a), sin/sqrt(b))/n there and (sqrt(a) cos, sqrt(b) sin)/m
    # here, and d(angle)/r = d(phi)/(m n) per length along the chord.
    phi = (np.arange(chords) + 0.5) * np.pi / chords
    m = np.hypot(np.sqrt(a) * np.cos(phi), np.sqrt(b) * np.sin(phi))
    n = np.hypot(np.cos(phi) / np.sqrt(a), np.sin(phi) / np.sqrt(b))
    along_x, along_y = np.cos(phi) / (np.sqrt(a) * n), np.sin(phi) / (np.sqrt(b) * n)
    cos, sin = np.sqrt(a) * np.cos(phi) / m, np.sqrt(b) * np.sin(phi) / m
    weights = np.stack((np.ones(chords), cos * cos, cos * sin)) * np.pi / (chords * m * n)
    gauss = np.cos((np.arange(chord_points) + 0.5) * np.pi / chord_points)

    # Base function (i, j, k): (w - X) T_i(X) T_j(Y) w**k.
    of_x, of_y, of_w = np.array(
        [
            (i, j, k)
            for i in range(degree)
            for j in range(degree - i)
            for k in (0, 1)
            if i + j + k < degree
        ]
    ).T

    def functions_summed(at_x: FloatArray, at_y: FloatArray, weight: FloatArray) -> FloatArray:
        """Sums of the base functions over the last axis of points."""
        at_x, at_y = np.clip(at_x, -1.0, 1.0), np.clip(at_y, -1.0, 1.0)  # rounding
        w = np.sqrt(1.0 - at_y * at_y)
        in_x = chebvander(at_x, degree - 1) * (weight * (w - at_x))[..., np.newaxis]
        in_y = chebvander(at_y, degree - 1)
        in_y = np.concatenate((in_y, in_y * w[..., np.newaxis]), axis=-1)
        products = np.swapaxes(in_x, -1, -2) @ in_y
        return np.asarray(products[..., of_x, of_y + degree * of_w])

    kernels = np.empty((3, *x.shape, of_x.size))
    for place in np.ndindex(x.shape):
        middle = x[place] * along_x + y[place] * along_y
        middle_x, middle_y = x[place] - middle * along_x, y[place] - middle * along_y
        half = np.sqrt(1.0 - middle_x**2 - middle_y**2)[:, np.newaxis] * gauss
        sums = functions_summed(
            middle_x[:, np.newaxis] + half * along_x[:, np.newaxis],
            middle_y[:, np.newaxis] + half * along_y[:, np.newaxis],
            np.full(half.shape, np.pi / chord_points),
        )
        kernels[:, *place] = weights @ sums

    angle = (np.arange(chords) + 0.5) * np.pi / chords  # Y = cos(angle): dY = sin(angle) d(angle)
    on_y = np.repeat(np.cos(angle)[:, np.newaxis], chord_points, axis=1)
    on_x = np.sin(angle)[:, np.newaxis] * gauss
    area = np.sin(angle)[:, np.newaxis] * np.full(on_x.shape, np.pi**2 / (chords * chord_points))
    moments = [functions_summed(on_x, on_y, area * of) for of in (1.0, a * on_x, b * on_y)]
    return Influence(a * x, b * y, kernels, np.stack(moments).sum(axis=1), of_y % 2 == 0)


def stick_coefficients(of: Influence, poisson_ratio: float) -> StickCoefficients:
    """Solve for the tractions of unit creepages and spin, and sum them to forces and moment."""
    nu = poisson_ratio
    unit, xx, xy = of.kernels / np.pi
    even, odd = of.even, ~of.even

    def solve(
        in_x: BoolArray, in_y: BoolArray, *given: tuple[FloatArray, FloatArray]
    ) -> list[FloatArray]:
        """Tractions of displacements, with p_x of the functions in_x and p_y of those in_y."""
        columns = [
            np.concatenate(((1.0 - nu) * unit + nu * xx, nu * xy))[..., in_x],
            np.concatenate((nu * xy, unit - nu * xx))[..., in_y],
            np.stack([np.concatenate(u) for u in given], axis=-1),
        ]
        system = np.concatenate(columns, axis=-1)
        system -= system.mean(axis=1, keepdims=True)  # least squares over f_x and f_y
        system = system.reshape(-1, system.shape[-1])
        matrix, sides = system[:, : -len(given)], system[:, -len(given) :]
        scale = np.linalg.norm(matrix, axis=0)
        tractions = np.linalg.lstsq(matrix / scale, sides, rcond=1e-13)[0] / scale[:, np.newaxis]
        return np.split(tractions, [np.count_nonzero(in_x)])

    x, y, zero = of.x, of.y, np.zeros_like(of.x)
    force, about_x, about_y = of.moments
    along, _ = solve(even, odd, (x, zero))
    p_x, p_y = solve(odd, even, (zero, x), (-x * y, 0.5 * x * x))
    f_y = force[even] @ p_y
    m_z = about_x[even] @ p_y - about_y[odd] @ p_x
    return StickCoefficients(
        *(float(c) for c in (-(force[even] @ along)[0], -f_y[0], -f_y[1], m_z[0], -m_z[1]))
    )


NODES = (24, 12)  # Chebyshev points of ln(a/b) from -3 to 3, and of Poisson's ratio
TERMS = (18, 10)  # of the polynomials in them that are kept, which loses less than 3e-6


def write_polynomials() -> None:
    """Solve at all nodes and write the header with the polynomials; takes two minutes."""
    in_g, in_nu = (np.cos((np.arange(n) + 0.5) * np.pi / n) for n in NODES)
    g, nu = np.exp(3.0 * in_g), 0.25 * (1.0 + in_nu)
    solved = np.array(
        [[stick_coefficients(of, v) for v in nu] for of in (influence(float(at)) for at in g)]
    )
    lines = [
        "/* Chebyshev coefficients of the logarithms of c11, c22, c23 and c33 in ln(a/b)/3 and",
        " * 4 nu - 1. Written by tools/stick_rolling.py. */",
        "#ifndef CREEP_COEFFICIENTS_H",
        "#define CREEP_COEFFICIENTS_H",
        "",
        f"enum {{ ASPECT_TERMS = {TERMS[0]}, POISSON_TERMS = {TERMS[1]} }};",
        "",
        "/* clang-format off */",
        "static const double CREEP_COEFFICIENTS[4][ASPECT_TERMS][POISSON_TERMS] = {",
    ]
    for values in np.log(np.moveaxis(solved[..., [0, 1, 2, 4]], -1, 0)):
        of_g = chebfit(in_g, values, NODES[0] - 1)[: TERMS[0]]
        rows = chebfit(in_nu, of_g.T, NODES[1] - 1)[: TERMS[1]].T
        lines += ["{"] + ["{" + ", ".join(f"{v:.8e}" for v in row) + "}," for row in rows] + ["},"]
    lines += ["};", "/* clang-format on */", "", "#endif", ""]
    write_whole(package_folder("fmu") / "creep_coefficients.h", "\n".join(lines).encode())


if __name__ == "__main__":
    write_polynomials()
