"""The rules of the house: imports point down the list of rooms, and no module is in a circle."""

from __future__ import annotations

import ast
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import contactlib
from contactlib.base.writing import package_folder

# Lowest first: a room imports from rooms before it, and from itself.
ROOMS = [
    "base",
    "kernel",
    "laws",
    "table",
    "element",
    "vehicle",
    "stability",
    "traction",
    "files",
    "runs",
    "logs",
    "rl",
    "figures",
    "export",
    "cli",
]
PACKAGE = Path(contactlib.__file__).parent
NOT_ROOMS = {"_native", "fmu", "models"}  # a wheel brings the last two into the package
MODULES = [
    path
    for path in PACKAGE.rglob("*.py")
    if path.parent != PACKAGE and path.relative_to(PACKAGE).parts[0] not in NOT_ROOMS
]


def room_of(path: Path) -> str:
    return path.relative_to(PACKAGE).parts[0]


@cache
def imports(path: Path) -> frozenset[str]:
    """Modules that a module imports, anywhere in it; a name taken from a package is a candidate."""
    modules = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module:
            modules |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
        elif isinstance(node, ast.Import):
            modules |= {alias.name for alias in node.names}
    return frozenset(modules)


def test_rooms_are_those_of_the_list() -> None:
    assert {room_of(path) for path in MODULES} == set(ROOMS)


def test_imports_point_down() -> None:
    for path in MODULES:
        above = ROOMS[ROOMS.index(room_of(path)) + 1 :]
        for room in above:
            climbs = [
                name for name in imports(path) if f"{name}.".startswith(f"contactlib.{room}.")
            ]
            assert not climbs, f"{path.relative_to(PACKAGE)} must not import {climbs}"


def test_no_module_is_in_a_circle() -> None:
    names = {
        path: ".".join(("contactlib", *path.relative_to(PACKAGE).with_suffix("").parts))
        for path in MODULES
        if path.name != "__init__.py"
    }
    known = set(names.values())
    graph = {name: (imports(path) & known) - {name} for path, name in names.items()}
    assert len(tuple(TopologicalSorter(graph).static_order())) == len(names)  # or CycleError


def test_each_outside_library_has_one_door() -> None:
    doors = {
        "matplotlib": "figures",
        "cffi": "kernel",
        "click": "cli",
        "rich": "cli",
        "gymnasium": "rl",
    }
    for path in MODULES:
        for library, room in doors.items():
            if room_of(path) != room:
                assert not any(name.split(".")[0] == library for name in imports(path)), path


def test_building_and_reading_a_table_is_independent_of_the_laws() -> None:
    for name in ("building", "corner_sampling", "creep_force_table"):
        of_laws = {
            module for module in imports(PACKAGE / "table" / f"{name}.py") if ".laws." in module
        }
        assert of_laws <= {"contactlib.laws.law", "contactlib.laws.traction_data"} | {
            module
            for module in of_laws
            if module.startswith(("contactlib.laws.law.", "contactlib.laws.traction"))
        }


def test_code_is_ascii() -> None:
    tests = Path(__file__).parents[1]
    parts = [PACKAGE, package_folder("fmu"), package_folder("models")]
    folders = [*parts, tests, *map(tests.with_name, ("docs", "explorer", "tools"))]
    for folder in folders:
        paths = [p for p in folder.rglob("*") if p.suffix in {".py", ".c", ".h", ".inc", ".toml"}]
        assert paths
        for path in paths:
            path.read_text(encoding="ascii")
