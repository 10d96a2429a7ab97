"""Made-up results of sweeps."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from contactlib.runs.analysis import SWEEP_OUTCOMES

FRICTION, LOAD = np.linspace(0.3, 0.9, 7), np.linspace(177e3, 265e3, 9)
CONTROLLERS = ["open_loop", "threshold", "creep_pi"]


DESCRIBED = {
    "friction": ("1", "friction on the patch / friction before it"),
    "load": ("N", "axle load"),
    "length": ("m", "length of the patch"),
    "seed": ("1", "seed of the noise"),
    "damping": ("N.m.s", "damping of the drive"),
    "inertia": ("kg.m2", "inertia of wheelset and motor"),
    "critical_torque": ("N.m", "torque at which the wheel slips away in a slow ramp"),
    "torque_margin": ("1", "critical torque over the largest demand, less one"),
    "clearing_time": ("s", "longest time that the largest demand survives"),
    "worst_pole": ("1/s", "largest pole of the falling branch"),
    "stable": ("1", "whether the largest demand is held"),
    "utilisation": ("1", "part of what can be transmitted that is"),
    "slip_work": ("J", "work of slip"),
    "recovery_time": ("s", "longest lack of force"),
}


ABOUT = {"title": "Wet patches", "source": "Ranges: chosen, at 5 $ a run"}


def described(name: str, dims: Any, values: ArrayLike) -> xr.DataArray:
    unit, text = DESCRIBED[name]
    attrs = {"units": unit, "long_name": text}
    if name in SWEEP_OUTCOMES and SWEEP_OUTCOMES[name].percent:
        attrs["display_units"] = "%"
    return xr.DataArray(values, dims=dims, name=name, attrs=attrs)


def grid(outcomes: dict[str, Any], **axes: ArrayLike) -> xr.Dataset:
    """Outcomes as functions of the axes; one more row than axes: of controllers."""
    values = np.meshgrid(*(np.asarray(v, dtype=float) for v in axes.values()), indexing="ij")
    data = xr.Dataset(attrs=ABOUT)
    for name, function in outcomes.items():
        outcome = np.array(function(*values))
        dims = (*["controller"] * (outcome.ndim - len(axes)), *axes)
        data[name] = (dims, outcome) if name == "failed" else described(name, dims, outcome)
    for name, at in axes.items():
        data = data.assign_coords({name: described(name, name, np.asarray(at, dtype=float))})
    if "controller" in data.dims:
        data = data.assign_coords(controller=CONTROLLERS[: data.sizes["controller"]])
    return data


def torque(friction: Any, load: Any) -> Any:
    return 0.12 * friction * load


def clearing(friction: Any, load: Any) -> Any:
    """Not held, for some time, and for good."""
    margin = load / 205e3 - 1.0
    return np.where(margin < 0.0, 0.0, np.where(friction > 0.75, np.inf, 0.5 * margin * friction))


def utilisation(friction: Any, second: Any) -> Any:
    part = (1.0 - friction) * second / np.max(second)
    return [1.0 - 0.8 * part, 1.0 - 0.3 * part**2, 0.97 - 0.1 * part]


@cache
def analysed() -> xr.Dataset:
    return grid(
        {
            "critical_torque": torque,
            "torque_margin": lambda friction, load: load / 205e3 - 1.0 + 0.0 * friction,
            "clearing_time": clearing,
            "stable": lambda friction, load: np.where(torque(friction, load) > 15e3, 1.0, 0.0),
        },
        friction=FRICTION,
        load=LOAD,
    )


@cache
def compared() -> xr.Dataset:
    def failed(friction: Any, length: Any) -> Any:
        lost = (friction < 0.35) & (length > 90.0)
        return np.array([lost, 0 * lost, 0 * lost], dtype=np.int8)

    def known(friction: Any, length: Any) -> Any:
        return np.where(failed(friction, length) > 0, np.nan, utilisation(friction, length))

    outcomes = {
        "utilisation": known,
        "slip_work": lambda f, s: 1e4 * 10.0 ** (5.0 * (1.0 - known(f, s))),
        "recovery_time": lambda f, s: np.where(
            known(f, s) < 0.6, np.inf, 5.0 * (1.0 - known(f, s))
        ),
        "failed": failed,
    }
    return grid(outcomes, friction=FRICTION, length=np.geomspace(10.0, 130.0, 6))


@cache
def sampled() -> xr.Dataset:
    rng = np.random.default_rng(1)
    count = 200
    friction, load, damping = (
        rng.uniform(0.3, 0.9, count),
        rng.normal(2e5, 1e4, count),
        rng.random(count),
    )
    noise = 0.02 * rng.standard_normal((2, count))
    used = np.array([0.6 + 0.3 * friction, 0.95 - 0.1 * friction]) + noise
    used[1, :3] = np.nan
    data = xr.Dataset(attrs=ABOUT)
    data["utilisation"] = described("utilisation", ("controller", "run"), used)
    data["clearing_time"] = described(
        "clearing_time", "run", np.where(friction > 0.75, np.inf, 0.02 * friction * load / 2e5)
    )
    data["failed"] = (("controller", "run"), np.isnan(used).astype(np.int8))
    coords = {"friction": friction, "load": load, "damping": damping}
    data = data.assign_coords({k: described(k, "run", v) for k, v in coords.items()})
    return data.assign_coords(controller=CONTROLLERS[:2], run=np.arange(count))
