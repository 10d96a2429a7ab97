"""A sweep: friction of a wet patch against its length, under three controllers.

Prints the share of the available force that each controller uses, over the patch's friction.
"""

from pathlib import Path

import contactlib as cl

Path("small_sweep.toml").write_text("""
name = "Wet patches"
source = "chosen"
scenario = "dry_wet_dry.toml"
controllers = ["threshold", "creep_pi", "slope_seeking"]
outcomes = ["limited_utilisation"]

[axes.patch_friction]
parameter = ["track.friction[1]", "track.friction[2]"]
values = [0.4, 0.5, 0.6]

[axes.patch_end]
parameter = ["track.distance[2]", "track.distance[3]"]
values = ["60 m", "130 m"]
""")
found = cl.ensemble("small_sweep.toml")
for controller, shares in found["limited_utilisation"].mean("patch_end").groupby("controller"):
    text = ", ".join(f"{100 * share:.1f} %" for share in shares.values.ravel())
    print(f"{controller:14} {text}")
