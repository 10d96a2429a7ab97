"""Files that a file names: a stranger's must not reach what is none of its own."""

from __future__ import annotations

from pathlib import Path, PureWindowsPath

from contactlib.files import package_folder


def file_beside(what: str, name: str, folder: Path, of: str) -> Path:
    """A file that another names: beside it or below its folder or, failing that, a shipped one.

    Parameters
    ----------
    what : str
        What the message calls it.
    name : str
        As the other file has it, with the separators of any system.
    folder : Path
        Of the other file. Symbolic links are followed, but not out of it.
    of : str
        What the message calls the other file.

    Raises
    ------
    ValueError
        If there is no plain file of this name, or the name leads elsewhere.
    """
    meant = PureWindowsPath(name)  # knows both kinds of separator, and drives
    if meant.anchor or ".." in meant.parts:
        raise ValueError(f"{what} must lie beside {of} or below: no absolute path, no '..'")
    for place in (folder, package_folder("models")):
        if (place / name).is_file():  # a device or a pipe is none
            if not (place / name).resolve().is_relative_to(place.resolve()):
                raise ValueError(f"{what} must lie beside {of} or below: a link leads elsewhere")
            return place / name
    raise ValueError(f"no such file, neither beside {of} nor among the shipped models")
