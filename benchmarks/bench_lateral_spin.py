"""Lateral and spin force beside FASTSIM, Polach and a table as USETAB, all in C.

``python benchmarks/bench_lateral_spin.py`` prints times, and errors against CONTACT.
"""

from __future__ import annotations

import csv
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from rivals import CUsetab, fastsim, forces_one_by_one, polach_with_spin
from timing import compare, one_core

import contactlib as cl
from contactlib import kernel
from contactlib.base.quantities import FloatArray
from contactlib.table.lateral_spin_table import lateral_spin_scales

NU = 0.28  # of CONTACT's cases
COULOMB = cl.Friction(static=0.3, kinetic=0.3, weakening_length=0.0)
USETAB_ENDS, USETAB = (0.25, 4.0), (5, 11, 21, 11)  # ratios a/b, and nodes along all axes


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
    bodies = cl.CreepForces(COULOMB, shear_modulus=82e9, poisson_ratio=NU)
    a, b, load = 5e-3 * np.sqrt(a_over_b), 5e-3 / np.sqrt(a_over_b), 1e5
    unit = 82e9 * 25e-6 / (COULOMB.kinetic * load)
    kalkers = creepages / (unit * normalizing(a_over_b))
    found = bodies.evaluate(
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


def main(points: int = 1000, **how: Any) -> None:
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
    found = plain.evaluate(inputs)
    rates = random.uniform(0.0, 3.0, (points, 4))
    g, creepages = random.uniform(0.5, 2.0, points), random.uniform(-3.0, 3.0, (points, 3))
    usetab, finer = like_usetab(), like_usetab(2)
    places = usetab.places(g, creepages)
    stiffness = np.broadcast_to(cl.laws.kalker_coefficients(1.0, NU)[:3], (points, 3))
    contacts = np.column_stack([g, stiffness, creepages])
    compare(
        "lateral and spin force, with 9 partial derivatives",
        points,
        "ns",
        {
            "Coulomb, spin, batch": lambda: plain.evaluate(inputs),
            "Coulomb, spin, one by one": lambda: forces_one_by_one(plain, inputs, found),
            "weakening, spin, batch": lambda: weak.evaluate(inputs),
            "weakening, spin, one by one": lambda: forces_one_by_one(weak, inputs, found),
            "Coulomb, no spin, batch": lambda: plain.evaluate(straight),
            "Coulomb, no spin, one by one": lambda: forces_one_by_one(plain, straight, found),
            "FASTSIM in C, 10 x 10, value": lambda: fastsim(rates, strips=10, elements=10),
            "FASTSIM in C, 50 x 50, value": lambda: fastsim(rates, strips=50, elements=50),
            "like USETAB in C, value": lambda: usetab(places),
            "like USETAB in C, 2 x finer, value": lambda: finer(places),
            "Polach with spin in C, value": lambda: polach_with_spin(contacts),
        },
        **how,
    )


def print_errors() -> None:
    """Errors by group of CONTACT's cases and of all."""
    errors = lateral_spin_errors()
    everybody = errors["long"]
    errors["all"] = {who: np.concatenate([e[who] for e in errors.values()]) for who in everybody}
    print("error over mu P, maximum (rms):", *everybody, sep="; ")
    for group, each in errors.items():
        sizes = [np.hypot(*error.T) for error in each.values()]
        print(group, *(f"{s.max():.4f} ({np.sqrt(np.mean(s**2)):.4f})" for s in sizes))


if __name__ == "__main__":
    with one_core():
        main()
    print_errors()
