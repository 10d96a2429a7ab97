"""An FMU of any kind, exported and unpacked."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import fmpy
from fmu_instance import Subject
from native_models import with_memory

import contactlib as cl


def fitting(model: cl.Model, name: str) -> cl.Model:
    """The model for a kind of FMU of `EXPORTS`."""
    return with_memory(model) if name.endswith("memory") else model


def exported(
    model: cl.Model, folder: Path, name: str = "force_element", version: int = 2, **options: Any
) -> Path:
    """New folder with the contents of an FMU of `EXPORTS`; options add to those that it has."""
    place = Path(tempfile.mkdtemp(dir=folder))
    arguments = {**Subject(name, version).arguments, **options}
    fmu = cl.export_fmu(fitting(model, name), place / "x.fmu", **arguments)
    return Path(fmpy.extract(str(fmu), unzipdir=str(place / "unpacked")))
