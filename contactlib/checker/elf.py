"""Shared libraries of Linux."""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from typing import NamedTuple

from contactlib.checker.library import Library, Version, text_at

MAGICS = (b"\x7fELF",)
MACHINES = {3: "x86", 40: "aarch32", 62: "x86_64", 183: "aarch64"}
SHARED = 3
DYNAMIC, NOT_IN_FILE, SYMBOLS, NEEDED_VERSIONS = 6, 8, 11, 0x6FFFFFFE
MOST_VERSIONS = 10_000
DT_NEEDED = 1
GLOBAL, WEAK = 1, 2
DEFAULT, PROTECTED = 0, 3


class _Section(NamedTuple):
    kind: int
    contents: bytes
    strings: int
    """Number of the section that holds the names which this one uses."""


def read(data: bytes) -> list[Library]:
    """Read one ELF file."""
    wide, order = data[4] == 2, "<" if data[5] == 1 else ">"
    kind, machine = struct.unpack_from(f"{order}HH", data, 16)
    sections = _sections(data, wide, order)

    def names(section: _Section) -> bytes:
        return sections[section.strings].contents

    exports, needed, glibc = set(), [], []
    for section in sections:
        if section.kind == SYMBOLS:
            exports |= set(_exports(section.contents, names(section), wide, order))
        elif section.kind == DYNAMIC:
            entries = struct.iter_unpack(f"{order}{'qQ' if wide else 'iI'}", section.contents)
            needed += [text_at(names(section), value) for tag, value in entries if tag == DT_NEEDED]
        elif section.kind == NEEDED_VERSIONS:
            glibc += list(_glibc_versions(section.contents, names(section), order))
    name = MACHINES.get(machine, f"machine_{machine}")
    oldest = ("glibc", max(glibc)) if glibc else None
    return [Library(f"{name}-linux", kind == SHARED, frozenset(exports), tuple(needed), oldest)]


def _sections(data: bytes, wide: bool, order: str) -> list[_Section]:
    (start,) = struct.unpack_from(f"{order}{'Q' if wide else 'I'}", data, 40 if wide else 32)
    size, count = struct.unpack_from(f"{order}HH", data, 58 if wide else 46)
    layout = f"{order}{'IIQQQQIIQQ' if wide else '10I'}"
    sections, total = [], 0
    for number in range(count):
        header = struct.unpack_from(layout, data, start + number * size)
        kind, offset, length, link = header[1], header[4], header[5], header[6]
        length = 0 if kind == NOT_IN_FILE else length
        total += length
        if total > len(data):
            raise ValueError("its sections are longer than the file")
        sections.append(_Section(kind, data[offset : offset + length], link))
    return sections


def _exports(symbols: bytes, names: bytes, wide: bool, order: str) -> Iterator[str]:
    for symbol in struct.iter_unpack(f"{order}{'IBBHQQ' if wide else 'IIIBBH'}", symbols):
        info, visibility, section = symbol[1:4] if wide else symbol[3:6]
        if info >> 4 in (GLOBAL, WEAK) and section and visibility & 3 in (DEFAULT, PROTECTED):
            yield text_at(names, symbol[0])


def _glibc_versions(needs: bytes, names: bytes, order: str) -> Iterator[Version]:
    """Versions of the chain of library records, each with a chain of versions."""
    library = known = 0
    while True:
        _, count, _, version, following = struct.unpack_from(f"{order}HHIII", needs, library)
        version += library
        known += count
        if known > MOST_VERSIONS:
            raise ValueError(f"it needs more than {MOST_VERSIONS} versions")
        for _ in range(count):
            _, _, _, name, next_version = struct.unpack_from(f"{order}IHHII", needs, version)
            if found := re.fullmatch(r"GLIBC_(\d+(?:\.\d+)*)", text_at(names, name)):
                yield tuple(int(part) for part in found[1].split("."))
            version += next_version
        if not following:
            return
        library += following
