"""The native libraries of an FMU, and the folders in which importers look for them.

FMI 3 has one folder for each platform, named by the platform's tuple. FMI 2 (from 2.0.4 on) uses
these tuples too, besides its older folders ``linux64``, ``win64`` and ``darwin64``, which mean
x86_64. Most importers do not support the tuples and use the older folders on an Arm processor as
well, so the export puts an Arm library into both folders where that is possible.

An installation contains this machine's library, a release wheel those of all platforms. The export
compiles missing ones from the C sources in the installation, with the compiler of the extra
``platforms``, and stores them in the user's cache.
"""

from __future__ import annotations

import hashlib
import importlib.util
import struct
import subprocess
import tempfile
from collections.abc import Sequence
from importlib import metadata
from pathlib import Path
from typing import Any

from contactlib import kernel
from contactlib.base.writing import keep_in_cache, package_folder, user_cache

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

_HOOK = package_folder("fmu") / "build_hook.py"
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
        If a platform is unknown, or its library is missing and there is no compiler; the message
        names the command that installs it.
    """
    libraries = _libraries(_checked(platforms))
    members = {}
    for folder, served in (FMI2_FOLDERS if fmi_version == 2 else FMI3_FOLDERS).items():
        available = [name for name in served if name in libraries]
        if available:
            suffix = kernel.library_path(available[0]).suffix
            slices = [libraries[name] for name in available]
            data = universal(slices) if folder == "darwin64" else slices[0]
            members[f"binaries/{folder}/{model_identifier}{suffix}"] = data
    return members


def _checked(platforms: Sequence[str] | None) -> list[str]:
    if platforms is None:
        platforms = [kernel.platform_name()]
    names = [platforms] if isinstance(platforms, str) else list(platforms)
    known = f"must be one of: {', '.join(PLATFORMS)}, all"
    if not names:
        raise ValueError(f"platforms = [] {known}")
    for name in names:
        if name not in (*PLATFORMS, "all"):
            raise ValueError(f"platforms = {name!r} {known}")
    return [name for name in PLATFORMS if name in names or "all" in names]


def _libraries(names: list[str]) -> dict[str, bytes]:
    """Library of each platform, all of the same sources as this machine's."""
    lacking = to_compile(names)
    available = {name: _compiled(name) if name in lacking else _found(name) for name in names}
    return {name: data for name, data in available.items() if data is not None}


def to_compile(platforms: Sequence[str] | None) -> list[str]:
    """Platforms whose library an export has to compile first.

    Raises
    ------
    ValueError
        If a platform is unknown, or there is no compiler.
    """
    names = [name for name in _checked(platforms) if _found(name) is None]
    if names and not _has_compiler():
        raise ValueError(
            f"platforms contains {', '.join(map(repr, names))}, whose library is not in this "
            "installation; pip install 'contactlib-rail[platforms]' installs the compiler for it"
        )
    return names


def _found(name: str) -> bytes | None:
    installed = _read(kernel.library_path(name))
    return _read(_cache(name)) if installed is None and _has_compiler() else installed


def _read(path: Path) -> bytes | None:
    """A library that is there and was built from the same sources as this machine's."""
    data = path.read_bytes() if path.is_file() else b""
    # A library of another platform cannot run here, but contains the token as a string.
    return data if kernel.token().encode() in data else None


def _has_compiler() -> bool:
    return importlib.util.find_spec("ziglang") is not None


def _cache(name: str) -> Path:
    """Where the user's cache has the library: another compiler or other flags give another file."""
    compiler = metadata.version("ziglang").encode() + _HOOK.read_bytes()
    key = f"{kernel.token()}-{hashlib.sha256(compiler).hexdigest()[:16]}"
    return user_cache("libraries") / key / name / kernel.library_path(name).name


def _compiled(name: str) -> bytes:
    """Compile a library and keep it in the user's cache, if that can be written."""
    spec: Any = importlib.util.spec_from_file_location("build_hook", _HOOK)
    build = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(build)
    if build.source_token() != kernel.token():
        raise ValueError(
            f"the C sources in {_HOOK.parent} are not those of this machine's library; "
            f"'python {_HOOK}' builds it again"
        )
    with tempfile.TemporaryDirectory() as scratch:
        library = Path(scratch) / kernel.library_path(name).name
        try:
            build.compile_library(name, library)
        except subprocess.CalledProcessError as error:
            raise RuntimeError(f"the library for {name} cannot be compiled: {error}") from None
        data = library.read_bytes()
    keep_in_cache(_cache(name), data)
    return data


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
