"""A slow torque ramp leaves the stable branch at the fold that `find_fold` predicts.

Draws fold.png, the steady states and the ramp, and prints the two torques, which agree to 1e-3.
"""

import matplotlib.pyplot as plt
import numpy as np

import contactlib as cl

SPEED = 10.0
wheelset = cl.load_model("roller_rig.toml").wheelset
curve, fold = cl.s_curve(wheelset, speed=SPEED), cl.find_fold(wheelset, speed=SPEED)
ramp = cl.TorqueControl(cl.Profile((0.0, 60.0, 120.0), (24e3, 28e3, 23e3)))
run = cl.simulate(wheelset, ramp, initial_speed=SPEED)
passed = run.first("peak_passed")
print(f"fold predicted at {fold.drive_torque:.0f} N.m, passed at {passed.drive_torque:.0f} N.m")

figure, axes = plt.subplots(figsize=(6.4, 4.0), layout="constrained")
axes.semilogy(1e-3 * run["drive_torque"], 100 * run["creepage"], color="0.6", label="slow ramp")
for stable, style in ((True, "-"), (False, "--")):
    torque = np.where(curve.stable == stable, 1e-3 * curve.drive_torque, np.nan)
    label = "stable" if stable else "unstable"
    axes.semilogy(torque, 100 * curve.creepage, style, color="C0", label=label)
axes.set(xlabel="drive torque [kN m]", ylabel="creepage [%]", xlim=(23, 28), ylim=(0.5, 1000))
axes.legend()
figure.savefig("fold.png")
