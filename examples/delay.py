"""What delay leaves of creep control: the gains that hold the falling branch, over the speed.

Draws delay.png and prints the lowest speed at which a delay of 10 ms leaves any gain.
"""

import matplotlib.pyplot as plt
import numpy as np

import contactlib as cl

DELAY = 10e-3
wheelset = cl.load_model("roller_rig.toml").wheelset
speeds = np.linspace(1.0, 40.0, 157)
figure, axes = plt.subplots(figsize=(6.4, 3.6), layout="constrained")
low, high = [], []
for speed in speeds:
    pole = cl.worst_pole(wheelset, speed=speed).pole
    gain = wheelset.radius / (wheelset.inertia * speed)  # of creepage rate over torque
    window = cl.controllability(pole, gain=gain, delay=DELAY).window
    low.append(np.nan if window.empty else window.lowest)
    high.append(np.nan if window.empty else window.highest)
axes.fill_between(speeds, 1e-6 * np.array(low), 1e-6 * np.array(high), alpha=0.4)
axes.set(
    xlabel="speed [m/s]",
    ylabel="proportional gain [MN m]",
    title="Gains that hold the falling branch",
)
figure.savefig("delay.png")
print(f"a delay of 10 ms leaves a gain from {speeds[np.isfinite(low)].min():.2f} m/s on")
