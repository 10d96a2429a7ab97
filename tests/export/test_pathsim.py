"""The wheelset's FMU in PathSim, as the guide's page on coupling shows it, against our own run."""

from __future__ import annotations

import re
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from outside_tools import module

import contactlib as cl
from contactlib.base.quantities import FloatArray

pytestmark = pytest.mark.tools

DURATION = 2.0
RISING = cl.Profile((0.0, DURATION), (24e3, 34e3))  # past the peak of the creep curve
HELD = cl.Profile.of(29e3)


@pytest.fixture(params=[2, 3], ids=lambda version: f"fmi{version}")
def guide(
    request: pytest.FixtureRequest,
    locomotive: cl.Model,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> dict[str, Any]:
    """Names that the guide's code defines, run in a folder with the FMU."""
    blocks = module("pathsim_fmi.blocks")
    monkeypatch.setattr(blocks, "FMUWrapper", blocks.FMUWrapper)  # which that code replaces
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))  # where the importer leaves its files
    monkeypatch.chdir(tmp_path)
    settings = {"kind": "wheelset", "fmi_version": request.param, "booleans": False}
    cl.export_fmu(locomotive, "wheelset.fmu", **settings)
    page = Path(__file__).resolve().parents[2] / "docs" / "howto" / "coupling.md"
    code = re.findall(r"^```python\n(.*?)^```", page.read_text(encoding="utf-8"), re.M | re.S)
    names: dict[str, Any] = {}
    exec("\n".join(code), names)  # noqa: S102
    return names


def error(
    model: cl.Model, time: FloatArray, omega: FloatArray, torque: cl.Profile, **inputs: Any
) -> float:
    """Largest difference from our own run [rad/s]."""
    run = cl.simulate(
        model.wheelset,
        cl.TorqueControl(torque),
        initial_speed=10.0,
        initial_creepage=0.0,
        duration=DURATION,
        output_interval=1e-4,  # a line between two rows is right to 1e-6 rad/s
        tolerance=1e-11,
        **inputs,
    )
    assert run["omega"].max() > 60.0  # it slipped away
    until = time < DURATION
    return float(np.abs(omega - np.interp(time, run.time, run["omega"]))[until].max())


def stepped(guide: dict[str, Any], step: float, *inputs: Any) -> tuple[FloatArray, FloatArray]:
    """Time, as the block's step ends there, and angular velocity in co-simulation."""
    fmu = guide["pathsim_fmi"].CoSimulationFMU("wheelset.fmu", dt=step)
    time, omega, _ = guide["run"](fmu, *inputs, duration=DURATION, dt=step)
    return time + step, omega


def test_model_exchange_gives_our_run(guide: dict[str, Any], locomotive: cl.Model) -> None:
    assert error(locomotive, guide["time"], guide["omega"], RISING) < 2e-5


def test_cosimulation_gives_our_run_under_held_inputs_also_without_friction(
    guide: dict[str, Any], locomotive: cl.Model
) -> None:
    smallest = 1e-6  # below it the slip counts as zero
    friction = cl.Profile((0.0, 1.0, 1.0, DURATION), (1.0, 1.0, smallest, smallest))
    time, omega = stepped(guide, 1e-3, HELD, lambda t: float(t < 1.0 - 1e-9))
    assert error(locomotive, time, omega, HELD, friction_scale=friction) < 2e-4
    # Nothing but the torque and the wheelset's damping acts on it then.
    free = time > 1.0 + 1e-9
    w = locomotive.wheelset
    rate = (29e3 - w.damping * omega[free]) / w.inertia
    np.testing.assert_allclose(np.diff(omega[free]) / 1e-3, rate[:-1], rtol=1e-4)
