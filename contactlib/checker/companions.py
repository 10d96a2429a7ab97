"""Rules on the files beside modelDescription.xml and the binaries."""

from __future__ import annotations

import posixpath
from collections.abc import Iterator, Mapping
from typing import Any

from contactlib.checker.definitions import repeated
from contactlib.checker.xml import parse, violations

TERMINALS = "terminalsAndIcons/terminalsAndIcons.xml"
BUILD = "sources/buildDescription.xml"
DOCUMENTATION = "documentation/index.html"
MEMBER_RULES = ("plug", "bus")


def companion_problems(files: Mapping[str, bytes], root: Any) -> Iterator[str]:
    """What is wrong with documentation, sources, terminals and icons."""
    version = root.get("fmiVersion")
    folders = {name.partition("/")[0] for name in files}
    if "documentation" in folders and DOCUMENTATION not in files:
        yield f"{DOCUMENTATION} is missing, though there is a folder documentation"
    yield from _fmi2_sources(files, root)
    for name, schema, check in (
        (BUILD, "fmi3/fmi3BuildDescription.xsd", _build_problems),
        (TERMINALS, "fmi3/fmi3TerminalsAndIcons.xsd", _terminal_problems),
    ):
        if name not in files:
            continue
        try:
            document = parse(files[name])
        except ValueError as error:
            yield f"{name} {error}"
            continue
        found = list(violations(document, schema))
        if not found:
            # In FMI 2.0, which does not know these files, they are of a version of their own.
            if version.startswith("3.") and document.get("fmiVersion") != version:
                found.append(
                    f"fmiVersion {document.get('fmiVersion')} must be {version}, "
                    "as in modelDescription.xml"
                )
            found += check(files, root, document)
        yield from (f"{name}: {problem}" for problem in found)


def has_sources(files: Mapping[str, bytes], root: Any) -> bool:
    """Whether the FMU says how it is compiled."""
    return BUILD in files or root.find("*/SourceFiles/File") is not None


def _fmi2_sources(files: Mapping[str, bytes], root: Any) -> Iterator[str]:
    for element in root.iterfind("*/SourceFiles"):
        interface = element.getparent().tag
        names = [file.get("name") for file in element.iterfind("File")]
        yield from repeated(f"modelDescription.xml: {interface}: source file", names)
        for name in names:
            if (path := posixpath.join("sources", name)) not in files:
                yield f"{path} is missing, though {interface}/SourceFiles names it"


def _build_problems(files: Mapping[str, bytes], root: Any, document: Any) -> Iterator[str]:
    known = {each.get("modelIdentifier") for each in root.iterfind("*[@modelIdentifier]")}
    for configuration in document.iterfind("BuildConfiguration"):
        if (identifier := configuration.get("modelIdentifier")) not in known:
            yield (
                f"line {configuration.sourceline}: modelIdentifier {identifier} is of no "
                "interface in modelDescription.xml"
            )
    for element in document.iter("SourceFile"):
        path = posixpath.normpath(posixpath.join("sources", element.get("name")))
        if path not in files:
            yield f"line {element.sourceline}: {path} is missing"
    for element in document.iter("IncludeDirectory"):
        path = posixpath.normpath(posixpath.join("sources", element.get("name")))
        if not any(name.startswith(f"{path}/") for name in files):
            yield f"line {element.sourceline}: folder {path} is missing"


def _terminal_problems(files: Mapping[str, bytes], root: Any, document: Any) -> Iterator[str]:
    named = root.iterfind("ModelVariables//*[@name]")
    variables = {element.get("name") for element in named}
    for level in (document.find("Terminals"), *document.iter("Terminal")):
        if level is not None:
            terminals = (each.get("name") for each in level.iterfind("Terminal"))
            yield from repeated("terminal", terminals)
    for terminal in document.iter("Terminal"):
        where = f'terminal "{terminal.get("name")}"'
        members = terminal.findall("TerminalMemberVariable")
        names = [member.get("variableName") for member in members]
        for stream in terminal.iterfind("TerminalStreamMemberVariable"):
            names += [stream.get("inStreamVariableName"), stream.get("outStreamVariableName")]
        for name in names:
            if name not in variables:
                yield f'{where}: variable "{name}" is not in modelDescription.xml'
        rule = terminal.get("matchingRule")
        given = [member.get("memberName") for member in members]
        if rule in MEMBER_RULES and None in given:
            yield f"{where}: matchingRule {rule} needs a memberName of each member"
        yield from repeated(f"{where}: member", (name for name in given if name is not None))
        for graphic in terminal.iterfind("TerminalGraphicalRepresentation"):
            yield from _icon(files, graphic.get("iconBaseName"), where)
    for _ in document.iterfind("GraphicalRepresentation/Icon"):
        yield from _icon(files, "icon", "Icon")


def _icon(files: Mapping[str, bytes], base: str, where: str) -> Iterator[str]:
    path = posixpath.normpath(f"terminalsAndIcons/{base}.png")
    if path not in files:
        yield f"{where}: {path} is missing"
    elif not files[path].startswith(b"\x89PNG\r\n\x1a\n"):
        yield f"{where}: {path} is no PNG image"
