"""Dynamic libraries of macOS."""

from __future__ import annotations

import struct
from collections.abc import Iterator

from contactlib.checker.library import LONGEST_NAME, Library, text_at

UNIVERSAL, UNIVERSAL_WIDE = b"\xca\xfe\xba\xbe", b"\xca\xfe\xba\xbf"
THIN = b"\xcf\xfa\xed\xfe"  # 64 bits, little endian: all that macOS runs today
MAGICS = (UNIVERSAL, UNIVERSAL_WIDE, THIN)
MACHINES = {0x0100_0007: "x86_64", 0x0100_000C: "aarch64"}
DYLIB, BUNDLE = 6, 8
LOADED_LIBRARIES = {0xC, 0x8000_0018, 0x8000_001F}
EXPORTS_TRIE, EXPORTS_IN_DYLD_INFO = 0x8000_0033, {0x22, 0x8000_0022}
OLDEST_MACOS, OLDEST_SYSTEM, MACOS = 0x24, 0x32, 1
MOST_PARTS, MOST_COMMANDS, MOST_NODES = 16, 4096, 200_000


def read(data: bytes) -> list[Library]:
    """Read one Mach-O file, thin or universal."""
    if data.startswith(THIN):
        return [_library(data)]
    layout = ">IIIII" if data.startswith(UNIVERSAL) else ">IIQQII"
    (count,) = struct.unpack_from(">I", data, 4)
    if count > MOST_PARTS:
        raise ValueError(f"it has {count} parts: at most {MOST_PARTS}")
    libraries = []
    for number in range(count):
        part = struct.unpack_from(layout, data, 8 + number * struct.calcsize(layout))
        offset, size = part[2], part[3]
        libraries.append(_library(data[offset : offset + size]))
    return libraries


def _library(data: bytes) -> Library:
    if not data.startswith(THIN):
        raise ValueError("a part is no 64-bit library")
    machine, _, kind, count = struct.unpack_from("<IIII", data, 4)
    if count > MOST_COMMANDS:
        raise ValueError(f"it has {count} load commands: at most {MOST_COMMANDS}")
    exports, needed, oldest = set(), [], None
    place, tries = 32, 0
    for _ in range(count):
        command, size = struct.unpack_from("<II", data, place)
        if size < 8:
            raise ValueError("a load command is too short")
        if command in LOADED_LIBRARIES:
            needed.append(text_at(data, place + struct.unpack_from("<I", data, place + 8)[0]))
        elif command == EXPORTS_TRIE or command in EXPORTS_IN_DYLD_INFO:
            at = place + (8 if command == EXPORTS_TRIE else 40)
            start, length = struct.unpack_from("<II", data, at)
            tries += 1
            if tries > 2:  # either kind once
                raise ValueError("it has more than one table of exports")
            exports |= set(_names(data[start : start + length]))
        elif command == OLDEST_MACOS:
            oldest = _version(data, place + 8)
        elif command == OLDEST_SYSTEM and struct.unpack_from("<I", data, place + 8)[0] == MACOS:
            oldest = _version(data, place + 12)
        place += size
    name = MACHINES.get(machine, f"machine_{machine:x}")
    is_shared = kind in (DYLIB, BUNDLE)
    return Library(f"{name}-darwin", is_shared, frozenset(exports), tuple(needed), oldest)


def _version(data: bytes, place: int) -> tuple[str, tuple[int, int]]:
    (number,) = struct.unpack_from("<I", data, place)
    return "macOS", (number >> 16, number >> 8 & 0xFF)


def _names(trie: bytes) -> Iterator[str]:
    """C names of a trie whose edges are pieces of names."""
    waiting, seen = [(0, b"")] if trie else [], set()
    while waiting:
        place, prefix = waiting.pop()
        if place in seen:
            raise ValueError("the table of exports runs in a circle")
        seen.add(place)
        if len(seen) + len(waiting) > MOST_NODES:
            raise ValueError(f"the table of exports has more than {MOST_NODES} nodes")
        size, place = _number(trie, place)
        if size:
            yield prefix.decode(errors="replace").removeprefix("_")
        place += size
        count, place = trie[place], place + 1
        for _ in range(count):
            end = trie.index(b"\0", place)
            child, following = _number(trie, end + 1)
            waiting.append(
                (child, (prefix + trie[place : min(end, place + LONGEST_NAME)])[:LONGEST_NAME])
            )
            place = following


def _number(trie: bytes, place: int) -> tuple[int, int]:
    """A number in steps of seven bits, and the place after it."""
    value = shift = 0
    while True:
        byte = trie[place]
        value |= (byte & 0x7F) << shift
        place, shift = place + 1, shift + 7
        if byte < 0x80:
            return value, place
        if shift > 63:
            raise ValueError("a number in the table of exports is too long")
