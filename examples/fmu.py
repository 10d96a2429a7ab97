"""The wheelset as an FMU, run by FMPy with a torque step.

Writes wheelset.fmu and prints creepage and creep force after 5 s, beside those of `simulate`.
"""

import numpy as np
from fmpy import simulate_fmu

import contactlib as cl

model = cl.load_model("locomotive.toml")
time, torque = (0.0, 1.0, 1.0, 5.0), (15e3, 15e3, 22e3, 22e3)
step = cl.TorqueControl(cl.Profile(time, torque))
run = cl.simulate(model.wheelset, step, initial_speed=model.initial_speed)

found = simulate_fmu(
    str(cl.export_fmu(model, "wheelset.fmu", kind="wheelset")),
    stop_time=5.0,
    start_values={"omega": run["omega"][0]},
    input=np.array(
        list(zip(time, torque, strict=True)), dtype=[("time", float), ("drive_torque", float)]
    ),
    output=["creepage", "creep_force"],
    relative_tolerance=1e-8,
)
for name in ("creepage", "creep_force"):
    print(f"{name:12} FMU {found[name][-1]:.6g}, simulate {run[name][-1]:.6g}")
