"""The creep curve as a table for other tools: few points, and a stated error between them.

The points along an axis come from a longest-step walk: from one point, the next lies as far away
as the interpolation error allows. This gives the minimum number of points on the curve.
"""

from __future__ import annotations

import io
import os
from collections.abc import Mapping, Sequence
from itertools import pairwise, product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.io import savemat

from contactlib import kernel
from contactlib.base.lazy import optional_library
from contactlib.base.quantities import FloatArray, Limits, checked, checked_number, shown
from contactlib.base.text import printable_line, version
from contactlib.base.writing import write_whole
from contactlib.element.force_element import ForceElement, creepage_limits

if TYPE_CHECKING:
    from xarray import Dataset

    from contactlib.files.model import Model

Axis = float | Sequence[float] | FloatArray | slice
Point = tuple[float, float, float]  # load, speed and friction scale
ERROR = Limits(at_least=1e-7, at_most=0.1)
DEFAULT_SPEED = 10.0  # m/s
MAX_ENTRIES = 10_000_000
AXIS_POINTS = 201  # of an axis, and of the creepage, when the axis's points are chosen
CHECKED = 400  # operating points at which the error is measured
UNITS = {  # and meaning
    "axle_load": ("N", "load of all wheels together"),
    "speed": ("m/s", "forward speed"),
    "friction_scale": ("1", "factor on both friction coefficients"),
    "creepage": ("1", "creepage (omega radius - speed)/speed"),
    "creep_force": ("N", "creep force, positive in traction"),
    "traction_coefficient": ("1", "creep force over load"),
}


def lookup_table(
    model: Model | ForceElement,
    *,
    axle_load: Axis | None = None,
    speed: Axis = DEFAULT_SPEED,
    friction_scale: Axis = 1.0,
    largest_creepage: float = 1.0,
    error: float = 1e-3,
) -> Dataset:
    """Creep force over creepage as a table, between whose points a tool interpolates linearly.

    Parameters
    ----------
    model : Model or ForceElement
        Gives the creep force.
    axle_load, speed, friction_scale : float, sequence of float or slice, optional
        Load of all wheels together [N], forward speed [m/s] and factor on both friction
        coefficients [1]. Several numbers become an axis of the table. A ``slice(lowest, highest)``
        becomes an axis whose points are chosen, so that linear interpolation between them keeps the
        error. Default: the nominal load, 10 m/s and 1. Speed matters only if friction falls with
        slip speed.
    largest_creepage : float, optional
        End of the creepages, which begin at zero, as the force is odd [1]. Default: 1.
    error : float, optional
        Largest error of the interpolated force over the largest force at the same load, speed and
        friction [1], from 1e-7 to 0.1. Default: 1e-3.

    Returns
    -------
    xarray.Dataset
        ``creep_force`` [N] and ``traction_coefficient`` [1] over those of ``axle_load``,
        ``speed`` and ``friction_scale`` that are axes, and over ``creepage``. The attributes state
        the error and how it was verified.

    Raises
    ------
    ValueError
        If a value is out of range, or the table would have more than 10 million entries.

    Examples
    --------
    >>> from contactlib.files.model import load_model
    >>> table = lookup_table(load_model("roller_rig.toml"))
    >>> table.sizes["creepage"], table.attrs["largest_error_found"] < 1e-3
    (26, True)
    """
    optional_library("xarray")
    element = model if isinstance(model, ForceElement) else model.wheelset.element
    error = checked_number("error", error, ERROR)
    given = {
        "axle_load": element.axle_load if axle_load is None else axle_load,
        "speed": speed,
        "friction_scale": friction_scale,
    }
    limits = kernel.force_input_limits()
    smallest = {  # below these all curves are of one shape, too narrow for a table
        "axle_load": 1e-6 * element.axle_load,
        "speed": element.minimum_speed,
        "friction_scale": 1e-3,
    }
    ends = {
        name: _axis(name, value, Limits(at_least=smallest[name], at_most=limits[name].at_most))
        for name, value in given.items()
    }
    highest = float(ends["speed"].max())
    maximum = creepage_limits(element, highest).at_most
    below = Limits(at_least=1e-6, at_most=maximum, given=("speed", highest))
    largest = checked_number("largest_creepage", largest_creepage, below)
    chosen = [name for name, value in given.items() if isinstance(value, slice)]
    count = max(2000, int(40.0 / error**0.5))
    for attempt in range(8):
        tolerance = 0.7**attempt * 0.98 * error / (1 + len(chosen))  # the errors add up
        axes = {name: _chosen(element, name, ends, chosen, largest, tolerance) for name in ends}
        _check_size([100, *(axis.size for axis in axes.values())])  # creepages, at least
        axes["creepage"] = _creepages(element, axes, largest, tolerance, count)
        table = _table(element, axes)
        largest_error, points = _error_between(element, table, chosen)
        if largest_error <= error:
            break
        count *= 2
    else:
        raise ValueError(
            f"error = {error!r} is out of reach for this law: {largest_error:.2g} is left"
        )
    several = [name for name in given if axes[name].size > 1]
    other = ""
    if several != chosen:
        worst, _ = _error_between(element, table, several)
        other = f"; between the given points of the other axes it is up to {worst:.2g}"
    named = {} if isinstance(model, ForceElement) else {"model": model.name, "source": model.source}
    if element.table.note:
        named["measured_curve"] = element.table.note
    return table.assign_attrs(
        title=f"creep force over creepage, by contactlib {version()}",
        **named,
        law=element.table.law,
        interpolation="linear",
        error=error,
        largest_error_found=largest_error,
        error_is="of the interpolated creep_force, over the largest force at the same load, "
        f"speed and friction; measured at {points} points{other}",
        symmetry="the force at a negative creepage is minus that at the positive one",
    )


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


def _forces(element: ForceElement, points: Sequence[Point], creepage: FloatArray) -> FloatArray:
    """Creep force at points and creepages, (points, creepages)."""
    curves = [
        element.at_creepage(creepage, speed=speed, axle_load=load, friction_scale=scale)
        for load, speed, scale in points
    ]
    return np.stack([curve["creep_force"] for curve in curves])


def _points(axes: Mapping[str, FloatArray]) -> list[Point]:
    loads, speeds, scales = (axes[name].tolist() for name in list(UNITS)[:3])
    return list(product(loads, speeds, scales))


def _dense(
    element: ForceElement, points: Sequence[Point], largest: float, count: int
) -> FloatArray:
    """Dense creepages, denser where the curves of the points rise."""
    zeta0 = min(
        element.saturation_creepage_at(axle_load=load, friction_scale=scale)
        for load, _, scale in points
    )
    u = np.linspace(0.0, largest / (largest + zeta0), count)
    return np.append(zeta0 * u[:-1] / (1.0 - u[:-1]), largest)


def _chosen(
    element: ForceElement,
    name: str,
    ends: Mapping[str, FloatArray],
    chosen: Sequence[str],
    largest: float,
    tolerance: float,
) -> FloatArray:
    """Points of an axis other than the creepage."""
    if name not in chosen:
        return ends[name]
    few = {n: np.linspace(e[0], e[-1], 4) if n in chosen else e for n, e in ends.items()}
    along = np.geomspace(ends[name][0], ends[name][1], AXIS_POINTS)
    along[0], along[-1] = ends[name]
    grid = {**few, name: along}
    _check_size([AXIS_POINTS, *(axis.size for axis in grid.values())])
    force = _forces(element, _points(grid), _dense(element, _points(ends), largest, AXIS_POINTS))
    force = force.reshape([*(axis.size for axis in grid.values()), AXIS_POINTS])
    force = np.moveaxis(force, list(grid).index(name), 0)
    scale = np.broadcast_to(force.max(axis=-1, keepdims=True), force.shape)
    values, scales = (part.reshape(AXIS_POINTS, -1) for part in (force, scale))
    return np.asarray(along[_walk(along, values, scales, tolerance)])


def _creepages(
    element: ForceElement,
    axes: Mapping[str, FloatArray],
    largest: float,
    tolerance: float,
    count: int,
) -> FloatArray:
    """Creepages for all points of the other axes."""
    points = _points(axes)
    dense = _dense(element, points, largest, count)
    maximum = MAX_ENTRIES // dense.size
    if len(points) > maximum:
        points = [points[i] for i in np.linspace(0, len(points) - 1, maximum).astype(int)]
    force = _forces(element, points, dense).T
    return dense[_walk(dense, force, force.max(axis=0), tolerance)]


def _table(element: ForceElement, axes: Mapping[str, FloatArray]) -> Dataset:
    """Force and traction coefficient over the axes; those of one point are no dimensions."""
    xarray = optional_library("xarray")
    shape = [axis.size for axis in axes.values()]
    _check_size(shape)
    force = _forces(element, _points(axes), axes["creepage"]).reshape(shape)
    table = xarray.Dataset({"creep_force": (list(axes), force)}, coords=dict(axes))
    table["traction_coefficient"] = table["creep_force"] / table["axle_load"]
    for name, (unit, meaning) in UNITS.items():
        table[name].attrs = {"units": unit, "long_name": meaning}
    return table.squeeze()  # type: ignore[no-any-return]


def _error_between(
    element: ForceElement, table: Dataset, along: Sequence[str]
) -> tuple[float, int]:
    """Largest relative error found along the creepage and these axes, and points compared."""
    random = np.random.default_rng(0)
    columns = []
    for name in list(UNITS)[:3]:
        axis = table[name].values.ravel()
        between = random.uniform(axis[0], axis[-1], CHECKED)
        columns.append(between if name in along else random.choice(axis, CHECKED))
    points = np.unique(np.stack(columns, axis=1), axis=0)
    each = 66 if len(points) <= 16 else 18
    fine = np.unique(
        np.concatenate([np.linspace(*pair, each) for pair in pairwise(table["creepage"].values)])
    )
    at = dict(zip(UNITS, points.T, strict=False))
    several = {name: ("point", at[name]) for name in at if name in table["creep_force"].dims}
    curves = table["creep_force"].interp(several).transpose(..., "creepage").values
    size, worst = table.sizes["creepage"], 0.0
    for point, curve in zip(points, np.broadcast_to(curves, (len(points), size)), strict=True):
        (law,) = _forces(element, [tuple(point.tolist())], fine)
        error = np.abs(np.interp(fine, table["creepage"], curve) - law)
        worst = max(worst, float(error.max() / law.max()))
    return worst, len(points) * fine.size


def _walk(at: FloatArray, values: FloatArray, scale: FloatArray, tolerance: float) -> list[int]:
    """Indices of the points of a longest-step walk through all columns of values."""

    def holds(first: int, last: int) -> bool:
        inner = slice(first + 1, last)
        share = ((at[inner] - at[first]) / (at[last] - at[first]))[:, np.newaxis]
        between = values[first] + share * (values[last] - values[first])
        error = np.abs(between - values[inner])
        return bool((error <= tolerance * (scale if scale.ndim == 1 else scale[inner])).all())

    kept, end = [0], len(at) - 1
    while kept[-1] < end:
        start, step = kept[-1], 1
        while start + 2 * step <= end and holds(start, start + 2 * step):
            step *= 2
        good, bad = start + step, min(start + 2 * step, end + 1)
        while bad - good > 1:
            middle = (good + bad) // 2
            good, bad = (middle, bad) if holds(start, middle) else (good, middle)
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
        ``.csv`` for text with a row for each point, below comments that state the error; ``.mat``
        (MATLAB) or ``.nc`` (NetCDF) for arrays.

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


def _csv(table: Dataset) -> bytes:
    """A line for each point, below comments with the attributes and what is no axis."""
    numbers = {n: f"{float(a)!r} {a.attrs['units']}" for n, a in table.coords.items() if not a.ndim}
    columns = [*table["creep_force"].dims, "traction_coefficient", "creep_force"]
    units = ", ".join(f"{name} {table[name].attrs['units']}" for name in columns)
    about = {**table.attrs, **numbers, "units": units}
    lines = "".join(f"# {name}: {printable_line(str(value))}\n" for name, value in about.items())
    frame = table.to_dataframe().reset_index()[columns]
    return (lines + str(frame.to_csv(index=False, lineterminator="\n"))).encode()


def _mat(table: Dataset) -> bytes:
    arrays = {str(name): array.values for name, array in table.variables.items()}
    units = ", ".join(f"{name} {array.attrs['units']}" for name, array in table.variables.items())
    about = {"dimensions": ", ".join(map(str, table["creep_force"].dims)), "units": units}
    buffer: Any = io.BytesIO()  # some versions of SciPy's types accept only paths
    savemat(buffer, {**arrays, **about, **table.attrs}, oned_as="column")
    # Without SciPy's date: the same table gives the same file.
    return bytes(b"MATLAB 5.0 MAT-file, by contactlib".ljust(116) + buffer.getvalue()[116:])


def _nc(table: Dataset) -> bytes:
    return bytes(table.to_netcdf(engine="scipy"))


FORMATS = {".csv": _csv, ".mat": _mat, ".nc": _nc}
