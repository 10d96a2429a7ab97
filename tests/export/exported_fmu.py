"""An FMU of any kind, exported and unpacked."""

from __future__ import annotations

import functools
import shutil
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
    place = Path(tempfile.mkdtemp(dir=folder)) / "unpacked"
    hashable = tuple((k, tuple(v) if isinstance(v, list) else v) for k, v in options.items())
    shutil.copytree(_unpacked(model, Subject(name, version), hashable), place)
    return place


@functools.lru_cache(maxsize=64)
def _unpacked(model: cl.Model, subject: Subject, options: tuple[tuple[str, Any], ...]) -> Path:
    """Folder that stays until the process ends; writing an FMU takes longer than copying one."""
    place = Path(tempfile.mkdtemp(dir=_process_folder().name))
    arguments = {**subject.arguments, **dict(options)}
    fmu = cl.export_fmu(fitting(model, subject.name), place / "x.fmu", **arguments)
    return Path(fmpy.extract(str(fmu), unzipdir=str(place / "unpacked")))


@functools.cache
def _process_folder() -> tempfile.TemporaryDirectory[str]:
    return tempfile.TemporaryDirectory(prefix="contactlib-fmus-")
