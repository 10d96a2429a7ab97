"""Finished chunks of a sweep on disk, so that a killed sweep can continue.

A folder has the plan, and a file for each chunk. Files are written whole, and chunks of one plan
are the same whoever computes them, so that neither a kill nor a second process can harm a result. A
file that was damaged, or is of another plan, does not have its checksum and is not used.
"""

from __future__ import annotations

import hashlib
import json
import shutil
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from contactlib.base.quantities import FloatArray
from contactlib.base.writing import write_whole

CHECKSUM = hashlib.sha256().digest_size
OTHERWISE = "discard it with --restart (restart=True), or choose another output folder"


class ChunkStore:
    """Chunks of one plan in a folder, which is created if needed.

    Parameters
    ----------
    folder : Path
        Folder of the chunks.
    digest : str
        Digest of the plan and its runs: JSON with an entry for each part.
    rows : int
        Numbers of a run.

    Raises
    ------
    ValueError
        If the folder has chunks of another plan.
    OSError
        If it cannot be written.
    """

    def __init__(self, folder: Path, digest: str, rows: int) -> None:
        self._folder, self._digest, self._rows = folder, digest, rows
        plan = folder / "plan.json"
        if plan.exists() and (known := plan.read_text(errors="replace")) != digest:
            raise another_plan(f"{folder} has chunks", known, digest)
        self._write(plan, digest.encode())

    def load(self) -> dict[int, FloatArray]:
        """Chunks by their first run, each of shape (rows, runs)."""
        chunks = {}
        for path in self._folder.glob("*.chunk"):
            checksum, numbers = (data := path.read_bytes())[:CHECKSUM], data[CHECKSUM:]
            if checksum == self._checksum(path, numbers):
                chunks[int(path.stem)] = np.frombuffer(numbers, "<f8").reshape(self._rows, -1)
        return chunks

    def save(self, first: int, results: FloatArray) -> None:
        """Save the results of a chunk, shape (rows, runs)."""
        path, numbers = self._folder / f"{first}.chunk", results.astype("<f8").tobytes()
        self._write(path, self._checksum(path, numbers) + numbers)

    def remove(self) -> None:
        """Remove the folder."""
        shutil.rmtree(self._folder, ignore_errors=True)

    def _checksum(self, path: Path, numbers: bytes) -> bytes:
        return hashlib.sha256(f"{self._digest} {path.stem} ".encode() + numbers).digest()

    def _write(self, path: Path, data: bytes) -> None:
        self._folder.mkdir(parents=True, exist_ok=True)
        with suppress(FileNotFoundError):  # a second process has finished, and removed the folder
            write_whole(path, data)


def another_plan(what: str, there: object, here: str) -> ValueError:
    """Error for results of another plan, whose digest is `found`; `here` is the present one's."""
    known, mine = _parsed(there), _parsed(here)
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
