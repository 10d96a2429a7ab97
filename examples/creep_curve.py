"""The law: traction rises with creepage, peaks, and falls, for three intensities k_hat.

Draws creep_curve.png, with the peak of each curve, and prints the peaks.
"""

import matplotlib.pyplot as plt
import numpy as np

import contactlib as cl

x = np.linspace(0.0, 4.0, 400)
figure, axes = plt.subplots(figsize=(6.4, 3.6), layout="constrained")
for k_hat in (0.0, 0.15, 0.3):
    law = cl.CarterGriffith(k_hat=k_hat)
    axes.plot(x, law.traction_ratio(x), label=f"k_hat = {k_hat:g}")
    at, ratio = law.peak
    axes.plot(at, ratio, "k.")
    print(f"k_hat {k_hat:4.2f}: maximum {ratio:.4f} at {at:.4f} times the saturation creepage")
axes.set(xlabel="creepage / saturation creepage", ylabel="Q / (f_d P)")
axes.legend()
figure.savefig("creep_curve.png")
