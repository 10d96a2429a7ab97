"""The creep curve as a table for other tools: few points, and a stated error between them.

The points along an axis come from a longest-step walk: from one point, the next lies as far away
as the interpolation error allows. This gives the minimum number of points on the curve.
"""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise, product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline, RegularGridInterpolator
from scipy.io import savemat
from scipy.optimize import brentq

from contactlib import kernel
from contactlib.base.lazy import optional_library
from contactlib.base.quantities import FloatArray, Limits, checked, checked_number, shown
from contactlib.base.text import harmless_line, version
from contactlib.base.writing import write_whole
from contactlib.element.force_element import ForceElement, creepage_limits

if TYPE_CHECKING:
    from xarray import Dataset

    from contactlib.files.model import Model

Axis = float | Sequence[float] | FloatArray | slice
ERRORS = {"linear": 1e-3, "cubic": 1e-5}  # default by interpolation
ERROR = Limits(at_least=1e-7, at_most=0.1)
DEFAULT_SPEED = 10.0  # m/s
MAX_ENTRIES = 10_000_000
MAX_EXACT = 16  # operating points whose peaks and kinks are all among the creepages
AXIS_POINTS = 201  # of an axis, and of the creepage, when the axis's points are chosen
CHECKED = 400  # operating points at which the error is measured
AXES = {  # unit and meaning
    "normal_load": ("N", "load of all wheels together"),
    "speed": ("m/s", "forward speed"),
    "friction_scale": ("1", "factor on both friction coefficients"),
    "creepage": ("1", "creepage (omega radius - speed)/speed"),
}
FIELDS = {
    "creep_force": ("N", "creep force, positive in traction"),
    "traction_coefficient": ("1", "creep force over load"),
    "slope": ("N", "derivative of the creep force by the creepage"),
}
MEANING = {
    "linear": "linear",
    "cubic": "cubic along the creepage, from creep_force and slope (Hermite); linear along others",
}


def lookup_table(
    model: Model | ForceElement,
    *,
    normal_load: Axis | None = None,
    speed: Axis = DEFAULT_SPEED,
    friction_scale: Axis = 1.0,
    largest_creepage: float = 1.0,
    error: float | None = None,
    interpolation: str = "linear",
) -> Dataset:
    """Creep force over creepage as a table, between whose points a tool interpolates.

    Parameters
    ----------
    model : Model or ForceElement
        Gives the creep force.
    normal_load, speed, friction_scale : float, sequence of float or slice, optional
        Load of all wheels together [N], forward speed [m/s] and factor on both friction
        coefficients [1]. Several numbers become an axis of the table. A ``slice(lowest, highest)``
        becomes an axis whose points are chosen, so that linear interpolation between them keeps the
        error. Default: the nominal load, 10 m/s and 1. Speed matters only if friction falls with
        slip speed.
    largest_creepage : float, optional
        End of the creepages, which begin at zero, as the force is odd [1]. Default: 1.
    error : float, optional
        Largest error of the interpolated force over the largest force at the same load, speed and
        friction [1], from 1e-7 to 0.1. Default: 1e-3, or 1e-5 if the interpolation is cubic.
    interpolation : {"linear", "cubic"}, optional
        Linear, or with the cubic along the creepage that has the table's values and slopes.
        Default: linear.

    Returns
    -------
    xarray.Dataset
        ``creep_force`` [N], ``traction_coefficient`` [1] and ``slope``, the derivative of the force
        by the creepage [N], over those of ``normal_load``, ``speed`` and ``friction_scale`` that
        are axes, and over ``creepage``. At up to 16 operating points the creepages have each peak,
        and each end of the stick zone or of the limit to static friction. The attributes state the
        error and how it was verified.

    Raises
    ------
    ValueError
        If a value is out of range, or the table would have more than 10 million entries.

    Examples
    --------
    >>> from contactlib.files.model import load_model
    >>> table = lookup_table(load_model("roller_rig.toml"))
    >>> table.sizes["creepage"], table.attrs["largest_error_found"] < 1e-3
    (27, True)
    """
    xarray = optional_library("xarray")

    if interpolation not in ERRORS:
        raise ValueError(
            f"interpolation = {shown(interpolation)} must be one of: {', '.join(ERRORS)}"
        )
    element = model if isinstance(model, ForceElement) else model.wheelset.element
    error = checked_number("error", ERRORS[interpolation] if error is None else error, ERROR)
    given = {
        "normal_load": element.normal_load if normal_load is None else normal_load,
        "speed": speed,
        "friction_scale": friction_scale,
    }
    limits: dict[str, Limits] = dict(kernel.force_input_limits())
    for name, smallest in (  # below these all curves are of one shape, too narrow for a table
        ("normal_load", 1e-6 * element.normal_load),
        ("speed", element.minimum_speed),
        ("friction_scale", 1e-3),
    ):
        limits[name] = Limits(at_least=smallest, at_most=limits[name].at_most)
    ends = {name: _axis(name, value, limits[name]) for name, value in given.items()}
    highest = float(ends["speed"].max())
    maximum = creepage_limits(element, highest).at_most
    below = Limits(at_least=1e-6, at_most=maximum, given=("speed", highest))
    largest = checked_number("largest_creepage", largest_creepage, below)
    chosen = [name for name, value in given.items() if isinstance(value, slice)]
    law = _Law(element, largest, interpolation, error)
    for attempt in range(8):
        axes = law.choose(ends, chosen, 0.7**attempt * 0.98 * error)
        fields = law.over(axes)
        found, points = law.error_between(axes, fields, chosen)
        if found <= error:
            break
        law.count *= 2
    else:
        raise ValueError(f"error = {error!r} is out of reach for this law: {found:.2g} is left")
    named = {} if isinstance(model, ForceElement) else {"model": model.name, "source": model.source}
    if element.table.note:
        named["measured_curve"] = element.table.note
    several = [name for name in given if axes[name].size > 1]
    other = ""
    if several != chosen:
        worst, _ = law.error_between(axes, fields, several)
        other = f"; between the given points of the other axes it is up to {worst:.2g}"
    kept = [name for name in axes if name in several or name == "creepage"]
    shape = [axes[name].size for name in kept]
    made: Dataset = xarray.Dataset(
        {
            name: (
                kept,
                field.reshape(shape),
                {"units": FIELDS[name][0], "long_name": FIELDS[name][1]},
            )
            for name, field in fields.items()
        },
        coords={
            name: (
                name if name in kept else (),
                axis if name in kept else axis[0],
                {"units": AXES[name][0], "long_name": AXES[name][1]},
            )
            for name, axis in axes.items()
        },
        attrs={
            "title": f"creep force over creepage, by contactlib {version()}",
            **named,
            "law": element.table.law,
            "interpolation": MEANING[interpolation],
            "error": error,
            "largest_error_found": found,
            "error_is": "of the interpolated creep_force, over the largest force at the same load, "
            f"speed and friction; measured at {points} points{other}",
            "symmetry": "the force at a negative creepage is minus that at the positive one",
        },
    )
    return made


def _axis(name: str, value: Any, limits: Limits) -> FloatArray:
    """Points of an axis, or the two ends of one whose points are to be chosen."""
    if isinstance(value, slice):
        if value.step is not None or value.start is None or value.stop is None:
            raise ValueError(f"{name} = {shown(value)} must be slice(lowest, highest)")
        value = [value.start, value.stop]
    axis = np.atleast_1d(checked(name, value, limits))
    if axis.ndim > 1 or axis.size == 0 or (np.diff(axis) <= 0.0).any():
        raise ValueError(
            f"{name} = {shown(value)} must be a number, or strictly increasing numbers"
        )
    return axis


def _check_size(shape: Sequence[int]) -> None:
    if float(np.prod([float(size) for size in shape])) > MAX_ENTRIES:
        sizes = " times ".join(map(str, shape))
        raise ValueError(f"the table would have {sizes} entries: must be <= {MAX_ENTRIES}")


class _Law:
    """The force of an element over axes, and the interpolation between points of them."""

    def __init__(
        self, element: ForceElement, largest: float, interpolation: str, error: float
    ) -> None:
        self.element, self.largest = element, largest
        self.cubic = interpolation == "cubic"
        self.count = max(2000, int(40.0 * error ** (-0.25 if self.cubic else -0.5)))

    def at(self, point: Sequence[float], creepage: FloatArray | float) -> NDArray[np.void]:
        """All outputs at creepages, and one load, speed and friction scale."""
        load, speed, scale = point
        return self.element.at_creepage(
            creepage, speed=speed, normal_load=load, friction_scale=scale
        )

    def over(self, axes: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """Force, traction coefficient and slope on the grid of the axes."""
        *others, creepage = (axes[name] for name in AXES)
        shape = tuple(axes[name].size for name in AXES)
        _check_size(shape)
        fields = {name: np.empty(shape) for name in FIELDS}
        for place, point in zip(np.ndindex(shape[:3]), product(*others), strict=True):
            values = self.at(point, creepage)
            fields["creep_force"][place] = values["creep_force"]
            fields["traction_coefficient"][place] = values["traction_coefficient"]
            fields["slope"][place] = values["force_gradient"] * point[1]
        return fields

    def dense(self, points: Sequence[Sequence[float]], count: int) -> FloatArray:
        """Dense creepages, denser where the curves of the points rise."""
        zeta0 = min(
            self.element.saturation_creepage_at(normal_load=load, friction_scale=scale)
            for load, _, scale in points
        )
        u = np.linspace(0.0, self.largest / (self.largest + zeta0), count)
        return np.append(zeta0 * u[:-1] / (1.0 - u[:-1]), self.largest)

    def exact(self, dense: FloatArray, point: Sequence[float]) -> list[float]:
        """Creepages of peaks, of the end of sticking, and of the limit to static friction."""
        bends: dict[str, Callable[[NDArray[np.void]], Any]] = {
            "peak": lambda values: values["force_gradient"],
            "limit": lambda values: values["force_margin"],
        }
        if not self.element.table.one_axis:
            bends["end of sticking"] = lambda values: values["normalized_creepage"] - 1.0
        values = self.at(point, dense)
        found = []
        for name, bend in bends.items():
            signs = np.sign(bend(values))
            for i in np.flatnonzero(signs[:-1] * signs[1:] < 0.0):

                def rest(x: float, bend: Callable[[NDArray[np.void]], Any] = bend) -> float:
                    return float(bend(self.at(point, x)))

                root = float(brentq(rest, dense[i], dense[i + 1], xtol=1e-15))
                # The slope jumps at the limit: a cubic needs both of its values.
                sides = (1.0 - 1e-9, 1.0 + 1e-9) if self.cubic and name == "limit" else (1.0,)
                found += [root * side for side in sides]
        return found

    def choose(
        self, ends: Mapping[str, FloatArray], chosen: Sequence[str], tolerance: float
    ) -> dict[str, FloatArray]:
        """Points of all axes; the errors along the chosen ones and the creepage add up."""
        tolerance /= 1.0 + len(chosen)
        axes = dict(ends)
        _check_size([100, *(axis.size for axis in ends.values())])  # creepages, at least
        few = {n: np.linspace(e[0], e[-1], 4) if n in chosen else e for n, e in ends.items()}
        for name in chosen:
            along = np.geomspace(ends[name][0], ends[name][-1], AXIS_POINTS)
            along[0], along[-1] = ends[name]
            grid = {**few, name: along}
            grid["creepage"] = self.dense(list(product(*ends.values())), AXIS_POINTS)
            force = np.moveaxis(self.over(grid)["creep_force"], list(AXES).index(name), 0)
            scale = np.abs(force).max(axis=-1, keepdims=True) * np.ones(force.shape[-1])
            force, scale = (part.reshape(AXIS_POINTS, -1) for part in (force, scale))
            axes[name] = along[_walk(along, force, None, scale, [], tolerance)]
        _check_size([100, *(axis.size for axis in axes.values())])
        points = list(product(*axes.values()))
        dense = self.dense(points, self.count)
        corners = (
            points if len(points) <= MAX_EXACT else product(*(e[[0, -1]] for e in ends.values()))
        )
        exact = [x for point in corners for x in self.exact(dense, point) if x < self.largest]
        dense = np.unique(np.append(dense, exact))
        maximum = max(2, MAX_ENTRIES // dense.size)
        if len(points) > maximum:
            points = [points[i] for i in np.linspace(0, len(points) - 1, maximum).astype(int)]
        fields = [
            (values["creep_force"], values["force_gradient"] * point[1])
            for point in points
            for values in [self.at(point, dense)]
        ]
        force, slope = (np.stack(part, axis=1) for part in zip(*fields, strict=True))
        scale = np.abs(force).max(axis=0)
        forced = np.searchsorted(dense, exact).tolist()
        kept = _walk(dense, force, slope if self.cubic else None, scale, forced, tolerance)
        return {**axes, "creepage": dense[kept]}

    def error_between(
        self,
        axes: Mapping[str, FloatArray],
        fields: Mapping[str, FloatArray],
        along: Sequence[str],
    ) -> tuple[float, int]:
        """Largest relative error found along the creepage and these axes, and points compared."""
        random = np.random.default_rng(0)
        columns = [
            random.uniform(axis[0], axis[-1], CHECKED)
            if name in along
            else random.choice(axis, CHECKED)
            for name, axis in axes.items()
            if name != "creepage"
        ]
        points = np.unique(np.stack(columns, axis=1), axis=0)
        creepage = axes["creepage"]
        each = 66 if len(points) <= MAX_EXACT else 18
        fine = np.unique(np.concatenate([np.linspace(*c, each) for c in pairwise(creepage)]))
        several = [i for i, axis in enumerate(axes.values()) if axis.size > 1 and i < 3]
        single = tuple(i for i in range(3) if i not in several)

        def curves(name: str) -> FloatArray:
            if not several:
                return np.broadcast_to(fields[name][0, 0, 0], (len(points), creepage.size))
            grid = [list(axes.values())[i] for i in several]
            known = RegularGridInterpolator(grid, np.squeeze(fields[name], single))
            return np.asarray(known(points[:, several]))

        worst = 0.0
        for point, force, slope in zip(points, curves("creep_force"), curves("slope"), strict=True):
            law = self.at(point.tolist(), fine)["creep_force"]
            between = (
                CubicHermiteSpline(creepage, force, slope)(fine)
                if self.cubic
                else np.interp(fine, creepage, force)
            )
            worst = max(worst, float(np.abs(between - law).max() / np.abs(law).max()))
        return worst, len(points) * fine.size


def _walk(
    at: FloatArray,
    values: FloatArray,
    slopes: FloatArray | None,
    scale: FloatArray,
    forced: Sequence[int],
    tolerance: float,
) -> list[int]:
    """Indices of the points of a longest-step walk through all columns of values."""

    def holds(first: int, last: int) -> bool:
        inner = slice(first + 1, last)
        width = at[last] - at[first]
        t = ((at[inner] - at[first]) / width)[:, None]
        between = values[first] + t * (values[last] - values[first])
        if slopes is not None:  # Hermite's cubic: the line, plus the terms of the slopes
            chord = values[last] - values[first]
            left, right = slopes[first] * width - chord, chord - slopes[last] * width
            between += t * (1.0 - t) * ((1.0 - t) * left + t * right)
        error = np.abs(between - values[inner])
        return bool((error <= tolerance * (scale if scale.ndim == 1 else scale[inner])).all())

    kept = [0]
    for stop in sorted({*forced, len(at) - 1} - {0}):
        while kept[-1] < stop:
            good, step = kept[-1] + 1, 2
            while kept[-1] + step < stop and holds(kept[-1], kept[-1] + step):
                good, step = kept[-1] + step, 2 * step
            bad = min(kept[-1] + step, stop + 1)
            if bad > stop or holds(kept[-1], stop):
                good, bad = (stop, stop + 1) if holds(kept[-1], stop) else (good, stop)
            while bad - good > 1:
                middle = (good + bad) // 2
                good, bad = (middle, bad) if holds(kept[-1], middle) else (good, middle)
            kept.append(good)
    return kept


# ---- files that other tools read -------------------------------------------------------------


def write_lookup_table(table: Dataset, path: str | os.PathLike[str]) -> Path:
    """Write a table of `contactlib.lookup_table`, in the format that the ending names.

    Parameters
    ----------
    table : xarray.Dataset
        The table.
    path : path
        ``.csv`` for text with a row for each point, below comments that state the error; ``.mat``,
        ``.npz`` or ``.nc`` (NetCDF) for arrays.

    Raises
    ------
    ValueError
        If the ending is another one.
    OSError
        If the file cannot be written.
    """
    return write_whole(path, FORMATS[known_format(path)](table))


def known_format(path: str | os.PathLike[str]) -> str:
    """Ending of a file, one of `FORMATS`, or a ValueError that names the file."""
    ending = Path(path).suffix.lower()
    if ending not in FORMATS:
        raise ValueError(
            f"{os.fspath(path)}: the ending must be one of: {', '.join(FORMATS)}, .bin"
        )
    return ending


def _arrays(table: Dataset) -> dict[str, Any]:
    names = [*(name for name in AXES if name in table.coords), *FIELDS]
    dimensions = ", ".join(map(str, table["creep_force"].dims))
    arrays = {name: table[name].values for name in names}
    units = ", ".join(f"{name} {table[name].attrs['units']}" for name in names)
    return {**arrays, "dimensions": dimensions, "units": units, **table.attrs}


def _csv(table: Dataset) -> bytes:
    text = io.StringIO()
    fixed = [name for name in AXES if table[name].ndim == 0]
    for name, value in table.attrs.items():
        text.write(f"# {name}: {harmless_line(str(value))}\n")
    for name in fixed:
        text.write(f"# {name}: {float(table[name])!r} {table[name].attrs['units']}\n")
    columns = {name: table[name] for name in AXES if name not in fixed}
    columns |= {name: table[name] for name in ("traction_coefficient", "creep_force", "slope")}
    units = ", ".join(f"{name} {column.attrs['units']}" for name, column in columns.items())
    text.write(f"# units: {units}\n")
    like = table["creep_force"]
    rows = [column.broadcast_like(like).transpose(*like.dims).values for column in columns.values()]
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*(map(repr, row.ravel().tolist()) for row in rows), strict=True))
    return text.getvalue().encode()


def _mat(table: Dataset) -> bytes:
    buffer = io.BytesIO()
    file: Any = buffer  # some versions of SciPy's types accept only paths
    savemat(file, _arrays(table), oned_as="column")
    head = (
        b"MATLAB 5.0 MAT-file, by contactlib"  # without SciPy's date: the same table, the same file
    )
    return head.ljust(116) + buffer.getvalue()[116:]


def _npz(table: Dataset) -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, **_arrays(table))
    return buffer.getvalue()


def _nc(table: Dataset) -> bytes:
    return bytes(table.to_netcdf(engine="scipy"))


FORMATS = {".csv": _csv, ".mat": _mat, ".npz": _npz, ".nc": _nc}
