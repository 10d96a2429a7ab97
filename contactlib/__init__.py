"""Creep force element for vehicle dynamics: the Carter-Griffith law from table to FMU.

import contactlib as cl

law = cl.CarterGriffith(k_hat=0.3)              # the law itself
table = cl.CreepForceTable.from_law(cl.CarterGriffith, contact="line")
model = cl.load_model("models/roller_rig.toml") # a wheelset and its runs
cl.export_fmu(model, "CreepForceElement.fmu")   # for any vehicle tool
"""

import ast
import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

# Public name -> the module that defines it: what __init__.pyi imports. Scientific libraries take a
# second to load, so each module waits for the first use of one of its names.
_HOMES = {
    alias.name: node.module
    for node in ast.parse(Path(__file__).with_suffix(".pyi").read_text(encoding="ascii")).body
    if isinstance(node, ast.ImportFrom) and node.module
    for alias in node.names
}

__all__ = sorted(_HOMES)


class _Package(ModuleType):
    """Imports what it holds at the first use."""

    def __getattr__(self, name: str) -> Any:
        if name not in _HOMES:
            message = f"module {__name__!r} has no attribute {name!r}"
            raise AttributeError(message, name=name, obj=self)
        if _HOMES[name] == __name__:  # a subpackage, such as `stability`
            return import_module(f"{__name__}.{name}")
        value = getattr(import_module(_HOMES[name]), name)
        setattr(self, name, value)
        return value

    def __setattr__(self, name: str, value: object) -> None:
        # Importing a submodule sets it on the package. It must not hide the function of its name.
        if not isinstance(value, ModuleType) or _HOMES.get(name, __name__) == __name__:
            super().__setattr__(name, value)

    def __dir__(self) -> list[str]:
        return __all__


sys.modules[__name__].__class__ = _Package
