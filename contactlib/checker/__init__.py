"""Check an FMU, whoever made it: FMI 2.0 and 3.0, archive, description, libraries and all.

FMPy's validation reads modelDescription.xml alone, and stops at what it did not expect. Here each
rule has its own words, and FMPy is asked for a second opinion where no rule is broken.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
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

SCHEMAS = {2: "fmi2/fmi2ModelDescription.xsd", 3: "fmi3/fmi3ModelDescription.xsd"}


class Examination(NamedTuple):
    """What was found in an FMU, and what was looked at."""

    problems: list[str]
    checked: str


def check_fmu(path: str | os.PathLike[str]) -> list[str]:
    """What is wrong with an FMU.

    The library for this machine is loaded, in a process of its own: check what you would run.

    Parameters
    ----------
    path : path
        FMU of FMI 2.0 or 3.0.

    Returns
    -------
    list of str
        One line for each problem, which names file, variable, value and limit; empty if the FMU
        is fine.

    Raises
    ------
    OSError, ValueError
        If `path` cannot be read, or is not a zip file.
    """
    return examine_fmu(path).problems


def examine_fmu(path: str | os.PathLike[str]) -> Examination:
    """Problems as of `check_fmu`, and one line on what was checked."""
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
    described = list(_description_problems(description)) or list(_second_opinion(path))
    problems += [f"{FILE}: {problem}" for problem in described]
    problems += companion_problems(files, root)
    broken = list(binary_problems(files, root, version))
    problems += broken
    if whole:
        problems += loading_problems(files, root, version)
    interfaces = description.interfaces
    parts = [kind, " and ".join(interfaces), f"{len(description.variables)} variables"]
    parts += [f"{len(files)} files", *([] if broken else oldest_systems(files))]
    if loadable(files, root, version):
        parts.append("loaded on this machine")
    return Examination(problems, ", ".join(parts))


def _description_problems(description: Description) -> Iterator[str]:
    yield from definition_problems(description)
    yield from variable_problems(description)
    yield from structure_problems(description)


def _second_opinion(path: str | os.PathLike[str]) -> Iterator[str]:
    from fmpy.validation import validate_fmu

    for problem in validate_fmu(os.fspath(path)):
        yield f"FMPy: {' '.join(problem.split())}"
