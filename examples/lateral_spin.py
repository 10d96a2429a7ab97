"""Longitudinal and lateral force, without and with spin, in Kalker's creepages.

Draws lateral_spin.png, the limit circle of combined creepage, and prints two forces.
"""

import matplotlib.pyplot as plt
import numpy as np

import contactlib as cl

steel = cl.Friction(static=0.3, kinetic=0.3, weakening_length=0.0)
bodies = cl.CreepForces(steel, shear_modulus=82e9, poisson_ratio=0.28)
contact = {"semi_axis_x": 6e-3, "semi_axis_y": 6e-3, "normal_load": 75e3}
angle = np.linspace(0.0, 2.0 * np.pi, 181)
figure, axes = plt.subplots(figsize=(5.8, 4.6), layout="constrained")
for size in (0.5e-3, 1e-3, 2e-3, 1e-2):
    found = bodies.evaluate(
        **contact, creepage_x=-size * np.cos(angle), creepage_y=-size * np.sin(angle)
    )
    axes.plot(1e-3 * found["force_x"], 1e-3 * found["force_y"], label=f"{100 * size:g} %")
axes.set(xlabel="longitudinal force [kN]", ylabel="lateral force [kN]", aspect="equal")
axes.legend(title="creepage", loc="upper left", bbox_to_anchor=(1.0, 1.0))
figure.savefig("lateral_spin.png")
for spin in (0.0, 0.2):
    found = bodies.evaluate(**contact, creepage_x=-0.001, spin=spin)
    print(f"spin {spin:g} 1/m: {found['force_x']:.0f} N along, {found['force_y']:.0f} N across")
