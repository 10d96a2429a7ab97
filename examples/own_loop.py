"""The plant in a loop of your own: a thousand wheelsets, each with another friction on its patch.

Prints how many of them slip away under full demand, and how many if the torque is cut at a slip of
0.3 m/s.
"""

from dataclasses import replace

import numpy as np

import contactlib as cl

scenario = replace(cl.load_scenario("dry_wet_dry.toml"), duration=6.0)
factors = np.linspace(0.4, 1.1, 1000)
cases = [
    replace(scenario, track=cl.Track(friction_left=cl.Profile((30.0, 30.0), (1.0, factor))))
    for factor in factors
]
for cut in (False, True):
    plant = cl.Plant(cases, tolerance=1e-4)
    measured = plant.reset(seed=1)
    fastest = np.zeros(len(cases))
    while plant.time < scenario.duration:
        slip = measured.wheel_speed - measured.vehicle_speed
        allowed = np.where(slip > 0.3, 0.3, 1.0) if cut else 1.0
        measured = plant.step(allowed * measured.demand)
        fastest = np.maximum(fastest, plant["slip_velocity"])
    print(f"{'with' if cut else 'without'} the cut: {np.count_nonzero(fastest > 2.0)} slip away")
