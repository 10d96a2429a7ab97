"""Finished chunks of a sweep on disk, so that a killed sweep can continue, and a lock for them.

Each chunk is written atomically to its own file, which begins with a checksum of plan, position and
contents: a damaged chunk, or one of another plan, is not used.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import platform
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np

from contactlib.base.quantities import FloatArray
from contactlib.base.writing import write_whole

NAME = "lock"
CHECKSUM = hashlib.sha256().digest_size
OTHERWISE = "discard it with --restart (restart=True), or choose another output folder"
_held: set[Path] = set()  # locks of this process


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Lock a folder for this process; create it if needed, and remove it if it is empty at the end.

    The lock of a dead process of this host is taken over.

    Raises
    ------
    RuntimeError
        If another process holds the lock; the message names it, and the remedy if it is wrong.
    OSError
        If the folder cannot be created or written.
    """
    path = folder.resolve() / NAME
    _take(path)
    _held.add(path)
    try:
        yield
    finally:
        _held.discard(path)
        path.unlink(missing_ok=True)
        with suppress(OSError):  # not empty
            path.parent.rmdir()


def _take(path: Path) -> None:
    mine = json.dumps({"host": platform.node(), "pid": os.getpid()}).encode()
    while True:
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666)
        except FileExistsError:
            _remove_stale(path)
        except FileNotFoundError:  # the previous owner has just removed the folder
            continue
        else:
            try:
                with os.fdopen(descriptor, "wb") as file:
                    file.write(mine)
            except BaseException as error:  # else a lock without an owner would stay forever
                path.unlink(missing_ok=True)
                if isinstance(error, OSError):
                    raise OSError(error.errno, error.strerror, os.fspath(path)) from None
                raise
            return


def _remove_stale(path: Path) -> None:
    """Remove the lock of a dead process; raise if it lives, or if this host cannot tell."""
    try:
        data = path.read_bytes()
    except FileNotFoundError:  # just released
        return
    host, pid = _owner(data)
    if host != platform.node() or _lives(pid, path):
        who = f"process {pid} on {host}" if host else "another process"
        raise RuntimeError(
            f"{path.parent} is in use by {who}, which writes to it; if it no longer does, "
            f"remove {path}"
        )
    # Two processes that find the lock stale must not remove each other's new lock: rename is
    # atomic, so only one of them moves the file away.
    aside = path.with_name(f".{NAME}.{os.getpid()}")
    with suppress(FileNotFoundError):
        path.rename(aside)
        if aside.read_bytes() != data:
            with suppress(FileExistsError):
                os.link(aside, path)
        aside.unlink()


def _owner(data: bytes) -> tuple[str, int]:
    """Host and process that a lock names; an empty host if it names none."""
    try:
        known = json.loads(data)
        return str(known["host"]), int(known["pid"])
    except (ValueError, KeyError, TypeError):
        return "", 0


def _lives(pid: int, path: Path) -> bool:
    """Whether a process of this host lives and may hold the lock."""
    if pid == os.getpid():  # an earlier process may have had the same number, as in containers
        return path in _held
    if os.name != "posix":  # there os.kill(pid, 0) sends Ctrl+C
        return True
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True


class ChunkStore:
    """Folder of the chunks of one plan.

    Parameters
    ----------
    folder : Path
        Folder, which is created if needed.
    digest : str
        Digest of the plan and its runs: JSON with an entry for each part.
    runs, chunk : int
        Number of runs, and number of runs in a chunk; an existing folder overrides the latter.

    Attributes
    ----------
    chunk : int
        Number of runs in each chunk but the last.

    Raises
    ------
    ValueError
        If the folder has chunks of another plan.
    OSError
        If the folder cannot be created or written.
    """

    def __init__(self, folder: Path, digest: str, *, runs: int, chunk: int) -> None:
        self.folder, self._digest, self._runs, self.chunk = folder, digest, runs, chunk
        folder.mkdir(parents=True, exist_ok=True)
        plan = folder / "plan.json"
        if plan.exists():
            known = _parsed(plan.read_bytes())
            found = known.get("chunk")
            if known.get("digest") != digest or not isinstance(found, int) or found < 1:
                raise another_plan(f"{folder} has chunks", known.get("digest"), digest)
            self.chunk = found
        else:
            made = {"digest": digest, "runs": runs, "chunk": chunk}
            write_whole(plan, json.dumps(made, indent=1).encode())

    def load(self, first: int) -> dict[str, FloatArray] | None:
        """Load the chunk with this first run; None if it is missing or damaged."""
        try:
            data = self._path(first).read_bytes()
        except FileNotFoundError:
            return None
        contents = data[CHECKSUM:]
        if data[:CHECKSUM] != self._checksum(first, contents):
            return None
        try:
            with zipfile.ZipFile(io.BytesIO(contents)) as archive:
                if any(member.compress_type for member in archive.infolist()):
                    return None  # it is not one of `save`, and may grow to any size
            with np.load(io.BytesIO(contents), allow_pickle=False) as arrays:
                return dict(arrays)
        except (ValueError, MemoryError, zipfile.BadZipFile):
            return None

    def save(self, first: int, results: Mapping[str, FloatArray]) -> None:
        """Save the results of a chunk."""
        buffer = io.BytesIO()
        np.savez(buffer, **results)  # type: ignore[arg-type]
        contents = buffer.getvalue()
        write_whole(self._path(first), self._checksum(first, contents) + contents)

    def _path(self, first: int) -> Path:
        return self.folder / f"{first:09d}.chunk"

    def _checksum(self, first: int, contents: bytes) -> bytes:
        end = min(first + self.chunk, self._runs)
        return hashlib.sha256(f"{self._digest} {first} {end} ".encode() + contents).digest()


def discard(folder: Path) -> None:
    """Remove all chunks of a folder, of any plan."""
    beside = (*folder.glob(".*.chunk.*"), *folder.glob(".plan.json.*"))  # left by a killed process
    for path in (*folder.glob("*.chunk"), *beside, folder / "plan.json"):
        path.unlink(missing_ok=True)
    with suppress(OSError):  # not empty
        folder.rmdir()


def another_plan(what: str, found: object, here: str) -> ValueError:
    """Error for results of another plan, whose digest is `found`; `here` is the present one's."""
    known, mine = _parsed(found), _parsed(here)
    if (made := known.get("contactlib", "another contactlib")) != mine.get("contactlib"):
        why = f"made with {made}, this is {mine.get('contactlib')}"
    else:
        other = [name for name in {**mine, **known} if known.get(name) != mine.get(name)]
        if any(name.startswith("axis ") for name in other):  # and so the values of all runs
            other = [name for name in other if name != "axes"]
        why = f"not the same: {', '.join(other)}"
    return ValueError(f"{what} of another plan: {why}; {OTHERWISE}")


def _parsed(text: Any) -> dict[str, object]:
    try:
        known = json.loads(text)
    except (TypeError, ValueError):
        return {}
    return known if isinstance(known, dict) else {}
