"""Scenario files: the shipped ones, and how mistakes are reported."""

from __future__ import annotations

import math
import shutil
import tomllib
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import contactlib as cl
from contactlib.base.writing import package_folder
from contactlib.element import ProcessZoneWarning
from contactlib.files.reading import file_kind
from contactlib.traction import OpenLoop, Sensors
from contactlib.vehicle import Axle, Drivetrain, DynamicLoad, Motor

MODELS = package_folder("models")
SHIPPED = sorted(p.stem for p in MODELS.glob("*.toml") if "demand" in tomllib.loads(p.read_text()))
WET = 0.30 / 0.55  # Polach 2005


def load(name: str) -> cl.Scenario:
    return cl.load_scenario(f"{name}.toml")


def limit(scenario: cl.Scenario, speed: float, scale: float = 1.0) -> float:
    """Torque that friction takes [N.m]."""
    wheelset = scenario.drivetrain.wheelset
    force = cl.vehicle.available_force(wheelset.element, speed=speed, friction_scale=scale)
    return wheelset.radius * float(force)


# ---- the shipped ones -----------------------------------------------------------------------


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_scenarios_load(name: str) -> None:
    scenario = load(name)
    element = scenario.drivetrain.wheelset.element
    assert scenario.source
    assert scenario.controllers
    if name.startswith("torque_or_creep"):  # the plain vehicle
        return
    # Polach 2005, dry; of the coach wet.
    friction = element.friction  # at high slip speed it is Polach's A times that at rest
    assert friction.slip_rate_residual * friction.kinetic == pytest.approx(
        0.4 * friction.static, rel=1e-3
    )
    assert friction.slip_rate_decay == (0.2 if name == "coach_braking" else 0.6)
    assert element.memory
    assert scenario.demand.at[-1] <= scenario.duration
    # The run can begin in a steady state on the rising branch.
    scale = scenario.rails.friction_scale(0.0, 0.0)
    at_start = limit(scenario, scenario.initial_speed, float(scale.min()))
    assert abs(scenario.demand(0.0)) < 0.95 * at_start


@pytest.mark.parametrize("name", ["dry_wet_dry", "braking", "split_friction"])
def test_wet_patch_is_100_m_that_the_demand_is_too_much_for(name: str) -> None:
    scenario = load(name)
    left = scenario.track.friction_left
    assert left.at[2] - left.at[1] == 100.0
    assert min(left.value) == pytest.approx(WET, abs=1e-3)
    right = scenario.track.friction_right
    assert (right is None) == (name != "split_friction")
    largest = max(map(abs, scenario.demand.value))
    speed = scenario.initial_speed
    element, worst = scenario.drivetrain.wheelset.element, min(left.value)
    other = worst if right is None else 1.0
    wet = element.radius * cl.vehicle.available_force(
        element, speed=speed, friction_scale=worst, other_friction_scale=other
    )
    assert wet < largest < limit(scenario, speed)
    assert largest > 0.9 * limit(scenario, speed)


def test_step_and_ramp_ask_for_too_much_and_end_where_spinning_wheels_come_back() -> None:
    for name in ("torque_step", "torque_ramp"):
        scenario = load(name)
        fold = cl.find_fold(scenario.drivetrain.wheelset, speed=scenario.initial_speed)
        assert max(scenario.demand.value) > fold.drive_torque > scenario.demand.value[0]
        assert scenario.demand.value[-1] < fold.return_torque


def test_speed_sweep_demands_more_than_friction_gives_at_any_speed() -> None:
    scenario = load("speed_sweep")
    wheelset, held = scenario.drivetrain.wheelset, scenario.held_speed
    assert held is not None
    assert (min(held.value), max(held.value)) == (5.0, 40.0)
    for speed in np.linspace(5.0, 40.0, 8):
        largest = limit(scenario, speed) + wheelset.damping * speed / wheelset.radius
        assert largest < max(scenario.demand.value)


def test_sand_comes_while_the_demand_is_above_the_limit() -> None:
    scenario = load("sanding")
    slippery, sanded = (
        float(scenario.track.friction_scale(0.0, t)[0]) for t in (0.0, scenario.duration)
    )
    before, after = (limit(scenario, 6.0, scale) for scale in (slippery, sanded))
    assert slippery < 0.5 * sanded
    assert before < after < max(scenario.demand.value)


@pytest.mark.parametrize("name", ["split_friction", "torsion"])
def test_elastic_axle_is_that_of_a_locomotive(name: str) -> None:
    drivetrain = load(name).drivetrain
    assert 40.0 < drivetrain.torsional_frequency / (2.0 * math.pi) < 60.0
    assert 0.005 < drivetrain.torsional_damping_ratio < 0.02


def test_torsion_is_held_beyond_the_peak_where_it_grows() -> None:
    scenario = load("torsion")
    data = tomllib.loads((MODELS / "torsion.toml").read_text())
    reference = data["controllers"]["beyond_peak"]["reference"]
    drivetrain, speed = scenario.drivetrain, scenario.initial_speed
    wheelset = drivetrain.wheelset
    grid = np.linspace(0.0, 0.1, 100_001)
    peak = grid[np.argmax(wheelset.element.at_creepage(grid, speed=speed)["creep_force"])]
    assert reference / peak > 1.5
    # r^2 |Q'|/(J V) > 2 D omega_t, with the mean of a wheel that swings in the denominator gone.
    slope = wheelset.balanced(creepage=reference, speed=speed).creep_force_slope
    growth = -(wheelset.radius**2) * slope / (wheelset.inertia * speed)
    decay = 2.0 * drivetrain.torsional_damping_ratio * drivetrain.torsional_frequency
    assert growth > 1.5 * decay
    rising = wheelset.balanced(creepage=0.65 * peak, speed=speed).creep_force_slope
    assert rising > 0.0


# ---- what is read ---------------------------------------------------------------------------

TEXT = """
name = "x"
source = "y"
wheelset = "locomotive.toml"

[run]
initial_speed = "36 km/h"
duration = "1 min"

[demand]
time = [0.0, 1.0]
torque = ["10 kN.m", 20e3]

[controllers.first]
kind = "open_loop"
"""


def write(folder: Path, text: str) -> Path:
    path = folder / "mine.toml"
    path.write_text(text)
    return path


def test_what_is_left_out_is_as_plain_as_can_be(tmp_path: Path) -> None:
    scenario = cl.load_scenario(write(tmp_path, TEXT))
    assert scenario.initial_speed == pytest.approx(10.0)
    assert scenario.duration == 60.0
    assert scenario.design_speed == scenario.initial_speed
    assert scenario.demand == cl.Profile((0.0, 1.0), (10e3, 20e3))
    assert scenario.track == cl.Track()
    assert scenario.held_speed is None
    drivetrain = scenario.drivetrain
    assert (drivetrain.axle, drivetrain.motor) == (None, Motor())
    assert not drivetrain.wheelset.element.memory
    assert list(scenario.controllers) == ["first"]


def test_all_sections_are_read(tmp_path: Path) -> None:
    more = """
        [controllers.second]
        kind = "open_loop"
        sample_time = "5 ms"
        [axle]
        stiffness = "6 MN.m/rad"
        damping = 400
        [motor]
        lag = "20 ms"
        power = "1.6 MW"
        [sensors]
        vehicle_speed_bias = "-0.5 %"
        encoder_pulses = 120
        delay = "10 ms"
        seed = 3
        [track]
        distance = ["1 km", "2 km"]
        friction_left = ["50 %", 1.0]
        friction_right = [1.0, 1.0]
        time = [5.0, 8.0]
        friction_over_time = [1.0, 0.5]
        slope = ["30 %", 1.0]
        [dynamic_load]
        frequency = [0.5, "10 Hz"]
        density = [0.02, 0.0]
        seed = 7
        [wheelset_changes.contact]
        memory = true
        [wheelset_changes.friction]
        static = 0.5
        [wheelset_changes.wheelset]
        mass = "22.5 t"
    """
    scenario = cl.load_scenario(write(tmp_path, TEXT + more))
    drivetrain = scenario.drivetrain
    assert drivetrain.axle == Axle(stiffness=6e6, damping=400.0)
    assert drivetrain.motor == Motor(lag=0.02, power=1.6e6)
    assert drivetrain.wheelset.element.memory
    assert scenario.sensors == Sensors(
        vehicle_speed_bias=-0.005, encoder_pulses=120.0, delay=0.01, seed=3.0
    )
    assert scenario.track.friction_left == cl.Profile((1e3, 2e3), (0.5, 1.0))
    assert scenario.track.friction_scale(1e3, 9.0).tolist() == [0.25, 0.5]
    assert scenario.track.slope == cl.Profile((1e3, 2e3), (0.3, 1.0))
    assert scenario.dynamic_load == DynamicLoad(
        frequency=(0.5, 10.0), density=(0.02, 0.0), seed=7.0
    )
    assert list(scenario.controllers) == ["first", "second"]
    assert scenario.controller("second").sample_time == pytest.approx(5e-3)
    # One key changes, and what follows from it: k_hat and saturation creepage are as in the file.
    element = drivetrain.wheelset.element
    assert (element.friction.kinetic, element.friction.static) == (0.21, 0.5)
    assert element.k_hat == pytest.approx(0.3)
    assert element.saturation_creepage == pytest.approx(0.015)
    assert drivetrain.wheelset.mass == pytest.approx(22.5e3)


def test_a_rig_holds_its_speed(tmp_path: Path) -> None:
    rig = TEXT.replace("locomotive", "roller_rig")
    still = cl.load_scenario(write(tmp_path, rig))
    assert still.held_speed == cl.Profile.of(still.initial_speed)
    swept = rig.replace('initial_speed = "36 km/h"', "")
    swept += '[held_speed]\ntime = [0.0, 5.0]\nspeed = [4.0, "36 km/h"]'
    scenario = cl.load_scenario(write(tmp_path, swept))
    assert scenario.held_speed == cl.Profile((0.0, 5.0), (4.0, 10.0))
    assert scenario.initial_speed == scenario.design_speed == 4.0


def test_controllers_are_designed_for_the_drivetrain(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    inputs: dict[str, Any] = {}

    def for_drivetrain(drivetrain: Drivetrain, **given: Any) -> Any:
        inputs.update(given, drivetrain=drivetrain)
        if given["sample_time"] == 3.0:
            raise ValueError("OpenLoop.sample_time = 3.0 is too long")
        return OpenLoop(sample_time=given["sample_time"])

    monkeypatch.setattr(OpenLoop, "for_drivetrain", for_drivetrain)
    text = TEXT.replace("duration", "design_speed = 5.0\nduration") + "sample_time = 0.02"
    scenario = cl.load_scenario(write(tmp_path, text))
    assert inputs["drivetrain"] is scenario.drivetrain
    assert (inputs["speed"], inputs["sample_time"]) == (5.0, 0.02)
    assert inputs["sensors"] == scenario.sensors
    with pytest.raises(
        cl.ModelError, match=r"mine\.toml: controllers\.first\.sample_time = 3\.0 is too long"
    ):
        cl.load_scenario(write(tmp_path, text.replace("0.02", "3.0")))


# ---- the vehicle's file ---------------------------------------------------------------------


def test_vehicle_lies_beside_the_scenario_or_is_shipped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "locomotive.toml").write_text("name = 1")
    monkeypatch.chdir(elsewhere)  # where a command runs does not matter
    path = write(tmp_path, TEXT)
    assert cl.load_scenario(path).drivetrain.wheelset.inertia == 250.0
    vehicle = (MODELS / "locomotive.toml").read_text().replace("inertia = 130.0", "inertia = 180.0")
    (tmp_path / "locomotive.toml").write_text(vehicle)
    assert cl.load_scenario(path).drivetrain.wheelset.inertia == 300.0
    (tmp_path / "vehicles").mkdir()
    shutil.move(tmp_path / "locomotive.toml", tmp_path / "vehicles" / "own.toml")
    path = write(tmp_path, TEXT.replace("locomotive.toml", "vehicles/own.toml"))
    assert cl.load_scenario(path).drivetrain.wheelset.inertia == 300.0


def test_each_reader_names_the_other() -> None:
    with pytest.raises(cl.ModelError, match=r"roller_rig\.toml: is a model, .*load_model"):
        cl.load_scenario("roller_rig.toml")
    with pytest.raises(cl.ModelError, match=r"torsion\.toml: is a scenario, .*load_scenario"):
        cl.load_model("torsion.toml")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("[vehicle]", True),
        ("[wheelset_changes]", True),
        ("[controllers.pi]", True),
        ("[demand]", True),
        ("[contact]", False),
    ],
)
def test_each_key_that_only_scenarios_have_makes_one(
    tmp_path: Path, text: str, expected: bool
) -> None:
    (tmp_path / "x.toml").write_text(text)
    assert (file_kind(tmp_path / "x.toml") == "scenario") is expected
    (tmp_path / "x.toml").write_text(f"{text}\n=")
    with pytest.raises(cl.ModelError, match=r"x\.toml: "):
        file_kind(tmp_path / "x.toml")


# ---- mistakes -------------------------------------------------------------------------------


# Sections that stand before [demand], each with a mistake.
ADDED = [
    ("[wheelset_changes]\nname = 3", r"wheelset_changes\.name is not a kn"),
    (
        "[wheelset_changes.friction]\nslip_rat_decay = 3",
        r"wheelset_changes\.friction\.slip_rat_decay is not .*mean 'slip_rate_decay'",
    ),
    (
        "[wheelset_changes.friction]\nstatic = 0.1",
        r"wheelset locomotive\.toml changed: friction\.static = 0\.1 .*>= kinetic",
    ),
    ("[held_speed]\ntime=[0.0]\nspeed=[1.0]", r"held_speed needs .*rig"),
    ("[axle]", r"axle\.stiffness is missing"),
    ("[motor]\nrotor_inertia = 7", r"motor\.rotor_inertia = 7\.0 is for .* needs both rotor_in"),
    ("[motor]\ngear_ratio = 4", r"motor\.gear_ratio = 4\.0 is for .* needs both rotor_inertia and"),
    ("[motor]\nshaft_damping = 9", r"motor\.shaft_damping = 9\.0 is for .* both rotor_inertia and"),
    (
        "[motor]\nrotor_inertia = 90\ngear_ratio = 2\nshaft_stiffness = 1e6",
        r"motor\.rotor_inertia = 90\.0 .* < 62\.5, as wheelset\.inertia = 250\.0 contains it",
    ),
    ("[wheelset_changes.contact]\nmemory = 1", r"contact\.memory = 1 "),
    ("[contact_relaxation]\nlength = 1", r"contact_relaxation is not a known"),
    ("[track]\ndistance = [0.0]", r"track\.distance must go with slope, grade, speed_limit"),
    (
        "[track]\ndistance = [0.0]\nfriction_left = [1.0]",
        r"track\.distance must go with .*given are distance and friction_left",
    ),
    ("[track]\ntime = [0.0]", r"track\.time is given alone: .* go together"),
    ("[track]\nslope = [0.5]", r"track\.distance must go .*given are slope"),
    (
        "[track]\ndistance = [0.0, 1.0]\nfriction = [1.0]",
        r"track\.distance has 2 and friction 1 entries",
    ),
    ("[dynamic_load]\ntime = [0.0]", r"dynamic_load\.time and factor, or"),
    ("[axes.x]\nvalues = [1.0]", r"is a sweep"),
]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        *(("[demand]", f"{section}\n[demand]", message) for section, message in ADDED),
        ("[demand]", "[demnd]", r"demnd is not a known key; did you mean 'demand'"),
        ('source = "y"', "", r"source is missing"),
        ('wheelset = "locomotive.toml"', "", r"wheelset is missing"),
        ('"locomotive.toml"', "3", r"wheelset = 3 must be a string"),
        ("locomotive.toml", "no.toml", r"wheelset no\.toml: no such file, neither beside"),
        ("locomotive.toml", "../x.toml", r"wheelset must lie beside the scenario or below"),
        ("locomotive.toml", "torsion.toml", r"wheelset torsion\.toml: is a scenario"),
        ('initial_speed = "36 km/h"', "", r"run\.initial_speed and held_speed: give one"),
        (
            '"36 km/h"',
            "0.0",
            r"run\.design_speed is missing, and the initial speed 0\.0 is out of.*0\.1",
        ),
        ("time = [0.0, 1.0]", "time = [1.0]", r"demand\.time has 1 and torque 2 entries"),
        ("[0.0, 1.0]", "[0.0]\npressure = [1e5]", r"demand must have one of .* torque, pressure$"),
        ('torque = ["10 kN.m", 20e3]', "", r"demand must have one of .*; given: nothing"),
        ('torque = ["10 kN.m", 20e3]', "pressure = [0.0, 1e5]", r"demand\.pressure needs brake"),
        ("[demand]", "[brake]\nvent_time = 1.0\n[demand]", r"fill_time = None and build_up_time"),
        (
            "[demand]",
            "[brake]\nvent_time = 1.0\nfill_time = 1.0\ntorque = 1e3\n[demand]",
            r"pressure = None and torque = 1000\.0: give both or neither",
        ),
        ("[controllers.first]", "[controllers.metrics]", r"controllers.'metrics' is not a name"),
        ("[controllers.first]", '[controllers."../x"]', r"controllers.'\.\./x' is not a name"),
        ("[controllers.first]", "[controller.first]", r"controller is not .*mean 'controllers'"),
        ('[controllers.first]\nkind = "open_loop"', "[controllers]", r"controllers must name at"),
        ("[controllers.first]\nkind", "[controllers]\nkind", r"controllers\.kind = .*a section"),
        ('kind = "open_loop"', "", r"controllers\.first\.kind is missing; it is one of: open_loop"),
        ("open_loop", "opn_loop", r"controllers\.first\.kind = 'opn_loop' .*mean 'open_loop'"),
        ('"open_loop"', '"open_loop"\nkin = 1', r"controllers\.first\.kin is .*mean 'kind'"),
        ('"36 km/h"', f"1{400 * '0'}", r"run\.initial_speed is out of range"),
        (
            "[controllers.first]",
            '[controllers.First]\nkind = "open_loop"\n[controllers.first]',
            r"differ in more than capital letters",
        ),
    ],
)
def test_a_mistake_is_one_clear_line(old: str, new: str, message: str, tmp_path: Path) -> None:
    assert old in TEXT
    with pytest.raises(cl.ModelError, match=rf"mine\.toml: .*{message}") as caught:
        cl.load_scenario(write(tmp_path, TEXT.replace(old, new, 1)))
    assert "\n" not in str(caught.value)


CREEP = """
[controllers.creep]
kind = "creep_control"
time = [0.0, 2.0]
creepage = ["1 %", "2 %"]
proportional_gain = 1e6
torque_min = 0.0
torque_max = "35 kN.m"
"""
TORQUE = '[controllers.torque]\nkind = "torque_control"\n'


def test_continuous_controllers_are_read(tmp_path: Path) -> None:
    scenario = cl.load_scenario(write(tmp_path, TEXT + CREEP + TORQUE))
    assert scenario.any_controller("torque") == cl.TorqueControl(scenario.demand)
    assert scenario.any_controller("creep") == cl.CreepControl(
        reference=cl.Profile((0.0, 2.0), (0.01, 0.02)),
        proportional_gain=1e6,
        torque_min=0.0,
        torque_max=35e3,
    )
    assert isinstance(scenario.controller("first"), OpenLoop)
    for name in ("creep", "torque"):
        with pytest.raises(ValueError, match=f"controller = '{name}' is continuous"):
            scenario.controller(name)


@pytest.mark.parametrize(
    ("added", "message"),
    [
        (
            CREEP.replace("[0.0, 2.0]", "[2.0, 0.0]"),
            r"\.creep\.time = .* must be increasing",
        ),
        (CREEP.replace("[0.0, 2.0]", "[0.0]"), r"creep\.time has 1 and creepage 2 entries"),
        (CREEP.replace("torque_min = 0.0", "torque_min = 4e4"), r"torque_min = 40000\.0 .*< torq"),
        (CREEP.replace("torque_min = 0.0", ""), r"controllers\.creep\.torque_min is missing"),
        (f"{TORQUE}torque = [0.0]", r"controllers\.torque\.torque is not a known key"),
        (f"{TORQUE}[motor]\nlag = 0.01", r"torque is continuous .* must not have \[motor\]$"),
        (f"{TORQUE}[axle]\nstiffness = 6e6", r"torque is continuous .* must not have \[axle\]$"),
        (f"{CREEP}[track]\ndistance = [0.0]\nfriction = [0.5]", r"creep is .* have \[track\]$"),
    ],
)
def test_continuous_controllers_act_on_the_wheels(tmp_path: Path, added: str, message: str) -> None:
    with pytest.raises(cl.ModelError, match=message):
        cl.load_scenario(write(tmp_path, TEXT + added))


def test_a_scenario_made_in_python_is_checked_too() -> None:
    scenario = load("dry_wet_dry")
    with pytest.raises(ValueError, match=r"held_speed = Profile.*the wheelset's speed is free"):
        replace(scenario, held_speed=cl.Profile.of(10.0))
    with pytest.raises(ValueError, match=r"Scenario\.duration = -1\.0 .*> 0"):
        replace(scenario, duration=-1.0)
    with pytest.raises(ValueError, match="at least one controller"):
        replace(scenario, controllers={})


def test_an_implausible_change_of_the_vehicle_warns_once(tmp_path: Path) -> None:
    text = (MODELS / "dry_wet_dry.toml").read_text()
    path = tmp_path / "mine.toml"
    path.write_text(
        text.replace(
            "[wheelset_changes.friction]", "[wheelset_changes.friction]\nstatic = 4.5"
        ).replace('lag = "10 ms"', "lag = 10")
    )
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        warnings.simplefilter("ignore", ProcessZoneWarning)
        cl.load_scenario(path)
    keys = [str(w.message).partition("mine.toml: ")[2].partition(" is ")[0] for w in caught]
    assert keys == ["wheelset_changes.friction.static = 4.5", "motor.lag = 10 s"]


@pytest.mark.parametrize(
    ("change", "doubt"),
    [
        ("contact]\nwheel_load = 40e3", r"load = 4e\+04 N, but .* wheel carries 1\.103e\+05 N"),
        ("wheelset]\nradius = 0.445", r"radius_x = 0\.5 m and wheelset\.radius = 0\.445 m differ"),
        ("wheelset]\nmass = 3e5", r"resistance is that of .*mass = 3e\+05 kg, .* 1\.425e\+05 kg"),
        ("wheelset]\n[motor]\ntrip_speed = 9", r"trip_speed = 9 m/s trips at the initial speed"),
        (
            "wheelset]\nwheels = 1\n[wheelset_changes.contact]\nwheel_load = 220.65e3",
            r"wheelset\.wheels = 1: each axle of a vehicle has 2",
        ),
        (
            "wheelset]\nradius = 1.6\n[wheelset_changes.contact]\nradius_x = 1.6",
            r"axles 3 m apart: wheels of wheelset\.radius = 1\.6 m overlap",
        ),
    ],
)
def test_numbers_that_physics_ties_together_are_compared(
    tmp_path: Path, change: str, doubt: str
) -> None:
    text = (MODELS / "four_axles.toml").read_text()
    for section in ("[wheelset_changes.contact]\nmemory = true\n", '[motor]\nlag = "10 ms"\n'):
        text = text.replace(section, "")
    with pytest.warns(cl.InputWarning, match=doubt):
        cl.load_scenario(write(tmp_path, f"{text}[wheelset_changes.{change}\n"))


def test_the_mass_of_a_wheelset_by_itself_is_no_doubt_in_a_vehicle(tmp_path: Path) -> None:
    text = (MODELS / "four_axles.toml").read_text()
    text += "[wheelset_changes.wheelset]\nmass = 2600\n[wheelset_changes.resistance]\n"
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        zero = "constant = 0.0\nlinear = 0.0\nquadratic = 0.0\n"
        scenario = cl.load_scenario(file := write(tmp_path, text + zero))
        axis = '[axes.r]\nlabel = "r"\nparameter = "vehicle.wheelset.damping"\nvalues = [1.0, 2.0]'
        chosen = f'name = "s"\nsource = "s"\nscenario = "{file.name}"\noutcomes = ["air_used"]\n'
        (tmp_path / "sweep.toml").write_text(f"{chosen}{axis}\n")
        cl.load_sweep(tmp_path / "sweep.toml").scenario_of(1)
    assert not [w for w in caught if w.category is cl.InputWarning]
    assert scenario.drivetrain.wheelset.mass == 142.5e3  # of the vehicle and its train, by axle


def test_all_mistakes_of_scenario_and_vehicle_come_at_once(tmp_path: Path) -> None:
    vehicle = (MODELS / "locomotive.toml").read_text()
    vehicle = vehicle.replace('mass = "142.5 t"', 'mas = "142.5 t"').replace("0.45", "-0.45")
    (tmp_path / "loco.toml").write_text(vehicle)
    text = TEXT.replace("locomotive.toml", "loco.toml").replace('"1 min"', '"1 m"')
    text = text.replace("time = [0.0, 1.0]", "time = [1.0, 0.0]").replace("open_loop", "opn_loop")
    (tmp_path / "mine.toml").write_text(text + "[motr]\nlag = 1\n")
    with pytest.raises(cl.ModelError) as caught:
        cl.load_scenario(tmp_path / "mine.toml")
    heads = [
        line.partition("mine.toml: ")[2].split(" = ")[0].split(" is ")[0]
        for line in caught.value.lines
    ]
    assert sorted(heads) == sorted(
        [
            "wheelset loco.toml: friction.static",
            "wheelset loco.toml: wheelset.mas",
            "run.duration",
            "demand.time",
            "controllers.first.kind",
            "motr",
        ]
    )
    assert heads[:2] == ["wheelset loco.toml: friction.static", "wheelset loco.toml: wheelset.mas"]
    assert heads[-1] == "motr"
