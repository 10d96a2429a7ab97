"""Tables by the name of their law: shipped ones are read, others are built once per user."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from contextlib import suppress
from functools import cache, lru_cache, partial
from typing import Literal

from contactlib import kernel
from contactlib.base.quantities import Limits, checked_number
from contactlib.base.writing import PACKAGE, keep_in_cache, user_cache
from contactlib.laws.carter_griffith import CarterGriffith
from contactlib.laws.cohesive import CohesiveZone
from contactlib.laws.friction import EXPONENTIAL, Weakening
from contactlib.table.building import exchange_layers
from contactlib.table.cohesive_layers import cohesive_layers
from contactlib.table.creep_force_table import CreepForceTable

Shape = Literal["line", "elliptic"]

MAX_KEPT = 100  # tables in the user's cache, of 0.5 to 4 MB


def _silent(part: float) -> None:
    """Report no progress."""


@lru_cache
def carter_griffith_table(contact: Shape) -> CreepForceTable:
    """The shipped table of the Carter-Griffith law."""
    return CreepForceTable.load(kernel.shipped_path(contact))


def build_carter_griffith_table(
    contact: str, progress: Callable[[float], object] = _silent, *, layers: bool = False
) -> CreepForceTable:
    """Build that table from the law, in seconds; with layers, as shipped, in minutes."""
    return CreepForceTable.from_law(
        CarterGriffith, contact=contact, layers=layers, progress=progress
    )


_cohesive: dict[tuple[str, float, Weakening, bool], CreepForceTable] = {}


def cohesive_table(
    contact: Shape,
    static_to_kinetic: float,
    weakening: Weakening = EXPONENTIAL,
    progress: Callable[[float], object] = _silent,
    *,
    layers: bool = False,
) -> CreepForceTable:
    """Table of the cohesive-zone law for one friction ratio.

    Building takes some 8 s. With the exponential weakening the table is then kept in the
    user's cache, from where later processes read it. The friction ratio is from 1.01 to 30. The
    target is 1e-8 for the exponential, 1e-6 for a function, and 3e-5 for a weakening with kinks,
    whose slope is right to 0.01 (0.0001 for the others).

    With `layers`, which takes some 30 s more and the exponential weakening, the law may have a
    layer. Its error is 1e-4 for layer ratios from 0.03 on, `max_layer_error`, below 0.001, from
    1e-4 on, and 0.006 for thinner layers.
    """
    limits = Limits(at_least=1.01, at_most=30.0)
    static_to_kinetic = checked_number("static_to_kinetic", static_to_kinetic, limits)
    key = (contact, static_to_kinetic, weakening, layers)
    if layers and weakening != EXPONENTIAL:
        raise ValueError(
            f"layers = True needs the exponential weakening, not {weakening.name!r}: choose "
            "Friction(...) without a function, or no layer"
        )
    if layers and key not in _cohesive:

        def layered() -> CreepForceTable:
            clean = cohesive_table(
                contact, static_to_kinetic, weakening, lambda v: progress(0.2 * v)
            )
            spline = cohesive_layers(contact, static_to_kinetic, lambda v: progress(0.2 + 0.8 * v))
            return CreepForceTable(exchange_layers(clean.data, b"", spline))

        _cohesive[key] = _kept(f"cohesive_{contact}_{static_to_kinetic!r}_layers", layered)
    elif key not in _cohesive:
        build = partial(
            CreepForceTable.from_law,
            CohesiveZone,
            contact=contact,
            static_to_kinetic=static_to_kinetic,
            progress=progress,
        )
        if weakening is EXPONENTIAL:
            _cohesive[key] = _kept(f"cohesive_{contact}_{static_to_kinetic!r}", build)
        else:  # a function has no name for its table in the cache
            target, slope_target = (3e-5, 1e-2) if weakening.kinks else (1e-6, 1e-4)
            _cohesive[key] = build(weakening=weakening, target=target, slope_target=slope_target)
    return _cohesive[key]


def _kept(name: str, build: Callable[[], CreepForceTable]) -> CreepForceTable:
    """Read a table from the user's cache, or build it and keep it there."""
    folder = user_cache("tables")
    path = folder / f"{name}_{_sources()}.bin"
    with suppress(OSError, ValueError):  # not there, or damaged
        return CreepForceTable.load(path)
    table = build()
    keep_in_cache(path, table.data)
    kept = sorted(folder.glob("*.bin"), key=lambda p: (_sources() in p.name, p == path))
    for surplus in kept[:-MAX_KEPT]:  # tables of other releases first
        with suppress(OSError):
            surplus.unlink()
    return table


@cache
def _sources() -> str:
    """Digest of the inputs of a table: the laws, the grids and the kernel."""
    digest = hashlib.sha256(kernel.token().encode())
    for room in ("kernel", "laws", "table"):
        for path in sorted((PACKAGE / room).rglob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
