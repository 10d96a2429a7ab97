"""The zip itself: what a tool meets before it can read anything."""

from __future__ import annotations

import lzma
import os
import stat
import struct
import zipfile
import zlib
from bisect import bisect_left
from collections import Counter
from collections.abc import Iterator, Mapping
from typing import NamedTuple

FMI_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
MOST_UNPACKED = 2**30  # of all files together [byte]; a zip can unpack to a thousand times its size
# What `zipfile` raises of bytes that are no zip.
UNREADABLE = (
    zipfile.BadZipFile, zlib.error, lzma.LZMAError, struct.error,
    EOFError, OSError, IndexError, OverflowError, ValueError,
)  # fmt: skip


class Archive(NamedTuple):
    """Contents of every whole file by its name, and what is wrong with the zip."""

    files: Mapping[str, bytes]
    problems: list[str]


def read_archive(path: str | os.PathLike[str]) -> Archive:
    """Read all files of a zip.

    Raises
    ------
    ValueError
        If `path` is not a zip file, or unpacks to more than `MOST_UNPACKED`.
    """
    try:
        archive = zipfile.ZipFile(path)
    except UNREADABLE as error:
        if isinstance(error, OSError) and error.filename is not None:
            raise  # the file cannot be read
        raise ValueError(f"{os.fspath(path)} is not a zip file: {error}") from None
    with archive:
        entries = [entry for entry in archive.infolist() if not entry.filename.endswith("/")]
        size = sum(entry.file_size for entry in entries)
        if size > MOST_UNPACKED:
            raise ValueError(
                f"{os.fspath(path)} unpacks to {size} bytes: must be <= {MOST_UNPACKED}"
            )
        problems = list(_bad_names([entry.orig_filename for entry in archive.infolist()]))
        problems += [f"{e.filename}: is a symbolic link" for e in entries if _is_link(e)]
        problems += [
            f"{e.orig_filename!r}: has another name too, {e.filename!r}"
            for e in archive.infolist()
            if e.filename != e.orig_filename  # of an extra field, or cut off
        ]
        files = {}
        for entry in entries:
            if entry.compress_type not in FMI_METHODS:
                problems.append(
                    f"{entry.filename}: compression method {entry.compress_type} must be "
                    "0 (stored) or 8 (deflate)"
                )
            try:
                files[entry.filename] = _contents(archive, entry)
            except (NotImplementedError, RuntimeError) as error:  # method or encryption
                problems.append(f"{entry.filename}: cannot be unpacked: {error}")
            except UNREADABLE as error:
                problems.append(f"{entry.filename}: damaged: {error}")
    return Archive(files, problems)


def _contents(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> bytes:
    """All of a file, unpacking no more than the zip says that there is."""
    with archive.open(entry) as file:
        found = file.read(entry.file_size)
        file.read(1)  # at its end the checksum is compared
    return found


def _is_link(entry: zipfile.ZipInfo) -> bool:
    return stat.S_ISLNK(entry.external_attr >> 16)


def _bad_names(names: list[str]) -> Iterator[str]:
    seen: dict[str, str] = {}
    ordered = sorted(names)
    for name, times in Counter(names).items():
        # Unpacking must stay in its folder, on every system.
        parts = name.removesuffix("/").split("/")
        if name.startswith("/") or ".." in parts or "\\" in name or ":" in name:
            yield f"{name}: the path must be relative, without '..', '\\' and ':'"
        if not name.isprintable():
            yield f"{name!r}: the path must be without control characters"
        if {"", "."} & set(parts):
            yield f"{name!r}: the path must be without empty parts and '.'"
        # A set of all folders could be long: one name can have 30 000 of them.
        next_one = bisect_left(ordered, f"{name}/")
        if next_one < len(ordered) and ordered[next_one].startswith(f"{name}/"):
            yield f"{name}: is a file and a folder"
        if times > 1:
            yield f"{name}: is in the zip {times} times"
        # Windows and macOS take names that differ in case for one file.
        if (first := seen.setdefault(name.casefold(), name)) != name:
            yield f"{name}: differs from {first} in nothing but case"
