"""Fit the parameters of a creep force law to measured traction.

The model is mu(zeta) = f_d g q(x), x = zeta/(zeta0 g), where q is a law of `contactlib.laws` and g
is the factor on friction at the slip speed w = |zeta| V: (1 - A) exp(-B w) + A, or for thermal
softening `laws.thermal_contact.friction_factor`. A law's k_hat becomes k_hat/sqrt(g). With a layer
zeta0 is that of the clean contact, and lam does not depend on friction. Data often do not determine
some parameters, so each estimate comes with its confidence interval.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import MISSING, dataclass, fields, replace
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial.chebyshev import chebpts1, chebvander
from numpy.typing import ArrayLike
from scipy.optimize import brentq, least_squares
from scipy.special import fdtri, stdtrit

from contactlib import kernel
from contactlib.base.quantities import (
    FINITE,
    FloatArray,
    Limits,
    Quantity,
    checked,
    checked_number,
    derived,
)
from contactlib.laws.carter_griffith import CarterGriffith
from contactlib.laws.contact_law import K_HAT, LAYER_RATIO
from contactlib.laws.data_doubts import doubts_of
from contactlib.laws.friction import FALL_TEMPERATURE, Friction
from contactlib.laws.heat import ContactHeat
from contactlib.laws.hertz import Contact, EllipticContact
from contactlib.laws.law import Law
from contactlib.laws.scales import saturation_creepage
from contactlib.laws.thermal_contact import friction_factor
from contactlib.laws.traction_data import TractionData

SCALES = {
    "kinetic": Quantity("1", above=0.0, at_most=1e12),
    "saturation_creepage": Quantity("1", above=0.0, at_most=1e12),
}
OF_FRICTION = Friction.quantities()
SLIP_RATE = {name: OF_FRICTION[name] for name in ("slip_rate_residual", "slip_rate_decay")}
SOFTENING = {"softening_temperature": FALL_TEMPERATURE}
MAX_X = 1e300  # normalized creepage
K_NODES = 8  # laws between which k_hat/sqrt(g) is interpolated
SCREENED, REFINED = 96, 6  # starting points tried, and searches from the best of them
PROFILE_POINTS = 6  # on each side of an estimate
STEP = 1e-6  # of the range: for derivatives; an estimate closer to an end counts as at that end
LOGARITHMIC = ("kinetic", "saturation_creepage", "softening_temperature", "layer_compliance")
COMPLIANCES = (1e-15, 1e-10)  # of a layer [m/Pa]
WIDEST = 1e30  # largest ratio of the ends of a range that is searched by its logarithm
SINGULAR = 1e-6  # ratio of singular values below which the data do not determine a direction


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """One fitted parameter.

    Parameters
    ----------
    value : float
        The least-squares estimate, in `unit`.
    unit : str
        Its unit.
    standard_error : float
        From the Jacobian; nan if the data do not define it: at an end of the range, or in a
        direction that they do not determine.
    interval : tuple of float
        Confidence interval; it ends at the range searched where the data give no bound.
    range : tuple of float
        Ends of the range that was searched.
    """

    value: float
    unit: str
    standard_error: float
    interval: tuple[float, float]
    range: tuple[float, float]

    @property
    def identifiable(self) -> bool:
        """Whether the data determine the value: see the notes of `fit`."""
        low, high = self.interval
        inside = self.range[0] < low and high < self.range[1]
        return inside and high - low <= 10.0 * abs(self.value) and self.seen

    @property
    def seen(self) -> bool:
        """False if other parameters can compensate any change of this one."""
        return self.value in self.range or math.isfinite(self.standard_error)


@dataclass(frozen=True, kw_only=True, eq=False)
class FitResult:
    """Result of `fit`.

    Parameters
    ----------
    law : object
        The law at its estimates.
    estimates : mapping of str to Estimate
        The fitted parameters by name.
    fixed : mapping of str to float
        The parameters that were given.
    correlation : ndarray
        Correlation of the estimates in their order; nan where there is no standard error.
    residuals : ndarray
        Measured less fitted traction coefficient, one per point [1].
    level : float
        Confidence level of the intervals [1].
    profiled : bool
        True if the intervals are from the profile likelihood, False if from the standard errors.
    heat : ContactHeat or None
        Thermal model of the contact, if friction softens thermally.
    layer : LineContact, EllipticContact or None
        The clean contact, if a layer was fitted.
    doubts : tuple of str
        What makes the points doubtful: a zero offset, or residuals that are systematic by side, by
        speed or by place in the data; a sentence each.
    """

    law: Law
    estimates: Mapping[str, Estimate]
    fixed: Mapping[str, float]
    correlation: FloatArray
    residuals: FloatArray
    level: float
    profiled: bool
    heat: ContactHeat | None = None
    layer: Contact | None = None
    doubts: tuple[str, ...] = ()

    @property
    def values(self) -> dict[str, float]:
        """Every parameter by name, fitted or given; with a layer also saturation_creepage."""
        values = {**{name: e.value for name, e in self.estimates.items()}, **self.fixed}
        return values if self.layer is None else _with_clean_scale(values, self.layer)

    @property
    def rmse(self) -> float:
        """Root mean square of `residuals` [1]."""
        return float(np.sqrt(np.mean(self.residuals**2)))

    @property
    def aic(self) -> float:
        """Akaike's criterion; of fits to the same points, the minimum predicts best."""
        return self._criterion(2.0)

    @property
    def bic(self) -> float:
        """Schwarz's criterion, as `aic`; the penalty is ln(number of points) per parameter."""
        return self._criterion(math.log(self.residuals.size))

    def _criterion(self, cost: float) -> float:
        """-2 ln(likelihood) of normal errors, up to a constant, plus the penalty of parameters."""
        variance = max(self.rmse**2, float(np.finfo(np.float64).tiny))
        return self.residuals.size * math.log(variance) + cost * (len(self.estimates) + 1)

    def traction_coefficient(
        self, creepage: ArrayLike, speed: ArrayLike | None = None
    ) -> FloatArray:
        """Fitted Q/P at an array of creepages [1], and speeds [m/s] if friction falls with them."""
        zeta = checked("creepage", creepage, FINITE)
        points = TractionData(zeta, np.zeros_like(zeta), speed)
        return _traction_coefficient(self.law, self.values, points, self.heat)

    @property
    def caveats(self) -> tuple[str, ...]:
        """Parameters that the data do not determine, and `doubts`, one sentence each."""
        sentences = list(self.doubts)
        for name, e in self.estimates.items():
            if not e.identifiable:
                sentences.append(
                    f"{name} is not identifiable: at {100 * self.level:g} % the data allow "
                    f"{e.interval[0]:.3g} to {e.interval[1]:.3g} "
                    f"of the range {e.range[0]:.3g} to {e.range[1]:.3g}."
                )
        names = list(self.estimates)
        if blurred := [name for name in names if not self.estimates[name].seen]:
            sentences.append(f"Only combinations of {', '.join(blurred)} are identifiable.")
        for i, j in zip(*np.nonzero(np.abs(np.tril(self.correlation, -1)) > 0.95), strict=True):
            sentences.append(
                f"{names[j]} and {names[i]} are known only together: "
                f"their correlation is {self.correlation[i, j]:.3f}."
            )
        return tuple(sentences)

    def __str__(self) -> str:
        lines = [
            f"{type(self.law).__name__}, {len(self.residuals)} points: "
            f"root mean square of the residuals {self.rmse:.4f}"
        ]
        for name, e in self.estimates.items():
            unit = "" if e.unit == "1" else f" {e.unit}"
            lines.append(
                f"{name} = {e.value:.4g}{unit}, standard error {e.standard_error:.2g}, "
                f"{100 * self.level:g} % interval {e.interval[0]:.4g} to {e.interval[1]:.4g}"
            )
        return "\n".join([*lines, *self.caveats])


def fit(
    law: type[Any],
    data: TractionData,
    *,
    slip_rate: bool = False,
    heat: ContactHeat | None = None,
    layer: Contact | None = None,
    level: float = 0.95,
    ranges: Mapping[str, tuple[float, float]] | None = None,
    **fixed: Any,
) -> FitResult:
    """Fit a law to measured traction by least squares.

    The parameters are ``kinetic`` (f_d), ``saturation_creepage`` (zeta0), every quantity of the
    law that has no default and, if `slip_rate`, ``slip_rate_residual`` (A) and ``slip_rate_decay``
    (B), or, if `heat`, ``softening_temperature`` (T_m). With `layer`, ``layer_compliance`` (L)
    takes the place of ``saturation_creepage``. Parameters given as keywords are held, the others
    are fitted.

    Parameters
    ----------
    law : type
        A law such as `CarterGriffith` or `Polach`. Carter's is CarterGriffith with ``k_hat=0.0``;
        Coulomb friction is Carter's law with a saturation creepage far below the data's.
    data : TractionData
        The measured points; with their speed if `slip_rate` or `heat`.
    slip_rate : bool
        Whether friction falls with slip speed.
    heat : ContactHeat, optional
        Thermal model of the contact; its friction f_d (1 - T/T_m) falls with its temperature.
        kinetic and T_m refer to the temperature at which the surfaces enter.
    layer : LineContact or EllipticContact, optional
        The clean contact at the load of the data. zeta0 then follows from f_d, Eq. (15), and the
        slope from a thin elastic layer between the bodies, whose shear compliance L is its
        thickness over its shear modulus. The law must be `CarterGriffith`; its ``layer_ratio`` is
        L E_t/(2 a) with the contact's `tangential_modulus` E_t, and its ``contact`` that of
        `layer`. The fit does not contain the softening of a half-space.
    level : float
        Confidence level of the intervals [1], between 0 and 1.
    ranges : mapping of str to (float, float), optional
        Ranges to search. Default: the law's own limits; for kinetic 1/100 to 10 times the largest
        traction coefficient; for saturation_creepage 1/1000 of the smallest to 1000 times the
        largest creepage; for slip_rate_decay 0 to 100 over the largest slip speed; for
        softening_temperature 1 to 1e6 K; for layer_compliance 1e-15 to 1e-10 m/Pa, or less at the
        law's largest ``layer_ratio``.
    **fixed
        Parameters to hold, and options of the law such as ``contact="line"``.

    Returns
    -------
    FitResult

    Raises
    ------
    ValueError
        If a value or a range is out of its limits, a parameter has no finite range, the data lack
        a speed, no point has a creepage, there are no more points than free parameters, `heat`
        comes with `slip_rate`, `heat` or `layer` with a law for another shape of contact, or
        `layer` with another law than `CarterGriffith`.
    TypeError
        If the law does not have an option.

    Notes
    -----
    Where the Jacobian is regular and the intervals stay inside the ranges, intervals are the
    estimate plus and minus Student's t times the standard error. Otherwise all intervals are those
    of the profile likelihood: the values at which the sum of squares, at its minimum over the other
    parameters, is at most 1 + F(level; 1, n - p)/(n - p) times the overall minimum. A parameter is
    called not identifiable if its interval reaches an end of its range or is wider than ten times
    the estimate, or if the Jacobian is singular in its direction: other parameters can then
    compensate any change of it, and only their ranges bound the interval. Parameters whose estimate
    is at an end of its range are not in the Jacobian; standard errors treat them as known. All this
    assumes that the law is true and that the errors of the points are independent and of equal
    variance. An interval does not show whether another law fits better: compare `FitResult.rmse`.

    Polach's law depends on kA and kS only through kA/zeta0 and kS/zeta0. Hold
    ``saturation_creepage`` to fit it; for another zeta0, kA and kS change in proportion. If all
    three are fitted, they are not identifiable.

    A fit takes seconds, or half a minute if both k_hat and the slip rate are free.

    Examples
    --------
    >>> from contactlib.laws.carter_griffith import CarterGriffith
    >>> law = CarterGriffith(k_hat=0.3)
    >>> zeta = np.linspace(0.001, 0.06, 60)
    >>> noise = 0.002 * np.cos(12345.0 * zeta)
    >>> data = TractionData(zeta, 0.21 * law.traction_ratio(zeta / 0.015) + noise)
    >>> result = fit(CarterGriffith, data, contact="line")
    >>> e = result.estimates["k_hat"]
    >>> e.identifiable, e.interval[0] < 0.3 < e.interval[1]
    (True, True)
    """
    level = checked_number("level", level, Limits(above=0.0, below=1.0))
    if (slip_rate or heat) and data.speed is None:
        raise ValueError(f"{'slip_rate' if slip_rate else 'heat'} needs data with a speed")
    if slip_rate and heat:
        raise ValueError("slip_rate = True cannot be combined with heat")
    if not data.creepage.any():
        raise ValueError("no point of the data has a creepage")
    of_law = {
        field.name: law.quantities()[field.name]
        for field in fields(law)
        if field.name in law.quantities() and field.default is MISSING
    }
    falls = SLIP_RATE if slip_rate else SOFTENING if heat else {}
    scales = SCALES
    if layer is not None:
        if law is not CarterGriffith:
            raise ValueError(f"layer is for CarterGriffith, not for {law.__name__}")
        per_compliance = 0.5 * layer.tangential_modulus / layer.semi_width
        most = LAYER_RATIO.at_most / per_compliance
        compliance = Quantity("m/Pa", at_least=0.0, at_most=most)
        scales = {"kinetic": SCALES["kinetic"], "layer_compliance": compliance}
        shape = "elliptic" if isinstance(layer, EllipticContact) else "line"
        if fixed.setdefault("contact", shape) != shape:
            raise ValueError(f"contact = {fixed['contact']!r} must be the layer's, {shape!r}")
    quantities = {**scales, **of_law, **falls}
    options = {name: fixed.pop(name) for name in set(fixed) - set(quantities)}
    for name, value in fixed.items():
        fixed[name] = checked_number(name, value, quantities[name])
    free = [name for name in quantities if name not in fixed]
    ranges = ranges or {}
    if unknown := sorted(set(ranges) - set(free)):
        raise ValueError(f"{unknown[0]} is not a free parameter: they are {', '.join(free)}")
    degrees = data.creepage.size - len(free)
    if degrees < 1 or not free:
        raise ValueError(f"{data.creepage.size} points for {len(free)} free parameters")
    axes = [axis_of(name, quantities[name], data, ranges.get(name)) for name in free]

    def law_with(values: Mapping[str, float]) -> Law:
        given = {name: values[name] for name in of_law}
        if layer is not None:
            given["layer_ratio"] = values["layer_compliance"] * per_compliance
        made: Law = law(**given, **options)
        if heat and getattr(made, "contact", heat.shape) != heat.shape:
            raise ValueError(f"heat.shape = {heat.shape!r} must be the law's contact")
        return made

    def all_values(theta: FloatArray) -> dict[str, float]:
        fitted = {n: a.value(float(t)) for n, a, t in zip(free, axes, theta, strict=True)}
        values = {**fitted, **fixed}
        return values if layer is None else _with_clean_scale(values, layer)

    def residuals(theta: FloatArray) -> FloatArray:
        values = all_values(theta)
        model = _traction_coefficient(law_with(values), values, data, heat)
        return np.asarray(data.traction_coefficient - model)

    problem = Problem(residuals, len(free))
    theta = problem.settled(problem.search(axes))
    values = all_values(theta)
    covariance = problem.covariance(theta, degrees)
    stretch = np.array([a.derivative(float(t)) for a, t in zip(axes, theta, strict=True)])
    covariance = covariance * np.outer(stretch, stretch)
    errors = np.sqrt(np.diag(covariance))
    reach = float(stdtrit(degrees, 0.5 + 0.5 * level)) * errors
    estimate = np.array([values[name] for name in free])
    low, high = np.array([(a.low, a.high) for a in axes]).T
    profiled = not bool(np.all((estimate - reach > low) & (estimate + reach < high)))
    if profiled:
        limit = 1.0 + float(fdtri(1, degrees, level)) / degrees
        coordinates = [problem.profile_interval(theta, j, limit) for j in range(len(free))]
        intervals = [
            (axis.value(a), axis.value(b)) for axis, (a, b) in zip(axes, coordinates, strict=True)
        ]
    else:
        intervals = list(zip(estimate - reach, estimate + reach, strict=True))
    rest = residuals(theta)
    doubts = doubts_of(data, lambda points: rest)
    return FitResult(
        law=law_with(values),
        estimates={
            name: Estimate(
                value=values[name],
                unit=quantities[name].unit,
                standard_error=float(error),
                interval=(float(interval[0]), float(interval[1])),
                range=(axis.low, axis.high),
            )
            for name, error, interval, axis in zip(free, errors, intervals, axes, strict=True)
        },
        fixed=fixed,
        correlation=covariance / np.outer(errors, errors),
        residuals=rest,
        level=level,
        profiled=profiled,
        heat=heat,
        layer=layer,
        doubts=tuple(f"{text[0].upper()}{text[1:]}." for text in doubts),
    )


def _with_clean_scale(values: Mapping[str, float], layer: Contact) -> dict[str, float]:
    """Add zeta0 of the clean contact, which is proportional to friction."""
    of_one = Friction(static=1.0, kinetic=1.0, weakening_length=0.0)
    zeta0 = values["kinetic"] * saturation_creepage(layer, of_one)
    return {**values, "saturation_creepage": zeta0}


def _traction_coefficient(
    law: Law, values: Mapping[str, float], data: TractionData, heat: ContactHeat | None
) -> FloatArray:
    kinetic, zeta0 = values["kinetic"], values["saturation_creepage"]
    x = _finite_ratio(data.creepage, zeta0)
    if heat is None and "slip_rate_residual" not in values:
        return np.asarray(
            kinetic * _ratio_at_k_hats(law, x, np.full(x.shape, values.get("k_hat", 0.0)))
        )
    if data.speed is None:
        raise ValueError("friction falls with slip speed, so a speed is needed")
    if heat is None:
        residual, decay = values["slip_rate_residual"], values["slip_rate_decay"]
        g = (1.0 - residual) * np.exp(-decay * np.abs(data.creepage) * data.speed) + residual
    else:
        warmth = kinetic * heat.rise_per_creepage(data.creepage, data.speed)
        number = warmth * (zeta0 / values["softening_temperature"])
        cold = values.get("k_hat", 0.0)
        g = friction_factor(x, number, k_hat=cold, contact=heat.shape)
    ratio = _ratio_at_k_hats(law, _finite_ratio(x, g), values.get("k_hat", 0.0) / np.sqrt(g))
    return np.asarray(kinetic * g * ratio)


@cache
def _shipped(contact: str) -> kernel.NativeTable:
    """The table of the law with a layer: the kernel reads it without the room that builds it."""
    return kernel.NativeTable(kernel.shipped_path(contact).read_bytes())


def _finite_ratio(a: FloatArray, b: FloatArray | float) -> FloatArray:
    """Creepage a/b, limited to finite floats, where laws have reached their last value."""
    with np.errstate(over="ignore"):
        return np.asarray(np.clip(a / b, -MAX_X, MAX_X))


def _ratio_at_k_hats(law: Any, x: FloatArray, k_hat: FloatArray) -> FloatArray:
    """Traction ratio with a k_hat for each point, interpolated between Chebyshev nodes in its log.

    A k_hat beyond the law's range is replaced by the end of the range. With a layer, where a law
    takes a hundred times as long, the shipped table gives it.
    """
    if isinstance(law, CarterGriffith) and law.layer_ratio > 0.0:
        held = np.minimum(k_hat, K_HAT.at_most)
        return _shipped(law.contact).evaluate(x, held, np.full(x.shape, law.layer_ratio))[0]
    if not k_hat.any():
        return np.asarray(law.traction_ratio(x))
    highest = law.quantities()["k_hat"].at_most
    logs = np.log(np.minimum(k_hat, highest))
    first, last = float(logs.min()), float(logs.max())
    if first == last:
        return np.asarray(replace(law, k_hat=min(float(k_hat[0]), highest)).traction_ratio(x))
    nodes = chebpts1(K_NODES)
    k_nodes = np.minimum(np.exp(0.5 * (first + last) + 0.5 * (last - first) * nodes), highest)
    samples = np.array([replace(law, k_hat=float(k)).traction_ratio(x) for k in k_nodes])
    places = (2.0 * logs - first - last) / (last - first)
    weights = chebvander(places, K_NODES - 1) @ np.linalg.inv(chebvander(nodes, K_NODES - 1))
    return np.asarray((weights * samples.T).sum(axis=1))


# ---- bounded least squares in coordinates from 0 to 1 --------------------------------------
# There are several minima, so the search starts at many places, the same on every run.


class Axis(NamedTuple):
    """A free parameter's range, mapped to 0..1, and the part where searches start."""

    low: float
    high: float
    start: tuple[float, float]
    logarithmic: bool

    def value(self, theta: float) -> float:
        """Value at a coordinate; exact at the ends, as rounding must not leave the range."""
        if theta in (0.0, 1.0):
            return self.high if theta else self.low
        if self.logarithmic:
            return float(self.low * (self.high / self.low) ** theta)
        return self.low + theta * (self.high - self.low)

    def derivative(self, theta: float) -> float:
        """Derivative of the value by the coordinate."""
        if self.logarithmic:
            return self.value(theta) * math.log(self.high / self.low)
        return self.high - self.low


def axis_of(
    name: str, limits: Quantity, data: TractionData, given: tuple[float, float] | None
) -> Axis:
    """Range of a parameter: the given one, or what its limits and the data suggest."""
    zeta = np.abs(data.creepage[data.creepage != 0.0])
    largest = float(np.abs(data.traction_coefficient).max()) or 1.0
    low, high = max(limits.at_least, limits.above), min(limits.at_most, limits.below)
    if math.isfinite(high - low):  # a value near an end that is not allowed
        low, high = (
            low if limits.allows(low) else low + 1e-6 * (high - low),
            high if limits.allows(high) else high - 1e-6 * (high - low),
        )
    start = (0.05, 0.6)  # fractions of the range: most laws have small parameters
    if name == "kinetic":
        low, high = 1e-2 * largest, 10.0 * largest
        start = (math.log(60.0) / math.log(1e3), math.log(200.0) / math.log(1e3))
    elif name == "saturation_creepage":
        low, high = 1e-3 * float(zeta.min()), 1e3 * float(zeta.max())
        step = math.log(1e3) / math.log(high / low)
        start = (step, 1.0 - step)
    elif name == "softening_temperature":
        start = (math.log(1e2) / math.log(1e6), math.log(4e3) / math.log(1e6))
    elif name == "layer_compliance":
        low, high = COMPLIANCES[0], min(COMPLIANCES[1], high)
        start = (0.2, 0.8)
    elif name == "slip_rate_decay":
        assert data.speed is not None  # noqa: S101 (for mypy; fit has checked it)
        high = 100.0 / float(np.abs(data.creepage * data.speed).max())
        start = (1e-3, 0.05)
    if given is not None:
        low, high = (checked_number(f"ranges[{name!r}]", end, limits) for end in given)
        start = (0.05, 0.95)
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise ValueError(f"{name} has no range to search: give its value, or ranges[{name!r}]")
    if name in LOGARITHMIC:
        ends = {"low": low, "high": high}
        derived(f"high/low of ranges[{name!r}]", lambda: high / low, ends, Limits(at_most=WIDEST))
    return Axis(float(low), float(high), start, name in LOGARITHMIC)


class Problem:
    """Residuals as a function of `size` coordinates from 0 to 1."""

    def __init__(self, residuals: Callable[[FloatArray], FloatArray], size: int) -> None:
        self.residuals, self.size = residuals, size

    def cost(self, theta: FloatArray) -> float:
        """Sum of squares."""
        return float(np.sum(self.residuals(theta) ** 2))

    def refine(
        self, theta: FloatArray, held: tuple[int, ...] = (), tolerance: float = 1e-11
    ) -> FloatArray:
        """The minimum near `theta` with the coordinates `held` fixed."""
        whole = theta.copy()
        moving = np.setdiff1d(np.arange(self.size), held)
        if not moving.size:
            return whole

        def part(moved: FloatArray) -> FloatArray:
            whole[moving] = moved
            return self.residuals(whole)

        solution = least_squares(
            part, theta[moving], bounds=(0.0, 1.0), ftol=tolerance, xtol=1e-10, gtol=1e-12
        )
        whole[moving] = solution.x
        return whole

    def search(self, axes: list[Axis]) -> FloatArray:
        """The best minimum found from evenly scattered starts, the same on every run."""
        low, high = np.array([axis.start for axis in axes]).T
        # Additive recurrence with the powers of the root of phi**(size + 1) = phi + 1.
        phi = float(brentq(lambda p: p ** (self.size + 1) - p - 1.0, 1.0, 2.0))
        steps = phi ** -np.arange(1.0, self.size + 1.0)
        scatter = (0.5 + np.outer(np.arange(SCREENED), steps)) % 1.0
        starts = sorted(low + (high - low) * scatter, key=self.cost)[:REFINED]
        return min((self.refine(start) for start in starts), key=self.cost)

    def settled(self, theta: FloatArray) -> FloatArray:
        """`theta`, with each coordinate near an end of its range moved there if it fits as well."""
        held: tuple[int, ...] = ()
        for j in range(self.size):
            end = round(float(theta[j]))
            if abs(theta[j] - end) < 0.01:
                at_end = theta.copy()
                at_end[j] = end
                at_end = self.refine(at_end, held=(*held, j))
                if self.cost(at_end) <= self.cost(theta) * (1.0 + 1e-9):
                    theta, held = at_end, (*held, j)
        return theta

    def covariance(self, theta: FloatArray, degrees: int) -> FloatArray:
        """Covariance of the coordinates; nan where the data do not define it."""
        covariance = np.full((self.size, self.size), np.nan)
        inside = np.flatnonzero((theta > STEP) & (theta < 1.0 - STEP))
        if not inside.size:
            return covariance
        steps = STEP * np.eye(self.size)[inside]
        rises = [self.residuals(theta + step) - self.residuals(theta - step) for step in steps]
        jacobian = np.array(rises).T / (2.0 * STEP)
        norms = np.linalg.norm(jacobian, axis=0)
        norms[norms == 0.0] = 1.0
        _, sizes, directions = np.linalg.svd(jacobian / norms, full_matrices=False)
        seen = sizes > SINGULAR * sizes[0]
        blurred = (np.abs(directions[~seen]) > 1e-3).any(axis=0)
        scaled = directions[seen].T / sizes[seen]
        part = scaled @ scaled.T / np.outer(norms, norms) * self.cost(theta) / degrees
        part[blurred], part[:, blurred] = np.nan, np.nan
        covariance[np.ix_(inside, inside)] = part
        return covariance

    def profile_interval(self, theta: FloatArray, j: int, limit: float) -> tuple[float, float]:
        """Range of coordinate j where the profiled sum of squares is within `limit`."""
        allowed = limit * self.cost(theta)

        def excess(coordinate: float, near: FloatArray) -> tuple[float, FloatArray]:
            start = near.copy()
            start[j] = coordinate
            best = self.refine(start, held=(j,), tolerance=1e-6)
            return self.cost(best) - allowed, best

        def end(bound: float) -> float:
            """The outermost crossing on a grid that is denser near the estimate."""
            inside, outside, anchor, near = float(theta[j]), None, theta, theta
            for part in np.linspace(0.0, 1.0, PROFILE_POINTS + 1)[1:] ** 3:
                coordinate = bound if part == 1.0 else float(theta[j] + part * (bound - theta[j]))
                over, near = excess(coordinate, near)
                if over <= 0.0:
                    inside, outside, anchor = coordinate, None, near
                elif outside is None:
                    outside = coordinate
            if outside is None:
                return bound
            return float(
                brentq(
                    lambda c: excess(c, anchor)[0],
                    inside,
                    outside,
                    xtol=1e-3 * abs(outside - inside),
                )
            )

        return end(0.0), end(1.0)
