"""The house rule: imports point down this list."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

import contactlib
from contactlib.files import package_folder

# Lowest first; a room is a module or a folder, and rooms of one line do not import each other.
FLOORS = [
    {"parameters", "files", "terminal"},
    {"data", "friction", "hertz", "kernel", "profile"},
    {"laws"},
    {"fit", "table"},
    {"law_tables", "element"},
    {"wheelset"},
    {"drivetrain", "stability", "controllers", "peak_force", "track"},
    {"control_systems", "torsion", "traction"},
    {"simulation", "scenario"},
    {"fleet"},
    {"outcomes", "traction_run"},
    {"metrics", "ensemble_run"},
    {"comparison", "study"},
    {"sweep"},
    {"export", "cosimulation", "checker", "explorer"},
    {"figures"},
    {"demo", "report"},
    {"cli"},
]
FLOOR = {name: level for level, names in enumerate(FLOORS) for name in names}
PACKAGE = Path(contactlib.__file__).parent


def room_of(path: Path) -> str:
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


@cache
def imports(path: Path) -> set[str]:
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module:
            parts = node.module.split(".")
            names = [parts[1]] if len(parts) > 1 else [alias.name for alias in node.names]
            found |= {(parts[0], name) for name in names}
        elif isinstance(node, ast.Import):
            found |= {(alias.name.split(".")[0], "") for alias in node.names}
    return {f"{top}.{name}".rstrip(".") for top, name in found}


def test_imports_point_down() -> None:
    for path in PACKAGE.rglob("*.py"):
        room = room_of(path)
        if room == "__init__":
            continue
        for name in imports(path):
            top, _, other = name.partition(".")
            if top == "contactlib" and other != room:
                assert FLOOR[other] < FLOOR[room], f"{path.name} must not import {other}"


def test_each_outside_library_has_one_door() -> None:
    doors = {
        "matplotlib": {"figures"},
        "cffi": {"kernel"},
        "click": {"cli"},
        "rich": {"cli"},
        "lxml": {"checker"},
    }
    for path in PACKAGE.rglob("*.py"):
        for library, rooms in doors.items():
            if room_of(path) not in rooms:
                assert not any(name.split(".")[0] == library for name in imports(path)), path


def test_table_and_laws_do_not_know_each_other() -> None:
    assert not any("laws" in name for name in imports(PACKAGE / "table.py"))
    for path in (PACKAGE / "laws").glob("*.py"):
        assert not any("table" in name or "kernel" in name for name in imports(path))


def test_code_is_ascii() -> None:
    folders = [PACKAGE, package_folder("fmu"), package_folder("models"), Path(__file__).parent]
    for folder in folders:
        paths = [p for p in folder.rglob("*") if p.suffix in {".py", ".pyi", ".c", ".h", ".toml"}]
        assert paths
        for path in paths:
            path.read_text(encoding="ascii")
