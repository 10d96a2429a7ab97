"""Laws in closed form that a model file can name: each module of this package may have one."""

from __future__ import annotations

import pkgutil
from abc import ABC, abstractmethod
from collections.abc import Mapping
from functools import cache
from importlib import import_module
from typing import ClassVar

from numpy.typing import ArrayLike

from contactlib.base.quantities import FloatArray, Parameters


class FormulaLaw(Parameters, ABC):
    """A law of closed form: a frozen dataclass whose fields are its keys in ``[law]``.

    A class is all that a law needs: model files, sweeps, the guide's list of kinds and the tests of
    what works together find it by itself.

    Attributes
    ----------
    kind : str
        Name of the law in a file.
    meaning : str
        Sentences on it for the guide's list.
    contacts : tuple of str
        The contacts that it describes: ``"line"``, ``"elliptic"``. Default: both.
    without_layer : str
        What replaces a layer, which a law in closed form has not.
    example : mapping
        Its keys, for tests.
    """

    kind: ClassVar[str]
    meaning: ClassVar[str]
    contacts: ClassVar[tuple[str, ...]] = ("line", "elliptic")
    without_layer: ClassVar[str] = "the law has no layer; set slope_reduction in its place"
    example: ClassVar[Mapping[str, float]]

    @abstractmethod
    def traction_ratio(self, normalized_creepage: ArrayLike) -> FloatArray:
        """Traction ratio q = Q/(f_d P) at x = zeta/zeta0, for any shape of finite x; odd in x."""

    @abstractmethod
    def slope(self, normalized_creepage: ArrayLike) -> FloatArray:
        """Slope dq/dx at x, for any shape of finite x; even in x."""


@cache
def formula_laws() -> Mapping[str, type[FormulaLaw]]:
    """The laws in closed form by their kind, from all modules of this package."""
    package = __name__.rpartition(".")[0]
    for module in pkgutil.iter_modules(import_module(package).__path__):
        import_module(f"{package}.{module.name}")
    return {law.kind: law for law in sorted(FormulaLaw.__subclasses__(), key=lambda law: law.kind)}
