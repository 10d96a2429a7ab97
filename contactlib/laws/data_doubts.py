"""What measured points let doubt: the zero of their creepage, and whether they are one curve."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from contactlib.base.quantities import FloatArray
from contactlib.laws.traction_data import TractionData
from contactlib.laws.zero_offset import GROUP, zero_offset

APART = 0.03  # root mean square of a systematic residual, over the largest traction coefficient
F_RATIO = 12.0  # of its two coefficients: probability of some 1e-5 by chance, for 20 points


def shift_of(offset: float) -> str:
    """Sentence on points that run through zero at another creepage [1]."""
    sign, by = ("subtract", "from") if offset > 0.0 else ("add", "to")
    return (
        f"the points do not run through zero: their traction vanishes at a creepage of "
        f"{100 * offset:.2g} %; does the wheel's diameter have an error? to remove this offset, "
        f"{sign} {100 * abs(offset):.2g} % {by} every creepage"
    )


def doubts_of(
    data: TractionData, residual: Callable[[TractionData], FloatArray], suspect: int | None = None
) -> list[str]:
    """A sentence on each doubt of points: their offset, and whether they are one curve.

    Parameters
    ----------
    data : TractionData
        The points.
    residual : callable
        Residuals of the curve through given points: measured less fitted traction coefficient [1].
    suspect : int, optional
        As for `zero_offset`.
    """
    offset, several = zero_offset(data.creepage, data.traction_coefficient, suspect), None
    for _ in range(2):  # curves that differ by side also look like an offset
        shifted = data if offset is None else data.shifted(-offset)
        several = systematic_residual(shifted, residual(shifted))
        if offset is None or several is None:
            break
        offset = zero_offset(data.creepage, data.traction_coefficient / several[1], suspect)
    doubts = [] if offset is None else [shift_of(offset)]
    return doubts if several is None else [*doubts, several[0]]


def systematic_residual(data: TractionData, residual: FloatArray) -> tuple[str, FloatArray] | None:
    """Sentence on points that are several curves: by side, by speed, or by place in the file.

    With it comes the factor of each point's curve on the common one.

    Parameters
    ----------
    data : TractionData
        The points.
    residual : ndarray
        Their traction coefficient less that of the curve [1].
    """
    creepage, speed, side = data.creepage, data.speed, np.where(data.creepage < 0.0, -1.0, 1.0)
    residual = side * residual
    fitted = side * data.traction_coefficient - residual
    kinds = [(creepage < 0.0, "in traction", "in braking", "keep the rows of one side")]
    if speed is not None and speed.min() < speed.max():
        fast = speed > np.sqrt(speed.min() * speed.max())
        of_speed = (
            "keep the rows of one speed, or fit a law whose friction falls with slip speed by "
            "cl.fit(..., slip_rate=True)"
        )
        kinds.append((fast, _at(speed[~fast]), _at(speed[fast]), of_speed))
    row, of_one = np.arange(creepage.size), "keep the rows of one curve"
    later = row >= creepage.size // 2
    kinds.append((later, "of the first half of the rows", "of the second half", of_one))
    kinds.append((row % 2 == 1, "of the odd rows", "of the even rows", of_one))
    for second, first_kind, second_kind, remedy in kinds:
        off = _apart(np.abs(creepage), fitted, residual, second)
        if off is not None:
            text = (
                f"the residuals are systematic: the points {first_kind} are on average "
                f"{100 * off[0]:+.2g} % off the curve, those {second_kind} {100 * off[1]:+.2g} %; "
                f"are they one curve? if not, {remedy}"
            )
            return text, np.maximum(1.0 + np.where(second, off[1], off[0]), 0.1)
    return None


def _at(speed: FloatArray) -> str:
    low, high = f"{speed.min():.3g}", f"{speed.max():.3g}"
    return f"at {low} m/s" if low == high else f"at {low} to {high} m/s"


def _apart(
    creepage: FloatArray, fitted: FloatArray, residual: FloatArray, second: NDArray[np.bool_]
) -> tuple[float, float] | None:
    """Mean residuals of two groups over the curve, if the groups are apart where both are."""
    groups = ~second, second
    if min(int(group.sum()) for group in groups) < GROUP:
        return None
    low = max(float(creepage[group].min()) for group in groups)
    high = min(float(creepage[group].max()) for group in groups)
    both = (creepage >= low) & (creepage <= high)
    if min(int((group & both).sum()) for group in groups) < GROUP:
        return None
    q, r = fitted[both], residual[both]
    sign = np.where(second[both], -1.0, 1.0)
    place = np.log(np.maximum(creepage[both], 1e-3 * creepage.max()))
    place = (place - place.mean()) / (place.std() or 1.0)
    shape = np.column_stack([sign * q, sign * q * place])
    explained = shape @ np.linalg.lstsq(shape, r)[0]
    between, within = float(np.sum(explained**2)), float(np.sum((r - explained) ** 2))
    degrees = max(r.size - 2, 1)
    if np.sqrt(between / r.size) < APART * np.abs(fitted).max():
        return None
    if between / 2.0 < F_RATIO * within / degrees:
        return None
    means = [float(np.sum((r * q)[part]) / np.sum((q * q)[part])) for part in (sign > 0, sign < 0)]
    return means[0], means[1]
