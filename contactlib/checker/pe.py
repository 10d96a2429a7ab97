"""Dynamic libraries of Windows."""

from __future__ import annotations

import struct
from collections.abc import Iterator

from contactlib.checker.library import Library, text_at

MAGICS = (b"MZ",)
MACHINES = {0x14C: "x86", 0x8664: "x86_64", 0xAA64: "aarch64"}
DLL = 0x2000
WIDE = 0x20B
EXPORTS, IMPORTS = 0, 1
MOST_SECTIONS, MOST_EXPORTS, MOST_IMPORTS = 96, 65_536, 4096  # the first two are Windows' own


def read(data: bytes) -> list[Library]:
    """Read one PE file."""
    return [_Image(data).library()]


class _Image:
    def __init__(self, data: bytes) -> None:
        self._data = data
        (start,) = struct.unpack_from("<I", data, 60)
        if data[start : start + 4] != b"PE\0\0":
            raise ValueError("the PE header is missing")
        header = struct.unpack_from("<HHIIIHH", data, start + 4)
        self._machine, sections, self._flags = header[0], header[1], header[6]
        optional, size = start + 24, header[5]
        (magic,) = struct.unpack_from("<H", data, optional)
        self._directories = optional + (112 if magic == WIDE else 96)
        if sections > MOST_SECTIONS:
            raise ValueError(f"it has {sections} sections: at most {MOST_SECTIONS}")
        # Size in memory, address, size in the file, place in the file.
        self._sections = [
            struct.unpack_from("<IIII", data, optional + size + 40 * number + 8)
            for number in range(sections)
        ]

    def library(self) -> Library:
        name = MACHINES.get(self._machine, f"machine_{self._machine:x}")
        exports, needed = frozenset(self._exports()), tuple(self._imports())
        return Library(f"{name}-windows", bool(self._flags & DLL), exports, needed, None)

    def _place(self, address: int) -> int:
        """Where in the file the loaded image's `address` stands."""
        for in_memory, first, in_file, place in self._sections:
            if first <= address < first + max(in_memory, in_file):
                return int(place + address - first)
        raise ValueError(f"no section holds address {address:#x}")

    def _text(self, address: int) -> str:
        return text_at(self._data, self._place(address))

    def _directory(self, number: int) -> int:
        return int(struct.unpack_from("<I", self._data, self._directories + 8 * number)[0])

    def _exports(self) -> Iterator[str]:
        if not (address := self._directory(EXPORTS)):
            return
        count, _, names = struct.unpack_from("<III", self._data, self._place(address) + 24)
        if count > MOST_EXPORTS:
            raise ValueError(f"it exports {count} names: at most {MOST_EXPORTS}")
        first = self._place(names) if count else 0
        for (name,) in struct.iter_unpack("<I", self._data[first : first + 4 * count]):
            yield self._text(name)

    def _imports(self) -> Iterator[str]:
        if not (address := self._directory(IMPORTS)):
            return
        place = self._place(address)
        for number in range(MOST_IMPORTS):
            (name,) = struct.unpack_from("<I", self._data, place + 20 * number + 12)
            if not name:
                return
            yield self._text(name)
        raise ValueError(f"it needs more than {MOST_IMPORTS} libraries")
