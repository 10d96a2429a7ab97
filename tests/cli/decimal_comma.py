"""What files and messages contain in the locale of the environment; a program of its own.

    python decimal_comma.py FOLDER FMU

sets that locale for C and Python, in which a tool may run the library too, and prints as JSON its
decimal separator and what must not depend on it.
"""

from __future__ import annotations

import hashlib
import json
import locale
import sys
import warnings
from pathlib import Path

import numpy as np

import contactlib as cl
from contactlib.runs.result import Result

sys.path += map(str, (Path(__file__).parents[1], *Path(__file__).parents[1].iterdir()))

from fmu_instance import Instance


def main(folder: Path, unpacked: Path) -> dict[str, object]:
    """What was found, by name."""
    locale.setlocale(locale.LC_ALL, "")
    time = np.array([0.0, 0.5])
    run = Result(time=time, signals={"force": 1.5e3 * time}, units={"force": "N"})
    run.to_csv(folder / "run.csv")
    points = folder / "points.csv"
    points.write_text("creepage,traction_coefficient\n0.005,0.15\n0.01,0.25\n")
    model = cl.load_model("roller_rig.toml")
    messages: list[str] = []
    with Instance(unpacked).initialize() as fmu:
        values = fmu.get("radius", "static_friction")
        for values_out_of_range in ({"friction_scale": -1.5}, {"slip_rate_residual": 1.25e-300}):
            with fmu.refused():
                fmu.set(**values_out_of_range)
            messages.append(fmu.message)
        fmu.fmu.exitInitializationMode()
        with fmu.refused():
            fmu.step(0.125, 0.5)
        messages.append(fmu.message)
    exported = cl.export_fmu(model, folder / "x.fmu").read_bytes()
    return {
        "csv": (folder / "run.csv").read_text(),
        "read": cl.TractionData.from_csv(points).traction_coefficient.tolist(),
        "messages": messages,
        "values": values,
        "fmu": hashlib.sha256(exported).hexdigest(),
        "separator": locale.localeconv()["decimal_point"],
    }


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    json.dump(main(*map(Path, sys.argv[1:])), sys.stdout)
