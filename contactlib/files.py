"""Where the package's own files are, and writing files so that nothing is ever half written."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

PACKAGE = Path(__file__).resolve().parent


def package_folder(name: str) -> Path:
    """Folder ``fmu`` or ``models``: inside an installed package, beside it in a checkout."""
    inside = PACKAGE / name
    return inside if inside.is_dir() else PACKAGE.parent / name


def write_whole(path: str | os.PathLike[str], data: bytes) -> Path:
    """Write `data` beside `path`, then rename: `path` is the old file or the new one, whole.

    Raises
    ------
    OSError
        If the folder cannot be written; a file that stood at `path` is unchanged.
    """
    path = Path(path)
    try:
        descriptor, beside = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    except OSError as error:
        error.filename = os.fspath(path)  # the name that was asked for
        raise
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(data)
        mask = os.umask(0o077)  # threads share it: meanwhile their files are private, not public
        os.umask(mask)
        os.chmod(beside, 0o666 & ~mask)  # mkstemp makes files private
        os.replace(beside, path)
    except BaseException:
        Path(beside).unlink(missing_ok=True)
        raise
    return path
