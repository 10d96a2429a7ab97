"""The kernel in C, beside Polach's formulas, tables and FASTSIM in C.

All are called from one process and work on arrays that fit into the cache.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from pathlib import Path

import numpy as np
from bench_table import END, ERROR, K_HAT
from compiled import (
    CHermite,
    CPolach,
    CUsetab,
    ForcesOneByOne,
    KernelOneByOne,
    fastsim,
    polach_with_spin,
)
from numpy.typing import ArrayLike
from scipy.integrate import quad
from timing import Case

import contactlib as cl
from contactlib import kernel
from contactlib.base.quantities import FloatArray
from contactlib.table.lateral_spin_table import lateral_spin_scales

POINTS = 10_000
NU = 0.28  # of CONTACT's cases
COULOMB = cl.Friction(static=0.3, kinetic=0.3, weakening_length=0.0)
USETAB_ENDS, USETAB = (0.25, 4.0), (5, 11, 21, 11)  # ratios a/b, and nodes along all axes
POLACH = cl.Polach.dry()
CELLS = 1024
CALLS = 1000


def check() -> None:
    """Every rival gives the right values before it is timed.

    Raises
    ------
    AssertionError
        If one does not.
    """
    x = np.random.default_rng(3).uniform(-END, END, 5000)
    law = cl.CarterGriffith(k_hat=K_HAT)
    found, slope = np.empty_like(x), np.empty_like(x)
    CPolach(POLACH)(x, found)
    np.testing.assert_allclose(found, POLACH.traction_ratio(x), rtol=1e-13)
    CHermite(law, end=END, cells=CELLS)(x, found, slope)
    np.testing.assert_allclose(found, law.traction_ratio(x), atol=ERROR)
    np.testing.assert_allclose(slope, law.slope(x), atol=1e-5)
    _check_fastsim()
    _check_polach_with_spin()
    g, creepages = np.array([0.25, 1.0, 4.0]), np.array([[1.0, -0.25, 4.0]] * 3)
    places = like_usetab().places(g, creepages)  # nodes: u is 1/2, -1/5 and 4/5
    np.testing.assert_allclose(like_usetab()(places), lateral_spin_law(g, creepages), atol=1e-12)


def _check_polach_with_spin() -> None:
    """It is linear theory, his formula along rolling, and at last all of the friction."""
    g, zeta = 1.5, np.linspace(-9.0, 9.0, 50)
    c = cl.laws.kalker_coefficients(g, NU)[:3]
    rows = np.concatenate([[[g, *c]] * 3, 1e-6 * np.eye(3)], axis=1)
    linear = np.array([[c[0], 0.0], [0.0, c[1]], [0.0, c[2]]])
    np.testing.assert_allclose(polach_with_spin(rows), -1e-6 * linear, rtol=1e-4)
    straight = np.pad(np.column_stack([np.tile([g, *c], (50, 1)), zeta]), ((0, 0), (0, 2)))
    law = cl.Polach(adhesion_reduction=1.0, slip_reduction=1.0)
    ratio = law.traction_ratio(4.0 / (3.0 * np.pi) * c[0] * zeta)
    np.testing.assert_allclose(polach_with_spin(straight)[:, 0], -ratio, atol=1e-14)
    sliding = polach_with_spin(np.array([[g, *c, 0.6e6, -0.8e6, 0.1]]))
    np.testing.assert_allclose(sliding, [[-0.6, 0.8]], atol=1e-5)


def simplified_theory(rate: float) -> float:
    """Force over mu P of Kalker's simplified theory in pure longitudinal creepage, exactly.

    A strip of half-length w sticks from its leading edge until rate (w - xi) meets the bound
    w**2 - xi**2, so at xi = rate - w, and slides behind. Integrated along the strip that is
    2 rate w**2 - rate**2 w + rate**3/6, or 4 w**3/3 where nothing sticks.
    """

    def strip(eta: float) -> float:
        w = math.sqrt(max(0.0, 1.0 - eta * eta))
        if rate >= 2.0 * w:
            return 4.0 / 3.0 * w**3
        return 2.0 * rate * w**2 - rate**2 * w + rate**3 / 6.0

    # The strips beyond this one slide as a whole.
    sliding = math.sqrt(max(0.0, 1.0 - 0.25 * rate**2))
    parts = [(0.0, sliding), (sliding, 1.0)]
    return 4.0 / math.pi * sum(quad(strip, *part, epsabs=1e-13)[0] for part in parts)


def _check_fastsim() -> None:
    """It converges to its theory, has Kalker's linear slope, and depends on no direction."""
    for rate in (0.3, 1.2, 3.0):
        exact, given = simplified_theory(rate), np.array([[rate, 0.0, 0.0, 0.0]])
        error = [fastsim(given, strips=n, elements=n)[0, 0] - exact for n in (40, 80)]
        assert abs(error[1]) < 2e-4
        assert 1.5 < np.log2(error[0] / error[1]) < 2.5
    # Linear theory: F = 3 pi/4 x along and across, and G (a b)**1.5 c23 phi.
    g = 1.5
    creepages = 1e-5 * np.eye(3)
    slopes = fastsim(rates_of(np.full(3, g), creepages), strips=400, elements=400) / 1e-5
    c23 = -cl.laws.kalker_coefficients(g, NU).c23 / normalizing(np.array([g]))[0, 2]
    np.testing.assert_allclose(
        slopes, [[0.75 * np.pi, 0.0], [0.0, 0.75 * np.pi], [0.0, c23]], rtol=1e-3, atol=1e-3
    )
    skew = fastsim(np.array([[0.8, 0.0, 0.0, 0.0], [0.48, 0.64, 0.0, 0.0]]), strips=20, elements=20)
    np.testing.assert_allclose(skew[1], skew[0, 0] * np.array([0.6, 0.8]), rtol=1e-12)
    # It slides as a whole: Coulomb, with what the grid makes of the pressure's integral.
    sliding = fastsim(np.array([[0.6e4, -0.8e4, 0.1, 0.1]]), strips=100, elements=100)
    np.testing.assert_allclose(sliding, [[0.6, -0.8]], rtol=1e-3)


def rates_of(a_over_b: FloatArray, creepages: FloatArray) -> FloatArray:
    """FASTSIM's rates with three flexibilities, from Kalker's coefficients."""
    c23 = each_aspect(lambda g: [cl.laws.kalker_coefficients(g, NU).c23], a_over_b)[:, 0]
    spin = -2.0 * c23 / normalizing(a_over_b)[:, 2] * creepages[:, 2]
    return np.column_stack([9.0 / 64.0 * np.pi**2 * creepages[:, :2], spin / a_over_b, spin])


@cache
def like_usetab(fineness: int = 1) -> CUsetab:
    """Values of our own law, whose error is a part of that of multilinear interpolation."""
    aspects, *nodes = (1 + fineness * (n - 1) for n in USETAB)
    return CUsetab(
        lambda creepages, g: lateral_spin_law(np.full(len(creepages), g), creepages),
        np.geomspace(*USETAB_ENDS, aspects).tolist(),
        (nodes[0], nodes[1], nodes[2]),
    )


def each_aspect(function: Callable[[float], ArrayLike], a_over_b: FloatArray) -> FloatArray:
    """A function of a/b at many, of the shape (n, k)."""
    aspects, places = np.unique(a_over_b, return_inverse=True)
    return np.array([function(g) for g in aspects.tolist()])[places]


def normalizing(a_over_b: FloatArray) -> FloatArray:
    """Normalized creepages per Kalker's, times G a b/(mu N)."""
    return each_aspect(lambda g: -lateral_spin_scales(g, NU), a_over_b)


def lateral_spin_law(a_over_b: FloatArray, creepages: FloatArray) -> FloatArray:
    """Our forces and moment over mu P at normalized creepages without weakening."""
    pair = cl.CreepForces(COULOMB, shear_modulus=82e9, poisson_ratio=NU)
    a, b, load = 5e-3 * np.sqrt(a_over_b), 5e-3 / np.sqrt(a_over_b), 1e5
    unit = 82e9 * 25e-6 / (COULOMB.kinetic * load)
    kalkers = creepages / (unit * normalizing(a_over_b))
    found = pair.evaluate(
        semi_axis_x=a,
        semi_axis_y=b,
        normal_load=load,
        creepage_x=kalkers[:, 0],
        creepage_y=kalkers[:, 1],
        spin=kalkers[:, 2] / np.sqrt(a * b),
    )
    names = ("force_x", "force_y", "spin_moment")
    forces = np.stack([found[name] for name in names], axis=-1) / (COULOMB.kinetic * load)
    forces[:, 2] /= np.sqrt(a * b)
    return forces


def lateral_spin_errors() -> dict[str, dict[str, FloatArray]]:
    """Errors of force along and across at all cases of CONTACT: by group and by who finds them."""
    tests = Path(__file__).parents[1] / "tests"
    with open(tests / "laws" / "contact_3d_coulomb.csv") as file:
        table = list(csv.DictReader(line for line in file if not line.startswith("#")))
    columns = {name: np.array([float(row[name]) for row in table]) for name in list(table[0])[:-1]}
    a, b, g = columns["a"], columns["b"], columns["a_over_b"]
    unit = (columns["G"] * a * b / (columns["mu"] * columns["N"]))[:, np.newaxis]
    kalkers = np.stack([columns["cksi"], columns["ceta"], columns["cphi"] * np.sqrt(a * b)], axis=1)
    creepages = unit * kalkers * normalizing(g)
    true = np.stack([columns["fx"], columns["fy"]], axis=1)
    rates = rates_of(g, creepages)
    stiffness = unit * each_aspect(lambda g: cl.laws.kalker_coefficients(g, NU)[:3], g)
    found = {
        "contactlib": lateral_spin_law(g, creepages)[:, :2],
        "FASTSIM 10 x 10": fastsim(rates, strips=10, elements=10),
        "FASTSIM 50 x 50": fastsim(rates, strips=50, elements=50),
        "like USETAB": like_usetab()(like_usetab().places(g, creepages))[:, :2],
        "like USETAB, 2 x finer": like_usetab(2)(like_usetab(2).places(g, creepages))[:, :2],
        "Polach with spin": polach_with_spin(np.column_stack([g, stiffness, kalkers])),
    }
    groups = np.array([row["group"] for row in table])
    return {
        group: {who: (forces - true)[groups == group] for who, forces in found.items()}
        for group in dict.fromkeys(groups.tolist())
    }


def cases(points: int = POINTS) -> list[Case]:
    """What is timed."""
    return [_table(points), _lateral_spin(min(points, 1000)), *_elements(min(points, 4000))]


def _table(points: int) -> Case:
    """Traction ratio and slope."""
    x = np.random.default_rng(0).uniform(-END, END, points)
    k_hat, value, slope = np.array([K_HAT]), np.empty(points), np.empty(points)
    line, ellipse = (cl.carter_griffith_table(contact=c) for c in ("line", "elliptic"))
    one_line, one_ellipse = KernelOneByOne(line), KernelOneByOne(ellipse)
    formula = CPolach(POLACH)  # as the table, without a fall of friction
    hermite = CHermite(cl.CarterGriffith(k_hat=K_HAT), end=END, cells=CELLS)
    return Case(
        "kernel, value and slope",
        points,
        "ns",
        {
            "line, batch": lambda: line.native.evaluate(x, k_hat),
            "ellipse, batch": lambda: ellipse.native.evaluate(x, k_hat),
            "line, one by one": lambda: one_line(x, k_hat, value, slope),
            "ellipse, one by one": lambda: one_ellipse(x, k_hat, value, slope),
            "Polach in C, one by one, value": lambda: formula(x, value),
            "cubic Hermite table in C, one by one": lambda: hermite(x, value, slope),
        },
        {"Polach in C, one by one, value": ">= 3"},
        ours=4,
    )


def _elements(points: int) -> list[Case]:
    """Force elements in a batch, each input with its own load, and one call from Python."""
    found = []
    for model in ("roller_rig.toml", "locomotive.toml"):
        plain = cl.load_model(model).wheelset.element
        random = np.random.default_rng(0)
        inputs = np.zeros(points, kernel.struct_dtype("force_element_input"))
        creepage = plain.saturation_creepage * random.uniform(-3.0, 3.0, (2, points))
        inputs["speed"] = speed = random.uniform(1.0, 40.0, points)
        inputs["omega"] = speed * (1.0 + creepage[0]) / plain.rolling_parameters["radius"]
        inputs["normal_load"] = random.uniform(0.5, 1.5, points) * plain.normal_load
        inputs["friction_scale"] = 1.0
        lateral = inputs.copy()
        lateral["lateral_velocity"] = speed * creepage[1]
        spinning = lateral.copy()
        spinning["spin_velocity"] = speed * random.uniform(-0.5, 0.5, points)
        memory, layer = replace(plain, memory=True), replace(plain, layer_compliance=1e-13)
        batches = {
            "alone": (plain, inputs),
            "with memory": (memory, inputs),
            "with a layer": (layer, inputs),
            "with lateral slip": (plain, lateral),
            "with lateral slip and spin": (plain, spinning),
        }
        subjects = {
            name: partial(element.rolling_native.evaluate, given)
            for name, (element, given) in batches.items()
        }
        at = (21.8, 10.0, plain.normal_load, 1.0)
        calls = {
            name: partial(_calls, element.rolling_native.evaluate_one, at)
            for name, element in (("alone", plain), ("with memory", memory))
        }
        name = model.removesuffix(".toml")
        found.append(Case(f"force element of {name}, batch", points, "ns", subjects, ours=5))
        found.append(Case("the same, one call from Python", CALLS, "us", calls, ours=2))
    return found


def _calls(function: Callable[..., object], given: tuple[float, ...]) -> None:
    for _ in range(CALLS):
        function(*given)


def _lateral_spin(points: int) -> Case:
    """Ellipse, load, creepages and spin to both forces and the moment, as a vehicle tool needs."""
    random = np.random.default_rng(0)
    inputs = np.zeros(points, kernel.struct_dtype("creep_forces_input"))
    for name, low, high in (
        ("semi_axis_x", 4e-3, 8e-3),
        ("semi_axis_y", 4e-3, 8e-3),
        ("normal_load", 5e4, 1e5),
        ("friction_scale", 0.5, 1.0),
        ("creepage_x", -5e-3, 5e-3),
        ("creepage_y", -5e-3, 5e-3),
        ("spin", -1.0, 1.0),
    ):
        inputs[name] = random.uniform(low, high, points)
    straight = inputs.copy()
    straight["spin"] = 0.0
    weakening = cl.Friction(static=0.45, kinetic=0.3, weakening_length=1e-6)
    plain, weak = (
        cl.CreepForces(friction, shear_modulus=82e9, poisson_ratio=0.28).native
        for friction in (COULOMB, weakening)
    )
    rates = random.uniform(0.0, 3.0, (points, 4))
    g, creepages = random.uniform(0.5, 2.0, points), random.uniform(-3.0, 3.0, (points, 3))
    usetab, finer = like_usetab(), like_usetab(2)
    places = usetab.places(g, creepages)
    stiffness = np.broadcast_to(cl.laws.kalker_coefficients(1.0, NU)[:3], (points, 3))
    contacts = np.column_stack([g, stiffness, creepages])
    return Case(
        "lateral and spin force, with 9 partial derivatives",
        points,
        "ns",
        {
            "Coulomb, spin, batch": lambda: plain.evaluate(inputs),
            "Coulomb, spin, one by one": ForcesOneByOne(plain, inputs),
            "weakening, spin, batch": lambda: weak.evaluate(inputs),
            "weakening, spin, one by one": ForcesOneByOne(weak, inputs),
            "Coulomb, no spin, batch": lambda: plain.evaluate(straight),
            "Coulomb, no spin, one by one": ForcesOneByOne(plain, straight),
            "FASTSIM in C, 10 x 10, value": lambda: fastsim(rates, strips=10, elements=10),
            "FASTSIM in C, 50 x 50, value": lambda: fastsim(rates, strips=50, elements=50),
            "like USETAB in C, value": lambda: usetab(places),
            "like USETAB in C, 2 x finer, value": lambda: finer(places),
            "Polach with spin in C, value": lambda: polach_with_spin(contacts),
        },
        ours=6,
    )
