"""What the FMU checker reads from shared libraries of every platform, and what it says of them.

Compilers for all of them are not at hand, so the smallest files that hold what is read are made
here; FMPy carries real ones.
"""

from __future__ import annotations

import struct
import zipfile
from pathlib import Path

import fmpy
import pytest

from contactlib import kernel
from contactlib.checker.binaries import binary_problems, needed_functions, oldest_systems
from contactlib.checker.libraries import read_libraries
from contactlib.checker.library import Library
from contactlib.checker.xml import parse

NAMES = ("fmi3DoStep", "other")


def elf(
    machine: int = 62,
    *,
    kind: int = 3,
    wide: bool = True,
    exports: tuple[str, ...] = NAMES,
    hidden: tuple[str, ...] = (),
    needed: tuple[str, ...] = ("libc.so.6",),
    versions: tuple[str, ...] = ("GLIBC_2.2.5", "GLIBC_2.17"),
) -> bytes:
    strings = b"\0"
    places = {}
    for name in (*exports, *hidden, *needed, *versions):
        places[name] = len(strings)
        strings += name.encode() + b"\0"

    def symbol(name: str, section: int, visibility: int) -> bytes:
        if wide:
            return struct.pack("<IBBHQQ", places[name], 0x12, visibility, section, 0, 0)
        return struct.pack("<IIIBBH", places[name], 0, 0, 0x12, visibility, section)

    symbols = b"".join(symbol(name, 1, 0) for name in exports)
    symbols += b"".join(symbol(name, 1, 2) + symbol(name, 0, 0) for name in hidden)
    pair = "<qQ" if wide else "<iI"
    dynamic = b"".join(struct.pack(pair, 1, places[name]) for name in needed)
    needs = struct.pack("<HHIII", 1, len(versions), 0, 16, 0)
    for number, name in enumerate(versions, start=1):
        following = 0 if number == len(versions) else 16
        needs += struct.pack("<IHHII", 0, 0, 0, places[name], following)
    header = 64 if wide else 52
    sections = [(0, b""), (3, strings), (11, symbols), (6, dynamic), (0x6FFFFFFE, needs)]
    body, table = b"", b""
    for number, contents in sections:
        entry = (0, number, 0, 0, header + len(body), len(contents), 1, 0, 0, 0)
        table += struct.pack("<IIQQQQIIQQ" if wide else "<10I", *entry)
        body += contents
    ident = b"\x7fELF" + bytes([2 if wide else 1, 1, 1]) + bytes(9)
    layout = "<HHIQQQIHHHHHH" if wide else "<HHIIIIIHHHHHH"
    size = len(table) // len(sections)
    place = header + len(body)
    rest = struct.pack(layout, kind, machine, 1, 0, 0, place, 0, header, 0, 0, size, 5, 1)
    return ident + rest + body + table


def pe(
    machine: int = 0x8664,
    *,
    flags: int = 0x2022,
    exports: tuple[str, ...] = NAMES,
    needed: tuple[str, ...] = ("KERNEL32.dll",),
) -> bytes:
    base = 0x1000
    names, imports = 40, 40 + 4 * len(exports)
    texts = imports + 20 * (len(needed) + 1)
    strings, places = b"", []
    for name in (*exports, *needed):
        places.append(base + texts + len(strings))
        strings += name.encode() + b"\0"
    body = struct.pack("<IIIIIIIIII", *[0] * 6, len(exports), 0, base + names, 0)
    body += struct.pack(f"<{len(exports)}I", *places[: len(exports)])
    for place in places[len(exports) :]:
        body += struct.pack("<IIIII", 0, 0, 0, place, 0)
    body += bytes(20) + strings
    directories = struct.pack("<IIII", base, 40, base + imports, 20) + bytes(8 * 14)
    wide = machine != 0x14C
    optional = struct.pack("<H", 0x20B if wide else 0x10B) + bytes(110 if wide else 94)
    optional += directories
    start = 64 + 24 + len(optional) + 40
    section = b".rdata\0\0" + struct.pack("<IIII", len(body), base, len(body), start) + bytes(16)
    coff = struct.pack("<HHIIIHH", machine, 1, 0, 0, 0, len(optional), flags)
    dos = b"MZ" + bytes(58) + struct.pack("<I", 64)
    return dos + b"PE\0\0" + coff + optional + section + body


def mach_o(
    machine: int = 0x0100000C,
    *,
    kind: int = 6,
    exports: tuple[str, ...] = NAMES,
    needed: tuple[str, ...] = ("/usr/lib/libSystem.B.dylib",),
    macos: tuple[int, int] = (11, 0),
    old_commands: bool = False,
) -> bytes:
    def long(number: int) -> bytes:
        return bytes([number & 0x7F | 0x80, number >> 7])

    # Names share the edge "_", so that the walk has to go down twice.
    edges = [(name.encode() + b"\0", name) for name in exports]
    root = b"\0\1_\0" + long(5 + 1)[:2]
    place = len(root) + 2 + sum(len(edge) + 2 for edge, _ in edges)
    inner, leaves = b"\0" + bytes([len(edges)]), b""
    for edge, _ in edges:
        inner += edge + long(place + len(leaves))
        leaves += b"\2\0\0\0"
    trie = root + inner + leaves

    commands = []
    for name in needed:
        text = name.encode() + b"\0"
        text += bytes(-len(text) % 8)
        commands.append(struct.pack("<IIIIII", 0xC, 24 + len(text), 24, 0, 0, 0) + text)
    version = macos[0] << 16 | macos[1] << 8
    if old_commands:
        commands.append(struct.pack("<IIII", 0x24, 16, version, 0))
    else:
        commands.append(struct.pack("<IIIIII", 0x32, 24, 1, version, 0, 0))
    size = 48 if old_commands else 16
    start = 32 + sum(map(len, commands)) + size
    if old_commands:
        commands.append(
            struct.pack("<II", 0x8000_0022, size) + bytes(32) + struct.pack("<II", start, len(trie))
        )
    else:
        commands.append(struct.pack("<IIII", 0x8000_0033, size, start, len(trie)))
    body = b"".join(commands)
    header = b"\xcf\xfa\xed\xfe" + struct.pack(
        "<IIIIIII", machine, 0, kind, len(commands), len(body), 0, 0
    )
    return header + body + trie


def universal(*parts: bytes) -> bytes:
    header = b"\xca\xfe\xba\xbe" + struct.pack(">I", len(parts))
    body = b""
    for part in parts:
        place = 8 + 20 * len(parts) + len(body)
        header += struct.pack(">IIIII", 0, 0, place, len(part), 0)
        body += part
    return header + body


# ---- reading --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("data", "platform", "needed", "oldest"),
    [
        (elf(), "x86_64-linux", "libc.so.6", ("glibc", (2, 17))),
        (elf(183), "aarch64-linux", "libc.so.6", ("glibc", (2, 17))),
        (elf(3, wide=False), "x86-linux", "libc.so.6", ("glibc", (2, 17))),
        (elf(8), "machine_8-linux", "libc.so.6", ("glibc", (2, 17))),
        (pe(), "x86_64-windows", "KERNEL32.dll", None),
        (pe(0xAA64), "aarch64-windows", "KERNEL32.dll", None),
        (pe(0x14C), "x86-windows", "KERNEL32.dll", None),
        (mach_o(), "aarch64-darwin", "/usr/lib/libSystem.B.dylib", ("macOS", (11, 0))),
        (
            mach_o(0x01000007, kind=8, macos=(10, 15), old_commands=True),
            "x86_64-darwin",
            "/usr/lib/libSystem.B.dylib",
            ("macOS", (10, 15)),
        ),
    ],
)
def test_made_libraries(
    data: bytes, platform: str, needed: str, oldest: tuple[str, tuple[int, ...]] | None
) -> None:
    assert read_libraries(data) == [Library(platform, True, frozenset(NAMES), (needed,), oldest)]


def test_hidden_and_wanted_symbols_are_no_exports() -> None:
    (library,) = read_libraries(elf(hidden=("fmi3Reset",)))
    assert library.exports == frozenset(NAMES)


@pytest.mark.parametrize("data", [elf(kind=2), pe(flags=0x22), mach_o(kind=2)])
def test_programs_are_no_libraries(data: bytes) -> None:
    (library,) = read_libraries(data)
    assert not library.is_shared


def test_universal_library_is_several() -> None:
    libraries = read_libraries(universal(mach_o(), mach_o(0x01000007)))
    assert [library.platform for library in libraries] == ["aarch64-darwin", "x86_64-darwin"]


@pytest.mark.parametrize(
    ("whole", "kind"),
    [(elf(), "ELF"), (pe(), "PE"), (mach_o(), "Mach-O"), (universal(mach_o()), "Mach-O")],
)
def test_cut_libraries_are_refused(whole: bytes, kind: str) -> None:
    refused = []
    for length in range(4, len(whole)):
        try:
            read_libraries(whole[:length])
        except ValueError as error:
            refused.append(str(error))
    assert len(refused) > len(whole) / 2
    assert all(said.startswith(f"is no whole {kind} file: ") for said in refused)


def test_table_of_exports_in_a_circle_is_refused() -> None:
    whole = mach_o(exports=("a",))
    circle = whole.replace(b"\0\1_\0" + bytes([0x86, 0]), b"\0\1_\0" + bytes([0x80, 0]))
    assert circle != whole
    with pytest.raises(ValueError, match="in a circle"):
        read_libraries(circle)


def test_other_files_are_no_libraries() -> None:
    with pytest.raises(ValueError, match="neither an ELF, nor a PE, nor a Mach-O"):
        read_libraries(b"#!/bin/sh")


@pytest.mark.parametrize(
    ("file", "platforms"),
    [
        ("linux64/logging.so", ["x86_64-linux"]),
        ("win64/logging.dll", ["x86_64-windows"]),
        ("win32/logging.dll", ["x86-windows"]),
        ("darwin64/logging.dylib", ["x86_64-darwin", "aarch64-darwin"]),
    ],
)
def test_real_libraries(file: str, platforms: list[str]) -> None:
    path = Path(fmpy.__file__).parent / "logging" / file
    if not path.is_file():
        pytest.skip("this FMPy carries no such library")
    libraries = read_libraries(path.read_bytes())
    assert [library.platform for library in libraries] == platforms
    for library in libraries:
        assert library.is_shared
        assert library.exports == {"addLoggerProxy"}


def test_own_library_exports_what_python_calls() -> None:
    path = kernel.library_path(kernel.platform_name())
    (library,) = read_libraries(path.read_bytes())
    assert library.platform == kernel.platform_name()
    assert {"contactlib_token", "creep_table_open"} <= library.exports


# ---- judging --------------------------------------------------------------------------------

ALL2 = tuple(sorted(needed_functions("CoSimulation", 2)))
ALL3 = tuple(sorted(needed_functions("CoSimulation", 3)))


def judged(version: int, folder: str, name: str, data: bytes, *others: str) -> list[str]:
    root = parse(
        f'<fmiModelDescription fmiVersion="{version}.0">'
        '<CoSimulation modelIdentifier="m"/></fmiModelDescription>'.encode()
    )
    files = {f"binaries/{folder}/{name}": data, **dict.fromkeys(others, b"")}
    return list(binary_problems(files, root, version))


@pytest.mark.parametrize(
    ("version", "folder", "name", "data"),
    [
        (2, "linux64", "m.so", elf(exports=ALL2)),
        (2, "linux64", "m.so", elf(183, exports=ALL2)),
        (2, "linux32", "m.so", elf(3, wide=False, exports=ALL2)),
        (2, "win64", "m.dll", pe(exports=ALL2)),
        (2, "win32", "m.dll", pe(0x14C, exports=ALL2)),
        (2, "darwin64", "m.dylib", mach_o(0x01000007, exports=ALL2)),
        (2, "darwin64", "m.dylib", universal(mach_o(exports=ALL2))),
        (2, "aarch64-linux", "m.so", elf(183, exports=ALL2)),
        (3, "x86_64-linux", "m.so", elf(exports=ALL3)),
        (3, "aarch64-linux", "m.so", elf(183, exports=ALL3)),
        (3, "x86_64-windows", "m.dll", pe(exports=ALL3)),
        (3, "aarch64-darwin", "m.dylib", mach_o(exports=ALL3)),
        (3, "x86_64-darwin", "m.dylib", universal(mach_o(), mach_o(0x01000007, exports=ALL3))),
    ],
)
def test_right_folders(version: int, folder: str, name: str, data: bytes) -> None:
    assert judged(version, folder, name, data) == []


@pytest.mark.parametrize(
    ("folder", "name", "data", "said"),
    [
        ("aarch64-linux", "m.so", elf(exports=ALL3), "is for x86_64-linux, must be for aarch64-l"),
        ("x86_64-linux", "m.so", pe(exports=ALL3), "is for x86_64-windows, must be for x86_64-lin"),
        (
            "x86_64-darwin",
            "m.dylib",
            mach_o(exports=ALL3),
            "is for aarch64-darwin, must be for x86_64-darwin",
        ),
        ("x86_64-linux", "m.so", elf(kind=2, exports=ALL3), "is no shared library"),
        ("x86_64-linux", "m.so", elf(exports=ALL3[1:]), f"does not export {ALL3[0]}"),
        (
            "x86_64-linux",
            "m.so",
            elf(exports=ALL3, needed=("libm.so.6", "libstdc++.so.6")),
            "needs libstdc++.so.6, which is neither in the FMU nor on every machine",
        ),
        (
            "x86_64-windows",
            "m.dll",
            pe(exports=ALL3, needed=("api-ms-win-crt-heap-l1-1-0.dll", "VCRUNTIME140.dll")),
            "needs VCRUNTIME140.dll, which is neither in the FMU nor on every machine",
        ),
        (
            "aarch64-darwin",
            "m.dylib",
            mach_o(exports=ALL3, needed=("@rpath/libother.dylib",)),
            "needs @rpath/libother.dylib, which is neither",
        ),
        (
            "x86_64-linux",
            "m.so",
            elf(exports=ALL3, versions=("GLIBC_2.17", "GLIBC_2.29", "GLIBC_2.4")),
            "needs glibc 2.29, must not need more than 2.28",
        ),
        (
            "aarch64-darwin",
            "m.dylib",
            mach_o(exports=ALL3, macos=(11, 1)),
            "needs macOS 11.1, must not need more than 11.0",
        ),
        ("x86_64-linux", "m.so", elf()[:80], "is no whole ELF file: "),
        ("x86_64-linux", "m.so", b"", "is neither an ELF, nor a PE, nor a Mach-O file"),
    ],
)
def test_wrong_libraries(folder: str, name: str, data: bytes, said: str) -> None:
    (found,) = judged(3, folder, name, data)
    assert found.startswith(f"binaries/{folder}/{name} {said}")


def test_newest_systems_that_are_allowed() -> None:
    newest = elf(exports=ALL3, versions=("GLIBC_2.28",))
    assert judged(3, "x86_64-linux", "m.so", newest) == []


def test_library_beside_is_in_the_fmu() -> None:
    data = elf(exports=ALL3, needed=("libother.so",))
    other = "binaries/x86_64-linux/libother.so"
    assert len(judged(3, "x86_64-linux", "m.so", data)) == 1
    assert judged(3, "x86_64-linux", "m.so", data, other) == []


@pytest.mark.parametrize(
    ("folder", "name", "data", "said"),
    [
        ("linux32", "m.so", elf(exports=ALL2), "is for x86_64-linux, must be for x86-linux"),
        ("win64", "m.dll", pe(0x14C), "is for x86-windows, must be for x86_64-windows or aarch64"),
        ("darwin64", "m.dylib", elf(), "is for x86_64-linux, must be for x86_64-darwin or aarch"),
    ],
)
def test_wrong_fmi2_folders(folder: str, name: str, data: bytes, said: str) -> None:
    (found,) = judged(2, folder, name, data)
    assert found.startswith(f"binaries/{folder}/{name} {said}")


def test_systems_are_named() -> None:
    files = {
        "binaries/linux64/m.so": elf(),
        "binaries/darwin64/m.dylib": universal(mach_o(), mach_o(0x01000007, macos=(10, 15))),
        "binaries/win64/m.dll": pe(),
        "binaries/win64/notes.txt": b"",
        "binaries/win64/other.dll": b"",
    }
    assert list(oldest_systems(files)) == [
        "darwin64 (macOS 10.15, macOS 11.0)",
        "linux64 (glibc 2.17)",
        "win64",
    ]


def test_folders_and_names() -> None:
    assert judged(3, "linux64", "m.so", elf(exports=ALL3)) == [
        "binaries/linux64 is no platform of FMI 3.0, nor of FMI 2.0 "
        "(linux32, linux64, win32, win64, darwin64)"
    ]
    assert judged(2, "linux64", "n.so", elf(exports=ALL2)) == ["binaries/linux64/m.so is missing"]


def test_cut_zip_is_one_line(tmp_path: Path) -> None:
    path = tmp_path / "cut.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", b"<x/>")
    path.write_bytes(path.read_bytes()[:-10])
    from contactlib.checker import check_fmu

    with pytest.raises(ValueError, match=r"cut\.fmu is not a zip file"):
        check_fmu(path)
