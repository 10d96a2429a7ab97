"""Location of data files and of the user's cache, reading of small files, atomic writing."""

from __future__ import annotations

import errno
import os
import secrets
import shutil
from contextlib import suppress
from pathlib import Path

import platformdirs

PACKAGE = Path(__file__).resolve().parents[1]
C_SUFFIXES = (".c", ".h", ".inc")  # .inc: included several times, or under macros of the includer
MAX_BYTES = 2_000_000  # of a file that a user writes: what Python reads in a few seconds


def package_folder(name: str) -> Path:
    """Path of ``fmu`` or ``models``: inside an installed package, beside it in a checkout."""
    inside = PACKAGE / name
    return inside if inside.is_dir() else PACKAGE.parent / name


def c_sources(pattern: str = "*") -> list[Path]:
    """C sources of kernel and FMI shell whose names match, by name."""
    folders = (package_folder("fmu") / name for name in ("kernel", "fmi"))
    paths = (path for folder in folders for path in folder.glob(pattern))
    return sorted((p for p in paths if p.suffix in C_SUFFIXES), key=lambda p: p.name)


def read_small(path: Path, limit: int = MAX_BYTES) -> bytes:
    """Contents of a file, read up to a file size limit.

    Raises
    ------
    ValueError
        If it is too large.
    """
    with open(path, "rb") as file:
        data = file.read(limit + 1)
    if len(data) > limit:
        raise ValueError(f"the file is too large: it must have <= {limit / 1e6:g} MB")
    return data


def user_cache(name: str) -> Path:
    """Folder of this user's cache for results of long computations; it need not exist."""
    return platformdirs.user_cache_path("contactlib", appauthor=False) / name


def keep_in_cache(path: Path, data: bytes) -> None:
    """Write a file of the user's cache, if that can be written."""
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, data)


def write_whole(path: str | os.PathLike[str], data: bytes) -> Path:
    """Write a file atomically: `path` contains either the complete old or the complete new bytes.

    The data go to a temporary file in the same folder, which is then renamed. A symbolic link is
    kept and its target replaced; a pipe or a device is written directly. A killed process may
    leave a hidden temporary file (a dot and the start of the name), which can be deleted.

    Raises
    ------
    OSError
        If the file cannot be written; the message names `path`, and an existing file is unchanged.
    """
    path = Path(path)
    try:
        if path.exists() and not path.is_file():
            path.write_bytes(data)  # a folder refuses
        else:
            _replace(Path(os.path.realpath(path)) if path.is_symlink() else path, data)
    except OSError as error:  # may name the temporary file, or no file
        if not path.parent.is_dir():
            raise OSError(error.errno, "no such folder to write to", os.fspath(path)) from None
        raise OSError(error.errno, error.strerror, os.fspath(path)) from None
    return path


def _replace(path: Path, data: bytes) -> None:
    # File names are limited to 255 bytes, and a character takes up to 4.
    beside = path.with_name(f".{path.name[:40]}.{secrets.token_hex(8)}")
    known = path.exists()
    if known and not os.access(path, os.W_OK):  # a rename does not check this
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    try:
        with open(beside, "xb") as file:
            if known:
                shutil.copymode(path, beside)  # before writing: private data stay private
            file.write(data)
            file.flush()
            os.fsync(file.fileno())  # else a power cut after the rename can leave an empty file
        os.replace(beside, path)
    except BaseException:
        beside.unlink(missing_ok=True)
        raise
    _sync_folder(path.parent)


def _sync_folder(folder: Path) -> None:
    """Make the rename survive a power cut where the system can; the file is complete anyway."""
    if os.name == "posix":
        with suppress(OSError):
            descriptor = os.open(folder, os.O_RDONLY)
            try:
                os.fsync(descriptor)
            finally:
                os.close(descriptor)
