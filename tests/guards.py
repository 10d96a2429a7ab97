"""Take one protection after another out of the code, and see the tests that stand for it fail.

    python tests/guards.py [NAME ...]

works on a copy of the package; a guard of ``fmu/`` is taken out of a library built anew. The tests
of all guards must pass with them, and those of each must fail without it. Prints the guard, the
tests and the first line of their failure; exits with 1 if tests did not do so. Needs `os.fork`.
"""

from __future__ import annotations

import multiprocessing
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from importlib import import_module
from pathlib import Path

import pytest
from guard_table import GUARDS, Guard

import contactlib
from contactlib.files import package_folder

__all__ = ["GUARDS", "TESTS", "Guard", "source"]

TESTS = Path(__file__).resolve().parent
# What the tests' processes have from the start: they take longer to load than most tests to fail.
LOADED_ONCE = (
    *("control", "fmpy", "lxml.etree", "matplotlib.pyplot", "numpy"),
    *("scipy.integrate", "scipy.interpolate", "scipy.optimize", "xarray"),
)


def source(file: str) -> Path:
    """Where a guard's file is, in a checkout or an installed package."""
    top, _, rest = file.partition("/")
    if top == "fmu":
        return package_folder("fmu") / rest
    return Path(contactlib.__file__).parent / rest if top == "contactlib" else TESTS / rest


def copied(folder: Path) -> None:
    """A checkout without what is not needed, to `folder`."""
    plain = shutil.ignore_patterns("__pycache__", ".*_cache", "node_modules", "build")
    for name, found in {
        "contactlib": Path(contactlib.__file__).parent,
        "fmu": package_folder("fmu"),
        "models": package_folder("models"),
        "tests": TESTS,
    }.items():
        shutil.copytree(found, folder / name, ignore=plain, symlinks=True)
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        if (TESTS.parent / name).exists():
            shutil.copy(TESTS.parent / name, folder)


def run(folder: Path, said: Path, arguments: list[str]) -> None:
    """Run pytest on the copy, in a process of its own, whose exit status is pytest's."""
    with said.open("w") as file:
        os.dup2(file.fileno(), 1)
        os.dup2(file.fileno(), 2)
    os.chdir(folder)
    os.environ["PYTHONPATH"] = str(folder)
    sys.path.insert(0, str(folder))
    for name in [name for name in sys.modules if name.partition(".")[0] == "contactlib"]:
        del sys.modules[name]  # which is not the copy's
    options = ["-q", "-p", "no:cacheprovider", "--override-ini=addopts=", "-m", "not slow"]
    sys.exit(pytest.main([*options, "--import-mode=importlib", *arguments]))


def outcome(folder: Path, *arguments: str) -> tuple[int | None, str]:
    """Exit status of pytest on the copy, and the first line of what failed."""
    said = folder / "said.txt"
    process = multiprocessing.get_context("fork").Process(
        target=run, args=(folder, said, list(arguments))
    )
    process.start()
    process.join()
    lines = said.read_text(errors="replace").splitlines()
    # What says why stands behind an E; that a test was not even read stands nowhere else.
    why = next((line[1:].strip() for line in lines if line.startswith("E  ")), "")
    return process.exitcode, why or (lines[-1] if lines else "")


def with_all(folder: Path, guards: list[Guard]) -> tuple[int | None, str]:
    """Outcome of the tests of all these guards, with which nothing is wrong yet."""
    wanted: dict[str, set[str]] = {}
    for guard in guards:
        module, _, names = shlex.split(guard.tests)
        wanted.setdefault(module, set()).add(names)
    chosen = (f"{m} and ({' or '.join(f'({k})' for k in sorted(ks))})" for m, ks in wanted.items())
    return outcome(folder, *(f"tests/{module}" for module in wanted), "-k", " or ".join(chosen))


def without(guard: Guard, folder: Path) -> tuple[int | None, str]:
    """Outcome of the tests of a guard that is taken out."""
    path = folder / guard.file
    known = path.read_text()
    libraries = {p: p.read_bytes() for p in (folder / "contactlib" / "_native").rglob("*.so")}
    try:
        path.write_text(known.replace(guard.text, guard.without))
        if guard.file.startswith("fmu/"):
            command = [sys.executable, str(folder / "fmu" / "build_hook.py")]
            subprocess.run(command, check=True, capture_output=True, cwd=folder)
        return outcome(folder, "-x", *shlex.split(f"tests/{guard.tests}"))
    finally:
        path.write_text(known)
        for library, data in libraries.items():
            library.write_bytes(data)


def main(names: list[str]) -> int:
    """Replay the guards of these names, or all."""
    if unknown := set(names) - {guard.name for guard in GUARDS}:
        raise SystemExit(f"no such guard: {', '.join(sorted(unknown))}")
    chosen = [guard for guard in GUARDS if not names or guard.name in names]
    missed = 0
    os.environ["OPENBLAS_NUM_THREADS"] = "1"  # a process with threads must not be forked
    for name in LOADED_ONCE:
        import_module(name)
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        copied(folder)
        status, said = with_all(folder, chosen)
        if status != 0:
            raise SystemExit(f"tests fail with all guards there: {said}")
        # What is compiled of a file without its guard must not be taken for the file.
        os.environ["PYTHONDONTWRITEBYTECODE"] = "1"
        sys.dont_write_bytecode = True
        for guard in chosen:
            status, said = without(guard, folder)
            missed += status == 1
            mark = "" if status == 1 else f"NOT MISSED (status {status}) "
            print(f"{mark}{guard.name} | {guard.file} | {guard.tests} | {said}", flush=True)
    print(f"{missed} of {len(chosen)} guards are missed by their tests")
    return int(missed < len(chosen))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
