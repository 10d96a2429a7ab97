"""The FMU of a scenario's vehicle, against its run and against the balances of a vehicle."""

from __future__ import annotations

import ctypes
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from brake_pads import GIVE, held_by
from command_line import done
from exported_fmu import described, exported
from fmpy.fmi1 import FMICallException
from fmpy.validation import validate_fmu
from fmu_instance import Instance, Wheels
from plain_scenario import braked_vehicle, plain_scenario

import contactlib as cl
from contactlib import kernel
from contactlib.base.quantities import FloatArray
from contactlib.base.units import STANDARD_GRAVITY
from contactlib.runs.plant import Runs, timing
from contactlib.traction import Sensors
from contactlib.vehicle import Axle, Brake, Motor

OUTPUTS = (
    *("axle_load", "creepage", "creep_force", "drive_torque", "omega", "available_force"),
    *("friction", "falling_branch", "speed", "distance", "acceleration"),
)
MEMORY = [f"{name}_{side}" for name in ("held_force", "unslipped", "outer_force")
          for side in ("left", "right")]  # fmt: skip


@pytest.fixture(scope="module")
def wheelset(locomotive: cl.Model) -> cl.Wheelset:
    element = replace(locomotive.wheelset.element, memory=True)
    return replace(locomotive.wheelset, element=element)


def rows_of(scenario: cl.Scenario, controller: str, step: float) -> dict[str, FloatArray]:
    """Signals, states and inputs of a run by name, shape (rows, axles)."""
    control: Any = scenario.any_controller(controller)
    times = timing(scenario, control.sample_time, step)
    runs = Runs([scenario], control, times, index=[0], tolerance=1e-8)
    rows: dict[str, list[FloatArray]] = {}
    for block in runs.blocks():
        states, inputs = block._states, block._inputs
        given = {name: states[name] for name in states.dtype.names}
        given |= {"commanded_brake": inputs["commanded_brake"], "omega": states["omega_left"]}
        given |= {name: block[name] for name in (*OUTPUTS[:6], "acceleration", "falling_branch")}
        given["commanded_torque"] = block["commanded_torque"]
        sides = [inputs[f"friction_{side}"] for side in ("left", "right")]
        for name, values in {**given, "friction": sum(sides) / 2.0}.items():
            rows.setdefault(name, []).append(np.array(values))
    return {name: np.concatenate(values) for name, values in rows.items()}


@pytest.mark.parametrize(
    ("file", "controller", "step", "duration", "version"),
    [
        ("four_axles.toml", "creep_pi", 10e-3, 3.4, 3),
        ("coach_braking.toml", "wsp", 10e-3, 1.5, 2),
        pytest.param("four_axles.toml", "creep_pi", 1e-3, 4.0, 2, marks=pytest.mark.slow),
        pytest.param("coach_braking.toml", "wsp", 1e-3, 4.0, 3, marks=pytest.mark.slow),
    ],
)
def test_it_moves_as_in_the_run_under_the_same_torques(
    tmp_path: Path, file: str, controller: str, step: float, duration: float, version: int
) -> None:
    scenario = replace(cl.load_scenario(file), duration=duration)
    rows = rows_of(scenario, controller, step)
    with Instance(exported(scenario, tmp_path, "vehicle", version)) as tool:
        axles = Wheels(tool.initialize(tolerance=1e-8), scenario.axles)
        given = {"motor_torque": "commanded_torque", "brake_torque": "commanded_brake"}
        given |= {"acting_motor_torque": "drive_torque", "acting_brake_torque": "brake_torque"}
        given |= {"omega": "omega", "pads": "pads_left"} | dict(zip(MEMORY, MEMORY, strict=True))
        known = [name for name in given if axles.scalars(name)[0] in tool.references]
        tool.set(speed=rows["speed"][0, 0])
        for row in range(len(rows["speed"])):
            names = known if row == 0 else [name for name in known if name in axles.inputs]
            axles.set(**{name: rows[given[name]][row].tolist() for name in names})
            if row == 0:
                tool.fmu.exitInitializationMode()
            for name in OUTPUTS:
                shared = name in ("speed", "distance", "acceleration")
                got = tool.get(name)[0] if shared else np.array(axles.get(name))
                expected = rows[name][row, 0] if shared else rows[name][row]
                scale = np.abs(rows[name]).max() or 1.0
                np.testing.assert_allclose(got, expected, rtol=0.0, atol=1e-6 * scale, err_msg=name)
            tool.step(step * row, step)


@pytest.mark.parametrize("version", [2, 3])
def test_pressures_act_as_the_torques_of_the_brake_that_has_them(
    wheelset: cl.Wheelset, tmp_path: Path, version: int
) -> None:
    """By the brake's pressure and torque, in either interface; below zero it has no torque."""
    scenario, commanded = braked_vehicle(wheelset, 2), ("brake_torque", "acting_brake_torque")
    assert scenario.drivetrain.brake is not None
    per_pressure = 1.0 / scenario.drivetrain.brake.pressure_per_torque
    described_as = described(scenario)
    given = described_as.native_contact, described_as.start_values
    by_torque = kernel.NativeModel("vehicle", *given, wheels=2)
    by_torque.begin()
    folder = exported(scenario, tmp_path, "vehicle", version, brake_pressure=True)
    with Instance(folder) as tool:
        axles = Wheels(tool.initialize(), 2)
        tool.fmu.exitInitializationMode()
        units = {v.name.split("[")[0]: v.unit for v in tool.description.modelVariables}
        assert (units["brake_pressure"], units["torque_per_pressure"]) == ("Pa", "N.m/Pa")
        assert not {*commanded, "brake_fill_time", "brake_vent_time"} & {*units}
        for k in range(60):
            pressures = [2e5 - 1e4 * k, 3e3 * k]  # the first vents
            axles.set(brake_pressure=pressures)
            torques = [per_pressure * max(pressure, 0.0) for pressure in pressures]
            at = {f"{n}[{i + 1}]": torques[i] for n in commanded for i in range(2)}
            by_torque.set(**at)
            by_torque.evaluate()
            for name in (*OUTPUTS[:5], "pads"):
                known = by_torque.get(f"{name}[1]", f"{name}[2]")
                np.testing.assert_allclose(axles.get(name), known, rtol=1e-12, err_msg=name)
            if k == 30:
                tool.restore(tool.saved())
            tool.step(0.02 * k, 0.02)
            by_torque.advance(0.02)
    with Instance(folder, exchange=True).start() as tool:
        axles = Wheels(tool, 2)
        axles.set(brake_pressure=[1e5, 1.5e5])
        held = -per_pressure * np.array([1e5, 1.5e5])  # on pads that slide
        np.testing.assert_allclose(axles.get("drive_torque"), held, rtol=1e-12)


def test_advice_on_steps_knows_the_pads_under_a_pressure(wheelset: cl.Wheelset) -> None:
    scenario, steps = braked_vehicle(wheelset, 2), list[tuple[float, float]]()
    for name, value in (("brake_torque", 3e3), ("brake_pressure", 1e5)):
        made = described(scenario, brake_pressure=name == "brake_pressure")
        model = kernel.NativeModel("vehicle", made.native_contact, made.start_values, wheels=2)
        model.set(omega=1e3)  # so fast that the pads limit the step
        free = model.explicit_step()
        model.set(**{name: value})
        steps.append((free, model.explicit_step()))
    assert steps[0] == steps[1]
    assert steps[1][1] < steps[1][0]


@pytest.mark.parametrize(("n", "version"), [(1, 3), (2, 2), (4, 3), (6, 2), (8, 3)])
def test_forces_balance_at_any_number_of_axles(
    wheelset: cl.Wheelset, tmp_path: Path, n: int, version: int
) -> None:
    """Loads carry the weight; traction, grade, couplers and resistance move the whole mass."""
    scenario = braked_vehicle(wheelset, n)
    vehicle, body = scenario.vehicle, scenario.drivetrain.wheelset
    assert vehicle is not None
    with Instance(exported(scenario, tmp_path, "vehicle", version)) as tool:
        axles = Wheels(tool.initialize(), n)
        outer = {"grade": 0.01, "front_coupler_force": 2e3, "rear_coupler_force": 5e3}
        tool.set(speed=12.0, **outer)
        radii = [body.radius - 1e-3 * i for i in range(n)]
        axles.set(radius=radii, motor_torque=[4e3 + 100.0 * i for i in range(n)])
        tool.fmu.exitInitializationMode()
        rolling = np.array(axles.get("omega")) * radii
        np.testing.assert_allclose(rolling, 12.0, rtol=1e-14)
        for k in range(20):
            tool.step(0.05 * k, 0.05)
        loads, forces = np.array(axles.get("axle_load")), np.array(axles.get("creep_force"))
        speed, acceleration = tool.get("speed", "acceleration")
        weight = vehicle.own_mass * STANDARD_GRAVITY
        assert loads.sum() == pytest.approx(weight, rel=1e-9)
        davis = body.resistance
        resistance = n * (davis.constant + davis.linear * speed + davis.quadratic * speed**2)
        pull = forces.sum() - resistance - 3e3 - vehicle.mass * STANDARD_GRAVITY * 0.01
        assert acceleration == pytest.approx(pull / vehicle.mass, rel=1e-9)


def test_a_saved_state_goes_on_with_the_same_bits(tmp_path: Path) -> None:
    folder = exported(cl.load_scenario("four_axles.toml"), tmp_path, "vehicle", 3)

    def on(axles: Wheels, first: int) -> list[list[float]]:
        for k in range(first, first + 60):
            axles.tool.step(0.02 * k, 0.02)
        return [axles.get(name) for name in ("omega", "friction", "axle_load", "creep_force")]

    with Instance(folder) as tool, Instance(folder) as other:
        axles = Wheels(tool.initialize(), 4)
        axles.set(motor_torque=[24e3] * 4)
        tool.fmu.exitInitializationMode()
        before = on(axles, 0)
        state = tool.saved()
        there = Wheels(other.start(), 4)
        assert on(there, 0) != before
        other.restore(state)
        assert on(there, 60) == on(axles, 60)


def test_a_forged_state_is_refused_or_goes_on(wheelset: cl.Wheelset, tmp_path: Path) -> None:
    """Any number in it, under a valid checksum: the FMU answers with finite numbers."""
    random, taken = np.random.default_rng(5), 0
    with Instance(exported(braked_vehicle(wheelset, 2), tmp_path, "vehicle", 2)) as tool:
        axles = Wheels(tool.initialize(), 2)
        axles.set(motor_torque=[2e4] * 2)
        tool.fmu.exitInitializationMode()
        for k in range(40):
            tool.step(0.02 * k, 0.02)
        state = tool.saved()
        for _ in range(300):
            numbers = np.frombuffer(state[24 + 80 :], np.float64).copy()
            place = random.integers(0, 1500)
            numbers[place] = random.choice([np.nan, -1.0, 0.3, 1e9, -1e15, 1e300, numbers[place]])
            forged = state[24 : 24 + 80] + numbers.tobytes()
            try:
                tool.restore(kernel.framed(b"CREEPSTA", 3, forged))
                tool.step(tool.get("time")[0], 0.02)
            except FMICallException:
                continue
            taken += 1
            assert all(np.isfinite(axles.get(name)).all() for name in OUTPUTS[:8])
            tool.restore(state)
    assert 30 < taken < 270


@pytest.mark.parametrize(
    ("cleaning", "largest"), [(0.0, 1e-5), (1e-3, 2e-3)], ids=["held", "cleaned"]
)
def test_model_exchange_agrees_with_its_own_steps(
    wheelset: cl.Wheelset, tmp_path: Path, cleaning: float, largest: float
) -> None:
    """On rails that slip cleans, friction errs by part of the 2.5 % that cleaning adds to it."""
    scenario = braked_vehicle(wheelset, 2)
    scenario = replace(scenario, track=replace(scenario.track, cleaning=cleaning))
    folder = exported(scenario, tmp_path, "vehicle", 2)
    inputs = [f"motor_torque[{i}]" for i in (1, 2)]
    torque = np.array(
        [(0.0, 1e4, 1e4), (0.5, 1e4, 1e4), (0.5, 5e3, 8e3), (1.0, 5e3, 8e3)],
        [(name, np.float64) for name in ("time", *inputs)],
    )
    found = {
        interface: fmpy.simulate_fmu(
            str(folder), fmi_type=interface, solver="CVode", input=torque, stop_time=1.0,
            output_interval=1e-3, relative_tolerance=1e-6,
            output=["speed", "omega[1]", "omega[2]", "axle_load[1]", "friction[2]"],
        )
        for interface in ("CoSimulation", "ModelExchange")
    }  # fmt: skip
    time = np.linspace(0.05, 0.95, 19) + 1e-9
    for name in found["CoSimulation"].dtype.names[1:]:
        stepped, exchanged = (np.interp(time, run["time"], run[name]) for run in found.values())
        np.testing.assert_allclose(exchanged, stepped, rtol=largest, err_msg=name)


def test_derivatives_contain_the_other_axles(wheelset: cl.Wheelset, tmp_path: Path) -> None:
    folder = exported(braked_vehicle(wheelset, 2), tmp_path, "vehicle", 2, brake_pressure=True)
    start = {"motor_torque[1]": 5e3, "brake_pressure[1]": 1e4}
    with Instance(folder, exchange=True).start(**start) as tool:
        tool.fmu.enterContinuousTimeMode()
        states = [v.derivative for v in tool.description.modelVariables if v.derivative]
        nominals = (ctypes.c_double * len(states))()
        tool.fmu.fmi2GetNominalsOfContinuousStates(tool.fmu.component, nominals, len(states))
        assert list(nominals) == pytest.approx([float(v.nominal) for v in states], rel=1e-12)
        unknowns = ["der(speed)", "der(axle_load[1])", "der(omega[1])"]
        steps = {"omega[2]": 1e-4, "motor_torque[2]": 10.0, "grade": 1e-3, "brake_pressure[1]": 1e2}
        for known, step in steps.items():
            found = tool.derivative(unknowns, [known], [1.0])
            (value,), ends = tool.get(known), []
            for sign in (1.0, -1.0):
                tool.set(**{known: value + sign * step})
                ends.append(np.array(tool.get(*unknowns)))
            tool.set(**{known: value})
            expected = (ends[0] - ends[1]) / (2.0 * step)
            np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-9)
        assert not tool.log


@pytest.mark.parametrize("version", [2, 3])
def test_outputs_and_rates_are_consistent(
    wheelset: cl.Wheelset, tmp_path: Path, version: int
) -> None:
    """In traction, with a motor that brakes, under the brake, backwards, and with no load."""
    scenario = braked_vehicle(wheelset, 2)
    vehicle, train = scenario.vehicle, scenario.drivetrain
    body, brake, davis = train.wheelset, train.brake, train.wheelset.resistance
    assert vehicle is not None
    assert brake is not None
    torques = ("motor_torque", "acting_motor_torque", "brake_torque", "acting_brake_torque")
    rest = {"held_force_left": [3e4, 5e3], "held_force_right": [2e4, 7e3], "slip": [0.05, 0.6]}
    rest |= {name: [0.0, 0.0] for name in torques} | {"axle_load": [2e5, 2.2e5]}
    rest |= {name: [1.0, 1.0] for name in ("friction_scale", "pads")}
    places: list[dict[str, Any]] = [
        {"motor_torque": [9e3, 2e3], "acting_motor_torque": [8e3, 1e3]},
        {"motor_torque": [-9e3, 0.0], "slip": [-0.01, 0.003], "friction_scale": [0.5, 1.2]},
        {"brake_torque": [4e3, 6e3], "acting_brake_torque": [5e3, 2e3], "pads": [1.0, 0.7]},
        {"speed": -8.0, "slip": [-0.02, -0.1], "pads": [0.5, -1.0], "grade": 0.02},
        {"axle_load": [3e5, 0.0], "slip": [0.02, 0.3]},
    ]
    shared, falling = ("speed", "distance", "acceleration"), set[bool]()
    with Instance(exported(scenario, tmp_path, "vehicle", version), exchange=True) as tool:
        axles = Wheels(tool.start(), 2)
        tool.fmu.newDiscreteStates() if version == 2 else tool.fmu.updateDiscreteStates()
        tool.fmu.enterContinuousTimeMode()
        names = [name for name in axles.outputs if name not in shared]
        assert {*names} <= {*rest, *OUTPUTS, *MEMORY}  # which have a relation below
        names += [f"der({n})" for n in ("omega", "pads", "axle_load", *torques[1::2])]
        for place in places:
            speed, grade = place.pop("speed", 10.0), place.pop("grade", 0.0)
            given = {name: np.array(values) for name, values in (rest | place).items()}
            rim = given.pop("slip") + speed
            tool.set(speed=speed, grade=grade)
            axles.set(omega=(rim / body.radius).tolist(), **{n: [*v] for n, v in given.items()})
            got = {name: np.array(axles.get(name)) for name in names}
            load, force, torque = (got[n] for n in ("axle_load", "creep_force", "drive_torque"))
            pads = np.transpose([held_by(*at) for at in zip(given["pads"], rim, strict=True)])
            command, motor, demand, braking = (given[name] for name in torques)
            fill = np.where(demand > braking, brake.fill_time, brake.vent_time)
            drag = davis.constant * np.sign(speed) + davis.linear * speed
            drag += davis.quadratic * speed * abs(speed)
            pull = (force.sum() - 2.0 * drag) / vehicle.mass
            moment = torque - body.radius * force - body.damping * rim / body.radius
            rate = got["der(omega)"]
            loads = vehicle.loads(force, acceleration=pull, radius=body.radius, omega_rate=rate)
            for name, expected in {
                "creepage": (rim - speed) / abs(speed),
                "creep_force": 0.5 * (given[MEMORY[0]] + given[MEMORY[1]]) * (load > 0.0),
                "drive_torque": motor - pads[0] * braking,
                "der(omega)": moment / body.inertia,
                "der(pads)": pads[1],
                "der(acting_motor_torque)": (np.maximum(command, 0.0) - motor) / train.motor.lag,
                "der(acting_brake_torque)": (demand - braking) / fill,
                "der(axle_load)": (loads - load) / vehicle.load_lag,
            }.items():
                np.testing.assert_allclose(got[name], expected, 1e-9, 1e-9, err_msg=name)
            acceleration = pull - STANDARD_GRAVITY * grade
            found = tool.get("acceleration", "der(speed)", "der(distance)")
            assert found == pytest.approx([acceleration, acceleration, speed], rel=1e-9)
            largest = body.element.friction.static * got["friction"] * load
            assert (got["available_force"] <= largest).all()
            assert ((got["available_force"] > 0.0) == (load > 0.0)).all()
            assert (got["friction"] >= given["friction_scale"]).all()
            falling |= {value > 0.0 for value in axles.get("falling_indicator")}
    assert falling == {False, True}


def test_energy_is_kept_through_a_reversal(wheelset: cl.Wheelset, tmp_path: Path) -> None:
    """Motors drive the vehicle on, then a coupler pulls it back."""
    scenario, step, coupler = braked_vehicle(wheelset, 2), 2e-3, 0.0
    vehicle, body = scenario.vehicle, scenario.drivetrain.wheelset
    assert vehicle is not None
    with Instance(exported(scenario, tmp_path, "vehicle", 2)) as tool:
        axles = Wheels(tool.initialize(tolerance=1e-8), 2)
        tool.set(speed=0.2, **{f"{n}_resistance": 0.0 for n in ("constant", "linear", "quadratic")})
        tool.fmu.exitInitializationMode()
        axles.set(motor_torque=[6e3, 4e3])

        def now() -> tuple[float, float, float]:
            """Speed, kinetic energy and its rate by forces."""
            names = ("omega", "creep_force", "drive_torque")
            (speed,), (omega, force, torque) = (
                tool.get("speed"),
                np.array(list(map(axles.get, names))),
            )
            lost = body.damping * omega**2 + force * (body.radius * omega - speed)
            stored = 0.5 * (vehicle.mass * speed**2 + body.inertia * omega @ omega)
            return speed, stored, float(torque @ omega - lost.sum() - coupler * speed)

        start, work, speeds = now(), [0.0], [0.2]
        for k in range(300):
            if k == 50:
                coupler = 1e5
                tool.set(rear_coupler_force=coupler)
                axles.set(motor_torque=[0.0, 0.0])
            before = now()
            tool.step(step * k, step)
            after = now()
            work.append(0.5 * step * (before[2] + after[2]))
            speeds.append(after[0])
    assert max(speeds) > 0.2 > 0.0 > -0.2 > min(speeds)
    assert abs(after[1] - start[1] - sum(work)) < 1e-3 * np.abs(work).sum()


def test_brakes_hold_the_vehicle_on_a_grade(wheelset: cl.Wheelset, tmp_path: Path) -> None:
    """It stops, and no wheel turns back by more than its pads give."""
    scenario = braked_vehicle(wheelset, 2)
    body = scenario.drivetrain.wheelset
    with Instance(exported(scenario, tmp_path, "vehicle", 3)) as tool:
        axles = Wheels(tool.initialize(), 2)
        tool.set(speed=0.5, grade=-0.01)
        axles.set(brake_torque=[2e4, 1e4])
        tool.fmu.exitInitializationMode()
        turned, places = np.zeros(2), [0.0]
        for k in range(300):
            tool.step(0.01 * k, 0.01)
            turned += 0.01 * np.minimum(axles.get("omega"), 0.0)
            places.append(tool.get("distance")[0])
        assert body.radius * turned.min() > -2.0 * GIVE
        assert places[-1] > max(places) - 2.0 * GIVE
        assert np.abs(axles.get("omega")).max() < 1e-6
        assert tool.log == []


@pytest.mark.parametrize("outer", ["front_coupler_force", "rear_coupler_force"])
def test_an_axle_lifts_off_and_comes_back(
    wheelset: cl.Wheelset, tmp_path: Path, outer: str
) -> None:
    """In the air its wheels have no force, and only its motor turns them."""
    scenario, air = braked_vehicle(wheelset, 2), 0 if outer.startswith("front") else 1
    body, torque = scenario.drivetrain.wheelset, 2e3
    with Instance(exported(scenario, tmp_path, "vehicle", 2)) as tool:
        axles = Wheels(tool.start(**({outer: 2e6} if air == 0 else {})), 2)  # there, or later
        tool.set(**{outer: 2e6})
        axles.set(motor_torque=[torque, torque])
        for k in range(80):
            if k == 50:
                got = {n: axles.get(n)[air] for n in ("axle_load", "omega", "der(omega)")}
                assert got["axle_load"] < 1e-4 * body.element.axle_load
                alone = (torque - body.damping * got["omega"]) / body.inertia
                assert got["der(omega)"] == pytest.approx(alone, rel=1e-3)
                tool.set(**{outer: 0.0})
            tool.step(0.01 * k, 0.01)
        loads, factors = np.array(axles.get("axle_load")), np.array(axles.get("friction"))
        grip = body.element.friction.static * factors * loads
        assert loads.min() > 0.5 * body.element.axle_load
        assert (np.abs(axles.get("creep_force")) <= grip).all()
        assert min(np.abs(axles.get("creep_force"))) > 1e3
        assert tool.log == []


def test_values_that_are_set_are_those_of_a_changed_vehicle(
    wheelset: cl.Wheelset, tmp_path: Path
) -> None:
    """Geometry, masses, lags, wheels and start of another scenario: the same bits afterwards."""
    random, scenario = np.random.default_rng(3), braked_vehicle(wheelset, 2)
    folder, nominal = exported(scenario, tmp_path, "vehicle", 2), described(scenario).start_values
    vehicle, train = scenario.vehicle, scenario.drivetrain
    assert vehicle is not None
    assert train.brake is not None

    def other(part: Any, *names: str) -> Any:
        factors = dict(zip(names, random.uniform(0.9, 1.1, len(names)).tolist(), strict=True))
        return replace(part, **{name: getattr(part, name) * f for name, f in factors.items()})

    numbers = [n for n in nominal if isinstance(getattr(vehicle, n, None), float)]
    numbers.remove("axles_per_bogie")
    moved = replace(other(vehicle, *numbers), position=(0.0, 2.7))
    body = other(replace(train.wheelset, mass=moved.mass / 2.0), "inertia", "damping")
    drive = {
        "brake": other(train.brake, "fill_time", "vent_time"),
        "motor": other(train.motor, "lag"),
    }
    changes = {"vehicle": moved, "drivetrain": replace(train, wheelset=body, **drive)}
    changed = replace(scenario, **changes, initial_speed=12.0)
    start = described(changed).start_values
    values = {name: value for name, value in start.items() if nominal[name] != value}
    given = {"motor_torque[1]": 9e3, "brake_torque[2]": 4e3, "rear_coupler_force": 3e4}
    ends = []
    for place, known in ((folder, values), (exported(changed, tmp_path, "vehicle", 2), {})):
        with Instance(place).initialize() as tool:
            tool.set(**{n: v for n, v in known.items() if n in tool.references}, **given)
            tool.fmu.exitInitializationMode()
            for k in range(20):
                tool.step(0.02 * k, 0.02)
            ends.append(tool.get(*sorted(tool.references)))
    assert {*numbers, "speed", "motor_lag", "position[2]"} <= {*values}
    np.testing.assert_allclose(ends[0], ends[1], rtol=1e-12)


RAILS = [1e-3, 1.0, 0.1, 1024.0, 2.0, 0.0, 5.0, 1.0, 0.5, 0.0, *(1.0, 0.0, 1.0) * 2, 1.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ("place", "value", "message"),
    [
        (0, -1.0, "cleaning"),
        (1, 0.0, "cleaning"),
        (3, 1000.0, "power of two"),
        (4, 0.0, "number of points"),
        (4, 1.5, "not whole"),
        (5, 6.0, "not increasing"),
        (8, -0.5, "value of a profile"),
        (8, np.nan, "not finite"),
        (9, 1.0, "value of a profile"),
        (-1, 2.0, "value of a profile"),
        (None, 3, "too short"),
        (None, 20, "too long"),
    ],
)
def test_damaged_rails_are_refused(
    wheelset: cl.Wheelset, place: int | None, value: float, message: str
) -> None:
    numbers = np.array([*RAILS, 0.0])
    numbers = numbers[: len(RAILS)] if place is not None else numbers[: int(value)]
    if place is not None:
        numbers[place] = value
    contact = wheelset.element.native_contact
    kernel.NativeRails(contact, kernel.framed(b"CREEPRAI", 1, np.array(RAILS).tobytes()))
    with pytest.raises(ValueError, match=message):
        kernel.NativeRails(contact, kernel.framed(b"CREEPRAI", 1, numbers.tobytes()))


def test_damaged_resource_is_refused_with_its_name(wheelset: cl.Wheelset, tmp_path: Path) -> None:
    folder = exported(braked_vehicle(wheelset, 2), tmp_path, "vehicle", 2)
    assert validate_fmu(str(folder)) == []
    file = folder / "resources" / "rails.bin"
    data = bytearray(file.read_bytes())
    data[-5] ^= 1
    file.write_bytes(data)
    log: list[tuple[str, str]] = []
    with pytest.raises(Exception, match="nstantiate"):
        Instance(folder, log=log)
    assert "resource rails.bin: the file is damaged" in log[0][1]


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"axles": 5.0}, "axles = 5 must be 4"),
        ({"axles_per_bogie": 3.0}, "axles_per_bogie = 3 must give two or more bogies of 4 axles"),
        ({"position[3]": 2.0}, "position[3] = 2 is out of range: must be above position[2] = 2.5"),
        ({"load_lag": 0.0}, "load_lag = 0 is out of range"),
        ({"static_friction": 0.1}, "axle 1: static_friction = 0.1 is out of range"),
        ({"brake_torque[2]": -1.0}, "brake_torque[2] = -1 is out of range"),
    ],
)
def test_impossible_vehicles_are_refused(
    wheelset: cl.Wheelset, tmp_path: Path, given: dict[str, float], message: str
) -> None:
    folder = exported(braked_vehicle(wheelset, 4), tmp_path, "vehicle", 2)
    with Instance(folder).initialize() as tool, tool.refused(message):
        tool.set(**given)
        tool.fmu.exitInitializationMode()


def test_export_refuses_what_a_vehicle_s_fmu_cannot_be(
    wheelset: cl.Wheelset, locomotive: cl.Model, tmp_path: Path
) -> None:
    path, scenario = tmp_path / "x.fmu", braked_vehicle(wheelset, 2)
    train = replace(scenario.drivetrain, axle=Axle(stiffness=1e7))
    shaft = Motor(rotor_inertia=10.0, shaft_stiffness=1e6)
    shafted = replace(scenario.drivetrain, motor=shaft)
    pads = Brake(fill_time=0.25, vent_time=0.12, pad_speed=(0.0, 9.0), pad_friction=(1.2, 0.8))
    padded = replace(scenario.drivetrain, brake=pads)
    unknown = replace(scenario.drivetrain, brake=Brake(fill_time=0.25, vent_time=0.12))
    by_pressure = {"brake_pressure": True}
    for wrong, options, message in (
        (scenario, {"wheels": 2}, "a vehicle has the axles of its scenario"),
        (scenario, {"kind": "wheelset"}, "needs a Model: expected one, got a Scenario"),
        (locomotive, {"kind": "vehicle"}, "needs a Scenario: expected one, got a Model"),
        (braked_vehicle(wheelset, 2, load_lag=0.0), {}, "vehicle.load_lag = 0.0 must be > 0"),
        (replace(scenario, drivetrain=train), {}, "drivetrain.axle is elastic"),
        (replace(scenario, drivetrain=shafted), {}, "drivetrain.motor has an elastic shaft"),
        (replace(scenario, drivetrain=padded), {}, "drivetrain.brake has pads: in an FMU"),
        (replace(scenario, drivetrain=unknown), by_pressure, r"needs \[brake\] with pressure"),
        (locomotive, by_pressure, "brake_pressure = True needs kind = 'vehicle'"),
        (plain_scenario(wheelset), {}, r"scenario.vehicle = None: .* needs a scenario with"),
    ):
        given: Any = options
        with pytest.raises(ValueError, match=message):
            cl.export_fmu(wrong, path, **given)
    assert not path.exists()


def test_the_command_takes_a_scenario(tmp_path: Path) -> None:
    path = tmp_path / "coach.fmu"
    result = done("fmu", "coach_braking.toml", "-o", path)
    assert result.output.strip() == str(path)
    assert validate_fmu(str(path)) == []
    description = fmpy.read_model_description(str(path))
    starts = [v.start for v in description.modelVariables if v.name.startswith("position[")]
    assert [float(start) for start in starts] == [0.0, 2.5, 19.0, 21.5]
    assert "contact_temperature[1]" not in {v.name for v in description.modelVariables}


@pytest.mark.slow
def test_a_master_in_c_stops_the_coach_where_the_run_does(tmp_path: Path) -> None:
    class Protection:
        sample_time = 0.01

        def start(self, measured: Any, torque: Any) -> None:
            return None

        def sample(self, measured: Any, memory: None) -> tuple[Any, None]:
            slips = measured.wheel_speed < 0.9 * measured.vehicle_speed
            return np.where(slips, 0.0, measured.demand), memory

    scenario = replace(cl.load_scenario("coach_braking.toml"), sensors=Sensors(), duration=50.0)
    protection: Any = Protection()
    run: Any = cl.run_scenario(scenario, protection, tolerance=1e-7)
    folder = exported(scenario, tmp_path, "vehicle", 2)
    source = Path(__file__).parents[2] / "examples" / "vehicle_fmu.c"
    command = [sys.executable, "-m", "ziglang", "cc", "-Wall", "-Wextra", "-Werror", str(source)]
    headers = Path(fmpy.__file__).parent / "c-code"
    subprocess.run(
        [*command, f"-isystem{headers}", "-ldl", "-lm", "-o", "m"], check=True, cwd=tmp_path
    )
    printed = subprocess.check_output([tmp_path / "m", folder], text=True)
    distance, time = map(float, re.findall(r"[\d.]+", printed))
    assert distance == pytest.approx(run["distance"].max(), abs=0.1)  # of 1 km
    assert time == pytest.approx(run.time[np.argmax(run["speed"] < 0.01)], abs=0.03)
