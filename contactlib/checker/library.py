"""What a shared library says of itself, whatever the platform it is for."""

from __future__ import annotations

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


def text_at(data: bytes, offset: int) -> str:
    """Text up to its terminating zero."""
    return data[offset : data.index(b"\0", offset)].decode(errors="replace")
