"""The kernel in C, beside Polach's formula and a table in C: ``python benchmarks/bench_kernel.py``.

Arrays fit into the cache.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from bench_table import END, K_HAT
from rivals import CHermite, kernel_one_by_one, polach
from timing import compare, one_core

import contactlib as cl
from contactlib import kernel

POLACH = cl.Polach.dry()
CELLS = 1024
CALLS = 1000


def traction(points: int, **how: Any) -> None:
    """Traction ratio and slope."""
    x = np.random.default_rng(0).uniform(-END, END, points)
    k_hat, value, slope = np.array([K_HAT]), np.empty(points), np.empty(points)
    line, ellipse = cl.carter_griffith_table("line"), cl.carter_griffith_table("elliptic")
    hermite = CHermite(cl.CarterGriffith(k_hat=K_HAT), end=END, cells=CELLS)
    compare(
        "kernel, value and slope",
        points,
        "ns",
        {
            "line, batch": lambda: line.native.evaluate(x, k_hat),
            "ellipse, batch": lambda: ellipse.native.evaluate(x, k_hat),
            "line, one by one": lambda: kernel_one_by_one(line, x, k_hat, value, slope),
            "ellipse, one by one": lambda: kernel_one_by_one(ellipse, x, k_hat, value, slope),
            "Polach in C, one by one, value": lambda: polach(POLACH, x, value),
            "cubic Hermite table in C, one by one": lambda: hermite(x, value, slope),
        },
        **how,
    )


def elements(points: int, **how: Any) -> None:
    """Force elements in a batch, each input with its own load, and one call from Python."""
    for model in ("roller_rig.toml", "locomotive.toml"):
        plain = cl.load_model(model).wheelset.element
        random = np.random.default_rng(0)
        inputs = np.zeros(points, kernel.struct_dtype("force_element_input"))
        creepage = plain.saturation_creepage * random.uniform(-3.0, 3.0, (2, points))
        inputs["speed"] = speed = random.uniform(1.0, 40.0, points)
        inputs["omega"] = speed * (1.0 + creepage[0]) / plain.rolling_parameters["radius"]
        inputs["normal_load"] = random.uniform(0.5, 1.5, points) * plain.axle_load
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
        at = (21.8, 10.0, plain.axle_load, 1.0)
        calls = {
            name: partial(called, element.rolling_native.evaluate_one, at)
            for name, element in (("alone", plain), ("with memory", memory))
        }
        name = model.removesuffix(".toml")
        compare(f"force element of {name}, batch", points, "ns", subjects, **how)
        compare("the same, one call from Python", CALLS, "us", calls, **how)


def called(function: Callable[..., object], given: tuple[float, ...]) -> None:
    """Call the function often."""
    for _ in range(CALLS):
        function(*given)


if __name__ == "__main__":
    with one_core():
        traction(10_000)
        elements(4000)
