"""Bounded least squares in coordinates from 0 to 1: search, covariance, profile intervals.

Least squares has several minima here, so the search starts at many places, which are the same on
every run.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq, least_squares

from contactlib.base.quantities import FloatArray, Limits, Quantity, checked_number, derived
from contactlib.laws.traction_data import TractionData

SCREENED, REFINED = 96, 6  # starting points tried, and searches from the best of them
PROFILE_POINTS = 6  # on each side of an estimate
STEP = 1e-6  # of the range: for derivatives; an estimate closer to an end counts as at that end
LOGARITHMIC = ("kinetic", "saturation_creepage", "softening_temperature")
WIDEST = 1e30  # largest ratio of the ends of a range that is searched by its logarithm
SINGULAR = 1e-6  # ratio of singular values below which the data do not determine a direction


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
