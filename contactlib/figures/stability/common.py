"""What the figures of stability share: lines by stability."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter
from numpy.typing import NDArray

from contactlib.figures.style import BLUE, DASHED, GREEN, ORANGE
from contactlib.parameters import FloatArray

# Three lines that differ in width as well, so that they can be told apart in grey.
THREE = ((BLUE, 1.2), (ORANGE, 2.0), (GREEN, 2.9))
STABLE, UNSTABLE = "stable at constant torque", "unstable at constant torque"
SHADE = "#EDEDED"


def by_stability(
    axes: Axes,
    x: FloatArray,
    y: FloatArray,
    stable: NDArray[np.bool_],
    *,
    color: str | None = None,
    labels: tuple[str | None, str | None] = (None, None),
    **style: Any,
) -> None:
    """A curve: solid where it is stable, dashed where it is not; of one colour or of two."""
    # A point beside a change belongs to both lines, so that they meet.
    changes = stable[1:] != stable[:-1]
    meets = ~stable | np.append(changes, False) & ~stable | np.append(False, changes) & stable
    axes.plot(x, np.where(stable, y, np.nan), color=color or BLUE, label=labels[0], **style)
    dashed: dict[str, Any] = {"color": color or ORANGE, "ls": DASHED, "label": labels[1]}
    axes.plot(x, np.where(meets, y, np.nan), **dashed, **style)


def dot(axes: Axes, x: float, y: float, *, stable: bool) -> None:
    """A state: filled if it is stable, hollow if it is not."""
    axes.plot([x], [y], "o", color="black", mfc="black" if stable else "white", ms=6.5, zorder=5)


def plain_log(axis: Axis, *steps: float) -> None:
    """Label a logarithmic axis with plain numbers, at these steps of each decade."""
    axis.set_major_locator(LogLocator(subs=steps))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def percent(creepage: float) -> str:
    """A creepage in words."""
    if creepage >= 10.0:
        return f"{100.0 * creepage:.0f} %"
    return f"{100.0 * creepage:#.3g}".rstrip(".") + " %"
