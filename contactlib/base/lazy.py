"""Public names that a package imports when they are first used.

Scientific libraries take a second to load, so a package lists its names in a block ``if
TYPE_CHECKING:``, which type checkers and editors read, and so does `lazy_names`.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any


def lazy_names(package: str) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """``__getattr__``, ``__dir__`` and ``__all__`` of a package, from its file's ``if`` block."""
    module = sys.modules[package]
    tree = ast.parse(Path(str(module.__file__)).read_text(encoding="ascii"))
    homes = {
        alias.name: node.module
        for block in tree.body
        if isinstance(block, ast.If)
        for node in block.body
        if isinstance(node, ast.ImportFrom) and node.module
        for alias in node.names
    }

    def get(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}", name=name)
        home = homes[name]
        if home == package:  # a subpackage, such as `stability`
            value = import_module(f"{home}.{name}")
        else:
            value = getattr(import_module(home), name)
        setattr(module, name, value)
        return value

    names = sorted(homes)
    return get, names.copy, names


EXTRAS = {  # which "pip install" brings a library that most users do not need
    "control": "control",
    "distributed": "cluster",
    "fmpy": "fmi",
    "gymnasium": "rl",
    "pandas": "data",
    "xarray": "data",
}


def optional_library(name: str) -> Any:
    """A library of an extra, or its module such as ``fmpy.fmi2``.

    Raises
    ------
    ImportError
        If the library is not installed, with the extra that brings it.
    """
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        root = name.split(".")[0]
        if error.name != root:  # what that library lacks
            raise
        extra = EXTRAS[root]
        raise ImportError(
            f"{root} is not installed: pip install 'contactlib-rail[{extra}]', or [all]", name=root
        ) from None
