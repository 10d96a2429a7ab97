"""What a shared library says of itself, whatever the platform it is for."""

from __future__ import annotations

import struct
from typing import NamedTuple

Version = tuple[int, ...]


class Library(NamedTuple):
    """One library, for one processor."""

    platform: str
    """FMI 3 platform tuple, such as ``x86_64-linux``."""
    is_shared: bool
    exports: frozenset[str]
    needed: tuple[str, ...]
    oldest_system: tuple[str, Version] | None
    """What it runs on at least, such as ``("glibc", (2, 17))``; None if it does not say."""


def read_libraries(data: bytes) -> list[Library]:
    """Read an ELF, PE or Mach-O file; a universal Mach-O file holds several libraries.

    Raises
    ------
    ValueError
        If `data` is none of these, or is not whole.
    """
    from contactlib.checker import elf, mach_o, pe

    for magics, kind, read in (
        (elf.MAGICS, "ELF", elf.read),
        (pe.MAGICS, "PE", pe.read),
        (mach_o.MAGICS, "Mach-O", mach_o.read),
    ):
        if data.startswith(magics):
            try:
                return read(data)
            except (struct.error, IndexError, OverflowError, ValueError) as error:
                raise ValueError(f"is no whole {kind} file: {error}") from None
    raise ValueError("is neither an ELF, nor a PE, nor a Mach-O file")


def text_at(data: bytes, offset: int) -> str:
    """Text up to its terminating zero."""
    return data[offset : data.index(b"\0", offset)].decode(errors="replace")
