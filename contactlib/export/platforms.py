"""The native libraries of an FMU, and the folders in which importers look for them.

FMI 3 has one folder for each platform, named by the platform's tuple. FMI 2 (from 2.0.4 on) uses
these tuples too, besides its older folders ``linux64``, ``win64`` and ``darwin64``, which mean
x86_64. Most importers do not know the tuples and use the older folders on an Arm processor as well,
so an Arm library is put into both folders where that is possible.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence

from contactlib.contact import kernel

PLATFORMS = ("x86_64-linux", "aarch64-linux", "x86_64-windows", "x86_64-darwin", "aarch64-darwin")
FMI3_FOLDERS = {name: (name,) for name in PLATFORMS}

# darwin64 holds one file for all its platforms; any other folder holds the first one requested.
FMI2_FOLDERS = {
    "linux64": ("x86_64-linux", "aarch64-linux"),
    "aarch64-linux": ("aarch64-linux",),
    "win64": ("x86_64-windows",),
    "darwin64": ("x86_64-darwin", "aarch64-darwin"),
    "aarch64-darwin": ("aarch64-darwin",),
}

UNIVERSAL_MAGIC = 0xCAFEBABE
SLICE_ALIGNMENT = 14  # exponent of two: the page size of macOS on Arm


def binaries(
    platforms: Sequence[str] | None, fmi_version: int, model_identifier: str
) -> dict[str, bytes]:
    """Members of an FMU below ``binaries/``, by path.

    Parameters
    ----------
    platforms : sequence of str, optional
        FMI 3 platform tuples, such as ``"x86_64-linux"``; ``"all"`` means all of them. Default:
        this machine's.
    fmi_version : {2, 3}
        Version of the standard, which determines the folders.
    model_identifier : str
        Name of the files.

    Returns
    -------
    dict of str to bytes
        The members, in an order that does not depend on that of `platforms`.

    Raises
    ------
    ValueError
        If a platform is unknown, or its library is missing or was built from other sources; the
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
    known = f"must be one of {', '.join(PLATFORMS)}, or all"
    if not names:
        raise ValueError(f"platforms is empty, {known}")
    for name in names:
        if name not in (*PLATFORMS, "all"):
            raise ValueError(f"platforms holds {name!r}, {known}")
    return [name for name in PLATFORMS if name in names or "all" in names]


def _libraries(names: list[str]) -> dict[str, bytes]:
    """Library of each platform, all built from the same sources as this machine's."""
    paths = {name: kernel.library_path(name) for name in names}
    missing = [name for name, path in paths.items() if not path.is_file()]
    if missing:
        raise ValueError(_refusal(missing, "not built", missing))
    found = {name: path.read_bytes() for name, path in paths.items()}
    # A library of another platform cannot run here, but contains the token as a string.
    stale = [name for name, data in found.items() if kernel.token().encode() not in data]
    if stale:
        # Either of the two may be the old one, so both are built.
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
    """Join macOS libraries for several processors into one; return a single one unchanged.

    Each Mach-O file names its processor after its magic number.
    """
    if len(slices) == 1:
        return slices[0]
    page = 1 << SLICE_ALIGNMENT
    header = struct.pack(">II", UNIVERSAL_MAGIC, len(slices))
    body = b""
    for data in slices:
        processor, variant = struct.unpack_from("<II", data, 4)
        body += bytes(-len(body) % page)
        # The header occupies the first page.
        header += struct.pack(
            ">IIIII", processor, variant, page + len(body), len(data), SLICE_ALIGNMENT
        )
        body += data
    return header.ljust(page, b"\0") + body
