"""Slip-weakening friction: it drops from a static to a kinetic value over microns of slip."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import quad
from scipy.interpolate import PchipInterpolator

from contactlib.base.quantities import (
    FINITE,
    NOT_NEGATIVE,
    FloatArray,
    Limits,
    Parameters,
    Quantity,
    checked,
    checked_number,
    checked_samples,
)

ROUNDING = 4.0 * float(np.finfo(np.float64).eps)
DOUBLINGS = 1e-12 * 2.0 ** np.arange(81)  # slips at which a function is sampled [m]
DECADES = 18  # over which Eq. (2) is integrated, beyond the slip at half of the drop
TAIL = 1e-6  # largest accepted share of the last decade in Eq. (2)
EFFUSIVITY = Quantity("W.s0.5/(m2.K)", at_least=1e-3, at_most=1e9, usual=(1e3, 4e4))
SOFTENING_TEMPERATURE = Quantity(
    "K",
    at_least=0.0,
    at_most=1e6,
    usual=(0.0, 1480.0),
    hint="it is a rise above ambient, and steel melts at 1480 K above",
)
FALL_TEMPERATURE = replace(SOFTENING_TEMPERATURE, at_least=1.0)  # if friction does fall
STEEL_EFFUSIVITY = 13437.0  # that of `laws.heat.STEEL`


@dataclass(frozen=True)
class Weakening(ABC):
    """Shape of the weakening: the fraction of the drop that is left.

    phi(v) = (f(u) - f_d)/(f_s - f_d) with v = u/Delta, so that phi(0) = 1, phi goes to 0, and the
    integral of phi is 1 by Eq. (2). Shapes with equal fields are equal.

    Attributes
    ----------
    name : str
        Name in reports.
    kinks : bool
        Whether a derivative of phi jumps somewhere. Laws are then solved to 2e-6 only.
    """

    name: str
    kinks: ClassVar[bool] = False

    @abstractmethod
    def fraction(self, v: FloatArray) -> FloatArray:
        """Shape phi at v >= 0, slip over weakening length [1]."""

    @abstractmethod
    def slope(self, v: FloatArray) -> FloatArray:
        """d(phi)/dv at v >= 0 [1]."""


@dataclass(frozen=True)
class _Exponential(Weakening):
    """Rabinowicz's exponential."""

    def fraction(self, v: FloatArray) -> FloatArray:
        return np.exp(-v)

    def slope(self, v: FloatArray) -> FloatArray:
        return -np.exp(-v)


EXPONENTIAL: Weakening = _Exponential("exponential")


@dataclass(frozen=True)
class _Function(Weakening):
    """Shape of any f(u), with the constants that `Friction.from_function` found."""

    function: Callable[[float], float]
    static: float
    kinetic: float
    length: float
    fineness: float  # scale of v on which the function changes
    reach: float  # v beyond which it equals the kinetic coefficient to rounding

    def fraction(self, v: FloatArray) -> FloatArray:
        slip = self.length * np.minimum(v, self.reach)
        f = np.vectorize(self.function, otypes=[np.float64])(slip)
        return np.asarray((f - self.kinetic) / (self.static - self.kinetic))

    def slope(self, v: FloatArray) -> FloatArray:
        v = np.asarray(v)
        h = 1e-5 * (v + self.fineness)
        middle = np.maximum(v, h)  # of a parabola through three points that are not negative
        low, here, high = (self.fraction(middle + side * h) for side in (-1.0, 0.0, 1.0))
        return np.asarray(
            (high - low) / (2.0 * h) + (v - middle) * (high - 2.0 * here + low) / h**2
        )


@dataclass(frozen=True)
class _Samples(Weakening):
    """Shape of sampled data: the monotone cubic through them, and zero beyond."""

    v: tuple[float, ...]
    phi: tuple[float, ...]
    kinks: ClassVar[bool] = True

    @cached_property
    def _curve(self) -> Any:
        return PchipInterpolator(self.v, self.phi)

    def fraction(self, v: FloatArray) -> FloatArray:
        v = np.asarray(v)
        return np.where(v < self.v[-1], self._curve(np.minimum(v, self.v[-1])), 0.0)

    def slope(self, v: FloatArray) -> FloatArray:
        v = np.asarray(v)
        return np.where(v < self.v[-1], self._curve(np.minimum(v, self.v[-1]), 1), 0.0)


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
    weakening : Weakening, optional
        Shape of f(u) between the two. Default: Rabinowicz's exponential. The limit of a short
        weakening zone does not depend on it.
    softening_temperature : float, optional
        T_m of the factor 1 - T/T_m by which both coefficients fall with the contact's flash
        temperature T [K]; at least 1. Both are rises above ambient, the temperature of the bodies:
        600 degC is a rise of 580 K. Steel melts at 1480 K. Default: 0, no fall.
    thermal_effusivity : float, optional
        Root of conductivity, density and heat capacity of wheel and rail, for T
        [W s^0.5/(m^2 K)]. Default: that of steel.
    slip_rate_residual : float, optional
        The alternative to thermal softening: A of the factor (1 - A) exp(-B w) + A, with the slip
        speed w [1]. Default: no fall. Polach's A applies to his single coefficient mu0 and includes
        the fall from `static` to `kinetic`. Use A times static/kinetic here: friction at high slip
        speed is then A `static`; 0.40 becomes 0.857 with 0.45 and 0.21.
    slip_rate_decay : float, optional
        B of the same factor [s/m]. Default: 0, no fall.

    Raises
    ------
    ValueError
        If a value is not finite or out of its range, or if friction falls in both ways.

    Examples
    --------
    >>> friction = Friction(static=0.45, kinetic=0.21, weakening_length=1.3e-6)
    >>> friction.ratio
    2.142857142857143
    >>> friction.coefficient([0.0, 1.3e-6, 1e-3]).round(4).tolist()
    [0.45, 0.2983, 0.21]
    """

    static: Annotated[float, Quantity("1", above=0.0, usual=(0.005, 2.0))]
    kinetic: Annotated[float, Quantity("1", above=0.0, usual=(0.005, 2.0))]
    weakening_length: Annotated[float, Quantity("m", at_least=0.0, usual=(0.0, 1e-3))]
    weakening: Weakening = EXPONENTIAL
    slip_rate_residual: Annotated[float, Quantity("1", above=0.0, at_most=1.0)] = 1.0
    slip_rate_decay: Annotated[float, Quantity("s/m", at_least=0.0, usual=(0.0, 10.0))] = 0.0
    softening_temperature: Annotated[float, SOFTENING_TEMPERATURE] = 0.0
    thermal_effusivity: Annotated[float, EFFUSIVITY] = STEEL_EFFUSIVITY

    def __post_init__(self) -> None:
        super().__post_init__()
        given = f"Friction.softening_temperature = {self.softening_temperature!r}"
        if 0.0 < self.softening_temperature < 1.0:
            raise ValueError(f"{given} is out of range: must be 0 (no softening) or >= 1")
        if self.softens_with_heat and self.slip_rate_decay > 0.0:
            raise ValueError(
                f"{given} and Friction.slip_rate_decay = {self.slip_rate_decay!r} both "
                "lower friction with slip speed: give only one of them"
            )
        if self.static < self.kinetic:
            raise ValueError(
                f"Friction.static = {self.static!r} is out of range: "
                f"must be >= kinetic = {self.kinetic!r}"
            )
        self._check_derived("ratio")

    @classmethod
    def from_function(
        cls,
        f: Callable[[float], float],
        *,
        kinetic: float | None = None,
        name: str = "function",
        **others: float,
    ) -> Friction:
        """Friction of any function f(u) of the slip u >= 0 [m], not negative.

        The static coefficient is f(0), the weakening length follows from Eq. (2).

        Parameters
        ----------
        f : callable
            Coefficient [1] at one slip [m]. It need not fall everywhere.
        kinetic : float, optional
            Limit of f at large slip [1]. Default: found by evaluating f at large slips.
        name : str, optional
            Name of the weakening's shape.
        **others
            Further fields of `Friction`.

        Raises
        ------
        ValueError
            If a value of f is not finite or negative, if f does not settle or f(0) is not above
            its limit, or if Eq. (2) does not converge.

        Examples
        --------
        >>> friction = Friction.from_function(lambda u: 0.3 + 0.1 / (1.0 + u / 2e-6) ** 3)
        >>> friction.static, friction.kinetic, round(1e6 * friction.weakening_length, 6)
        (0.4, 0.3, 1.0)
        """

        def at(u: float) -> float:
            return checked_number(f"f({u:g})", f(u), NOT_NEGATIVE)

        static = at(0.0)
        limit = _limit(at, static) if kinetic is None else kinetic
        limit = checked_number("kinetic", limit, Limits(above=0.0))
        _check_drop("f(0)", static, limit)
        half, reach, length = _weakening_length(at, static, limit)
        return cls(
            static=static,
            kinetic=limit,
            weakening_length=length,
            weakening=_Function(name, f, static, limit, length, half / length, reach / length),
            **others,
        )

    @classmethod
    def from_samples(
        cls,
        slip: ArrayLike,
        coefficient: ArrayLike,
        *,
        name: str = "samples",
        **others: float,
    ) -> Friction:
        """Friction of sampled data: the monotone cubic (PCHIP) through the samples.

        Parameters
        ----------
        slip, coefficient : array_like
            Slips [m], strictly increasing from 0, and the coefficients there [1]. The last one is
            the kinetic coefficient and applies to larger slips.
        name, **others
            As in `from_function`.

        Raises
        ------
        ValueError
            If the samples are not two rows of one length, out of range, or do not fall.

        Examples
        --------
        >>> Friction.from_samples([0.0, 1e-6, 4e-6], [0.4, 0.3, 0.2]).static
        0.4
        """
        u, f = checked_samples(NOT_NEGATIVE, slip=slip, coefficient=coefficient)
        static, kinetic = float(f[0]), float(f[-1])
        _check_drop("coefficient[0]", static, kinetic)
        phi = (f - kinetic) / (static - kinetic)
        length = float(PchipInterpolator(u, phi).integrate(0.0, u[-1]))  # Eq. (2)
        _check_length(length)
        return cls(
            static=static,
            kinetic=kinetic,
            weakening_length=length,
            weakening=_Samples(name, tuple((u / length).tolist()), tuple(phi.tolist())),
            **others,
        )

    @property
    def ratio(self) -> float:
        """Static over kinetic coefficient: the largest traction ratio that friction allows [1]."""
        return self.static / self.kinetic

    @property
    def falls_with_slip_speed(self) -> bool:
        """Whether both coefficients fall with slip speed, in whichever way."""
        return self.softens_with_heat or (
            self.slip_rate_decay > 0.0 and self.slip_rate_residual < 1.0
        )

    @property
    def softens_with_heat(self) -> bool:
        """Whether friction falls with flash temperature (thermal softening)."""
        return self.softening_temperature > 0.0

    def coefficient(self, slip: ArrayLike) -> FloatArray:
        """f(u) at slips u >= 0 [m] and zero slip speed [1], for any shape.

        Raises
        ------
        ValueError
            If a slip is negative or not finite.
        """
        u = checked("slip", slip, NOT_NEGATIVE)
        if self.weakening_length == 0.0:
            return np.where(u > 0.0, self.kinetic, self.static)
        with np.errstate(over="ignore"):  # at very large slips
            fraction = self.weakening.fraction(u / self.weakening_length)
        return np.asarray(self.kinetic + (self.static - self.kinetic) * fraction)

    def slip_rate_factor(self, slip_speed: ArrayLike) -> FloatArray:
        """Factor g(w) = (1 - A) exp(-B w) + A on both coefficients at slip speeds +-w [m/s].

        Raises
        ------
        ValueError
            If a slip speed is not finite.
        """
        w = np.abs(checked("slip_speed", slip_speed, FINITE))
        residual = self.slip_rate_residual
        with np.errstate(over="ignore"):
            share = np.exp(-self.slip_rate_decay * w)
        return np.asarray((1.0 - residual) * share + residual)


def _check_drop(what: str, static: float, kinetic: float) -> None:
    if not static > kinetic:
        raise ValueError(f"{what} = {static!r} is out of range: must be > kinetic = {kinetic!r}")


def _check_length(length: float) -> None:
    if not length > 0.0:
        raise ValueError(
            f"Eq. (2) gives the weakening length {length!r} m, which must be > 0: f is below its "
            "kinetic value over too much of the slip"
        )


def _limit(at: Callable[[float], float], static: float) -> float:
    """Value at which f settles, where it stays while the slip grows eightfold."""
    values = [static] * 4
    for u in DOUBLINGS:
        values = [*values[1:], at(float(u))]
        moved = abs(values[-1] - static) > ROUNDING * static
        if moved and np.ptp(values) <= ROUNDING * static:
            return values[-1]
    if values[-1] == static:
        _check_drop("f(0)", static, values[-1])
    raise ValueError(
        f"f does not settle: f({DOUBLINGS[-2]:g}) = {values[-2]!r} and f({DOUBLINGS[-1]:g}) = "
        f"{values[-1]!r}; give its limit as kinetic"
    )


def _weakening_length(
    at: Callable[[float], float], static: float, kinetic: float
) -> tuple[float, float, float]:
    """Slips at about half of the drop and at the full drop, and Delta of Eq. (2) [m]."""
    drop = static - kinetic
    half = next((float(u) for u in DOUBLINGS if at(float(u)) <= kinetic + 0.5 * drop), None)
    if half is None:
        raise ValueError(f"kinetic = {kinetic!r} is out of range: f does not fall half way to it")
    total, share = 0.0, np.inf
    for start, end in pairwise([0.0, 0.1 * half, *(half * 10.0 ** np.arange(DECADES + 1))]):
        # full_output suppresses quad's warnings of rounding, which the shares show as well
        part = quad(
            lambda u: (at(u) - kinetic) / drop,
            start,
            end,
            epsabs=1e-12 * abs(total),
            epsrel=1e-11,
            limit=400,
            full_output=1,
        )[0]
        total += part
        share = abs(part) / abs(total) if total != 0.0 else np.inf
        settled = end > half and abs(at(end) - kinetic) <= ROUNDING * static
        if settled and share <= TAIL:
            _check_length(total)
            return half, float(end), float(total)
    raise ValueError(
        f"kinetic = {kinetic!r}: the integral of Eq. (2) does not converge; the last decade, up to "
        f"u = {end:g} m, still adds {share:.1e} of it"
    )
