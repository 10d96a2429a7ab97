"""Slip-weakening friction: a static value that drops to a kinetic one over microns of slip."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from contactlib.parameters import Parameters, Quantity


@dataclass(frozen=True, kw_only=True)
class Friction(Parameters):
    """Friction coefficient f(u) that weakens with slip u from `static` to `kinetic`.

    Parameters
    ----------
    static : float
        f_s, coefficient before slip [1]; at least `kinetic`.
    kinetic : float
        f_d, coefficient after much slip [1]; above zero.
    weakening_length : float
        Delta, Eq. (2): integral of (f(u) - f_d) du / (f_s - f_d) [m]. Zero is Coulomb friction.

    Raises
    ------
    ValueError
        If a value is not finite or out of its range.

    Examples
    --------
    >>> Friction(static=0.45, kinetic=0.21, weakening_length=1.3e-6).ratio
    2.142857142857143
    """

    static: Annotated[float, Quantity("1", above=0.0)]
    kinetic: Annotated[float, Quantity("1", above=0.0)]
    weakening_length: Annotated[float, Quantity("m", at_least=0.0)]

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.static < self.kinetic:
            raise ValueError(
                f"Friction.static = {self.static!r} is out of range: "
                f"must be >= Friction.kinetic = {self.kinetic!r}"
            )

    @property
    def ratio(self) -> float:
        """Static over kinetic coefficient: the largest traction ratio friction allows [1]."""
        return self.static / self.kinetic
