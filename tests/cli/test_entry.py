"""Ctrl-C at any moment: one line at most, and the exit status of a shell."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest
from sweep_files import UNCOUNTED, write_sweep

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")

# What is started behind a shell's & inherits an interrupt that is ignored; a user's does not.
CODE = """
import signal
signal.signal(signal.SIGINT, signal.default_int_handler)
from contactlib.cli.entry import main
print("ready", flush=True)
main()
"""
COMMANDS = {  # and about how long each takes [s]
    "new": (["new", "--list"], 0.5),
    "simulate": (["simulate", "dry_wet_dry.toml", "--compare", "-o", "out"], 3.0),
    "sweep": (["sweep", "quick.toml", "-o", "out", "--chunk", "1"], 3.0),
    "processes": (["sweep", "quick.toml", "-o", "out", "--processes", "--workers", "2"], 4.0),
    "tune": (["tune", "dry_wet_dry.toml", "threshold", "--trials", "60", "-o", "out"], 6.0),
}


def interrupted(command: list[str], folder: Path, after: float) -> tuple[int, str]:
    """Exit status in a shell, and stderr, of a command that gets Ctrl-C after a time [s]."""
    running = subprocess.Popen(
        [sys.executable, "-c", CODE, *command],
        cwd=folder,
        env=UNCOUNTED,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    assert running.stdout
    assert running.stdout.readline() == "ready\n"
    time.sleep(after)
    with suppress(ProcessLookupError):
        os.killpg(running.pid, signal.SIGINT)  # a terminal's goes to all processes
    _, err = running.communicate(timeout=60)
    # As Python ends, it has taken its handlers back, and the signal itself ends the process.
    return running.returncode if running.returncode >= 0 else 128 - running.returncode, err


@pytest.mark.slow
@pytest.mark.parametrize("name", COMMANDS)
def test_ctrl_c_is_one_line_at_most(tmp_path: Path, name: str) -> None:
    count = int(os.environ.get("CONTACTLIB_MOMENTS", "2"))
    command, takes = COMMANDS[name]
    if name in ("sweep", "processes"):
        write_sweep(tmp_path).rename(tmp_path / "quick.toml")
    rng = random.Random(f"{name} {count}")  # noqa: S311 - no secret
    for moment in range(count):
        folder = tmp_path / str(moment)
        folder.mkdir()
        for path in tmp_path.glob("*.toml"):
            (folder / path.name).write_bytes(path.read_bytes())
        after = takes * rng.random() ** 2  # more often while it imports
        status, err = interrupted(command, folder, after)
        assert len(err.splitlines()) <= 1, (after, err)
        assert "Traceback" not in err
        assert status in (130, 0), (after, err)  # zero if it had ended by then
        if err:
            assert (status, err) == (130, "contactlib: interrupted\n"), after
