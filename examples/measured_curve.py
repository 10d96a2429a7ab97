"""Fit Polach's law to the measured curve of a locomotive (Engel, Beck & Alders 1998).

Draws measured_curve.png and prints the parameters with their intervals, and the fit residual.
"""

import matplotlib.pyplot as plt
import numpy as np

import contactlib as cl

SPEED = 10.0  # of the measurement [m/s]
data = cl.TractionData.from_csv(cl.files.model_path("eurosprinter_engel1998.csv"), speed=SPEED)
found = cl.fit(cl.Polach, data, slip_rate=True, saturation_creepage=0.00364)
for name, one in found.estimates.items():
    low, high = one.interval
    print(f"{name:20} {one.value:.4f} ({low:.4f} to {high:.4f})")
print(f"fit residual {np.sqrt(np.mean(found.residuals**2)):.4f} in Q/P, root mean square")

figure, axes = plt.subplots(figsize=(6.4, 3.6), layout="constrained")
axes.plot(100 * data.creepage, data.traction_coefficient, ".", color="0.6", label="measured")
zeta = np.linspace(0.0, data.creepage.max(), 300)
axes.plot(100 * zeta, found.traction_coefficient(zeta, SPEED), label="Polach, fitted")
axes.set(xlabel="creepage [%]", ylabel="Q/P")
axes.legend()
figure.savefig("measured_curve.png")
