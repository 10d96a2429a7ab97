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

If the creepages change along the rolled distance s, like exp(i k s), then du_x/dx - i k u_x takes
the place of du_x/dx. For slow changes u = u_0 + i k u_1, with u_0 as above and

    u_1x = int u_0x dx + g_x(y),    u_1y = int u_0y dx + g_y(y),

whose g_x and g_y are again such that the tractions vanish where the material enters. The force is
F_0 + i k F_1, so it lags behind the creepage by the relaxation length -F_1/F_0.

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
    """What the base functions of the tractions do on one ellipse with a b = 1, a along x.

    `kernels` holds the integrals of p/r, p dx**2/r**3 and p dx dy/r**3 at points x, y: its shape
    is (3, rows, points of a row, functions). `moments` holds the integrals of p, x p and y p, and
    `even` marks the functions that are even in y.
    """

    a: float
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
    return Influence(float(a), a * x, b * y, kernels, np.stack(moments).sum(axis=1), of_y % 2 == 0)


def _solve(
    of: Influence, poisson_ratio: float, along: bool, given: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Moments of the tractions of given displacements, and the constants f of each row.

    `given` has the shape (cases, 2 components, rows, points). If `along`, p_x is even in y and
    p_y odd, else the reverse. The shapes of the results are (cases, 2, 3) and (cases, 2, rows, 1).
    """
    nu, cases = poisson_ratio, len(given)
    unit, xx, xy = of.kernels / np.pi
    in_x, in_y = (of.even, ~of.even) if along else (~of.even, of.even)
    columns = [
        np.concatenate(((1.0 - nu) * unit + nu * xx, nu * xy))[..., in_x],
        np.concatenate((nu * xy, unit - nu * xx))[..., in_y],
        np.stack([np.concatenate(u) for u in given], axis=-1),
    ]
    system = np.concatenate(columns, axis=-1)
    means = system.mean(axis=1)
    system -= means[:, np.newaxis]  # least squares over f_x and f_y
    system = system.reshape(-1, system.shape[-1])
    matrix, sides = system[:, :-cases], system[:, -cases:]
    scale = np.linalg.norm(matrix, axis=0)
    tractions = np.linalg.lstsq(matrix / scale, sides, rcond=1e-13)[0] / scale[:, np.newaxis]
    p_x, p_y = np.split(tractions, [np.count_nonzero(in_x)])
    moments = np.stack((of.moments[:, in_x] @ p_x, of.moments[:, in_y] @ p_y)).T.swapaxes(1, 2)
    f = means[:, :-cases] @ tractions - means[:, -cases:]
    return moments, f.T.reshape(*given.shape[:3], 1)


def stick_coefficients(of: Influence, poisson_ratio: float) -> StickCoefficients:
    """Solve for the tractions of unit creepages and spin, and sum them to forces and moment."""
    x, y, zero = of.x, of.y, np.zeros_like(of.x)
    (along,), _ = _solve(of, poisson_ratio, True, np.array([(x, zero)]))
    across = np.array([(zero, x), (-x * y, 0.5 * x * x)])
    (lateral, spin), _ = _solve(of, poisson_ratio, False, across)
    m_z, m_z_spin = (p[1, 1] - p[0, 2] for p in (lateral, spin))
    found = (-along[0, 0], -lateral[1, 0], -spin[1, 0], m_z, -m_z_spin)
    return StickCoefficients(*map(float, found))


def stick_lengths(of: Influence, poisson_ratio: float) -> tuple[float, float, float]:
    """Relaxation lengths over a: of F_x for xi, and of F_y for eta and for phi."""
    x, y, zero = of.x, of.y, np.zeros_like(of.x)
    xx = 0.5 * x * x
    cases = [  # u_0 without f_0, and its integrals over x
        (True, [(x, zero)], [(xx, zero)]),
        (False, [(zero, x), (-x * y, xx)], [(zero, xx), (-xx * y, x**3 / 6.0)]),
    ]
    lengths: list[float] = []
    for along, steady, integrals in cases:
        force, f = _solve(of, poisson_ratio, along, np.array(steady))
        first, _ = _solve(of, poisson_ratio, along, np.array(integrals) + f * x)
        component = 0 if along else 1
        lengths += list(-first[:, component, 0] / force[:, component, 0] / of.a)
    longitudinal, lateral, spin = map(float, lengths)
    return longitudinal, lateral, spin


NODES = (24, 12)  # Chebyshev points of ln(a/b) from -3 to 3, and of Poisson's ratio
TERMS = (18, 10)  # of the polynomials in them that are kept, which loses less than 3e-6


def write_polynomials() -> None:
    """Solve at all nodes and write the header with the polynomials; takes some minutes."""
    in_g, in_nu = (np.cos((np.arange(n) + 0.5) * np.pi / n) for n in NODES)
    g, nu = np.exp(3.0 * in_g), 0.25 * (1.0 + in_nu)
    solved = np.array(
        [
            [(*stick_coefficients(of, v), *stick_lengths(of, v)) for v in nu]
            for of in (influence(float(at)) for at in g)
        ]
    )
    lines = [
        "/* Chebyshev coefficients in ln(a/b)/3 and 4 nu - 1 of the logarithms of c11, c22, c23",
        " * and c33, and of the relaxation lengths. Written by tools/stick_rolling.py. */",
        "#ifndef CREEP_COEFFICIENTS_H",
        "#define CREEP_COEFFICIENTS_H",
        "",
        f"enum {{ ASPECT_TERMS = {TERMS[0]}, POISSON_TERMS = {TERMS[1]} }};",
        "",
        "/* clang-format off */",
    ]
    columns = {"CREEP_COEFFICIENTS": [0, 1, 2, 4], "RELAXATION_LENGTHS": [5, 6, 7]}
    for name, kept in columns.items():
        unused = name == "CREEP_COEFFICIENTS"  # in the kernel as one file
        lines += ["#ifndef ONE_FILE_KERNEL"] * unused
        shape = f"[{len(kept)}][ASPECT_TERMS][POISSON_TERMS]"
        lines.append(f"static const double {name}{shape} = {{")
        for values in np.log(np.moveaxis(solved[..., kept], -1, 0)):
            of_g = chebfit(in_g, values, NODES[0] - 1)[: TERMS[0]]
            rows = chebfit(in_nu, of_g.T, NODES[1] - 1)[: TERMS[1]].T
            listed = (", ".join(f"{v:.8e}" for v in row) for row in rows)
            lines += ["{", *(f"{{{row}}}," for row in listed), "},"]
        lines += ["};", *["#endif /* ONE_FILE_KERNEL */"] * unused]
    lines += ["/* clang-format on */", "", "#endif", ""]
    write_whole(
        package_folder("fmu") / "kernel" / "creep_coefficients.h", "\n".join(lines).encode()
    )


if __name__ == "__main__":
    write_polynomials()
