"""The wheel contains what it declares, and nothing else.

CONTACTLIB_WHEEL names the wheel to examine; `pytest -m slow tests/export/test_wheel.py` builds one
from the tree, and another from the source distribution, which must be the same to the last byte.
CONTACTLIB_DIST names a new folder for the one of the tree.
"""

from __future__ import annotations

import base64
import csv
import getpass
import hashlib
import io
import os
import re
import shutil
import socket
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from collections.abc import Mapping
from email import message_from_bytes
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from fmu_proof import MACHINE, libraries
from outside_tools import missing
from packaging.requirements import Requirement
from tree import FOLDERS, ROOT

from contactlib import kernel
from contactlib.export.platforms import PLATFORMS

FILES = (
    "CHANGELOG.md",
    "CITATION.cff",
    "CONTRIBUTING.md",
    "LICENSE",
    "README.md",
    "pyproject.toml",
)
TAGS = {
    "manylinux_2_17_x86_64": "x86_64-linux",
    "manylinux_2_17_aarch64": "aarch64-linux",
    "win_amd64": "x86_64-windows",
    "macosx_11_0_arm64": "aarch64-darwin",
    "macosx_10_15_x86_64": "x86_64-darwin",
}
LIBRARY = re.compile(r"contactlib/_native/([\w-]+)/contactlib\.(?:so|dll|dylib)")

pytestmark = pytest.mark.skipif(
    not (ROOT / "fmu" / "build_hook.py").is_file(), reason="the tree that it is of is not here"
)


class Wheel(NamedTuple):
    """A wheel, the contents of its files, and folders of the machine that built it."""

    path: Path
    files: Mapping[str, bytes]
    folders: tuple[Path, ...]

    def described(self, name: str) -> bytes:
        return self.files[f"{self.info}/{name}"]

    @property
    def info(self) -> str:
        return "-".join(self.path.name.split("-")[:2]) + ".dist-info"


@pytest.fixture(scope="module", params=["given", pytest.param("built", marks=pytest.mark.slow)])
def wheel(request: pytest.FixtureRequest) -> Wheel:
    if request.param == "given":
        if "CONTACTLIB_WHEEL" not in os.environ:
            missing("CONTACTLIB_WHEEL names no wheel")
        return opened(Path(os.environ["CONTACTLIB_WHEEL"]))
    built_here: Wheel = request.getfixturevalue("wheel_of_the_tree")
    return built_here


@pytest.fixture(scope="module")
def wheel_of_the_tree(tmp_path_factory: pytest.TempPathFactory) -> Wheel:
    folder = tmp_path_factory.mktemp("wheel")
    output = Path(os.environ.get("CONTACTLIB_DIST", folder / "dist"))
    return opened(built(copied_tree(folder / "tree"), output), folder, ROOT)


def opened(path: Path, *folders: Path) -> Wheel:
    with zipfile.ZipFile(path) as archive:
        names = archive.namelist()
        assert len(set(names)) == len(names)
        return Wheel(path, {name: archive.read(name) for name in names}, folders)


def copied_tree(folder: Path) -> Path:
    folder.mkdir()
    ignored = shutil.ignore_patterns("_native", "node_modules", "__pycache__", ".*cache")
    for name in FOLDERS:
        shutil.copytree(ROOT / name, folder / name, ignore=ignored)
    for name in FILES:
        shutil.copy(ROOT / name, folder / name)
    return folder


def built(tree: Path, output: Path, kind: str = "wheel") -> Path:
    """Build with what is installed, as CI's `python -m build --no-isolation` does."""
    for tool in ("hatchling", "ziglang"):
        if find_spec(tool) is None:
            missing(f"{tool} is not installed")
    command = [sys.executable, "-m", "hatchling", "build", "-t", kind, "-d", str(output)]
    subprocess.run(command, cwd=tree, check=True, capture_output=True)
    (path,) = output.glob("*.whl" if kind == "wheel" else "*.tar.gz")
    return path


def tree(folder: str, *suffixes: str) -> set[str]:
    """Files of the tree below a folder that belong in a wheel, relative to it."""
    return {
        path.relative_to(ROOT / folder).as_posix()
        for path in (ROOT / folder).rglob("*")
        if path.suffix in suffixes and not {"__pycache__", "locomotive_train"} & {*path.parts}
    }


def inside(wheel: Wheel, folder: str) -> set[str]:
    start = f"{folder}/"
    return {name.removeprefix(start) for name in wheel.files if name.startswith(start)}


def test_it_has_the_package_and_what_describes_it(wheel: Wheel) -> None:
    assert {name.partition("/")[0] for name in wheel.files} == {"contactlib", wheel.info}
    described = {"METADATA", "WHEEL", "RECORD", "entry_points.txt", "licenses/LICENSE"}
    assert inside(wheel, wheel.info) == described
    assert wheel.described("licenses/LICENSE") == (ROOT / "LICENSE").read_bytes()
    assert wheel.described("entry_points.txt").decode().split() == [
        *("[console_scripts]", "contactlib", "=", "contactlib.cli.entry:main")
    ]


def test_its_modules_are_those_of_the_package(wheel: Wheel) -> None:
    expected = tree("contactlib", ".py")
    modules = {n for n in inside(wheel, "contactlib") if n.endswith(".py")}
    assert modules == expected | {"fmu/build_hook.py", "fmu/source_token.py"}
    assert not [name for name in wheel.files if re.search(r"test|conftest|source/|\.pyc", name)]


def test_its_other_files_are_those_of_the_tree(wheel: Wheel) -> None:
    kinds = {
        "fmu": (".c", ".h", ".inc", ".md", ".py"),
        "models": (".toml", ".csv", ".png", ".md"),
        "table/data": (".bin",),
        "files/templates": (".toml",),
        "export/assets": (".html", ".css", ".svg", ".png", ".txt", ".c", ".cs", ".h", ".mo"),
    }
    for folder, suffixes in kinds.items():
        source = folder if folder in FOLDERS else f"contactlib/{folder}"
        assert inside(wheel, f"contactlib/{folder}") == tree(source, *suffixes)
    folders = rf"({'|'.join(kinds)}|_native)/|.*\.py$"
    rest = {n for n in inside(wheel, "contactlib") if not re.match(folders, n)}
    assert rest == {"README.md", "py.typed", "export/explorer.html", "export/explorer.wasm.zlib"}
    for name, data in wheel.files.items():
        _, _, below = name.partition("/")
        if name.startswith("contactlib/") and not LIBRARY.fullmatch(name):
            outside = below.startswith(("fmu/", "models/"))
            place = (ROOT if outside else ROOT / "contactlib") / below
            assert data == place.read_bytes(), name


def test_its_libraries_are_those_of_its_platforms(wheel: Wheel, tmp_path: Path) -> None:
    """Its own, or those of all; each for the platform of its folder, and of these sources."""
    matches = {name: LIBRARY.fullmatch(name) for name in wheel.files if "_native/" in name}
    platforms = {match[1] for match in matches.values() if match}
    platform = TAGS[wheel.path.stem.split("-")[-1]]
    assert len(platforms) == len(matches)
    assert platforms in ({platform}, set(PLATFORMS))
    for name, match in matches.items():
        assert match
        (tmp_path / "library").write_bytes(wheel.files[name])
        (library,) = libraries(tmp_path / "library")
        assert library.platform == match[1]
        assert kernel.token().encode() in wheel.files[name], name
    about = message_from_bytes(wheel.described("WHEEL"))
    assert about["Tag"] == f"py3-none-{wheel.path.stem.split('-')[-1]}"
    assert about["Root-Is-Purelib"] == "false"


def test_the_record_is_right(wheel: Wheel) -> None:
    rows = list(csv.reader(io.StringIO(wheel.described("RECORD").decode())))
    assert sorted(name for name, _, _ in rows) == sorted(wheel.files)
    for name, digest, size in rows:
        if name == f"{wheel.info}/RECORD":
            assert (digest, size) == ("", "")
            continue
        data = wheel.files[name]
        encoded = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).decode().rstrip("=")
        assert (digest, int(size)) == (f"sha256={encoded}", len(data)), name


def test_it_requires_what_the_project_lists(wheel: Wheel) -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    about: Any = message_from_bytes(wheel.described("METADATA"))
    expected = {(None, required(text)) for text in project["dependencies"]}
    for extra in project["optional-dependencies"]:
        expected |= {(extra, required(text)) for text in expanded(project, extra)}
    required_by = set()
    for text in about.get_all("Requires-Dist"):
        requirement, _, marker = text.partition(";")
        extra = re.fullmatch(r" *extra == '(\w+)'", marker)
        required_by.add((extra[1] if extra else None, required(requirement)))
        assert bool(extra) == bool(marker)
    assert required_by == expected
    assert (about["Name"], about["Version"]) == (project["name"], project["version"])
    assert about["Requires-Python"] == project["requires-python"]
    assert about["License-Expression"] == project["license"]
    stem = project["name"].replace("-", "_")
    assert wheel.path.name.startswith(f"{stem}-{project['version']}-py3-none-")


def required(text: str) -> tuple[str, str]:
    requirement = Requirement(text)
    return requirement.name, str(requirement.specifier)


def expanded(project: dict[str, Any], extra: str) -> set[str]:
    """What an extra requires, where it names others of the same project too."""
    requirements: set[str] = set()
    for text in project["optional-dependencies"][extra]:
        requirement = Requirement(text)
        others = requirement.extras if requirement.name == project["name"] else ()
        requirements |= set().union(*(expanded(project, o) for o in others)) if others else {text}
    return requirements


def test_nothing_names_the_machine_that_built_it(wheel: Wheel) -> None:
    names = {socket.gethostname(), getpass.getuser(), *map(str, wheel.folders), str(Path.home())}
    long = [name.encode() for name in names if len(name) > 7]  # others are words
    for name, data in wheel.files.items():
        if LIBRARY.fullmatch(name):
            assert not MACHINE.search(data), name
        for other in long:
            assert other not in data, name


def test_its_entries_have_no_time_and_no_rights_of_a_machine(wheel: Wheel) -> None:
    with zipfile.ZipFile(wheel.path) as archive:
        for entry in archive.infolist():
            assert entry.date_time == (2020, 2, 2, 0, 0, 0), entry.filename
            assert (entry.external_attr >> 16) & 0o7777 in (0o644, 0o755), entry.filename


@pytest.mark.slow
def test_the_source_distribution_gives_the_same_wheel(
    wheel_of_the_tree: Wheel, tmp_path: Path
) -> None:
    """In another folder, at another time."""
    first = wheel_of_the_tree.path
    with tarfile.open(built(copied_tree(tmp_path / "here"), tmp_path, "sdist")) as archive:
        archive.extractall(tmp_path / "elsewhere", filter="data")
    (there,) = (tmp_path / "elsewhere").iterdir()
    assert (there / "tools" / "half_space.py").is_file()  # which no wheel holds
    again = built(there, tmp_path / "again")
    assert first.name == again.name
    assert first.read_bytes() == again.read_bytes()
