"""Make the spline of what spin adds to the force in the plane: `contactlib.contact.plane_table`.

The kernel's force in the plane (`fmu/plane_law.c`) is a closed form without spin plus a spline
for what spin adds, and for the moment. This module solves rolling contact with the half-space
witness at many creepages and fits the spline to what the closed form leaves. No simulation needs
it.

Coordinates. The normalized creepages l = (along, across, spin) have the sign of their forces, and
for each 3 pi/4 is about the force that it would make if nothing slipped. All of space is put into
a ball by

    u = l/(1/2 + sqrt(l^2 + 1/4)),    l = u/(1 - u^2),

which is linear where the contact sticks. On the ball's surface the whole contact slides, and force
depends on the direction of u alone: sliding makes each traction oppose the rigid slip, so there
forces are plain integrals of Hertz's pressure, without solving anything. A spline in u thus goes
as far as full slip.

Spline. Uniform cubic B-splines, CELLS of them over -1 <= u <= 1 in each direction. Mirror images
tie the coefficients: force along rolling is odd in l_x and even in (l_y, l_s), force across and
moment are even in l_x and odd in (l_y, l_s). So a quarter of them is free, samples are needed in
one quarter only, and halves along and in spin are stored.

Fit. Least squares over the samples and over some directions of full slip, with second differences
of neighbouring coefficients as a weak penalty: it fills the corners of the cube outside the ball
and keeps the noise of the samples out of the spline. Two things are required: what spin adds to
force vanishes without spin, and the smallest creepages give Kalker's linear force and moment,
which change too quickly there for samples to show them.

Error. The fit leaves 0.001 to 0.005 of the samples in root mean square (f_d N; moment: f_d N
sqrt(a b)). The largest is 0.036 for a/b from 1/4 to 4, and 0.067 at 1/8 and 8. It lies where spin
all but balances the creepage across rolling: there force changes faster than cells of this size
can follow. Between the knots of a/b and nu the errors are 0.006 and 0.037.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.stats import qmc

from contactlib.base.quantities import FloatArray
from contactlib.base.writing import write_whole
from contactlib.contact import kernel
from contactlib.contact.half_space import rolling_forces
from contactlib.contact.kalker import kalker_coefficients
from contactlib.contact.law_tables import carter_griffith_table
from contactlib.contact.plane_table import (
    ASPECTS,
    CELLS,
    FILE,
    MAGIC,
    POISSON_RATIOS,
    VERSION,
    plane_scales,
)

SAMPLES = 3000  # for each ellipse and Poisson's ratio
FULL_SLIP = 500  # directions of full slip
SMOOTHING = 1e-4  # weight of the squared second differences
IN_STICK = 1e5  # weight of the smallest creepages, whose forces are a part of 1e-4
NO_SPIN = 1e4  # weight of the squared additions to force without spin
SIZE = CELLS + 3  # coefficients in each direction
# Signs of each force as l_x changes its sign, and as l_y and l_s do.
MIRRORED = ((-1, 1), (1, -1), (1, -1))


def samples(a_over_b: float, poisson_ratio: float, count: int) -> tuple[FloatArray, FloatArray]:
    """Solve rolling contact without weakening at creepages that fill a quarter of the ball.

    Parameters
    ----------
    a_over_b, poisson_ratio : float
    count : int
        Number of cases; each takes some 10 to 20 ms.

    Returns
    -------
    u : ndarray, shape (cases, 3)
    forces : ndarray, shape (cases, 3)
        Force along and across [f_d N], moment [f_d N sqrt(a b)]. A few cases that the solver
        does not find are left out.
    """
    enough = int(np.ceil(np.log2(10 * count)))
    u = qmc.Sobol(3, seed=1).random_base2(enough) * [1, 2, 1] - [0, 1, 0]
    radius = np.linalg.norm(u, axis=1)
    u = u[(radius > 1e-3) & (radius < 0.985)][:count]
    # The solver starts from the case before, so each is followed by its nearest neighbour.
    order, left = [0], np.ones(len(u), dtype=bool)
    while len(order) < len(u):
        left[order[-1]] = False
        others = np.flatnonzero(left)
        order.append(others[np.sum((u[others] - u[order[-1]]) ** 2, axis=1).argmin()])
    u = u[order]
    forces = rolling_forces(
        _kalkers(_creepages(u), a_over_b, poisson_ratio),
        a_over_b=a_over_b,
        poisson_ratio=poisson_ratio,
    )
    found = np.isfinite(forces).all(axis=1)
    return u[found], forces[found]


def coefficients(
    u: FloatArray, forces: FloatArray, a_over_b: float, poisson_ratio: float
) -> FloatArray:
    """Fit the spline to samples.

    Parameters
    ----------
    u, forces : ndarray, shape (cases, 3)
        As `samples` gives them.
    a_over_b, poisson_ratio : float

    Returns
    -------
    ndarray, shape (11, 19, 11, 3)
        The halves of coefficients that are stored, for force along and across and moment.
    """
    rng = np.random.default_rng(3)
    sliding = np.abs(rng.normal(size=(FULL_SLIP, 3)))
    sliding[:, 1] *= rng.choice([-1, 1], FULL_SLIP)
    sliding /= np.linalg.norm(sliding, axis=1, keepdims=True)
    slipping = _full_slip(_kalkers(sliding, a_over_b, poisson_ratio), a_over_b)
    c = kalker_coefficients(a_over_b, poisson_ratio)
    slopes = np.array([[c.c11, 0, 0], [0, c.c22, c.c23], [0, -c.c23, c.c33]])
    small = 1e-4 * np.eye(3)
    in_stick = -_kalkers(small, a_over_b, poisson_ratio) @ slopes.T
    u = np.concatenate((u, 0.9999 * sliding, small))
    forces = np.concatenate((forces, slipping, in_stick))
    weights = np.ones((len(u), 1))
    weights[-3:] = IN_STICK

    table = carter_griffith_table("elliptic").native
    closed, _ = kernel.plane_forces(table, a_over_b, poisson_ratio, _creepages(u))
    design, penalty = weights * _design(u), _second_differences()
    eye, (first, values) = sparse.identity(SIZE), _splines(np.zeros(1))
    middle = sparse.csr_array((values[0], (np.zeros(4, int), first + np.arange(4))), (1, SIZE))
    no_spin = sparse.kron(sparse.kron(eye, eye), middle)
    halves = []
    for k, signs in enumerate(MIRRORED):
        free = _free(*signs)
        at_samples, rough = design @ free, penalty @ free
        normal = at_samples.T @ at_samples + SMOOTHING * (rough.T @ rough)
        if k < 2:
            added = no_spin @ free
            normal = normal + NO_SPIN * (added.T @ added)
        wanted = at_samples.T @ (weights * (forces - closed))[:, k]
        every = free @ np.linalg.solve(normal.toarray(), wanted)
        halves.append(every.reshape(SIZE, SIZE, SIZE)[CELLS // 2 :, :, CELLS // 2 :])
    return np.stack(halves, axis=-1)


def write_table() -> None:
    """Solve and fit all ellipses and Poisson's ratios and write the file; takes 15 minutes."""
    fitted = [
        coefficients(*samples(g, nu, SAMPLES), g, nu) for nu in POISSON_RATIOS for g in ASPECTS
    ]
    contents = np.array(fitted, dtype="<f4").tobytes()
    write_whole(FILE, kernel.framed(MAGIC, VERSION, contents))


def _creepages(u: FloatArray) -> FloatArray:
    """Normalized creepages at places in the ball."""
    return np.asarray(u / (1.0 - np.sum(u**2, axis=1, keepdims=True)))


def _kalkers(normalized: FloatArray, a_over_b: float, poisson_ratio: float) -> FloatArray:
    """Creepages in the solver's variables."""
    return np.asarray(-normalized / plane_scales(a_over_b, poisson_ratio))


def _full_slip(creepages: FloatArray, a_over_b: float) -> FloatArray:
    """Forces if all points slide, each against the rigid slip: sums over 200 rings of one force."""
    ring, angle = (np.arange(200) + 0.5) / 200, (np.arange(400) + 0.5) * np.pi / 200
    radius = np.sqrt(1.0 - ring ** (2.0 / 3.0))[:, np.newaxis]
    x = (np.sqrt(a_over_b) * radius * np.cos(angle)).ravel()
    y = (radius * np.sin(angle) / np.sqrt(a_over_b)).ravel()
    forces = []
    for xi, eta, phi in creepages:
        slip = np.array([xi - phi * y, eta + phi * x])
        p_x, p_y = -slip / np.hypot(*slip).clip(1e-300)
        forces.append((p_x.mean(), p_y.mean(), (x * p_y - y * p_x).mean()))
    return np.array(forces)


def _splines(u: FloatArray) -> tuple[np.ndarray[tuple[int], np.dtype[np.int_]], FloatArray]:
    """First of the four splines that are not zero at u, and the values of all four."""
    place = (u + 1.0) * CELLS / 2
    cell = np.minimum(place.astype(int), CELLS - 1)
    f = place - cell
    h = 1.0 - f
    middle = [2 / 3 + f * f * (f / 2 - 1), 2 / 3 + h * h * (h / 2 - 1)]
    return cell, np.stack([h**3 / 6, *middle, f**3 / 6], axis=1)


def _design(u: FloatArray) -> sparse.csr_array:
    """Values at u of all products of three splines."""
    (i, in_x), (j, in_y), (k, in_s) = (_splines(column) for column in u.T)
    four = np.arange(4)
    of = np.ravel_multi_index(
        (
            i[:, np.newaxis, np.newaxis, np.newaxis] + four[:, np.newaxis, np.newaxis],
            j[:, np.newaxis, np.newaxis, np.newaxis] + four[:, np.newaxis],
            k[:, np.newaxis, np.newaxis, np.newaxis] + four,
        ),
        (SIZE, SIZE, SIZE),
    )
    values = np.einsum("ni,nj,nk->nijk", in_x, in_y, in_s)
    starts = np.arange(0, of.size + 1, 64)
    return sparse.csr_array((values.ravel(), of.ravel(), starts), (len(u), SIZE**3))


def _second_differences() -> sparse.csr_array:
    """Those of the coefficients in each direction."""
    difference = sparse.diags_array([1.0, -2.0, 1.0], offsets=[0, 1, 2], shape=(SIZE - 2, SIZE))
    eye = sparse.identity(SIZE)
    parts = [
        sparse.kron(sparse.kron(difference, eye), eye),
        sparse.kron(sparse.kron(eye, difference), eye),
        sparse.kron(sparse.kron(eye, eye), difference),
    ]
    return sparse.csr_array(sparse.vstack(parts))


def _free(along: int, turn: int) -> sparse.csr_array:
    """All coefficients from the free ones; the arguments are a row of `MIRRORED`."""
    index = np.arange(SIZE**3).reshape(SIZE, SIZE, SIZE)
    images = [index, index[::-1], index[:, ::-1, ::-1], index[::-1, ::-1, ::-1]]
    image = np.stack([part.ravel() for part in images])
    signs = np.array([1, along, turn, along * turn])
    vanishes = ((image == image[0]) & (signs[:, np.newaxis] == -1)).any(axis=0)
    rows = np.flatnonzero(~vanishes)
    _, columns = np.unique(image.min(axis=0)[rows], return_inverse=True)
    values = signs[image.argmin(axis=0)[rows]].astype(float)
    return sparse.csr_array((values, (rows, columns)), (SIZE**3, columns.max() + 1))
