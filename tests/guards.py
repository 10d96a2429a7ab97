"""Take one protection after another out of the code, and see the tests that stand for it fail.

    python tests/guards.py [NAME ...]

works on a copy of the package; a guard of ``fmu/`` is taken out of a library built anew. For each
guard its tests must pass with it and fail without. Prints the guard, the test and the first line of
its failure; exits with 1 if a test did not do so.
"""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

import contactlib
from contactlib.files import package_folder

TESTS = Path(__file__).resolve().parent


class Guard(NamedTuple):
    """A protection: its file, its text there, the text without it, and tests that miss it."""

    name: str
    file: str  # below contactlib/, or of fmu/ or tests/
    text: str
    without: str
    tests: str  # as pytest takes them, with -k


def source(file: str) -> Path:
    """Where a guard's file is, in a checkout or an installed package."""
    top, _, rest = file.partition("/")
    if top == "fmu":
        return package_folder("fmu") / rest
    return Path(contactlib.__file__).parent / rest if top == "contactlib" else TESTS / rest


FAULTS, AROUND = "test_faults.py", "test_surroundings.py"
GUARDS = [
    Guard(
        "written beside",
        "contactlib/files.py",
        'beside = path.with_name(f".{path.name[:40]}.{secrets.token_hex(8)}")',
        "beside = path",
        f"{FAULTS} -k 'old_file or kill or whole'",
    ),
    Guard(
        "nothing left beside",
        "contactlib/files.py",
        "        beside.unlink(missing_ok=True)\n        raise",
        "        raise",
        f"{FAULTS} -k 'old_file or no_space'",
    ),
    Guard(
        "names of full length",
        "contactlib/files.py",
        "path.name[:40]",
        "path.name",
        f"{FAULTS} -k any_name",
    ),
    Guard(
        "a name of its own beside",
        "contactlib/files.py",
        "{secrets.token_hex(8)}",
        "new",
        f"{FAULTS} -k two_that_write",
    ),
    Guard(
        "data on the disk before the rename",
        "contactlib/files.py",
        "            os.fsync(file.fileno())",
        "            file.fileno()",
        f"{FAULTS} -k on_the_disk",
    ),
    Guard(
        "name on the disk",
        "contactlib/files.py",
        "    _sync_folder(path.parent)",
        "    path.parent",
        f"{FAULTS} -k on_the_disk",
    ),
    Guard(
        "the file that was asked for is named",
        "contactlib/files.py",
        "raise OSError(error.errno, error.strerror, os.fspath(path)) from None",
        "raise",
        f"{FAULTS} -k 'names_it or no_space or folder_is'",
    ),
    Guard(
        "links stay",
        "contactlib/files.py",
        "Path(os.path.realpath(path)) if path.is_symlink() else path",
        "path",
        f"{FAULTS} -k link",
    ),
    Guard(
        "pipes and devices stay",
        "contactlib/files.py",
        "if path.exists() and not path.is_file():",
        "if path.is_dir():",
        f"{FAULTS} -k pipe_takes",
    ),
    Guard(
        "protected files stay",
        "contactlib/files.py",
        "if known and not os.access(path, os.W_OK):",
        "if not known and not os.access(path.parent, os.R_OK):",
        f"{FAULTS} -k without_write_permission",
    ),
    Guard(
        "rights stay",
        "contactlib/files.py",
        "            shutil.copymode(path, beside)",
        "            shutil.get_archive_formats()",
        f"{FAULTS} -k old_rights",
    ),
    Guard(
        "a lock that names nobody",
        "contactlib/sweep/lock.py",
        "                path.unlink()\n                raise",
        "                raise",
        f"{FAULTS} -k lock",
    ),
    Guard(
        "one start for one folder",
        "contactlib/sweep/lock.py",
        "os.O_WRONLY | os.O_CREAT | os.O_EXCL",
        "os.O_WRONLY | os.O_CREAT",
        "test_sweep_execution.py -k second_start",
    ),
    Guard(
        "the old comparison",
        "contactlib/report.py",
        "        if len(runs) == 1:",
        "        if len(runs) > 0:",
        f"{FAULTS} -k comparison",
    ),
    Guard(
        "what kills left of a plan",
        "contactlib/sweep/store.py",
        '*folder.glob(".plan.json.*")',
        "*()",
        f"{FAULTS} -k among_the_chunks",
    ),
    Guard(
        "checksum of a chunk",
        "contactlib/sweep/store.py",
        "if data[:CHECKSUM] != self._checksum(first, contents):",
        "if not data[:CHECKSUM]:",
        "test_sweep_execution.py -k damaged_chunk",
    ),
    Guard(
        "files are written in one place",
        "contactlib/comparison.py",
        'write_whole(Path(folder) / f"metrics.{suffix}", content.encode())',
        '[p := Path(folder) / f"metrics.{suffix}", p.write_bytes(content.encode())][0]',
        f"{FAULTS} -k 'other_module or metrics'",
    ),
    Guard(
        "zip entries have no date",
        "contactlib/export/package.py",
        "zipfile.ZipInfo(name, date_time=(1980, 1, 1, 0, 0, 0))",
        "zipfile.ZipInfo(name, date_time="
        "(t := __import__('time')).localtime(t.time() % 1e9 + 5e8)[:6])",
        f"{AROUND} -k do_not_know_the_time",
    ),
    Guard(
        "PDF has no date",
        "contactlib/figures/style.py",
        '"pdf": {"CreationDate": None}',
        '"pdf": {}',
        f"{AROUND} -k do_not_know_the_time",
    ),
    Guard(
        "SVG has no date",
        "contactlib/figures/style.py",
        '"svg": {"Date": None}',
        '"svg": {}',
        f"{AROUND} -k do_not_know_the_time",
    ),
    Guard(
        "endings of figures",
        "contactlib/figures/style.py",
        "    if kind not in UNDATED:",
        "    if kind is None:",
        f"{AROUND} -k another_ending",
    ),
    Guard(
        "time left by a clock that never jumps",
        "contactlib/cli.py",
        "        return time.monotonic() - self._start",
        "        return time.time() - self._start",
        f"{AROUND} -k time_left",
    ),
    Guard(
        "dot in messages of the FMU",
        "fmu/component.c",
        "    if (length == 0) return text;",
        "    if (length < 99) return text;",
        f"{AROUND} -k decimal_comma",
    ),
    Guard(
        "letters that a terminal has not",
        "contactlib/cli.py",
        'stream.reconfigure(errors="backslashreplace")',
        "stream.flush()",
        f"{AROUND} -k cannot_show",
    ),
    Guard(
        "broken pipe",
        "contactlib/cli.py",
        "isinstance(error, BrokenPipeError) and error.filename is None",
        "error is None",
        f"{AROUND} -k reader_that_has_gone",
    ),
    Guard(
        "SIGTERM",
        "contactlib/cli.py",
        "signal.signal(signal.SIGTERM, signal.default_int_handler)",
        "signal.getsignal(signal.SIGTERM)",
        f"{AROUND} -k asked_to_end",
    ),
    Guard(
        "one line",
        "contactlib/terminal.py",
        r"""harmless(text[: LONGEST_LINE + 1]).replace("\n", r"\n")""",
        "harmless(text[: LONGEST_LINE + 1])",
        f"{AROUND} -k one_line",
    ),
    Guard(
        "version of a table, in Python",
        "contactlib/kernel.py",
        "ffi.string(error).decode() + _versions(data)",
        "ffi.string(error).decode()",
        f"{AROUND} -k table_of_another",
    ),
    Guard(
        "older files",
        "fmu/checked_file.c",
        "if (found_version < version) return",
        "if (found_version + 9 < version) return",
        f"{AROUND} -k 'of_another_version and older'",
    ),
    Guard(
        "newer files",
        "fmu/checked_file.c",
        "if (found_version > version) return",
        "if (found_version > version + 9) return",
        f"{AROUND} -k 'of_another_version and newer'",
    ),
    Guard(
        "chunks of another plan",
        "contactlib/sweep/store.py",
        'if known.get("digest") != digest or',
        "if",
        f"{AROUND} -k 'another_contactlib and chunks'",
    ),
    Guard(
        "results of another plan",
        "contactlib/sweep/ensemble.py",
        'if known.attrs.get("plan_digest") != digest:',
        'if "plan_digest" not in known.attrs:',
        f"{AROUND} -k 'another_contactlib and nc'",
    ),
]


# ---- replaying ------------------------------------------------------------------------------


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


def outcome(folder: Path, tests: str) -> tuple[int, str]:
    """Exit status of pytest on the copy, and the first line of what failed."""
    options = ["-q", "-x", "-p", "no:cacheprovider", "--override-ini=addopts="]
    command = [sys.executable, "-m", "pytest", *options, "--import-mode=importlib"]
    done = subprocess.run(
        [*command, *shlex.split(f"tests/{tests}")],
        cwd=folder, capture_output=True, text=True, check=False,
        env={**os.environ, "PYTHONPATH": str(folder), "OPENBLAS_NUM_THREADS": "1"},
    )  # fmt: skip
    lines = (done.stdout + done.stderr).splitlines()
    # What says why stands behind an E; that a test was not even read stands nowhere else.
    said = next((line[1:].strip() for line in lines if line.startswith("E  ")), "")
    return done.returncode, said or (lines[-1] if lines else "")


def replay(guard: Guard, folder: Path) -> tuple[bool, str]:
    """Whether the tests fail without the guard, and what they say then."""
    path = folder / guard.file
    known = path.read_text()
    libraries = {p: p.read_bytes() for p in (folder / "contactlib" / "_native").rglob("*.so")}
    try:
        path.write_text(known.replace(guard.text, guard.without))
        if guard.file.startswith("fmu/"):
            command = [sys.executable, str(folder / "fmu" / "build_hook.py")]
            subprocess.run(command, check=True, capture_output=True, cwd=folder)
        status, said = outcome(folder, guard.tests)
    finally:
        path.write_text(known)
        for library, data in libraries.items():
            library.write_bytes(data)
    return status == 1, said if status == 1 else f"status {status}, must be 1: {said}"


def main(names: list[str]) -> int:
    """Replay the guards of these names, or all."""
    if unknown := set(names) - {guard.name for guard in GUARDS}:
        raise SystemExit(f"no such guard: {', '.join(sorted(unknown))}")
    chosen = [guard for guard in GUARDS if not names or guard.name in names]
    failed = 0
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        copied(folder)
        with_guards = {tests: outcome(folder, tests) for tests in {g.tests for g in chosen}}
        for guard in chosen:
            status, said = with_guards[guard.tests]
            missed, said = (
                replay(guard, folder) if status == 0 else (False, f"fails anyway: {said}")
            )
            failed += not missed
            mark = "" if missed else "NOT MISSED "
            print(f"{mark}{guard.name} | {guard.file} | {guard.tests} | {said}", flush=True)
    print(f"{len(chosen) - failed} of {len(chosen)} guards are missed by their tests")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
