"""Make the splines of what spin adds to the lateral force: `contactlib.table.lateral_spin_table`.

The kernel's lateral force (`fmu/kernel/lateral_spin_formula.h`) is a closed form without spin plus
splines for what spin adds, and for the moment: one without weakening, and two terms of what
friction that weakens adds to it. `python tools/lateral_spin_building.py` solves rolling contact
with the half-space solver at many creepages and fits the splines to what the closed form leaves.

Coordinates. The normalized creepages l = (along, across, spin) have the sign of their forces, and
for each 3 pi/4 is about the force that it would make if nothing slipped. All of space is put into
a ball by

    u = l/(1/2 + sqrt(l^2 + 1/4)),    l = u/(1 - u^2),

which is linear where the contact sticks. On the ball's surface the whole contact slides, and force
depends on the direction of u alone: sliding makes each traction oppose the rigid slip, so there
forces are plain integrals of Hertz's pressure, without solving anything. A spline in u thus goes
as far as full slip.

Splines. Uniform cubic B-splines over -1 <= u <= 1 in each direction. Mirror images tie the
coefficients: force along rolling is odd in l_x and even in (l_y, l_s), force across and moment are
even in l_x and odd in (l_y, l_s). So a quarter of them is free, samples are needed in one quarter
only, and halves along and in spin are stored.

Weakening. The slip that a point accumulates differs over a contact that spins, so each part weakens
by another amount. What that adds is (A w + B w^2) e/(e + 0.157) with e = f_s/f_d - 1 and
w = k^2/(k^2 + 0.2), where k is k_hat up to 0.8. A and B are fitted at three k_hat, one friction
ratio and one nu. So w was chosen that two terms follow all of k_hat; 0.157 is what f_s/f_d 15/7 has
more than 11/7.

Fit. Least squares over the samples and over some directions of full slip, with second differences
of neighbouring coefficients as a weak penalty: it fills the corners of the cube outside the ball
and keeps the noise of the samples out of the spline. Two things are required: what spin adds to
force vanishes without spin, and the smallest creepages give Kalker's linear force and moment,
which change too quickly there for samples to show them.

Error. The fit leaves 0.001 to 0.005 of the samples in root mean square (f_d N; moment: f_d N
sqrt(a b)). The largest is 0.036 for a/b from 1/4 to 4, and 0.067 at 1/8 and 8. It lies where spin
all but balances the creepage across rolling: there force changes faster than cells of this size
can follow. Between the knots of a/b and nu the errors are 0.006 and 0.037. With weakening the
root mean square is 0.003, 0.013 and 0.006 in the two forces and the moment for a/b up to 2, and
0.006, 0.021 and 0.017 at 8; the largest error is 0.12 up to 2, and 0.2 beyond.
"""

from __future__ import annotations

import numpy as np
from half_space import rolling_forces
from scipy import sparse
from scipy.interpolate import BSpline
from scipy.stats import qmc

from contactlib import kernel
from contactlib.base.quantities import FloatArray
from contactlib.base.writing import write_whole
from contactlib.laws.kalker import kalker_coefficients
from contactlib.table.lateral_spin_table import (
    ASPECTS,
    FILE,
    MAGIC,
    POISSON_RATIOS,
    VERSION,
    forget_coefficients,
    lateral_spin_coefficients,
    lateral_spin_scales,
    stored_shapes,
)
from contactlib.table.law_tables import carter_griffith_table, cohesive_table

SAMPLES = 3000  # for each ellipse and Poisson's ratio
WEAKENING_SAMPLES = 600  # for each ellipse and k_hat
K_HATS = (0.15, 0.3, 0.6)
STATIC_RATIO, POISSON_RATIO = 11.0 / 7.0, 0.28  # of the samples with weakening
FULL_SLIP = 500  # directions of full slip
SMOOTHING = 1e-4  # weight of the squared second differences
IN_STICK = 1e5  # weight of the smallest creepages, whose forces are a part of 1e-4
NO_SPIN = 1e4  # weight of the squared additions to force without spin
# Signs of each force as l_x changes its sign, and as l_y and l_s do.
MIRRORED = ((-1, 1), (1, -1), (1, -1))


def samples(
    a_over_b: float, poisson_ratio: float, count: int, k_hat: float = 0.0
) -> tuple[FloatArray, FloatArray]:
    """Solve rolling contact at creepages that fill a quarter of the ball.

    Parameters
    ----------
    a_over_b, poisson_ratio : float
    count : int
        Number of cases; each takes some 10 to 20 ms, and 50 to 150 ms if friction weakens.
    k_hat : float
        Of longitudinal creepage, with the friction ratio `STATIC_RATIO`. Default: 0, Coulomb's.

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
        static_ratio=STATIC_RATIO if k_hat else 1.0,
        weakening_length=weakening_length(a_over_b, poisson_ratio, k_hat) if k_hat else 1.0,
    )
    found = np.isfinite(forces).all(axis=1)
    return u[found], forces[found]


def weakening_length(
    a_over_b: float, poisson_ratio: float, k_hat: float, static_ratio: float = STATIC_RATIO
) -> float:
    """Delta in the half-space solver's variables at a k_hat of longitudinal creepage: Eq. (17)."""
    stiffness = kernel.half_space_scales(a_over_b, poisson_ratio).stiffness_x
    line = 1.5 * np.sqrt(a_over_b) * (1.0 - poisson_ratio) / (static_ratio - 1.0)
    return float(line * k_hat**2 / stiffness)


def coefficients(
    u: FloatArray, forces: FloatArray, a_over_b: float, poisson_ratio: float
) -> FloatArray:
    """Fit the spline of what spin adds without weakening to samples.

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
    sliding = _sliding()
    slipping = _full_slip(_kalkers(sliding, a_over_b, poisson_ratio), a_over_b)
    c = kalker_coefficients(a_over_b, poisson_ratio)
    slopes = np.array([[c.c11, 0, 0], [0, c.c22, c.c23], [0, -c.c23, c.c33]])
    small = 1e-4 * np.eye(3)
    in_stick = -_kalkers(small, a_over_b, poisson_ratio) @ slopes.T
    u = np.concatenate((u, 0.9999 * sliding, small))
    forces = np.concatenate((forces, slipping, in_stick))
    table = carter_griffith_table("elliptic").native
    closed, _ = kernel.lateral_spin_forces(table, a_over_b, poisson_ratio, _creepages(u))
    return _fitted(u, forces - closed, np.ones((len(u), 1)), stored_shapes()[0])


def weakening_coefficients(
    cases: list[tuple[float, FloatArray, FloatArray]], a_over_b: float, of_spin: FloatArray
) -> FloatArray:
    """Fit both terms of what weakening adds to samples with `POISSON_RATIO`.

    Parameters
    ----------
    cases : list of (k_hat, u, forces)
        As `samples` gives them.
    a_over_b : float
    of_spin : ndarray, shape (LATERAL_SPIN_COEFFICIENTS,)
        A set of coefficients whose terms of weakening are zero.

    Returns
    -------
    ndarray, shape (11, 19, 11, 6)
        The halves of coefficients that are stored, for both forces and the moment of each term.
    """
    table = cohesive_table("elliptic", STATIC_RATIO).native
    without, small = _sliding(), 1e-4 * np.eye(3)
    places, target, powers = [], [], []
    for k_hat, u, forces in cases:
        law, _ = kernel.lateral_spin_forces(
            table, a_over_b, POISSON_RATIO, _creepages(u), k_hat, of_spin
        )
        part = 1.0 / (1.0 + 0.157 / (STATIC_RATIO - 1.0))
        places.append(np.concatenate((u, 0.9999 * without, small)))
        target.append(np.concatenate(((forces - law) / part, np.zeros((len(without) + 3, 3)))))
        w = k_hat**2 / (k_hat**2 + 0.2)
        powers.append(np.full((len(places[-1]), 2), (w, w**2)))
    weighted = np.concatenate(target)
    shape = stored_shapes()[1]
    return _fitted(np.concatenate(places), weighted, np.concatenate(powers), shape)


def _sliding() -> FloatArray:
    """Directions of full slip in a quarter of the ball's surface."""
    rng = np.random.default_rng(3)
    sliding = np.abs(rng.normal(size=(FULL_SLIP, 3)))
    sliding[:, 1] *= rng.choice([-1, 1], FULL_SLIP)
    return np.asarray(sliding / np.linalg.norm(sliding, axis=1, keepdims=True))


def _fitted(
    u: FloatArray, target: FloatArray, factors: FloatArray, shape: tuple[int, ...]
) -> FloatArray:
    """Halves of the coefficients of a sum of splines at u, each with a factor at each place.

    The smallest u count as in full stick.
    """
    cells = shape[1] - 3
    weights = np.where(np.linalg.norm(u, axis=1) < 1e-3, IN_STICK, 1.0)[:, np.newaxis]
    design, penalty = weights * _design(u, cells), _second_differences(shape[1])
    eye, middle = sparse.identity(shape[1]), _splines(np.zeros(1), cells)
    no_spin = sparse.kron(sparse.kron(eye, eye), middle)
    terms = np.arange(factors.shape[1])
    halves = np.empty((*shape[:3], terms.size, 3))
    for k, signs in enumerate(MIRRORED):
        free = _free(*signs, shape[1])
        at_samples, rough = design @ free, penalty @ free
        alone = SMOOTHING * (rough.T @ rough)
        if k < 2:
            added = no_spin @ free
            alone = alone + NO_SPIN * (added.T @ added)
        every = sparse.hstack([factors[:, [term]] * at_samples for term in terms], format="csr")
        normal = every.T @ every + sparse.block_diag([alone for _ in terms])
        solved = np.linalg.solve(normal.toarray(), every.T @ (weights * target)[:, k])
        for term, part in zip(terms, np.split(solved, terms.size), strict=True):
            cube = (free @ part).reshape(shape[1], shape[1], shape[1])
            halves[..., term, k] = cube[cells // 2 :, :, cells // 2 :]
    return halves.reshape(shape)


def write_table() -> None:
    """Solve and fit all ellipses and write the file; takes some 50 minutes."""
    fitted = np.array(
        [[coefficients(*samples(g, nu, SAMPLES), g, nu) for g in ASPECTS] for nu in POISSON_RATIOS]
    )
    write_file(fitted, np.zeros((len(ASPECTS), *stored_shapes()[1])))
    of_weakening = []
    for g, of_spin in zip(ASPECTS, lateral_spin_coefficients(POISSON_RATIO), strict=True):
        cases = [(k, *samples(g, POISSON_RATIO, WEAKENING_SAMPLES, k)) for k in K_HATS]
        of_weakening.append(weakening_coefficients(cases, g, of_spin))
    write_file(fitted, np.array(of_weakening))


def write_file(of_spin: FloatArray, of_weakening: FloatArray) -> None:
    """Write the coefficients of all ellipses into the file of `lateral_spin_coefficients`."""
    contents = b"".join(part.astype("<f4").tobytes() for part in (of_spin, of_weakening))
    write_whole(FILE, kernel.framed(MAGIC, VERSION, contents))
    forget_coefficients()


def _creepages(u: FloatArray) -> FloatArray:
    """Normalized creepages at places in the ball."""
    return np.asarray(u / (1.0 - np.sum(u**2, axis=1, keepdims=True)))


def _kalkers(normalized: FloatArray, a_over_b: float, poisson_ratio: float) -> FloatArray:
    """Creepages in the solver's variables."""
    return np.asarray(-normalized / lateral_spin_scales(a_over_b, poisson_ratio))


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


def _splines(u: FloatArray, cells: int) -> sparse.csr_array:
    """Values at u of all splines of one direction."""
    knots = np.linspace(-1.0 - 6.0 / cells, 1.0 + 6.0 / cells, cells + 7)
    return sparse.csr_array(BSpline.design_matrix(u, knots, 3))


def _design(u: FloatArray, cells: int) -> sparse.csr_array:
    """Values at u of all products of three splines."""
    each = [_splines(column, cells) for column in u.T]
    i, j, k = (splines.indices.reshape(-1, 4) for splines in each)
    size = cells + 3
    of = np.ravel_multi_index(
        (
            i[:, :, np.newaxis, np.newaxis],
            j[:, np.newaxis, :, np.newaxis],
            k[:, np.newaxis, np.newaxis, :],
        ),
        (size, size, size),
    )
    values = np.einsum("ni,nj,nk->nijk", *(splines.data.reshape(-1, 4) for splines in each))
    starts = np.arange(0, of.size + 1, 64)
    return sparse.csr_array((values.ravel(), of.ravel(), starts), (len(u), size**3))


def _second_differences(size: int) -> sparse.csr_array:
    """Those of the coefficients in each direction."""
    difference = sparse.diags_array([1.0, -2.0, 1.0], offsets=[0, 1, 2], shape=(size - 2, size))
    eye = sparse.identity(size)
    parts = [
        sparse.kron(sparse.kron(difference, eye), eye),
        sparse.kron(sparse.kron(eye, difference), eye),
        sparse.kron(sparse.kron(eye, eye), difference),
    ]
    return sparse.csr_array(sparse.vstack(parts))


def _free(along: int, turn: int, size: int) -> sparse.csr_array:
    """All coefficients from the free ones; the signs are a row of `MIRRORED`."""
    index = np.arange(size**3).reshape(size, size, size)
    images = [index, index[::-1], index[:, ::-1, ::-1], index[::-1, ::-1, ::-1]]
    image = np.stack([part.ravel() for part in images])
    signs = np.array([1, along, turn, along * turn])
    vanishes = ((image == image[0]) & (signs[:, np.newaxis] == -1)).any(axis=0)
    rows = np.flatnonzero(~vanishes)
    _, columns = np.unique(image.min(axis=0)[rows], return_inverse=True)
    values = signs[image.argmin(axis=0)[rows]].astype(float)
    return sparse.csr_array((values, (rows, columns)), (size**3, columns.max() + 1))


if __name__ == "__main__":
    write_table()
