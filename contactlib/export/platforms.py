"""The native libraries that an FMU carries, and where importers look for them.

FMI 3 has one folder for each platform, named by the platform's tuple. FMI 2 (from 2.0.4 on) uses
these tuples too, except for the folders it has always had: there ``linux64``, ``win64`` and
``darwin64`` mean x86_64. Most importers never learned of the tuples and look into these folders
on an Arm processor as well, so an Arm library stands in both places where that is possible.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence

from contactlib import kernel

PLATFORMS = ("x86_64-linux", "aarch64-linux", "x86_64-windows", "x86_64-darwin", "aarch64-darwin")
FMI3_FOLDERS = {name: (name,) for name in PLATFORMS}

# A macOS folder holds one file for all its platforms, any other the first one that is asked for.
FMI2_FOLDERS = {
    "linux64": ("x86_64-linux", "aarch64-linux"),
    "aarch64-linux": ("aarch64-linux",),
    "win64": ("x86_64-windows",),
    "darwin64": ("x86_64-darwin", "aarch64-darwin"),
    "aarch64-darwin": ("aarch64-darwin",),
}

UNIVERSAL_MAGIC = 0xCAFEBABE
SLICE_ALIGNMENT = 14  # power of two: a page of macOS on Arm


def binaries(
    platforms: Sequence[str] | None, fmi_version: int, model_identifier: str
) -> dict[str, bytes]:
    """Members of an FMU below ``binaries/``, by path.

    Parameters
    ----------
    platforms : sequence of str, optional
        FMI 3 platform tuples, such as ``"x86_64-linux"``; ``"all"`` stands for all of them. This
        machine's if left out.
    fmi_version : {2, 3}
        Version of the standard, which names the folders.
    model_identifier : str
        Name of the files.

    Returns
    -------
    dict of str to bytes
        The members; their order does not depend on that of `platforms`.

    Raises
    ------
    ValueError
        If a platform is unknown, or its library is not built or was built from other sources; the
        message names the command that builds it.
    """
    libraries = _libraries(_wanted(platforms))
    members = {}
    for folder, served in (FMI2_FOLDERS if fmi_version == 2 else FMI3_FOLDERS).items():
        found = [name for name in served if name in libraries]
        if found:
            suffix = kernel.library_path(found[0]).suffix
            slices = [libraries[name] for name in found]
            data = universal(slices) if folder == "darwin64" else slices[0]
            members[f"binaries/{folder}/{model_identifier}{suffix}"] = data
    return members


def _wanted(platforms: Sequence[str] | None) -> list[str]:
    if platforms is None:
        platforms = [kernel.platform_name()]
    names = [platforms] if isinstance(platforms, str) else list(platforms)
    known = f"must be of {', '.join(PLATFORMS)}, or all"
    if not names:
        raise ValueError(f"platforms is empty, {known}")
    for name in names:
        if name not in (*PLATFORMS, "all"):
            raise ValueError(f"platforms holds {name!r}, {known}")
    return [name for name in PLATFORMS if name in names or "all" in names]


def _libraries(names: list[str]) -> dict[str, bytes]:
    """Library of each platform, every one built from the sources of the one that runs here."""
    paths = {name: kernel.library_path(name) for name in names}
    missing = [name for name, path in paths.items() if not path.is_file()]
    if missing:
        raise ValueError(_refusal(missing, "not built", missing))
    found = {name: path.read_bytes() for name, path in paths.items()}
    # The token is a string inside each library, which is never run here.
    stale = [name for name, data in found.items() if kernel.token().encode() not in data]
    if stale:
        # Which of the two is old cannot be seen, so both are built.
        both = list(dict.fromkeys([kernel.platform_name(), *stale]))
        raise ValueError(_refusal(stale, "built from other C sources than this machine's", both))
    return found


def _refusal(names: list[str], fault: str, to_build: list[str]) -> str:
    listed = ", ".join(repr(name) for name in names)
    return (
        f"platforms holds {listed}, whose library is {fault}; in a checkout, "
        f"'python fmu/build_hook.py {' '.join(to_build)}' builds it"
    )


def universal(slices: Sequence[bytes]) -> bytes:
    """One macOS library of several processors', or the only one as it is.

    Each Mach-O file says itself which processor it is for: after its magic number.
    """
    if len(slices) == 1:
        return slices[0]
    page = 1 << SLICE_ALIGNMENT
    header = struct.pack(">II", UNIVERSAL_MAGIC, len(slices))
    body = b""
    for data in slices:
        processor, variant = struct.unpack_from("<II", data, 4)
        body += bytes(-len(body) % page)
        # The header takes the first page.
        header += struct.pack(
            ">IIIII", processor, variant, page + len(body), len(data), SLICE_ALIGNMENT
        )
        body += data
    return header.ljust(page, b"\0") + body
