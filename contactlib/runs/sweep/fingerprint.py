"""Fingerprints of controllers and metrics of a user's own, so that a sweep knows when they change.

A fingerprint is made of code and numbers: of the functions of a class, of what they use of their
module, and of the values in an object, but of no address, path or line. Libraries count by name.
What cannot be read gets a fingerprint of its own each time, so that a sweep with it never goes on.
"""

from __future__ import annotations

import hashlib
import secrets
import sys
from collections.abc import Iterator, Mapping
from functools import cached_property, partial
from pathlib import Path
from types import CodeType, FunctionType, MethodType, ModuleType
from typing import Any

PLAIN = (bool, int, float, complex, str, bytes, type(None), type(...))
WRITTEN = (FunctionType, classmethod, staticmethod, property)  # members with __ that a user writes


def fingerprint(value: object) -> str:
    """Digest that is the same in two processes only if code and numbers of a value are."""
    return hashlib.sha256(repr(_told(value, {})).encode()).hexdigest()


def _told(value: Any, seen: dict[int, tuple[int, object]]) -> Any:
    """All of a value as text and tuples; what has been told before stands there by its number."""

    def told(*parts: Any) -> tuple[Any, ...]:
        return tuple(_told(part, seen) for part in parts)

    if type(value) in PLAIN:
        return repr(value)
    if isinstance(value, tuple | CodeType):
        if isinstance(value, CodeType):
            return value.co_code.hex(), value.co_names, value.co_varnames, told(*value.co_consts)
        return told(type(value), *value)
    if isinstance(value, set | frozenset):
        return sorted(map(repr, told(*value)))
    if isinstance(value, FunctionType | type | ModuleType) and _of_library(value):
        return getattr(value, "__module__", ""), getattr(value, "__qualname__", value.__name__)
    if id(value) in seen:
        return seen[id(value)][0]
    seen[id(value)] = len(seen), value  # which stays alive, so that its address stays its own
    if isinstance(value, FunctionType):
        known = value.__globals__
        used = {name: known[name] for name in _names(value.__code__) if name in known}
        cells = [cell.cell_contents for cell in value.__closure__ or ()]
        return told(value.__code__, value.__defaults__, value.__kwdefaults__, used, cells)
    if isinstance(value, type):
        members = {name: one for name, one in vars(value).items() if _is_written(name, one)}
        return value.__qualname__, told(*value.__bases__, members)
    if isinstance(value, ModuleType):
        return Path(str(value.__file__)).read_bytes()
    if isinstance(value, Mapping):
        return told(type(value), *(part for item in value.items() for part in item))
    if isinstance(value, list):
        return told(type(value), *value)
    for kind, names in HELD.items():
        if isinstance(value, kind):
            return told(kind, *(getattr(value, name, None) for name in names))
    if hasattr(value, "__wrapped__"):  # as by functools.cache
        return told(value.__wrapped__)
    try:
        reduced = value.__reduce_ex__(4)
    except Exception:  # of any kind, as of copying and pickling
        return secrets.token_hex()
    if isinstance(reduced, str):
        return reduced
    make, given, state, items, pairs = (*reduced, None, None, None)[:5]
    return told(type(value), make, given, state, list(items or ()), list(pairs or ()))


HELD: dict[type, tuple[str, ...]] = {
    property: ("fget", "fset"),
    classmethod: ("__func__",),
    staticmethod: ("__func__",),
    MethodType: ("__func__", "__self__"),
    cached_property: ("func",),
    partial: ("func", "args", "keywords"),
}


def _names(function: CodeType) -> Iterator[str]:
    """Names that a function and those inside it use."""
    yield from function.co_names
    for constant in function.co_consts:
        if isinstance(constant, CodeType):
            yield from _names(constant)


def _is_written(name: str, member: object) -> bool:
    """Whether a member of a class is its author's, not Python's."""
    hidden = name.startswith("__") and name.endswith("__") and not isinstance(member, WRITTEN)
    return not hidden and name != "_abc_impl"


def _of_library(value: Any) -> bool:
    """Whether a function, class or module is of an installed library."""
    name = value.__name__ if isinstance(value, ModuleType) else value.__module__
    if name in (None, "__main__"):
        return False
    if name.partition(".")[0] in {*sys.stdlib_module_names, "contactlib"}:
        return True
    file = getattr(sys.modules.get(name), "__file__", None)
    return file is None or bool({"site-packages", "dist-packages"} & set(Path(file).parts))
