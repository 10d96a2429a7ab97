"""How often is a stop too long? By subset sampling with OpenTURNS (pip install openturns)."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import openturns as ot

import contactlib as cl

STOPS = 200  # of each subset; 2000 make it accurate to some 20 %
Path("tail.toml").write_text("""name = "Stops"\nsource = "chosen"
scenario = "wheel_slide_protection.toml"\ncontrollers = ["wsp"]
outcomes = ["stopping_distance"]\nuntil_stop = true\nnoise = "common"
sampling = {kind = "monte_carlo", runs = 1, seed = 1}\n[axes]
speed = {factor_on = "run.initial_speed", values = [0.7]}
rails = {factor_on = "track.friction", distribution = "normal", mean = 1, standard_deviation = 0.08}
pads = {factor_on = "demand.torque", distribution = "normal", mean = 1, standard_deviation = 0.05}
fill = {factor_on = "brake.fill_time", distribution = "normal", mean = 1, standard_deviation = 0.2}
""")
sweep = cl.load_sweep("tail.toml")


def distances(parts):
    """Stopping distances [m] at quantiles of the axes, a row for each stop; one speed for all."""
    columns = zip(sweep.plan.axes, np.pad(parts, ((0, 0), (1, 0))).T, strict=True)
    values = np.stack([axis.spread.at(part) for axis, part in columns], axis=1)
    return cl.ensemble(replace(sweep, values=values))["stopping_distance"].values.reshape(-1, 1)


function = ot.PythonFunction(3, 1, func_sample=distances)
vector = ot.RandomVector(ot.JointDistribution([ot.Uniform(0.0, 1.0)] * 3))
for limit in (437.0, 470.0):
    event = ot.ThresholdEvent(ot.CompositeRandomVector(function, vector), ot.Greater(), limit)
    search = ot.SubsetSampling(event)
    search.setBlockSize(STOPS)
    search.setMaximumOuterSampling(1)
    search.run()
    p, count = search.getResult().getProbabilityEstimate(), STOPS * search.getStepsNumber()
    print(f"{p:.1e} of the stops are longer than {limit:g} m, from {count} stops")
