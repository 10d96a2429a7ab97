"""Tables of laws, and the frame of contactlib's binary files."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from contactlib.base.quantities import FloatArray
from contactlib.base.writing import PACKAGE
from contactlib.kernel.library import ffi, library, pointer

TABLE_MAGIC, TABLE_VERSION = b"CREEPTAB", 3  # as in fmu/kernel/creep_table.c


NO_LAYER = np.zeros(1)


def shipped_path(contact: str) -> Path:
    """File of the shipped table of the Carter-Griffith law."""
    return PACKAGE / "table" / "data" / f"carter_griffith_{contact}.bin"


def framed(magic: bytes, version: int, contents: bytes) -> bytes:
    """Put the frame of fmu/kernel/checked_file.h around `contents`."""
    rest = struct.pack("<Q", 24 + len(contents)) + contents
    return magic + struct.pack("<II", version, zlib.crc32(rest)) + rest


class NativeTable:
    """A table that the kernel has checked and can read.

    Raises
    ------
    ValueError
        If the bytes are not a complete, undamaged table.
    """

    def __init__(self, data: bytes) -> None:
        lib = library()
        # The table must be aligned to eight bytes, which a bytes object does not promise.
        self._buffer = np.zeros(-(-len(data) // 8), dtype=np.uint64)
        self._buffer.view(np.uint8)[: len(data)] = np.frombuffer(data, np.uint8)
        self.struct = ffi.new("creep_table *")
        error = lib.creep_table_open(self.struct, pointer(self._buffer, "uint64_t"), len(data))
        if error != ffi.NULL:
            raise ValueError(ffi.string(error).decode() + _versions(data))

    def evaluate(
        self, x: FloatArray, k_hat: FloatArray, layer_ratio: FloatArray = NO_LAYER
    ) -> tuple[FloatArray, FloatArray]:
        """Traction ratio and slope; the others have the shape of `x` or one element."""
        ratio, slope = np.empty(x.shape), np.empty(x.shape)
        self._fill(x, k_hat, layer_ratio, ratio, slope)
        return ratio, slope

    def traction_ratio(
        self, x: FloatArray, k_hat: FloatArray, layer_ratio: FloatArray
    ) -> FloatArray:
        """The first of `evaluate`."""
        ratio = np.empty(x.shape)
        self._fill(x, k_hat, layer_ratio, ratio, None)
        return ratio

    def slope(self, x: FloatArray, k_hat: FloatArray, layer_ratio: FloatArray) -> FloatArray:
        """The second of `evaluate`."""
        slope = np.empty(x.shape)
        self._fill(x, k_hat, layer_ratio, None, slope)
        return slope

    def _fill(
        self,
        x: FloatArray,
        k_hat: FloatArray,
        layer_ratio: FloatArray,
        ratio: FloatArray | None,
        slope: FloatArray | None,
    ) -> None:
        x, k_hat, layer_ratio = (
            np.asarray(given, dtype=np.float64, order="C") for given in (x, k_hat, layer_ratio)
        )
        library().creep_table_evaluate_many(
            self.struct,
            x.size,
            pointer(x, "double"),
            pointer(k_hat, "double"),
            int(k_hat.size > 1),
            pointer(layer_ratio, "double"),
            int(layer_ratio.size > 1),
            ffi.NULL if ratio is None else pointer(ratio, "double"),
            ffi.NULL if slope is None else pointer(slope, "double"),
        )


class NativeContact:
    """A table with the data of lateral and spin force: of one ellipse, or of a pair of bodies.

    Raises
    ------
    ValueError
        If the bytes do not describe a contact.
    """

    def __init__(self, table: NativeTable, data: bytes, *, any_ellipse: bool = False) -> None:
        lib, words = library(), np.frombuffer(data, np.uint64).copy()  # aligned to eight bytes
        self.struct = ffi.new("creep_table *", table.struct[0])
        bytes_of = pointer(words, "uint64_t")
        if any_ellipse:
            shape = self.struct.bodies = ffi.new("creep_forces *")
            error = lib.creep_forces_open(shape, self.struct, bytes_of, len(data))
        else:
            shape = self.struct.lateral_spin = ffi.new("lateral_spin_contact *")
            error = lib.lateral_spin_contact_open(shape, bytes_of, len(data))
        if error != ffi.NULL:
            raise ValueError(ffi.string(error).decode())
        self._kept: Any = table, words, shape

    def own(self) -> NativeContact:
        """The contact for one instance of a model."""
        return self


def _versions(data: bytes) -> str:
    """End of the error message for a table of another version, else nothing."""
    found = int.from_bytes(data[8:12], "little")
    of_table = len(data) >= 24 and data[:8] == TABLE_MAGIC and found != TABLE_VERSION
    return f": {found}, this contactlib reads {TABLE_VERSION}" if of_table else ""


class Node(NamedTuple):
    """Where a law is sampled to make a table; see fmu/kernel/creep_table.h."""

    normalized_creepage: FloatArray
    line: FloatArray
    weight: FloatArray


def table_nodes(u: FloatArray, k_hat: float, layer_ratio: float = 0.0, **shape: int) -> Node:
    """Nodes at the spline coordinates `u`, 0 <= u < 1, of a table of this shape."""
    lib, node = library(), ffi.new("creep_node *")
    table, rows = ffi.new("creep_table *", shape), []
    for value in u:
        lib.creep_table_node(table, value, k_hat, layer_ratio, node)
        rows.append((node.normalized_creepage, node.line, node.weight))
    return Node(*np.array(rows).T)


def table_coordinate(normalized_creepage: float, k_hat: float) -> float:
    """Parameter t of the table at a creepage and a k_hat above zero."""
    return float(library().creep_table_coordinate(normalized_creepage, k_hat))
