"""Readers of files from a stranger: right, or refused in one line; never anything else."""

from __future__ import annotations

import datetime
import io
import struct
import tomllib
import tracemalloc
import warnings
import zipfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest
import xarray
from broken_files import (
    MODELS,
    READERS,
    changed,
    kind_of,
    places,
    refusal,
    refused_library,
    toml_file,
)
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from test_checker_binaries import elf, mach_o, pe

import contactlib as cl
from contactlib.checker import check_fmu
from contactlib.checker.archive import read_archive
from contactlib.checker.libraries import read_libraries
from contactlib.checker.xml import parse
from contactlib.sweep.dataset import read_dataset, write_dataset

FILES = sorted((*MODELS.glob("*.toml"), *MODELS.glob("*.csv")))
IDS = [path.name for path in FILES]
TOML = [path for path in FILES if path.suffix == ".toml"]
few = settings(
    derandomize=True,
    deadline=None,
    max_examples=60,
    database=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)

WORDS = ["", "5 mm", "5 kN", "nan", "1e999 m", "\0", "a\nb", "..", "/x.toml", "x" * 5000, "\u2028"]
WORDS += [path.name for path in TOML]
NUMBERS = [0, -1, 1, 2**63, 10**400, 10**9, 0.0, -0.0, 1e-320, 1e308, -1e308]
DAY = datetime.date(2000, 2, 29)
VALUES = st.recursive(
    st.sampled_from([*WORDS, *NUMBERS, float("nan"), float("inf"), True, False, DAY])
    | st.floats()
    | st.integers(),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(st.sampled_from(["values", "count", "x", "a\nb"]), inner, max_size=3)
    ),
    max_leaves=6,
)


def test_shipped_files_are_read() -> None:
    for path in FILES:
        assert refusal(kind_of(path), path) is None


@few
@given(data=st.data())
def test_changed_models_scenarios_and_sweeps(data: st.DataObject, tmp_path: Path) -> None:
    path = data.draw(st.sampled_from(TOML))
    contents = tomllib.loads(path.read_text(encoding="utf-8"))
    for _ in range(data.draw(st.integers(1, 3))):
        where = list(places(contents))
        how = data.draw(
            st.sampled_from(["replace", "replace", "replace", "drop", "nest", "rename"])
        )
        if where:
            changed(contents, data.draw(st.sampled_from(where)), how, data.draw(VALUES))
    made = tmp_path / "made.toml"
    made.write_text(toml_file(contents), encoding="utf-8")
    for kind in ("model", "scenario", "sweep"):
        refusal(kind, made)


@few
@given(data=st.data())
def test_changed_lines(data: st.DataObject, tmp_path: Path) -> None:
    path = data.draw(st.sampled_from(FILES))
    lines = path.read_bytes().splitlines(keepends=True)
    for _ in range(data.draw(st.integers(1, 4))):
        place, other = (data.draw(st.integers(0, len(lines) - 1)) for _ in range(2))
        how = data.draw(st.sampled_from(["twice", "swap", "cut", "bytes"]))
        if how == "twice":
            lines.insert(place, lines[other])
        elif how == "swap":
            lines[place], lines[other] = lines[other], lines[place]
        elif how == "cut":
            lines[place] = lines[place][: len(lines[place]) // 2]
        else:
            lines[place] += data.draw(st.binary(max_size=8))
    made = tmp_path / "made.toml"
    made.write_bytes(b"".join(lines))
    refusal(kind_of(path), made)


@pytest.mark.parametrize("kind", READERS)
@few
@given(data=st.binary(max_size=200))
def test_any_bytes(kind: str, data: bytes, tmp_path: Path) -> None:
    path = tmp_path / "made"
    path.write_bytes(data)
    said = refusal(kind, path)
    assert said is not None or kind == "csv"


@few
@given(
    rows=st.lists(
        st.lists(
            st.sampled_from(["0.1", "-1", "1e999", "nan", "x\r", "", '"1"', "\x0c1"]), max_size=4
        ),
        max_size=4,
    ),
    head=st.sampled_from(
        ["creepage,traction_coefficient", "speed,creepage,traction_coefficient", "x", "creepage"]
    ),
)
def test_any_columns(rows: list[list[str]], head: str, tmp_path: Path) -> None:
    path = tmp_path / "made.csv"
    path.write_text("\n".join([head, *map(",".join, rows)]), encoding="utf-8", newline="")
    refusal("csv", path)


# ---- sizes ---------------------------------------------------------------------------------


SWEEP = tomllib.loads((MODELS / "friction_and_load_sweep.toml").read_text(encoding="utf-8"))


def sweep_with(**axis: object) -> str:
    """The shipped sweep with these keys in each axis."""
    return toml_file(SWEEP | {"axes": {name: v | axis for name, v in SWEEP["axes"].items()}})


MANY = {
    "counts": (sweep_with(count=10**9), "count = 1000000000 must be a whole number"),
    "points": (sweep_with(count=10**6), "the grid has 1000000000000 points: at most 10000000"),
    "deep lists": (f"x = {'[' * 100_000}", "nested too deeply"),
    "deep tables": (f"x = {'{a=' * 100_000}", "nested too deeply"),
    "long names": (f"{'x' * 100_000} = 1", "..."),
    "long lists": (toml_file(SWEEP | {"outcomes": {"x": [0.5] * 100_000}}), "outcomes = {'x'"),
    "names of two lines": (r'"a\nb" = 1', r"a\nb is not a known key"),
    "texts of two lines": (
        toml_file(SWEEP | {"axes": "a\r\x1b\nb"}),
        r"'a\r\x1b\nb' must be a section",
    ),
    "huge numbers": (f"axes = 0x{'f' * 100_000}", ""),
}


@pytest.mark.parametrize("name", MANY)
def test_large_and_odd_contents(name: str, tmp_path: Path) -> None:
    text, said = MANY[name]
    path = tmp_path / "made.toml"
    path.write_text(text, encoding="utf-8")
    for kind in ("model", "scenario"):
        assert refusal(kind, path) is not None
    assert said in str(refusal("sweep", path))


def test_long_profile_is_read(tmp_path: Path) -> None:
    contents = tomllib.loads((MODELS / "dry_wet_dry.toml").read_text(encoding="utf-8"))
    contents["track"]["distance"] = [float(i) for i in range(100_000)]
    contents["track"]["friction"] = [1.0] * 100_000
    contents["vehicle"] = "locomotive.toml"
    path = tmp_path / "long.toml"
    path.write_text(toml_file(contents), encoding="utf-8")
    assert refusal("scenario", path) is None


# ---- tables and FMUs -----------------------------------------------------------------------


def test_tables_are_refused_with_their_name(table: cl.CreepForceTable, tmp_path: Path) -> None:
    path = tmp_path / "made.bin"
    for size in range(0, len(table.data), 7):
        path.write_bytes(table.data[:size])
        assert refusal("table", path) is not None
        with pytest.raises(ValueError, match=r"file|table"):
            cl.CreepForceTable(table.data[:size])


@pytest.fixture(scope="module")
def exported(rig: cl.Model, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A small FMU, without libraries."""
    path = cl.export_fmu(rig, tmp_path_factory.mktemp("readers") / "x.fmu")
    made = io.BytesIO()
    with zipfile.ZipFile(path) as whole, zipfile.ZipFile(made, "w") as small:
        for name in whole.namelist():
            if name.endswith((".xml", ".bin")):
                small.writestr(name, whole.read(name), zipfile.ZIP_DEFLATED)
    return made.getvalue()


@settings(few, max_examples=20)
@given(data=st.data())
def test_broken_fmus(data: st.DataObject, exported: bytes, tmp_path: Path) -> None:
    """Bytes of the zip's own structures are changed, or it is cut."""
    broken = bytearray(exported)
    starts = [i for i in range(len(broken) - 64) if broken[i : i + 2] == b"PK"]
    for _ in range(data.draw(st.integers(1, 4))):
        place = data.draw(st.sampled_from(starts)) + data.draw(st.integers(0, 63))
        broken[place] = data.draw(st.sampled_from([0, 1, 0x7F, 0xFF]) | st.integers(0, 255))
    if data.draw(st.integers(0, 4)) == 0:
        del broken[data.draw(st.integers(0, len(broken))) :]
    path = tmp_path / "made.fmu"
    path.write_bytes(broken)
    if refusal("fmu", path) is None:
        assert all(problem.isprintable() for problem in check_fmu(path))


def zipped(path: Path, name: str, data: bytes) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(name, data)
    return path


def test_fmus_that_lie_of_their_size_are_not_unpacked(tmp_path: Path) -> None:
    path = zipped(tmp_path / "x.fmu", "resources/x", bytes(100_000_000))
    data = bytearray(path.read_bytes())
    struct.pack_into("<I", data, data.index(b"PK\x01\x02") + 24, 10)
    path.write_bytes(data)
    tracemalloc.start()
    files, problems = read_archive(path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert files == {}
    assert problems[0].startswith("resources/x: damaged: ")
    assert peak < 5_000_000


@pytest.mark.parametrize("name", ["", ".", "a//b", "./a", "a/.", "a\nb", "\x1b[2J"])
def test_names_that_are_no_files(name: str, tmp_path: Path) -> None:
    path = zipped(tmp_path / "x.fmu", name or "#", b"")
    if not name:  # Python writes none: the letter becomes a note on the file
        data = bytearray(path.read_bytes())
        struct.pack_into("<HH", data, 26, 0, 1)
        struct.pack_into("<HH", data, data.index(b"PK\x01\x02") + 28, 0, 1)
        path.write_bytes(data)
    assert "the path must be " in check_fmu(path)[0]
    assert check_fmu(path)[0].isprintable()


def test_a_name_of_many_folders_takes_little_memory(tmp_path: Path) -> None:
    path = zipped(tmp_path / "x.fmu", f"{'a/' * 32_000}b", b"")
    tracemalloc.start()
    read_archive(path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 5_000_000


LAUGHS = "".join(f'<!ENTITY l{i} "{f"&l{i - 1};" * 10 if i else "ha"}">' for i in range(12))


@pytest.mark.parametrize(
    "body", ["<x>&l11;</x>", '<x a="&l11;"/>', "<x/>"], ids=["text", "attribute", "nowhere"]
)
def test_entities_are_refused(body: str) -> None:
    with pytest.raises(ValueError, match=r"document type|well-formed"):
        parse(f"<!DOCTYPE x [{LAUGHS}]>{body}".encode())


def test_external_entities_are_refused(tmp_path: Path) -> None:
    (tmp_path / "secret").write_text("secret")
    place = (tmp_path / "secret").as_uri()
    with pytest.raises(ValueError, match="document type"):
        parse(f'<!DOCTYPE x [<!ENTITY e SYSTEM "{place}">]><x>&e;</x>'.encode())


def test_broken_datasets(tmp_path: Path) -> None:
    path = tmp_path / "x.nc"
    write_dataset(xarray.Dataset({"slip_work": ("run", [0.0, 1.0], {"units": "J"})}), path)
    data = path.read_bytes()
    for place in range(len(data)):
        path.write_bytes(data[:place] + b"\xff" + data[place + 1 :])
        with suppress(ValueError), warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of xarray, about odd attributes
            read_dataset(path)


# ---- shared libraries ----------------------------------------------------------------------

MADE = {"elf": elf(), "pe": pe(), "mach_o": mach_o()}


@pytest.mark.parametrize("kind", MADE)
@few
@given(data=st.data())
def test_broken_libraries(kind: str, data: st.DataObject) -> None:
    broken = bytearray(MADE[kind])
    for _ in range(data.draw(st.integers(1, 4))):
        place = data.draw(st.integers(0, len(broken) - 4))
        number = data.draw(
            st.sampled_from([0, 1, 0x7FFFFFFF, 0xFFFFFFFF]) | st.integers(0, 1 << 31)
        )
        struct.pack_into("<I", broken, place, number)
    refused_library(bytes(broken))


def elf_of(*sections: tuple[int, bytes], overlap: int = 1) -> bytes:
    """ELF of these kinds of sections, each of which is listed so often; its names end nowhere."""
    body, table, at = b"", b"", 64
    for kind, contents in sections:
        entry = struct.pack("<IIQQQQIIQQ", 0, kind, 0, 0, at, len(contents), 0, 0, 0, 0)
        table += entry * overlap
        body += contents
        at += len(contents)
    count = len(table) // 64
    start = struct.pack(
        "<16sHHIQQQIHHHHHH", b"\x7fELF\2\1\1", 3, 62, 1, 0, 0, at, 0, 64, 0, 0, 64, count, 0
    )
    return start + body + table


def mach_o_of(trie: bytes, tables: int = 1) -> bytes:
    """Mach-O library with this table of exports, which it names so often."""
    start = 32 + 16 * tables
    header = struct.pack("<IIIIIIII", 0xFEEDFACF, 0x0100000C, 0, 6, tables, 16 * tables, 0, 0)
    return header + struct.pack("<IIII", 0x80000033, 16, start, len(trie)) * tables + trie


def chain(nodes: int) -> bytes:
    """Table of exports in which each node leads to the next."""
    found = []
    for number in range(nodes):
        at = 7 * (number + 1)
        steps = bytes([at & 0x7F | 0x80, at >> 7 & 0x7F | 0x80, at >> 14 & 0x7F | 0x80, at >> 21])
        found.append(b"\0\1\0" + steps)
    return b"".join([*found, b"\1\0\0"])


HUGE: dict[str, tuple[Callable[[], bytes], str]] = {
    "sections over each other": (
        lambda: elf_of((3, b"x" * 100_000), overlap=20_000),
        "sections are longer than the file",
    ),
    "versions without end": (
        lambda: elf_of((0x6FFFFFFE, struct.pack("<HHIII", 1, 60_000, 0, 0, 1) + bytes(100))),
        "more than 10000 versions",
    ),
    "sections of Windows": (
        lambda: MADE["pe"].replace(
            struct.pack("<H", 0x8664) + MADE["pe"][MADE["pe"].index(b"PE\0\0") + 6 :][:2],
            struct.pack("<HH", 0x8664, 60_000),
            1,
        ),
        "60000 sections: at most 96",
    ),
    "exports of Windows": (
        lambda: pe(exports=("x",) * 70_000),
        "70000 names: at most 65536",
    ),
    "imports of Windows": (lambda: pe(needed=("x",) * 5000), "more than 4096 libraries"),
    "tables of exports of macOS": (lambda: mach_o_of(b"", 3), "more than one table"),
    "nodes of such a table": (lambda: mach_o_of(chain(200_001)), "more than 200000 nodes"),
    "numbers in such a table": (lambda: mach_o_of(b"\x80" * 100_000), "is too long"),
    "parts of a universal library": (
        lambda: b"\xca\xfe\xba\xbe" + struct.pack(">I", 1 << 31),
        "parts: at most 16",
    ),
    "load commands": (
        lambda: MADE["mach_o"][:16] + struct.pack("<I", 1 << 31) + MADE["mach_o"][20:],
        "load commands: at most 4096",
    ),
}


@pytest.mark.parametrize("name", HUGE)
def test_libraries_that_would_take_forever(name: str) -> None:
    make, said = HUGE[name]
    with pytest.raises(ValueError, match=said):
        read_libraries(make())


def test_names_of_a_library_are_cut() -> None:
    symbol = b"".join(struct.pack("<IBBHQQ", i, 0x12, 0, 1, 0, 0) for i in range(1000))
    data = elf_of((3, b"x" * 100_000 + b"\0"), (11, symbol))
    (library,) = read_libraries(data)
    assert {len(name) for name in library.exports} == {256}
