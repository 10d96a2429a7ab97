"""Files that the package writes, and what can go wrong meanwhile; a program of its own.

    python faults.py FOLDER [commands]

makes a process for each fault and each output (or each command that writes), as limits and rights
cannot be taken back, and prints as JSON what came of it: by fault and output the process's exit
status, its error, and the contents of its folder afterwards.
"""

from __future__ import annotations

import ctypes
import json
import os
import resource
import signal
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import xarray
from click.testing import CliRunner

from contactlib import figures
from contactlib.cli.commands import main
from contactlib.runs.result import Result
from contactlib.runs.sweep.ensemble import write_dataset

sys.path += map(str, (Path(__file__).parents[1], *Path(__file__).parents[1].iterdir()))

from sweep_files import write_sweep

OLD = b"old"
SMALL = 16  # bytes; every output has more
Writer = Callable[[Path], object]


def writers() -> dict[str, Writer]:
    """What writes a text and what writes bytes, by the file's name.

    All files are written by one function (tests/base/test_writing.py), and by a command each.
    """
    time = np.linspace(0.0, 1.0, 9)
    run = Result(time=time, signals={"creepage": 0.1 * time}, units={"creepage": "1"})
    dataset = xarray.Dataset({"slip_work": ("run", time, {"units": "J"})})
    return {"run.csv": run.to_csv, "results.nc": lambda path: write_dataset(dataset, path)}


def command(*arguments: str) -> Callable[[Path], object]:
    """A command that writes to a path; its error on failure is a `SystemExit`."""

    def run(path: Path) -> None:
        result = CliRunner().invoke(main, [*arguments, "-o", str(path)])
        if result.exit_code != 0:
            raise SystemExit(
                f"{result.exit_code} {type(result.exception).__name__} {result.stderr}"
            )

    return run


def commands(folder: Path) -> dict[str, Writer]:
    """Commands, by the first file or the folder that they write."""
    figures.STABILITY_FIGURES = {"poles": figures.STABILITY_FIGURES["poles"]}
    sweep = write_sweep(folder)

    def to_folder(*arguments: str) -> Writer:
        return lambda path: command(*arguments)(path.parent)

    return {
        "command.bin": command("table", "roller_rig.toml"),
        "command.fmu": command("fmu", "roller_rig.toml"),
        "command.ssp": command("fmu", "roller_rig.toml", "--ssp"),
        "command.html": command("explore", "--no-open"),
        "torque.csv": to_folder("simulate", "torque_or_creep_rig.toml"),
        "stability_poles.png": to_folder("figures", "--stability"),
        "quick_sweep.nc": to_folder("sweep", str(sweep), "--restart", "--no-maps"),
        "creep_table.bin": to_folder("demo"),
    }


HARD_LIMIT = resource.getrlimit(resource.RLIMIT_FSIZE)[1]


# ---- faults ---------------------------------------------------------------------------------


def disk_full() -> None:
    """No file grows beyond some bytes: the real error of a write, of a limit instead of a disk."""
    sys.dont_write_bytecode = True  # or an import leaves the head of its bytecode, for good
    resource.setrlimit(resource.RLIMIT_FSIZE, (SMALL, HARD_LIMIT))


def no_rights() -> None:
    """Of what root may do against a folder's permissions, nothing."""
    if os.geteuid() == 0:
        header = (ctypes.c_uint32 * 2)(0x20080522, 0)  # version 3, this process
        if ctypes.CDLL(None, use_errno=True).capset(header, (ctypes.c_uint32 * 6)()) != 0:
            raise OSError(ctypes.get_errno(), "capset")


def signalled(number: signal.Signals) -> Callable[[], None]:
    """The signal comes when the data are written, and not yet renamed."""

    def arm() -> None:
        if number == signal.SIGINT:  # which a shell's job in the background ignores
            signal.signal(number, signal.default_int_handler)
        setattr(os, "fsync", lambda descriptor: os.kill(os.getpid(), number))  # noqa: B010

    return arm


FAULTS: dict[str, Callable[[], None]] = {
    "full": disk_full,
    "read_only": no_rights,
    "SIGKILL": signalled(signal.SIGKILL),
    "SIGINT": signalled(signal.SIGINT),
}


# ---- processes ------------------------------------------------------------------------------


def apart(action: Callable[[], object]) -> tuple[int, str]:
    """Do it in a process of its own: exit status, negative for a signal, and what it raised."""
    inlet, outlet = os.pipe()
    child = os.fork()
    if child == 0:
        error = ""
        try:
            action()
        except BaseException as raised:
            error = f"{type(raised).__name__}: {raised}"
        os.write(outlet, error.encode())
        # Or what coverage saves now ends after as many bytes.
        resource.setrlimit(resource.RLIMIT_FSIZE, (HARD_LIMIT, HARD_LIMIT))
        os._exit(0)
    os.close(outlet)
    with os.fdopen(inlet) as pipe:
        error = pipe.read()
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), error


def contents(folder: Path) -> dict[str, str]:
    """Files of a folder: "old", or their size."""
    return {
        p.name: "old" if p.read_bytes() == OLD else str(p.stat().st_size)
        for p in sorted(folder.iterdir())
        if p.is_file() and p.name != "plan.json"
    }


def tried(fault: str, name: str, writer: Writer, folder: Path) -> dict[str, Any]:
    """What comes of a fault while an old file is replaced, and of the next try."""
    folder.mkdir(parents=True)
    (folder / name).write_bytes(OLD)
    if fault == "read_only":
        folder.chmod(0o555)

    def faulty() -> None:
        FAULTS[fault]()
        writer(folder / name)

    status, error = apart(faulty)
    observed = {
        "status": status,
        "error": error,
        "path": str(folder / name),
        "files": contents(folder),
    }
    folder.chmod(0o755)
    if fault == "SIGKILL":
        observed["next"] = apart(lambda: writer(folder / name)), contents(folder)
    return observed


def all_tried(folder: Path, by_command: bool) -> dict[str, dict[str, Any]]:
    """Signals with all outputs, or what a disk does with all commands."""
    if by_command:
        attempts, faults = commands(folder), ["full", "read_only"]
    else:
        attempts, faults = writers(), ["SIGKILL", "SIGINT"]
        for name, writer in attempts.items():  # so that nothing has to be imported any more
            writer(folder / name)
    return {
        fault: {
            name: tried(fault, name, writer, folder / fault / name)
            for name, writer in attempts.items()
        }
        for fault in faults
    }


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    json.dump(all_tried(Path(sys.argv[1]), sys.argv[2:] == ["commands"]), sys.stdout)
