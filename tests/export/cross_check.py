"""FMUs with reference results, in the folders and files of the FMI cross-check.

    python tests/export/cross_check.py FOLDER

The layout is that of FMI-CROSS-CHECK-RULES.md, version 4.1, in the repository
modelica/fmi-cross-check: sections 9.1.4 and 9.1.5 and appendix B. The kernel computes the
references in Python: for co-simulation what a tool has at the end of each step, with the inputs of
its beginning, and for model exchange the solution for inputs that are linear between rows.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np

import contactlib as cl
from contactlib import kernel
from contactlib.base.quantities import FloatArray
from contactlib.export.description import MODEL_NAMES, Description
from contactlib.export.package import experiment, reference_inputs
from contactlib.export.platforms import FMI2_FOLDERS

TOOL = "contactlib"
PLATFORMS = ("linux64", "win64", "darwin64")  # those of ours that the rules know
TOLERANCE = 1e-4  # of each variable's largest value
MAX_OUTPUTS = 8  # the rules advise ten at most
PARTS = 100  # of a row in model exchange; the error falls as their square
README = """\
# {name}

{about}

`{name}_ref.csv` is the solution for the inputs of `{name}_in.csv`, which {how}.
The FMU's `documentation/index.html` says what its variables mean. MIT licence; no licence check.
"""
HOW = {
    "cs": "each communication step keeps as\nthey were at its beginning",
    "me": "are linear between its rows",
}


def reference(
    description: Description, outputs: Sequence[str], fmi_type: str
) -> tuple[dict[str, FloatArray], list[list[float]]]:
    """Inputs by name with ``time`` first, and rows of time and outputs."""
    inputs = reference_inputs(description)
    start, contact = description.start_values, description.native_contact
    native = kernel.NativeModel(description.kind, contact, start)
    time, rows = inputs["time"], []

    def give(at: float) -> None:
        native.set(**{n: float(np.interp(at, time, y)) for n, y in inputs.items() if n != "time"})

    give(0.0)
    for before, now in zip([0.0, *time.tolist()], time.tolist(), strict=False):
        parts = PARTS if fmi_type == "me" and description.of_role("state") else 1
        for k in range(parts if now > before else 0):
            if parts > 1:
                give(before + (k + 0.5) / parts * (now - before))
            native.advance((now - before) / parts)
        if fmi_type == "me":
            give(now)
        native.evaluate()
        rows.append([now, *native.get(*outputs)])
        give(now)
    return inputs, rows


def csv(names: Iterable[str], rows: Iterable[Iterable[float]]) -> str:
    """Text of a file, as appendix B has it."""
    lines = [",".join(f'"{name}"' for name in names), *(",".join(map(repr, r)) for r in rows)]
    return "\n".join(lines) + "\n"


def write(folder: Path, platforms: Mapping[str, Sequence[str]] | None = None) -> None:
    """Write FMUs of all kinds for model exchange and co-simulation, with their references.

    `platforms` names the libraries in each of the FMUs. Default: all, in those of all platforms.
    """
    model = cl.load_model("locomotive.toml")
    for platform, libraries in (platforms or {n: FMI2_FOLDERS[n] for n in PLATFORMS}).items():
        for kind, name in MODEL_NAMES.items():
            fmu = cl.export_fmu(model, folder / "x.fmu", kind=kind, platforms=libraries)
            packed, description = fmu.read_bytes(), Description(model, kind)
            fmu.unlink()
            step = experiment(description).step
            outputs = [v.name for v in description.variables if v.causality == "output" and v.type]
            outputs = outputs[:MAX_OUTPUTS]
            for fmi_type, how in HOW.items():
                place = folder / "fmus" / "2.0" / fmi_type / platform / TOOL / cl.__version__ / name
                place.mkdir(parents=True)
                inputs, rows = reference(description, outputs, fmi_type)
                given = np.column_stack(list(inputs.values())).tolist()
                about = " ".join(description.text.split())
                options = {"StartTime": 0.0, "StopTime": float(inputs["time"][-1])}
                options |= {"StepSize": step if fmi_type == "cs" else 0.0, "RelTol": TOLERANCE}
                options |= {"OutputIntervalLength": step}
                texts = {
                    "README.md": README.format(name=name, about=about, how=how),
                    f"{name}_in.csv": csv(inputs, given),
                    f"{name}_ref.csv": csv(["time", *outputs], rows),
                    f"{name}_ref.opt": "".join(f"{k}, {v!r}\n" for k, v in options.items()),
                }
                (place / f"{name}.fmu").write_bytes(packed)
                for file, text in texts.items():
                    (place / file).write_text(text, encoding="ascii", newline="\n")


if __name__ == "__main__":
    root = Path(sys.argv[1])
    root.mkdir(parents=True, exist_ok=True)
    write(root)
