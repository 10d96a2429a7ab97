"""One process at a time for one output: a file that says who has it."""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

NAME = "lock"
_held: set[Path] = set()  # by this process


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Have a folder to oneself: made if it is not there, removed afterwards if it is empty.

    A lock that a dead process of this host left behind is taken over.

    Raises
    ------
    RuntimeError
        If another has the folder; the message says who, and what to do if that is not so.
    OSError
        If the folder cannot be made or written.
    """
    path = folder.resolve() / NAME
    _take(path)
    _held.add(path)
    try:
        yield
    finally:
        _held.discard(path)
        path.unlink(missing_ok=True)
        with suppress(OSError):  # there is something else in it
            path.parent.rmdir()


def _take(path: Path) -> None:
    mine = json.dumps({"host": platform.node(), "pid": os.getpid()}).encode()
    while True:
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666)
        except FileExistsError:
            _remove_stale(path)
        except FileNotFoundError:  # the one before has just removed the folder
            continue
        else:
            try:
                with os.fdopen(descriptor, "wb") as file:
                    file.write(mine)
            except BaseException as error:  # or a lock that names nobody would stay for ever
                path.unlink(missing_ok=True)
                if isinstance(error, OSError):
                    raise OSError(error.errno, error.strerror, os.fspath(path)) from None
                raise
            return


def _remove_stale(path: Path) -> None:
    """Remove the lock of a dead process; refuse to if it lives, or nobody here can know."""
    try:
        data = path.read_bytes()
    except FileNotFoundError:  # just released
        return
    host, pid = _owner(data)
    if host != platform.node() or _lives(pid, path):
        who = f"process {pid} on {host}" if host else "another process"
        raise RuntimeError(
            f"{path.parent} is in use by {who}, which runs this sweep; if that is not so any "
            f"more, remove {path}"
        )
    # Two that find it stale must not remove each other's new one: only one can move it away.
    aside = path.with_name(f".{NAME}.{os.getpid()}")
    with suppress(FileNotFoundError):
        path.rename(aside)
        if aside.read_bytes() != data:
            with suppress(FileExistsError):
                os.link(aside, path)
        aside.unlink()


def _owner(data: bytes) -> tuple[str, int]:
    """Host and process that a lock names; no host if it names none."""
    try:
        known = json.loads(data)
        return str(known["host"]), int(known["pid"])
    except (ValueError, KeyError, TypeError):
        return "", 0


def _lives(pid: int, path: Path) -> bool:
    """Whether a process of this host lives, and so may hold the lock."""
    if pid == os.getpid():  # or it is of one before that had the same number, as in containers
        return path in _held
    if os.name != "posix":  # there a signal is no question
        return True
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True
