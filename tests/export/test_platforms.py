"""The libraries in an FMU and in a wheel, with stand-ins for those that are not built here."""

from __future__ import annotations

import os
import shutil
import struct
import subprocess
import sys
from collections.abc import Callable
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any

import platformdirs
import pytest
from cffi import FFI
from fmu_proof import FOLDERS, SUFFIXES
from tree import installed

from contactlib import kernel
from contactlib.base.writing import package_folder
from contactlib.export import platforms
from contactlib.export.platforms import PLATFORMS, binaries, universal

X86_64, ARM64 = 0x01000007, 0x0100000C  # as macOS counts processors
PROCESSOR = {"x86_64-darwin": X86_64, "aarch64-darwin": ARM64}


def mach_o(processor: int, size: int, rest: bytes = b"") -> bytes:
    """The head of a Mach-O file: magic number, processor, its variant; and something after."""
    head = struct.pack("<III", 0xFEEDFACF, processor, 3)
    return (head + rest).ljust(size, b"\x55")


def stand_in(name: str, token: str) -> bytes:
    """Something that differs from platform to platform and holds the token inside."""
    rest = name.encode() + b"\0" + token.encode() + b"\0"
    return mach_o(PROCESSOR.get(name, 0), 20_000, rest)


@pytest.fixture
def libraries(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Path]:
    """A library of each platform, made of the installed sources."""
    paths = {}
    for name in PLATFORMS:
        paths[name] = tmp_path / name / kernel.library_path(name).name
        paths[name].parent.mkdir()
        paths[name].write_bytes(stand_in(name, kernel.token()))
    monkeypatch.setattr(kernel, "library_path", paths.__getitem__)
    return paths


@pytest.mark.parametrize("version", FOLDERS)
def test_each_version_has_its_folders(libraries: dict[str, Path], version: int) -> None:
    expected = {
        f"binaries/{folder}/Wheel{SUFFIXES[names[0].split('-')[1]]}": universal(
            [libraries[name].read_bytes() for name in names]
        )
        for folder, names in FOLDERS[version].items()
    }
    once = binaries(PLATFORMS, version, "Wheel")
    assert once == expected
    for names in ("all", ["all"], [*reversed(PLATFORMS), PLATFORMS[0]]):
        assert list(binaries(names, version, "Wheel").items()) == list(once.items())


@pytest.mark.parametrize("system", ["linux", "darwin"])
def test_fmi_2_for_arm_alone_is_also_where_importers_look(
    libraries: dict[str, Path], system: str
) -> None:
    name = f"aarch64-{system}"
    members = binaries([name], 2, "Wheel")
    assert {path.split("/")[1] for path in members} == {name, f"{system}64"}
    assert set(members.values()) == {libraries[name].read_bytes()}


def test_universal_file_holds_each_library_whole_and_aligned() -> None:
    slices = [mach_o(X86_64, 40_001, b"first"), mach_o(ARM64, 2 * 16_384, b"second")]
    slices.append(mach_o(18, 13))
    data = universal(slices)
    magic, count = struct.unpack_from(">II", data)
    assert (magic, count) == (0xCAFEBABE, 3)
    end = 8 + 20 * count
    for i, expected in enumerate(slices):
        processor, variant, offset, size, alignment = struct.unpack_from(">5I", data, 8 + 20 * i)
        assert (processor, variant) == struct.unpack_from("<II", expected, 4)
        assert data[offset : offset + size] == expected
        assert alignment == 14
        assert offset % 2**alignment == 0
        assert offset >= end
        assert not any(data[end:offset])
        end = offset + size
    assert len(data) == end


def test_one_library_is_not_wrapped() -> None:
    assert universal([mach_o(ARM64, 100)]) == mach_o(ARM64, 100)


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (
            ["x86_64-linux", "pdp11-unix"],
            r"platforms = 'pdp11-unix' must be one of: x86_64-linux, .*, all",
        ),
        ("linux64", "'linux64' must be one of"),
        (["all", ""], "'' must be one of"),
        ([], r"platforms = \[\] must be one of: x86_64-linux"),
    ],
)
def test_unknown_platforms_are_refused(names: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        binaries(names, 2, "Wheel")


# ---- what is missing ------------------------------------------------------------------------


@pytest.fixture
def compiler(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A compiler that writes stand-ins, with a cache of its own; returns its log."""
    log, cache = tmp_path / "log", tmp_path / "cache"
    hook = tmp_path / "fmu" / "build_hook.py"
    hook.parent.mkdir()
    hook.write_text(
        "from pathlib import Path\n"
        f"def source_token(): return {kernel.token()!r}\n"
        "def compile_library(name, library):\n"
        f"    with open({str(log)!r}, 'a') as file: file.write(name + ' ')\n"
        "    Path(library).write_bytes(name.encode() + source_token().encode())\n"
    )
    pytest.importorskip("ziglang")
    monkeypatch.setattr(platforms, "_HOOK", hook)
    monkeypatch.setattr(platformdirs, "user_cache_path", lambda *_, **__: cache)
    log.write_text("")
    return log


def test_missing_libraries_are_compiled_once_and_kept(
    libraries: dict[str, Path], compiler: Path
) -> None:
    for name in ("x86_64-windows", "aarch64-linux"):
        libraries[name].unlink()
    assert platforms.to_compile("all") == ["aarch64-linux", "x86_64-windows"]
    first = binaries("all", 3, "Wheel")
    expected = f"x86_64-windows{kernel.token()}".encode()
    assert first["binaries/x86_64-windows/Wheel.dll"] == expected
    assert platforms.to_compile("all") == []
    assert binaries("all", 3, "Wheel") == first
    assert compiler.read_text().split() == ["aarch64-linux", "x86_64-windows"]


def test_libraries_of_other_sources_or_flags_are_compiled_again(
    libraries: dict[str, Path], compiler: Path
) -> None:
    name = next(name for name in PLATFORMS if name != kernel.platform_name())
    libraries[name].write_bytes(stand_in(name, "0" * 32))
    binaries([name], 3, "Wheel")
    hook = compiler.parent / "fmu" / "build_hook.py"
    hook.write_text(hook.read_text() + "# other flags\n")
    binaries([name], 3, "Wheel")
    for path in (compiler.parent / "cache").rglob("contactlib.*"):
        path.write_bytes(b"of another release")
    binaries([name], 3, "Wheel")
    assert compiler.read_text().split() == [name] * 3


def test_without_the_extra_one_command_is_named(
    libraries: dict[str, Path], compiler: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    libraries["x86_64-windows"].unlink()
    libraries["aarch64-linux"].unlink()
    monkeypatch.setitem(sys.modules, "ziglang", None)
    with pytest.raises(ValueError, match="'aarch64-linux', 'x86_64-windows', whose") as caught:
        binaries("all", 3, "Wheel")
    assert str(caught.value).count("pip install 'contactlib-rail[platforms]'") == 1
    assert "python" not in str(caught.value)
    assert len(binaries(["x86_64-linux", "x86_64-darwin"], 3, "Wheel")) == 2
    assert compiler.read_text() == ""


def test_changed_sources_ask_for_a_new_library_here_first(
    libraries: dict[str, Path], compiler: Path
) -> None:
    libraries["x86_64-windows"].unlink()
    hook = compiler.parent / "fmu" / "build_hook.py"
    hook.write_text(hook.read_text().replace(kernel.token(), "0" * 32))
    with pytest.raises(ValueError, match=r"'python .*build_hook\.py' builds it again"):
        binaries("all", 3, "Wheel")


@pytest.mark.parametrize(
    ("package", "remedy"),
    [(".", "install the package again"), ("contactlib", r"'python .*build_hook\.py' builds it")],
)
def test_library_of_other_sources_is_not_loaded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, package: str, remedy: str
) -> None:
    library = import_module("contactlib.kernel.library")  # a function has this name too
    built, sources = kernel.library_path(kernel.platform_name()), tmp_path / "fmu"
    shutil.copytree(package_folder("fmu"), sources)
    with (sources / "kernel" / "drivetrain.h").open("a") as file:
        file.write("/* changed */\n")
    monkeypatch.setattr(library, "ffi", FFI())
    monkeypatch.setattr(library, "package_folder", lambda _: sources)
    monkeypatch.setattr(library, "library_path", lambda _: built)
    monkeypatch.setattr(library, "PACKAGE", tmp_path / package)
    with pytest.raises(ImportError, match=f"was built from other C sources than .*; {remedy}"):
        library._load.__wrapped__()


def test_failure_of_the_compiler_is_one_line(libraries: dict[str, Path], compiler: Path) -> None:
    libraries["x86_64-windows"].unlink()
    hook = compiler.parent / "fmu" / "build_hook.py"
    fails = "import subprocess\ndef compile_library(*_):\n    "
    fails += "raise subprocess.CalledProcessError(1, ['zig'])\n"
    hook.write_text(hook.read_text() + fails)
    with pytest.raises(RuntimeError, match=r"library for x86_64-windows cannot be compiled: .*zig"):
        binaries("all", 3, "Wheel")


# ---- the build ------------------------------------------------------------------------------


@pytest.fixture
def hook() -> ModuleType:
    pytest.importorskip("hatchling")
    spec = spec_from_file_location("build_hook", package_folder("fmu") / "build_hook.py")
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)  # whose functions see what a test puts in their place
    spec.loader.exec_module(module)
    return module


Wheel = Callable[..., dict[str, Any]]


@pytest.fixture
def wheel(hook: ModuleType, monkeypatch: pytest.MonkeyPatch) -> Wheel:
    """What the hook gives hatchling, under these environment variables; nothing is compiled."""

    def path(name: str) -> Path:
        return Path(hook.NATIVE) / name / f"contactlib{hook.TARGETS[name].suffix}"

    def build(**environment: str) -> dict[str, Any]:
        for name in ("CONTACTLIB_HOST", "CONTACTLIB_PLATFORMS"):
            monkeypatch.delenv(name, raising=False)
        for name, value in environment.items():
            monkeypatch.setenv(name, value)
        build_data: dict[str, Any] = {"artifacts": []}
        hook.NativeLibraryHook.initialize(None, "standard", build_data)
        build_data["artifacts"] = [Path(each).parts[-2] for each in build_data["artifacts"]]
        return build_data

    monkeypatch.setattr(hook, "build_library", path)
    return build


def test_the_build_and_the_export_know_the_same_platforms(hook: ModuleType) -> None:
    assert set(hook.TARGETS) == set(PLATFORMS)
    for name, target in hook.TARGETS.items():
        assert kernel.library_path(name).suffix == target.suffix


def test_a_wheel_carries_this_machine_s_library_and_no_other(wheel: Wheel) -> None:
    build_data = wheel()
    assert build_data["artifacts"] == [kernel.platform_name()]
    assert build_data["pure_python"] is False


def test_a_release_wheel_carries_all_libraries_and_its_platform_s_tag(wheel: Wheel) -> None:
    tags = set()
    for name in PLATFORMS:
        build_data = wheel(CONTACTLIB_HOST=name, CONTACTLIB_PLATFORMS="all")
        assert sorted(build_data["artifacts"]) == sorted(PLATFORMS)
        tags.add(build_data["tag"])
    assert len(tags) == len(PLATFORMS)
    build_data = wheel(CONTACTLIB_HOST="x86_64-windows", CONTACTLIB_PLATFORMS="aarch64-linux")
    assert build_data["artifacts"] == ["x86_64-windows", "aarch64-linux"]
    assert build_data["tag"] == "py3-none-win_amd64"


@pytest.mark.parametrize(
    "environment", [{"CONTACTLIB_HOST": "vax"}, {"CONTACTLIB_PLATFORMS": "all,vax"}]
)
def test_the_build_refuses_unknown_platforms(wheel: Wheel, environment: dict[str, str]) -> None:
    with pytest.raises(SystemExit, match=r"'vax'; known: x86_64-linux, .*"):
        wheel(**environment)


@pytest.mark.tools
@pytest.mark.skipif(sys.platform == "win32", reason="folders keep their rights")
def test_installed_package_in_a_folder_that_cannot_be_written_compiles_the_same_bits(
    hook: ModuleType, tmp_path: Path
) -> None:
    """As a wheel holds it: the sources inside, no other platform's library, and no hatchling."""
    name = next(
        name for name in PLATFORMS if name.endswith("linux") if name != kernel.platform_name()
    )
    package = installed(tmp_path / "site-packages", name)
    for path in (package, package.parent, package / "fmu", package / "_native"):
        path.chmod(0o555)
    script = (
        "import sys; sys.modules['hatchling'] = None\n"
        "from contactlib.export import platforms\n"
        "sys.stdout.buffer.write(platforms._libraries(sys.argv[1:])[sys.argv[1]])\n"
    )
    environment = {"PYTHONPATH": str(package.parent), "XDG_CACHE_HOME": str(tmp_path / "cache")}
    run = [sys.executable, "-c", script, name]
    done = subprocess.run(
        run, cwd=tmp_path, env=os.environ | environment, capture_output=True, check=False
    )
    assert done.returncode == 0, done.stderr.decode()
    hook.compile_library(name, tmp_path / "contactlib.so")
    assert done.stdout == (tmp_path / "contactlib.so").read_bytes()
    for path in (package.parent, package, package / "fmu", package / "_native"):
        path.chmod(0o755)
