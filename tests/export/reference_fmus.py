"""FMUs of every kind of a wheelset's model with reference results, for the release.

    python tests/export/reference_fmus.py FOLDER [PLATFORM...]

Default: with the libraries of all platforms. The kernel computes the references in Python: for
co-simulation what a tool has at the end of each step, with the inputs of its beginning, and for
model exchange the solution for inputs that are linear between rows.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

import contactlib as cl
from contactlib import kernel
from contactlib.base.quantities import FloatArray
from contactlib.export.description import MODEL_NAMES, Description
from contactlib.export.package import reference_inputs

# A vehicle's FMU is compared with runs, and has a reference run of its own.
NAMES = {kind: name for kind, name in MODEL_NAMES.items() if kind != "vehicle"}
TOLERANCE = 1e-4  # of each variable's largest value
MAX_OUTPUTS = 8
PARTS = 100  # of a row in model exchange; the error falls as their square
INTERFACES = ("cs", "me")  # co-simulation, model exchange
ABOUT = """\
FMUs with reference results, by contactlib {version}: `NAME.fmi2.fmu` and `NAME.fmi3.fmu` give the
same numbers. Drive the inputs by `NAME_in.csv`, at the step of the FMU's default experiment, and
compare the outputs with

- `NAME_cs.csv` in co-simulation, where inputs keep over a step what they were at its beginning;
- `NAME_me.csv` in model exchange, where inputs are linear between rows.

Differences of up to {tolerance} of an output's largest value are those of a tool's solver. Each
FMU's `documentation/index.html` explains its variables. The guide's page "Tools that ran the FMUs"
lists results. MIT licence; the FMUs check no licence.
"""


def reference(
    description: Description, outputs: Sequence[str], interface: str
) -> tuple[dict[str, FloatArray], list[list[float]]]:
    """Inputs by name with ``time`` first, and rows of time and outputs."""
    inputs = reference_inputs(description)
    start, contact = description.start_values, description.native_contact
    native = kernel.NativeModel(description.kind, contact, start)
    time, rows = inputs["time"], []

    def set_inputs(at: float) -> None:
        native.set(**{n: float(np.interp(at, time, y)) for n, y in inputs.items() if n != "time"})

    set_inputs(0.0)
    for before, now in zip([0.0, *time.tolist()], time.tolist(), strict=False):
        parts = PARTS if interface == "me" and description.of_role("state") else 1
        for k in range(parts if now > before else 0):
            if parts > 1:
                set_inputs(before + (k + 0.5) / parts * (now - before))
            native.advance((now - before) / parts)
        if interface == "me":
            set_inputs(now)
        native.evaluate()
        rows.append([now, *native.get(*outputs)])
        set_inputs(now)
    return inputs, rows


def csv(names: Iterable[str], rows: Iterable[Iterable[float]]) -> str:
    """Text of a file: a header, and a row for each time."""
    return "\n".join([",".join(names), *(",".join(map(repr, row)) for row in rows)]) + "\n"


def write(folder: Path, platforms: Sequence[str] = ("all",)) -> None:
    """Write FMUs of these kinds and both versions, with inputs and references."""
    folder.mkdir(parents=True, exist_ok=True)
    about = ABOUT.format(version=cl.__version__, tolerance=TOLERANCE)
    texts = {"README.md": about}
    model = cl.load_model("locomotive.toml")
    for kind, name in NAMES.items():
        for version in (2, 3):
            path = folder / f"{name}.fmi{version}.fmu"
            cl.export_fmu(model, path, kind=kind, fmi_version=version, platforms=platforms)
        description = Description(model, kind)
        outputs = [v.name for v in description.variables if v.causality == "output" and v.type]
        outputs = [name for name in outputs if name != "pads"]  # which a turning wheel has at 1
        outputs = outputs[:MAX_OUTPUTS]
        for interface in INTERFACES:
            inputs, rows = reference(description, outputs, interface)
            texts[f"{name}_{interface}.csv"] = csv(["time", *outputs], rows)
        texts[f"{name}_in.csv"] = csv(inputs, np.column_stack(list(inputs.values())).tolist())
    for file, text in texts.items():
        (folder / file).write_text(text, encoding="ascii", newline="\n")


if __name__ == "__main__":
    write(Path(sys.argv[1]), sys.argv[2:] or ("all",))
