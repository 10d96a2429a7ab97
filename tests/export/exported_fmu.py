"""An FMU of any kind, exported and unpacked."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import pytest
from fmu_instance import Subject
from native_models import with_memory
from plain_scenario import braked_vehicle

import contactlib as cl
from contactlib.export import fmu_page, package
from contactlib.export.description import Description


def fitting(model: Any, name: str, axles: int = 1) -> Any:
    """The model for a kind of FMU of `EXPORTS`; for a vehicle a scenario of axles like it."""
    if name == "vehicle" and isinstance(model, cl.Model):
        return braked_vehicle(with_memory(model).wheelset, axles)
    return with_memory(model) if name.endswith("memory") else model


def described(model: cl.Model | cl.Scenario, **options: Any) -> Description:
    """Description of an FMU of a model that fits."""
    if isinstance(model, cl.Scenario):
        defaults = {"kind": None, "implicit": False, "parallel_exchange": False}
        return package.describe(model, **{**defaults, **options})
    return Description(model, **options)


def exported(
    model: Any, folder: Path, name: str = "force_element", version: int = 2, **options: Any
) -> Path:
    """New folder with what a tool reads of an FMU of `EXPORTS`, without its documentation.

    Options add to those of the kind. Of a scenario the name is "vehicle".
    """
    place = Path(tempfile.mkdtemp(dir=folder))
    arguments = {**Subject(name, version).arguments, **options}

    def unpacked(files: dict[str, bytes]) -> bytes:
        for file, data in files.items():
            if not file.startswith(("documentation/", "sources/")):
                (place / "unpacked" / file).parent.mkdir(parents=True, exist_ok=True)
                (place / "unpacked" / file).write_bytes(data)
        return b""

    with pytest.MonkeyPatch.context() as patch:  # most of the time is theirs
        patch.setattr(package, "zipped", unpacked)
        patch.setattr(package, "reference_run", lambda description: b"")
        patch.setattr(fmu_page, "index_page", lambda description: b"")
        patch.setattr(fmu_page, "readable_table", lambda table, layer_ratio: b"")
        cl.export_fmu(fitting(model, name), place / "x.fmu", **arguments)
    return place / "unpacked"
