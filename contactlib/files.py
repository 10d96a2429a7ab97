"""Where the package's own files are, and writing files so that nothing is ever half written."""

from __future__ import annotations

import errno
import os
import secrets
import shutil
from contextlib import suppress
from pathlib import Path

PACKAGE = Path(__file__).resolve().parent


def package_folder(name: str) -> Path:
    """Folder ``fmu`` or ``models``: inside an installed package, beside it in a checkout."""
    inside = PACKAGE / name
    return inside if inside.is_dir() else PACKAGE.parent / name


def write_whole(path: str | os.PathLike[str], data: bytes) -> Path:
    """Write `data` beside `path`, then rename: `path` is the old file or the new one, whole.

    A link stays one, and the file that it leads to is replaced. A pipe or a device takes the bytes
    and keeps its place. A process that is killed may leave a hidden file that begins with a dot and
    the first letters of the name; nothing reads it, and it may be removed.

    Raises
    ------
    OSError
        If it cannot be written; the message names `path`, and a file that stood there is unchanged.
    """
    path = Path(path)
    try:
        if path.exists() and not path.is_file():
            path.write_bytes(data)  # a folder refuses
        else:
            _replace(Path(os.path.realpath(path)) if path.is_symlink() else path, data)
    except OSError as error:  # which may name the file beside, or none
        raise OSError(error.errno, error.strerror, os.fspath(path)) from None
    return path


def _replace(path: Path, data: bytes) -> None:
    # Names have an end (255 bytes, 4 of them a character at most), and so has the one beside.
    beside = path.with_name(f".{path.name[:40]}.{secrets.token_hex(8)}")
    known = path.exists()
    if known and not os.access(path, os.W_OK):  # a rename would not ask
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    try:
        with open(beside, "xb") as file:
            if known:
                shutil.copymode(path, beside)  # first: what is private stays so meanwhile
            file.write(data)
            file.flush()
            os.fsync(file.fileno())  # else a power cut after the rename can leave an empty file
        os.replace(beside, path)
    except BaseException:
        beside.unlink(missing_ok=True)
        raise
    _sync_folder(path.parent)


def _sync_folder(folder: Path) -> None:
    """Let the new name outlast a power cut too, where a system can; the file is whole anyway."""
    if os.name == "posix":
        with suppress(OSError):
            descriptor = os.open(folder, os.O_RDONLY)
            try:
                os.fsync(descriptor)
            finally:
                os.close(descriptor)
