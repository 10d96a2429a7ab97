"""Chunks of results on disk, so that a sweep that was killed can go on.

Each chunk is a file of its own that is there whole or not at all, and begins with a checksum of
plan, place and contents: what is damaged, or of another plan, is not taken for a result.
"""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

import numpy as np

from contactlib.files import write_whole
from contactlib.parameters import FloatArray

CHECKSUM = hashlib.sha256().digest_size


class ChunkStore:
    """Folder of the chunks of one plan.

    Parameters
    ----------
    folder : Path
        Made if it is not there.
    digest : str
        Of the plan and its runs.
    made_with : str
        Which contactlib made the plan.
    runs, chunk : int
        Number of runs, and how many a chunk has; what a folder that is there already says about
        the latter goes before.

    Attributes
    ----------
    chunk : int
        Number of runs in each chunk but the last.

    Raises
    ------
    ValueError
        If the folder has chunks of another plan.
    OSError
        If it cannot be made or written.
    """

    def __init__(self, folder: Path, digest: str, made_with: str, *, runs: int, chunk: int) -> None:
        self.folder, self._digest, self._runs, self.chunk = folder, digest, runs, chunk
        folder.mkdir(parents=True, exist_ok=True)
        plan = folder / "plan.json"
        if plan.exists():
            known = _read_plan(plan)
            found = known.get("chunk")
            if known.get("digest") != digest or not isinstance(found, int) or found < 1:
                raise another_plan(
                    f"{folder} has chunks", known.get("made_with", "another contactlib"), made_with
                )
            self.chunk = found
        else:
            made = {"digest": digest, "made_with": made_with, "runs": runs, "chunk": chunk}
            write_whole(plan, json.dumps(made, indent=1).encode())

    def load(self, first: int) -> dict[str, FloatArray] | None:
        """Results of the chunk whose first run this is; None if there are none, or damaged."""
        try:
            data = self._path(first).read_bytes()
        except FileNotFoundError:
            return None
        contents = data[CHECKSUM:]
        if data[:CHECKSUM] != self._checksum(first, contents):
            return None
        with np.load(io.BytesIO(contents), allow_pickle=False) as arrays:
            return dict(arrays)

    def save(self, first: int, results: Mapping[str, FloatArray]) -> None:
        """Keep the results of a chunk."""
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
    """Remove the chunks that a folder has, of whatever plan."""
    beside = (*folder.glob(".*.chunk.*"), *folder.glob(".plan.json.*"))  # left by a kill
    for path in (*folder.glob("*.chunk"), *beside, folder / "plan.json"):
        path.unlink(missing_ok=True)
    with suppress(OSError):  # there is something else in it
        folder.rmdir()


def another_plan(what: str, found: object, here: str) -> ValueError:
    """Refusal of results whose plan has another digest; `found` and `here` made the two."""
    if found != here:
        why = f"made with {found}, this is {here}"
    else:
        why = "the sweep, its scenario or vehicle is not the same"
    return ValueError(
        f"{what} of another plan: {why}; start anew with --restart (restart=True), or choose "
        "another output folder"
    )


def _read_plan(path: Path) -> dict[str, object]:
    try:
        known = json.loads(path.read_bytes())
    except ValueError:
        return {}
    return known if isinstance(known, dict) else {}
