"""The vehicle of a scenario: a model file, with changes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path, PureWindowsPath
from typing import Any

from contactlib.files import package_folder
from contactlib.scenario.model import VEHICLE_SECTIONS
from contactlib.scenario.reading import check_keys, in_file, parse, read_given, subsection, text


def vehicle_contents(data: Mapping[str, Any], folder: Path) -> tuple[str, dict[str, Any]]:
    """What a message calls the vehicle of a scenario, and its file's contents with the changes."""
    name = text("vehicle", data["vehicle"])
    changes = subsection("vehicle_changes", data.get("vehicle_changes", {}))
    check_keys("vehicle_changes.", changes, VEHICLE_SECTIONS, ())
    given = {
        section: read_given(f"vehicle_changes.{section}", VEHICLE_SECTIONS[section], keys)
        for section, keys in changes.items()
    }
    label = f"vehicle {name} changed" if given else f"vehicle {name}"
    with in_file(label):
        vehicle = parse(file_beside("vehicle", name, folder, "the scenario"))
        if "vehicle" not in vehicle:  # else it says that it is no model
            for section, keys in given.items():
                vehicle[section] = {**subsection(section, vehicle.get(section, {})), **keys}
    return label, vehicle


def file_beside(what: str, name: str, folder: Path, of: str) -> Path:
    """A file that another names: beside it or below its folder or, failing that, a shipped one.

    Raises
    ------
    ValueError
        If there is none, or if the name leads elsewhere.
    """
    meant = PureWindowsPath(name)  # knows both kinds of separator, and drives
    if meant.anchor or ".." in meant.parts:
        raise ValueError(f"{what} must lie beside {of} or below: no absolute path, no '..'")
    for place in (folder, package_folder("models")):
        if (place / name).is_file():
            return place / name
    raise ValueError(f"no such file, neither beside {of} nor among the shipped models")
