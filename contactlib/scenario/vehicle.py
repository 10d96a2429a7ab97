"""The vehicle of a scenario: a model file, with changes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from contactlib.scenario.beside import file_beside
from contactlib.scenario.model import VEHICLE_SECTIONS
from contactlib.scenario.reading import check_keys, in_file, parse, read_given, subsection, text


def vehicle_contents(data: Mapping[str, Any], folder: Path) -> tuple[str, dict[str, Any], Path]:
    """What a message calls the vehicle of a scenario, and its file's contents with the changes.

    The third is the folder of the file that names the law's: the scenario's if the changes do.
    """
    name = text("vehicle", data["vehicle"])
    changes = subsection("vehicle_changes", data.get("vehicle_changes", {}))
    check_keys("vehicle_changes.", changes, VEHICLE_SECTIONS, ())
    given = {
        section: read_given(f"vehicle_changes.{section}", VEHICLE_SECTIONS[section], keys)
        for section, keys in changes.items()
    }
    label = f"vehicle {name} changed" if given else f"vehicle {name}"
    with in_file(label):
        file = file_beside("vehicle", name, folder, "the scenario")
        vehicle = parse(file)
        if "vehicle" not in vehicle:  # else it says that it is no model
            for section, keys in given.items():
                vehicle[section] = {**subsection(section, vehicle.get(section, {})), **keys}
    return label, vehicle, folder if "file" in given.get("law", {}) else file.parent
