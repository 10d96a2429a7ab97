"""Read a shared library of any platform."""

from __future__ import annotations

import struct

from contactlib.checker import elf, mach_o, pe
from contactlib.checker.library import Library


def read_libraries(data: bytes) -> list[Library]:
    """Read an ELF, PE or Mach-O file; a universal Mach-O file holds several libraries.

    Raises
    ------
    ValueError
        If `data` is none of these, or is not whole.
    """
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
