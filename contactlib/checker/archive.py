"""The zip itself: what a tool meets before it can read anything."""

from __future__ import annotations

import os
import zipfile
import zlib
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import PurePosixPath
from typing import NamedTuple

FMI_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)


class Archive(NamedTuple):
    """Contents of every whole file by its name, and what is wrong with the zip."""

    files: Mapping[str, bytes]
    problems: list[str]


def read_archive(path: str | os.PathLike[str]) -> Archive:
    """Read all files of a zip.

    Raises
    ------
    ValueError
        If `path` is not a zip file.
    """
    try:
        archive = zipfile.ZipFile(path)
    except zipfile.BadZipFile as error:
        raise ValueError(f"{os.fspath(path)} is not a zip file: {error}") from None
    with archive:
        entries = [entry for entry in archive.infolist() if not entry.is_dir()]
        problems = list(_bad_names([entry.orig_filename for entry in archive.infolist()]))
        files = {}
        for entry in entries:
            if entry.compress_type not in FMI_METHODS:
                problems.append(
                    f"{entry.filename}: compression method {entry.compress_type} must be "
                    "0 (stored) or 8 (deflate)"
                )
            try:
                files[entry.filename] = archive.read(entry)
            except (zipfile.BadZipFile, zlib.error, EOFError, OSError) as error:
                problems.append(f"{entry.filename}: damaged: {error}")
            except (NotImplementedError, RuntimeError) as error:  # method or encryption
                problems.append(f"{entry.filename}: cannot be unpacked: {error}")
    return Archive(files, problems)


def _bad_names(names: list[str]) -> Iterator[str]:
    seen: dict[str, str] = {}
    folders = {str(folder) for name in names for folder in PurePosixPath(name).parents}
    for name, times in Counter(names).items():
        # Unpacking must stay in its folder, on every system.
        if name.startswith("/") or ".." in name.split("/") or "\\" in name or ":" in name:
            yield f"{name}: the path must be relative, without '..', '\\' and ':'"
        if name in folders:
            yield f"{name}: is a file and a folder"
        if times > 1:
            yield f"{name}: is in the zip {times} times"
        # Windows and macOS take names that differ in case for one file.
        if (first := seen.setdefault(name.casefold(), name)) != name:
            yield f"{name}: differs from {first} in nothing but case"
