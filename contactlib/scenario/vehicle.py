"""The vehicle of a scenario: a model file, with changes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path, PureWindowsPath
from typing import Any

from contactlib.files import package_folder
from contactlib.scenario.model import VEHICLE_SECTIONS, build_model
from contactlib.scenario.reading import check_keys, in_file, parse, read_given, subsection, text
from contactlib.table import CreepForceTable
from contactlib.wheelset import Wheelset


def read_vehicle(
    data: Mapping[str, Any],
    folder: Path,
    table: CreepForceTable | None,
    progress: Callable[[float], object],
) -> Wheelset:
    """Wheelset of the model file that a scenario names, with the scenario's changes."""
    name = text("vehicle", data["vehicle"])
    changes = subsection("vehicle_changes", data.get("vehicle_changes", {}))
    check_keys("vehicle_changes.", changes, VEHICLE_SECTIONS, ())
    given = {
        section: read_given(f"vehicle_changes.{section}", VEHICLE_SECTIONS[section], keys)
        for section, keys in changes.items()
    }
    with in_file(f"vehicle {name} changed" if given else f"vehicle {name}"):
        vehicle = parse(_vehicle_path(name, folder))
        if "vehicle" not in vehicle:  # else it says that it is no model
            for section, keys in given.items():
                vehicle[section] = {**subsection(section, vehicle.get(section, {})), **keys}
        return build_model(vehicle, table, progress).wheelset


def _vehicle_path(name: str, folder: Path) -> Path:
    """A model file beside the scenario or below its folder or, failing that, a shipped one."""
    meant = PureWindowsPath(name)  # knows both kinds of separator, and drives
    if meant.anchor or ".." in meant.parts:
        raise ValueError("vehicle must lie beside the scenario or below: no absolute path, no '..'")
    for place in (folder, package_folder("models")):
        if (place / name).is_file():
            return place / name
    raise ValueError("no such file, neither beside the scenario nor among the shipped models")
