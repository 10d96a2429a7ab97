"""Finished chunks of a sweep on disk, so that a killed sweep can continue, and a lock for them.

One file, which its process locks, has a place for each chunk. A chunk that a kill or a full disk
has cut, or that was damaged, does not have its checksum and is not used.
"""

from __future__ import annotations

import errno
import hashlib
import json
import os
import platform
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from io import FileIO
from pathlib import Path
from typing import Any

import numpy as np

from contactlib.base.quantities import FloatArray

OWNER = 128  # bytes at the beginning of a locked file that name its process
CHECKSUM = hashlib.sha256().digest_size
OTHERWISE = "discard it with --restart (restart=True), or choose another output folder"


@contextmanager
def locked(path: Path) -> Iterator[FileIO]:
    """Open and lock a file, which is created if needed, and at the end removed if it has nothing.

    What the caller writes begins at `OWNER`. The system releases the lock when the process ends in
    any way.

    Raises
    ------
    RuntimeError
        If it is locked already; the message names the process.
    OSError
        If it cannot be created or written.
    """
    path = path.resolve()
    file = _taken(path)
    try:
        yield file
    finally:
        empty = os.fstat(file.fileno()).st_size <= OWNER
        if empty and os.name == "posix":
            path.unlink(missing_ok=True)  # while it is held: later it may be another's
        file.close()
        if empty and os.name != "posix":  # where an open file cannot be removed
            path.unlink(missing_ok=True)


def _taken(path: Path) -> FileIO:
    path.parent.mkdir(parents=True, exist_ok=True)
    while True:
        file = FileIO(path, "r+", opener=lambda p, flags: os.open(p, flags | os.O_CREAT, 0o666))
        try:
            _lock(file)
            if os.fstat(file.fileno()).st_nlink:
                file.seek(0)
                with suppress(OSError):  # the disk is full: nobody is named
                    file.write(f"process {os.getpid()} on {platform.node()}".encode().ljust(OWNER))
                return file
        except BlockingIOError:
            file.seek(0)
            owner = file.read(OWNER).decode(errors="replace").strip() or "another process"
            file.close()
            raise RuntimeError(f"{path} is in use by {owner}, which writes to it") from None
        except OSError as error:  # the file system has no locks
            file.close()
            raise OSError(error.errno, error.strerror, os.fspath(path)) from None
        file.close()  # the owner before has removed it


def _lock(file: FileIO) -> None:
    if sys.platform == "win32":
        import msvcrt

        file.seek(2**30)  # beyond the name, which stays readable
        try:
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        except PermissionError as error:
            raise BlockingIOError from error
    else:
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


def discard(file: FileIO) -> None:
    """Remove all chunks of a locked file, of any plan."""
    file.truncate(min(OWNER, os.fstat(file.fileno()).st_size))


class ChunkStore:
    """Chunks of one plan in a locked file: after its owner the plan, and a place for each chunk.

    Parameters
    ----------
    file : FileIO
        File of `locked`.
    digest : str
        Digest of the plan and its runs: JSON with an entry for each part.
    rows, runs, chunk : int
        Numbers of a run, number of runs, and of runs in a chunk; a file that has chunks overrides
        the last.

    Attributes
    ----------
    chunk : int
        Number of runs in each chunk but the last.

    Raises
    ------
    ValueError
        If the file has chunks of another plan.
    OSError
        If it cannot be written.
    """

    def __init__(self, file: FileIO, digest: str, *, rows: int, runs: int, chunk: int) -> None:
        self._file, self._digest, self._rows, self._runs = file, digest, rows, runs
        file.seek(OWNER)
        if (line := file.readline(1_000_000)).endswith(b"\n"):
            known = _parsed(line)
            found = known.get("chunk")
            if known.get("digest") != digest or not isinstance(found, int) or found < 1:
                raise another_plan(f"{file.name} has chunks", known.get("digest"), digest)
            chunk = found
        else:  # a kill came before anything was kept
            line = json.dumps({"digest": digest, "chunk": chunk}).encode() + b"\n"
            self._write(OWNER, line)
        self.chunk, self._begin = chunk, OWNER + len(line)

    def load(self, first: int) -> FloatArray | None:
        """Numbers of the chunk with this first run; None if it is missing or damaged."""
        count = min(self.chunk, self._runs - first)
        self._file.seek(self._place(first))
        data = self._file.read(CHECKSUM + 8 * self._rows * count)
        numbers = data[CHECKSUM:]
        whole = len(numbers) == 8 * self._rows * count
        if not whole or data[:CHECKSUM] != self._checksum(first, numbers):
            return None
        return np.frombuffer(numbers, "<f8").reshape(self._rows, count)

    def save(self, first: int, found: FloatArray) -> None:
        """Save the numbers of a chunk, shape (rows, runs)."""
        numbers = found.astype("<f8").tobytes()
        self._write(self._place(first), self._checksum(first, numbers) + numbers)

    def _place(self, first: int) -> int:
        return self._begin + first // self.chunk * (CHECKSUM + 8 * self._rows * self.chunk)

    def _checksum(self, first: int, numbers: bytes) -> bytes:
        return hashlib.sha256(f"{self._digest} {first} {self.chunk} ".encode() + numbers).digest()

    def _write(self, place: int, data: bytes) -> None:
        try:
            self._file.seek(place)
            while data:  # a second write gives the reason why the first was incomplete
                written = self._file.write(data)
                if not written:
                    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
                data = data[written:]
            os.fsync(self._file.fileno())
        except OSError as error:
            raise OSError(error.errno, error.strerror, os.fspath(self._file.name)) from None


def another_plan(what: str, found: object, here: str) -> ValueError:
    """Error for results of another plan, whose digest is `found`; `here` is the present one's."""
    known, mine = _parsed(found), _parsed(here)
    if (made := known.get("contactlib", "another contactlib")) != mine.get("contactlib"):
        why = f"made with {made}, this is {mine.get('contactlib')}"
    else:
        other = [name for name in {**mine, **known} if known.get(name) != mine.get(name)]
        if any(name.startswith("axis ") for name in other):  # and so the values of all runs
            other = [name for name in other if name != "values"]
        why = f"not the same: {', '.join(other)}"
    return ValueError(f"{what} of another plan: {why}; {OTHERWISE}")


def _parsed(text: Any) -> dict[str, object]:
    try:
        known = json.loads(text)
    except (TypeError, ValueError, RecursionError):
        return {}
    return known if isinstance(known, dict) else {}
