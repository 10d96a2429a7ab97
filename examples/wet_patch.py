"""Four traction controllers on one wet patch.

Draws wet_patch.png, the creepage under each, and prints how much of the available force they use.
"""

import matplotlib.pyplot as plt

import contactlib as cl

scenario = cl.load_scenario("dry_wet_dry.toml")
figure, axes = plt.subplots(figsize=(6.4, 3.6), layout="constrained")
for name in scenario.controllers:
    run = cl.run_scenario(scenario, name)
    found = cl.metrics(run, scenario.drivetrain)
    print(f"{name:14} uses {100 * found.limited_utilisation:5.1f} % while friction limits")
    axes.semilogy(run.time, 100 * run["creepage"].clip(1e-4), label=name.replace("_", " "))
axes.set(xlabel="time [s]", ylabel="creepage [%]", ylim=(0.1, None))
axes.legend()
figure.savefig("wet_patch.png")
