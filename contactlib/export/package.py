"""The contents of an FMU: libraries, sources, table, descriptions, page and a reference run.

No compiler is needed. The start values are in ``resources/``, where the library reads them, and in
modelDescription.xml, where the tool does. The kernel itself computes the reference run.
"""

from __future__ import annotations

import io
import math
import struct
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from contactlib import kernel
from contactlib.base.quantities import FloatArray, Limits, checked_whole, shown, warn
from contactlib.base.writing import c_sources
from contactlib.export import fmi2, fmi3, fmu_page
from contactlib.export.description import ASSUMED_INVERSE_MASS, Description
from contactlib.export.platforms import binaries
from contactlib.export.vehicle import parts_of
from contactlib.files.model import Missing
from contactlib.files.scenario import Scenario
from contactlib.runs.plant import common_step

if TYPE_CHECKING:
    from contactlib.files.model import Model


START_VALUES_VERSION = 4
MAX_WHEELS = 32  # in one FMU, as in fmu/fmi/model.h


LONGEST_STEP = {  # [s]
    "force_element": 5e-3,
    "wheelset": 1e-2,
    "wheelset_body": 1e-2,
    "creep_forces": 1e-2,
    "vehicle": 1e-2,
}
STEPS = 400  # of the reference run


class Experiment(NamedTuple):
    """End of the default experiment, and communication step also of the reference run [s]."""

    stop: float
    step: float


def experiment(description: Description) -> Experiment:
    """The default experiment: a step that is stable however the FMU is run.

    It is half of the stable limit for a held force and an explicit solver at the start values,
    where the contact sticks and is stiffest. The implicit mode allows more, but not in model
    exchange. A contact with memory is too stiff for an explicit solver to show anything in a run of
    this many steps; its step resolves the swing of the wheel on the contact. A vehicle's is the run
    of its scenario, and its step is a whole fraction of the controllers' sample times.
    """
    stable = [LONGEST_STEP[description.kind]]
    held = replace(description, implicit=False)
    if held.rails:  # an axle of the vehicle
        held = replace(held, kind="wheelset", wheels=1, per_wheel=(), rails=b"")
    if held.remembers:
        held = replace(held, kind="force_element", whole_wheelset=held.kind == "wheelset")
    native = kernel.NativeModel(held.kind, held.native_contact, held.start_values)
    if not held.remembers:
        stable.append(0.5 * native.explicit_step())
    if held.kind == "force_element":
        stable += native.get("step_size_hint")
    power = 10.0 ** math.floor(math.log10(min(stable)))
    step = max(round_number for n in (1, 2, 5) if (round_number := n * power) <= min(stable))
    if not description.run:
        return Experiment(STEPS * step, step)
    duration, *sample_times = description.run
    return Experiment(duration, common_step(step, sample_times))


def longest_step(description: Description) -> float:
    """Largest stable step over which the force may be held at the start values [s].

    The contact sticks there, and its force is the stiffest.
    """
    held = replace(description, implicit=False)
    native = kernel.NativeModel(held.kind, held.native_contact, held.start_values)
    return 2.0 * native.get("step_size_hint")[0]


def reference_inputs(description: Description) -> dict[str, FloatArray]:
    """Inputs by name at the communication points, with ``time`` [s] first.

    The inputs reach both branches: the creepage of the force element oscillates from traction to
    braking far past the peak; the drive torque of the wheelset exceeds what the contact can carry
    and returns. In the second half of the run the contact slips across rolling and spins, too.
    Among several wheels each one slips less than the one before.
    """
    step = experiment(description).step
    time, stop = step * np.arange(STEPS + 1, dtype=np.float64), STEPS * step
    element = description.element
    start, swing = description.start_values, np.sin(2.0 * np.pi * time / stop)
    sliding = element.friction.kinetic * element.axle_load
    pulse = np.sin(np.pi * time / stop) ** 2
    # A contact with memory that slides is the stiffer, the larger its creepage.
    reach, excess = (3.0, 0.3) if description.remembers else (6.0, 0.4)
    zeta0, width = element.saturation_creepage, element.contact.semi_width
    along = reach * zeta0 * swing**3
    late = np.clip(2.0 * time / stop - 1.0, 0.0, 1.0)  # in the second half
    across = 0.6 * zeta0 * np.sin(np.pi * late) ** 2
    turning = 0.5 * zeta0 / width * np.sin(2.0 * np.pi * late)
    columns = {
        "normal_load": element.axle_load * (1.0 + 0.1 * np.sin(30.0 * time / stop)),
        "friction_scale": 1.0 - 0.3 * pulse**4,
        **dict.fromkeys(
            ("drive_torque", "motor_torque"), element.radius * sliding * (0.9 + excess * pulse)
        ),
        "brake_torque": 0.3 * element.radius * sliding * np.sin(np.pi * late) ** 2,
        "brake_pressure": 3e5 * np.sin(np.pi * late) ** 2,
        "resistance_force": 0.1 * sliding * pulse,
        "grade": 0.01 * pulse,
        "front_coupler_force": 0.05 * sliding * pulse,
        "rear_coupler_force": 0.2 * sliding * pulse,
        "creep_force": sliding * (0.9 + 0.2 * pulse),
        "semi_axis_x": width * (1.0 + 0.2 * pulse),
        "semi_axis_y": start.get("semi_axis_y", width) * (1.0 - 0.2 * pulse),
        "creepage_x": -along,
        "creepage_y": across,
        "spin": turning,
    }
    if "creepage_x" in start:
        columns["speed"] = start["speed"] * (1.0 - 0.2 * time / stop)
    elif "speed" in start:
        columns |= {
            "omega": start["omega"] * (1.0 + along) * (1.0 - 0.2 * time / stop),
            "speed": start["speed"] * (1.0 - 0.2 * time / stop),
            "lateral_velocity": start["speed"] * across,
            "spin_velocity": start["speed"] * turning,
        }
    inputs = replace(description, arrays=True).of_role("input")
    rows = {"time": time}
    for v in inputs:
        first = columns[v.name][0]
        for i, scalar in enumerate(v.elements()):
            rows[scalar.name] = first + (1.0 - 0.03 * i) * (columns[v.name] - first)
    return rows


def reference_run(description: Description) -> bytes:
    """documentation/reference_run.csv; the README.txt beside it describes its rows."""
    inputs = reference_inputs(description)
    time = inputs.pop("time")
    contact, start = description.native_contact, description.start_values
    native = kernel.NativeModel(description.kind, contact, start, description.wheels)
    outputs = [
        e.name for v in description.variables if v.causality == "output" for e in v.elements()
    ]
    lines = [",".join(["time", *inputs, *outputs])]
    for i, t in enumerate(time.tolist()):
        if i > 0:
            try:
                native.advance(t - float(time[i - 1]))
            except RuntimeError as error:
                why = f"the reference run of the FMU fails before {t:g} s: {error}"
                raise RuntimeError(f"{why}; an older file stays as it is") from None
        row = {name: float(column[i]) for name, column in inputs.items()}
        native.set(**row)
        if i == 0:
            native.begin()
        else:
            native.evaluate()
        lines.append(",".join(map(repr, [t, *row.values(), *native.get(*outputs)])))
    return ("\n".join(lines) + "\n").encode()


def describe(
    model: Model | Scenario,
    kind: str | None,
    implicit: bool,
    parallel_exchange: bool,
    *,
    booleans: bool = True,
    brake_pressure: bool = False,
    wheels: int = 1,
    per_wheel: Sequence[str] = (),
    author: str | None = None,
    version: str | None = None,
) -> Description:
    """Check the parameters of `contactlib.export_fmu` and return a description."""
    of_vehicle = isinstance(model, Scenario)
    kind = kind or ("vehicle" if of_vehicle else "force_element")
    if kind not in kernel.MODEL_KINDS:
        raise ValueError(f"kind = {kind!r} must be one of: {', '.join(kernel.MODEL_KINDS)}")
    if of_vehicle != (kind == "vehicle"):
        needed, given = ("Scenario", "Model") if kind == "vehicle" else ("Model", "Scenario")
        raise ValueError(f"kind = {kind!r} needs a {needed}: expected one, got a {given}")
    if of_vehicle and wheels != 1:
        raise ValueError(f"wheels = {shown(wheels)}: a vehicle has the axles of its scenario")
    if brake_pressure and not of_vehicle:
        raise ValueError(f"brake_pressure = True needs kind = 'vehicle', not {kind!r}")
    if (implicit or parallel_exchange) and kind != "force_element":
        name = "implicit" if implicit else "parallel_exchange"
        raise ValueError(f"{name} = True needs kind = 'force_element', not {kind!r}")
    if implicit and not isinstance(model, Scenario) and isinstance(model.wheelset, Missing):
        warn(
            f"effective_inverse_mass = {ASSUMED_INVERSE_MASS:g} 1/kg is assumed, as the model has "
            "no inertia: set it to radius^2 / inertia + 1 / mass of what the element is coupled to"
        )
    for name, text in (("author", author), ("version", version)):
        printable = isinstance(text, str) and text.strip() and text.isprintable()
        if text is not None and not printable:
            raise ValueError(f"{name} = {shown(text)} must be text in one line")
    starts: Mapping[str, float] = {}
    rails, own, run = b"", list[str](), list[float]()
    if isinstance(model, Scenario):
        controls = map(model.controller, model.controllers)
        run = [model.duration, *(control.sample_time for control in controls)]
        model, starts, rails = parts_of(model, brake_pressure)
        wheels = int(starts["axles"])
        own = ["position", "radius"] if wheels > 1 else []
    description = Description(
        model,
        kind,
        implicit=implicit,
        parallel_exchange=parallel_exchange,
        booleans=booleans,
        wheels=checked_whole("wheels", wheels, Limits(at_least=1.0, at_most=MAX_WHEELS)),
        per_wheel=(*own, *per_wheel),
        starts=starts,
        rails=rails,
        run=run,
        author=author,
        version=version,
    )
    if wheels > 1 and kind == "wheelset_body":
        raise ValueError(f"wheels = {wheels} needs a kind with a contact, not {kind!r}")
    names = [
        v.name
        for v in description.of_role("fixed_parameter", "tunable_parameter")
        if v.unit != "Boolean"
        and v.name not in ("implicit", "parallel_exchange", "elliptic", "memory")
    ]
    for name in description.per_wheel:
        if wheels == 1 or name not in names:
            needed = "needs wheels > 1" if wheels == 1 else f"must be one of: {', '.join(names)}"
            raise ValueError(f"per_wheel = {shown(name)} {needed}")
    return description


def fmu(description: Description, fmi_version: int, platforms: Sequence[str] | None) -> bytes:
    """The FMU's bytes."""
    if not (isinstance(fmi_version, int) and fmi_version in (2, 3)):
        raise ValueError(f"fmi_version = {shown(fmi_version)} must be 2 or 3")
    description = replace(description, arrays=fmi_version == 3)
    stop, step = experiment(description)
    sources = _sources(fmi_version)
    compiled = [name for name in sources if name.endswith(".c")]
    icon = fmu_page.icon()
    files: dict[str, bytes] = {}
    if fmi_version == 2:
        files["modelDescription.xml"] = fmi2.model_description(description, compiled, stop, step)
        files["model.png"] = icon
    else:
        files["modelDescription.xml"] = fmi3.model_description(description, stop, step)
        files["sources/buildDescription.xml"] = fmi3.build_description(description, compiled)
        files["terminalsAndIcons/terminalsAndIcons.xml"] = fmi3.terminals_and_icons(description)
        files["terminalsAndIcons/icon.png"] = icon
    files |= binaries(platforms, fmi_version, description.model_name)
    files |= {f"sources/{name}": data for name, data in sources.items()}
    files["resources/start_values.bin"] = _start_values_file(description)
    files |= {f"resources/{name}": data for name, data in description.resources.items()}
    if "creep_table.bin" in description.resources:
        files["resources/creep_table.csv"] = fmu_page.readable_table(
            description.element.table, description.element.layer_ratio
        )
    files["documentation/index.html"] = fmu_page.index_page(description)
    files["documentation/licenses/license.txt"] = fmu_page.licence_text()
    files["documentation/reference_run.csv"] = reference_run(description)
    files["documentation/README.txt"] = fmu_page.reference_run_text(description, STEPS, step)
    return zipped(files)


def _sources(fmi_version: int) -> dict[str, bytes]:
    """The C sources that this version of the standard needs, by name.

    The importer supplies the standard's headers.
    """
    other = f"fmi{5 - fmi_version}"
    sources = {p.name: p.read_bytes() for p in c_sources() if not p.name.startswith(other)}
    # The build sets this by a flag; see fmu/fmi/token.h.
    sources["token_value.h"] = f'#define CONTACTLIB_TOKEN "{kernel.token()}"\n'.encode()
    return sources


def _start_values_file(description: Description) -> bytes:
    """Number of wheels, and start values with their number, as fmu/fmi/component.c reads them."""
    numbers = [float(description.wheels)]
    for v in kernel.model_variables(description.kind):
        if v.role in kernel.GIVEN:
            count = 1 if description.is_common(v) else description.wheels
            numbers += [float(count), *description.starts_of(v.name)[:count]]
    numbers.append(float(description.booleans))
    body = struct.pack(f"<{len(numbers)}d", *numbers)
    return kernel.framed(b"CREEPVAL", START_VALUES_VERSION, body)


def zipped(files: dict[str, bytes]) -> bytes:
    """Zip file whose bytes depend only on its contents."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, data in files.items():
            entry = zipfile.ZipInfo(name, date_time=(1980, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o755 << 16 if name.startswith("binaries/") else 0o644 << 16
            archive.writestr(entry, data, compresslevel=4)  # half the time, and 3 % larger
    return buffer.getvalue()
