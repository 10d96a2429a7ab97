"""What a shared library says of itself, whatever the platform it is for."""

from __future__ import annotations

from typing import NamedTuple

Version = tuple[int, ...]
LONGEST_NAME = 256


class Library(NamedTuple):
    """One library, for one processor."""

    platform: str
    """FMI 3 platform tuple, such as ``x86_64-linux``."""
    is_shared: bool
    exports: frozenset[str]
    needed: tuple[str, ...]
    oldest_system: tuple[str, Version] | None
    """What it runs on at least, such as ``("glibc", (2, 17))``; None if it does not say."""


def text_at(data: bytes, offset: int) -> str:
    """Text up to its terminating zero, or as much of it as can tell names apart.

    Names may overlap, so that all of them together would be much longer than the file.
    """
    end = data.find(b"\0", offset, offset + LONGEST_NAME)
    if end < 0:
        end = offset + LONGEST_NAME
        if end > len(data):
            raise ValueError("a name does not end")
    return data[offset:end].decode(errors="replace")
