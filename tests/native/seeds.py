"""The inputs that the fuzzer starts from.

Small tables of every shape and damaged ones, start values of every kind of FMU, and programs of FMI
calls, in the layout in which the targets take their bytes.
"""

from __future__ import annotations

import re
import struct
from pathlib import Path

import numpy as np
from fmu_instance import EXPORTS

from contactlib import CarterGriffith, CreepForceTable, kernel

PROGRAM = Path(__file__).with_name("fuzz_fmi.c")
POINTS = bytes([200, 12, 30, 0, 201, 10, 90, 255, 200, 8, 0, 40, 7, 0, 10, 255]) + bytes(
    [204, 14, 100, 128, 202, 9, 250, 1, 8, 80]
)


def table_file(
    cells_u: int,
    cells_k: int,
    *,
    one_axis: int = 0,
    twice_decay: int = 6,
    twice_corner: int = 0,
    root_k: int = 0,
    static_to_kinetic: float = 0.0,
    layers: tuple[int, int, int] = (0, 0, 0),
) -> bytes:
    """A table of this shape, with numbers of the size of one."""
    rows = 1 if one_axis else cells_k + 3
    count = rows * ((7 if twice_corner else 0) + cells_u + 3) if cells_u else 0
    header = struct.pack("<IIdddd", cells_u, cells_k, 1.7, 1e-9, 1e-9, 100.0)
    shape = struct.pack("<dIIII", static_to_kinetic, one_axis, twice_decay, twice_corner, root_k)
    shape += struct.pack("<IIIId", *layers, 0, 1e-6)
    numbers = np.cos(np.arange(count)).astype("<f8").tobytes()
    if any(layers):
        numbers += np.cos(np.arange(np.prod(np.add(layers, 3)))).astype("<f4").tobytes()
    return kernel.framed(
        kernel.TABLE_MAGIC,
        kernel.TABLE_VERSION,
        header + shape + b"seed".ljust(104, b"\0") + numbers,
    )


def tables() -> dict[str, bytes]:
    """Table files by what they are."""
    line = CreepForceTable.from_law(CarterGriffith, contact="line").data
    cell = table_file(1, 1)
    return {
        "line": line,
        "one_cell": cell,
        "one_axis": table_file(2, 1, one_axis=1, twice_decay=0),
        "corner": table_file(2, 2, twice_corner=3, static_to_kinetic=2.0),
        "root_k": table_file(3, 2, root_k=1, twice_decay=8),
        "no_decay": table_file(1, 2, twice_decay=0),
        "layers": table_file(2, 2, twice_decay=8, layers=(2, 1, 3)),
        "cut": cell[:-8],
        "header_only": line[:24],
        "old_version": cell[:8] + struct.pack("<I", kernel.TABLE_VERSION - 1) + cell[12:],
        "not_finite": cell[:-8] + struct.pack("<d", np.nan),
        "too_many_cells": cell[:24] + struct.pack("<I", 2**32 - 3) + cell[28:],
        "negative_k_max": cell[:32] + struct.pack("<d", -1.0) + cell[40:],
    }


def operations() -> dict[str, int]:
    """Number of each call in a program, as the target's enumeration has it."""
    text = PROGRAM.read_text(encoding="ascii")
    match = re.search(r"enum operation \{(.*?)\}", text, re.DOTALL)
    assert match is not None
    return {name: i for i, name in enumerate(re.findall(r"\w+", match[1]))}


def up() -> list[object]:
    """Calls that lead to the initialization."""
    return ["SET_UP", 0, [0], 0, "ENTER_INITIALIZATION", 0, [0], 0]


def word(number: int) -> list[object]:
    """A number as the target takes one that may be large."""
    return list(struct.pack("<I", number))


def programs(kind: str) -> dict[str, list[object]]:
    """Programs of calls, by what the tool does, after the bytes that make the instance."""
    at = {v.name: i for i, v in enumerate(kernel.model_variables(kind))}
    one = [2]
    omega, speed, force, creepage = (at[n] for n in ("omega", "speed", "creep_force", "creepage"))
    set_some = ["SET_REAL", 2, omega, speed, 90, 11, 30, 90, 11, 0]
    start = [up(), set_some, "EXIT_INITIALIZATION"]
    step = ["STEP", 1, 1, 24]
    get = ["GET_REAL", 4, force, creepage, at["falling_indicator"], speed]
    flags = ["GET_BOOLEAN", 1, at["falling_branch"]]
    derivative = ["SENSITIVITY", 2, 1, 0, force, creepage, omega, one]
    adjoint = ["SENSITIVITY", 2, 1, 1, force, creepage, omega, one, one]
    states = ["GET_STATES", 5, "GET_DERIVATIVES", 5, "GET_INDICATORS", 5, "GET_NOMINALS", 5]
    too_much = [["SENSITIVITY", 1, 1, adjoint, force, omega, [7]] for adjoint in (0, 1)]
    restore = ["DESERIALIZE", 1, 0, 1, "RESTORE", 1, step, get, "FORGET", 0, "RESTORE", 0]
    saved = [start, step, "SAVE", 0, "SERIALIZE", 0, 0]
    damaged = ["DESERIALIZE", 1, 1, word(1), [7], 1, "RESTORE", 1, get, step]  # a radius
    set_states = ["SET_STATES", 5, 200, 11, 60, 200, 10, 60]
    integrate = ["UPDATE", "ENTER_CONTINUOUS", "SET_TIME", one, states, set_states]
    leave = ["COMPLETED_STEP", "ENTER_EVENTS", derivative, adjoint, flags]
    odd = ["SET_REAL", 3, at["radius"], omega, speed, [4], [5], [10]]
    return {
        "steps": [start, step, get, step, get, flags, derivative, too_much, "RESET"],
        "states": [start, "SAVE", 0, step, "SERIALIZE", 0, 0, restore],
        "damaged_state": [saved, damaged],
        "exchange": [start, integrate, leave],
        "too_early": [step, states, derivative, get, up(), "RESET", start, step],
        "odd_values": [up(), odd, "SET_BOOLEAN", 1, at.get("implicit", 0), 1, get],
        "others": [["OTHER", number, number % 3] for number in range(43)],
        "logging": ["SET_LOGGING", 3, 1, 0, "SET_LOGGING", 4, 0, 3, 97, 98, 99, step],
    }


def as_bytes(program: object, numbers: dict[str, int]) -> bytes:
    """A program of names, numbers and lists of them."""
    if isinstance(program, str):
        return bytes([numbers[program]])
    if isinstance(program, int):
        return bytes([program])
    assert isinstance(program, list)
    return b"".join(as_bytes(part, numbers) for part in program)


def seeds(resources: Path) -> dict[str, dict[str, bytes]]:
    """Contents of every seed, by target and name; `resources` are those of the exported FMUs."""
    contents: dict[str, dict[str, bytes]] = {"table": {}, "start_values": {}, "fmi": {}}
    for name, data in tables().items():
        for mended in (0, 1):
            contents["table"][f"{name}{'_mended' * mended}"] = bytes([mended]) + POINTS + data
    for number, name in enumerate(EXPORTS):
        data = (resources / name / "start_values.bin").read_bytes()
        contents["start_values"][name] = bytes([number, 1, 0]) + data
        frame = 24 + 16  # before the first value, after the number of wheels and of its values
        huge = data[:frame] + struct.pack("<d", 1e9) + data[frame + 8 :]
        contents["start_values"][f"{name}-huge"] = bytes([number, 1, 0]) + huge
    place = b"file:///no%20such/folder"
    cell = tables()["one_cell"]
    contents["start_values"]["table"] = bytes([3, 3, len(place)]) + place + cell
    rails = (resources / "vehicle" / "rails.bin").read_bytes()
    count = rails[:56] + struct.pack("<d", 1e6) + rails[64:]  # of the first profile's points
    for name, data in {"rails": rails, "rails-huge": count}.items():
        contents["start_values"][name] = bytes([7, 5, 0]) + data
    contents["start_values"]["unmended"] = bytes([0, 0, 3]) + b"%2x" + data[:-1]
    numbers = operations()
    calls = contents["fmi"]
    for version, first in ((2, 0), (3, len(EXPORTS))):  # the FMUs' numbers in each version
        for number in (0, 1, 2, 4, 7):
            for name, program in programs(list(EXPORTS.values())[number]["kind"]).items():
                flags = 6 | (name == "exchange")
                data = bytes([first + number, flags]) + as_bytes(program, numbers)
                calls[f"{name}_{number}_{version}"] = data
        # Much torque on little inertia, so that the speed leaves its range.
        for number, kind in ((3, "wheelset"), (5, "wheelset_body")):
            names = [v.name for v in kernel.model_variables(kind)]
            given = [names.index("inertia"), names.index("drive_torque"), 14, 13]
            program = [up(), "SET_REAL", 2, *given, "EXIT_INITIALIZATION", "STEP", 1, 1, 0]
            data = as_bytes(program, numbers)
            calls[f"slip_away_{number}_{version}"] = bytes([first + number, 6]) + data
        calls[f"wrong_token_{version}"] = bytes([first, 0xFE, 3]) + b"abc" + bytes(9)
        calls[f"wrong_place_{version}"] = bytes([first, 0xF6, 3]) + b"%zz" + bytes(9)
        calls[f"long_token_{version}"] = bytes([first, 0xEE, 63]) + b"a" * 63
    return contents


def write_seeds(folder: Path, resources: Path) -> None:
    """Write the seeds to a new folder, in a folder of each target."""
    for target, each in seeds(resources).items():
        (folder / target).mkdir(parents=True)
        for name, data in each.items():
            (folder / target / name).write_bytes(data)
