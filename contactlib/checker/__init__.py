"""Check an FMU, whoever made it: FMI 2.0 and 3.0, archive, description, libraries and all.

FMPy's validation reads modelDescription.xml alone, and stops at what it did not expect. Here each
rule has its own words, and FMPy is asked for a second opinion where no rule is broken.
"""

from __future__ import annotations

import io
import os
import zipfile
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from contactlib.checker.archive import read_archive
from contactlib.checker.binaries import binary_problems, oldest_systems
from contactlib.checker.companions import companion_problems
from contactlib.checker.definitions import definition_problems
from contactlib.checker.description import FILE, Description, fmi_version
from contactlib.checker.loading import loadable, loading_problems
from contactlib.checker.structure import structure_problems
from contactlib.checker.variables import variable_problems
from contactlib.checker.xml import parse, violations
from contactlib.terminal import harmless_line

SCHEMAS = {2: "fmi2/fmi2ModelDescription.xsd", 3: "fmi3/fmi3ModelDescription.xsd"}


class Examination(NamedTuple):
    """What was found in an FMU, and what was looked at."""

    problems: list[str]
    checked: str


def check_fmu(path: str | os.PathLike[str], *, load: bool = False) -> list[str]:
    """What is wrong with an FMU.

    Its files are read, and nothing of it runs unless `load` asks for that.

    Parameters
    ----------
    path : path
        FMU of FMI 2.0 or 3.0.
    load : bool
        Also load the library for this machine, and make and free an instance, in a process of its
        own. This runs the FMU's code with all the rights of whoever asks for it.

    Returns
    -------
    list of str
        One line for each problem, which names file, variable, value and limit; empty if the FMU
        is fine.

    Raises
    ------
    OSError, ValueError
        If `path` cannot be read, is not a zip file, or unpacks to more than 1 GiB.
    """
    return examine_fmu(path, load=load).problems


def examine_fmu(path: str | os.PathLike[str], *, load: bool) -> Examination:
    """Problems as of `check_fmu`, and one line on what was checked."""
    found = _examined(path, load)
    return Examination(
        [harmless_line(problem) for problem in found.problems], harmless_line(found.checked)
    )


def _examined(path: str | os.PathLike[str], load: bool) -> Examination:
    files, problems = read_archive(path)
    whole = not problems  # what is not must not be unpacked
    try:
        if FILE not in files:
            raise ValueError("is missing")
        root = parse(files[FILE])
        version = fmi_version(root)
    except ValueError as error:
        return Examination([*problems, f"{FILE} {error}"], f"{len(files)} files")
    kind = f"FMI {root.get('fmiVersion')}"
    # All further rules take for granted what the schema demands.
    if violated := [f"{FILE}: {problem}" for problem in violations(root, SCHEMAS[version])]:
        return Examination([*problems, *violated], kind)
    description = Description(root)
    described = list(_description_problems(description)) or list(_second_opinion(files))
    problems += [f"{FILE}: {problem}" for problem in described]
    problems += companion_problems(files, root)
    broken = list(binary_problems(files, root, version))
    problems += broken
    runs = load and whole
    if runs:
        problems += loading_problems(files, root, version)
    interfaces = description.interfaces
    parts = [kind, " and ".join(interfaces), f"{len(description.variables)} variables"]
    parts += [f"{len(files)} files", *([] if broken else oldest_systems(files))]
    if loadable(files, root, version):
        parts.append("loaded on this machine" if runs else "not loaded")
    return Examination(problems, ", ".join(parts))


def _description_problems(description: Description) -> Iterator[str]:
    yield from definition_problems(description)
    yield from variable_problems(description)
    yield from structure_problems(description)


def _second_opinion(files: Mapping[str, bytes]) -> Iterator[str]:
    from fmpy.validation import validate_fmu

    # Of what was read here: FMPy would unpack the zip itself, whatever that comes to.
    with zipfile.ZipFile(seen := io.BytesIO(), "w") as archive:
        archive.writestr(FILE, files[FILE])
    for problem in validate_fmu(seen):
        yield f"FMPy: {' '.join(problem.split())}"
