"""Runs of scenarios: the plant, the sampling, the sensors and the track together."""

from __future__ import annotations

import dataclasses
import tomllib
from typing import Any, Self

import numpy as np
import pytest
from designed import LIMITED
from falling_friction import with_falling
from plain_scenario import plain_scenario, wet_patch

import contactlib as cl
from contactlib import stability
from contactlib.base.quantities import FloatArray
from contactlib.runs.signals import WORKS
from contactlib.traction import Measurement, OpenLoop, Sensors, SlopeSeeking
from contactlib.vehicle import Drivetrain, DynamicLoad, Motor, Resistance


@pytest.fixture
def wet_drive(locomotive: cl.Model) -> cl.Scenario:
    """Two seconds from 10 m/s, under a demand above what a wet rail allows."""
    shipped = cl.load_scenario("dry_wet_dry.toml")
    controllers = {name: shipped.controller(name) for name in ("creep_pi", "open_loop")}
    return plain_scenario(locomotive.wheelset, demand=cl.Profile.of(2.2e4), controllers=controllers)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Probe(OpenLoop):
    """Writes down what it is shown."""

    seen: list[Measurement[FloatArray]]

    def __deepcopy__(self, memo: object) -> Self:
        return self  # what it writes down is for the test

    def sample(self, measurement: Measurement[FloatArray], memory: Any) -> tuple[FloatArray, Any]:
        self.seen.append(measurement)
        return super().sample(measurement, memory)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Proportional(OpenLoop):
    """T = T0 + Kp (reference - creepage), by the book: the demand is T0."""

    gain: float
    reference: float

    def sample(self, measurement: Measurement[FloatArray], memory: Any) -> tuple[FloatArray, Any]:
        creepage = measurement.wheel_speed / measurement.vehicle_speed - 1.0
        return measurement.demand + self.gain * (self.reference - creepage), memory


def test_an_open_loop_is_a_torque_prescribed(rig: cl.Model, locomotive: cl.Model) -> None:
    wet = cl.Profile((0.5, 0.5, 0.9, 0.9), (1.0, 0.4, 0.4, 1.0))
    for model in (rig, locomotive):
        case = plain_scenario(model.wheelset, track=cl.Track(friction_over_time=wet))
        run = cl.run_scenario(case, "open_loop")
        other = cl.simulate(
            model.wheelset,
            cl.TorqueControl(cl.Profile.of(2.0e4)),
            duration=2.0,
            initial_speed=10.0,
            friction_scale=wet,
            tolerance=1e-11,
        )
        assert run["creepage"].max() > 0.5  # it slips away on the wet stretch
        for name in ("omega", "speed", "distance", "stored_energy", *WORKS):
            assert run[name][-1] == pytest.approx(other[name][-1], rel=1e-6), name


def test_a_patch_lies_where_it_lies(locomotive: cl.Model) -> None:
    patch = cl.Profile((5.0, 5.0, 15.0, 15.0), (1.0, 0.8, 0.8, 1.0))
    track = cl.Track(friction_left=patch, friction_right=cl.Profile.of(0.9))
    case = plain_scenario(locomotive.wheelset, track=track)
    run = cl.run_scenario(case, "open_loop", step=1e-3)
    on = (run["distance"] > 5.0) & (run["distance"] < 15.0)
    edge = np.minimum(abs(run["distance"] - 5.0), abs(run["distance"] - 15.0)) < 0.02
    np.testing.assert_array_equal(run["friction_scale_left"][~edge], np.where(on, 0.8, 1.0)[~edge])
    assert (run["friction_scale_right"] == 0.9).all()


WET = cl.Track(
    friction_left=cl.Profile((5.0, 5.0, 12.0, 14.0), (1.0, 0.6, 0.6, 1.0)),
    slope=cl.Profile((5.0, 6.0, 12.0, 12.0), (1.0, 0.29, 0.29, 1.0)),
)
ROUGH = DynamicLoad(frequency=(0.5, 2.0, 12.0), density=(0.02, 0.01, 0.0), seed=4)


def test_a_slope_everywhere_is_that_of_the_vehicle(wet_drive: cl.Scenario) -> None:
    """A factor of two's powers, so that dividing by it loses nothing: to the last bit."""
    flat = dataclasses.replace(wet_drive, track=cl.Track(slope=cl.Profile.of(0.25)))
    body = wet_drive.drivetrain.wheelset.with_slope(0.25)
    assert body.element.saturation_creepage == pytest.approx(
        4.0 * wet_drive.drivetrain.wheelset.element.saturation_creepage, rel=1e-15
    )
    vehicle = dataclasses.replace(wet_drive, drivetrain=Drivetrain(body), track=cl.Track())
    there, same = (cl.run_scenario(case, "creep_pi") for case in (flat, vehicle))
    for name in set(there.signals) - {"slope_scale"}:
        np.testing.assert_array_equal(there[name], same[name], err_msg=name)


def test_a_load_of_one_changes_no_bit(wet_drive: cl.Scenario) -> None:
    unit_load = DynamicLoad(time=(0.0, 1.0), factor=(1.0, 1.0))
    ones = dataclasses.replace(wet_drive, dynamic_load=unit_load)
    static, run = (cl.run_scenario(case, "creep_pi") for case in (wet_drive, ones))
    for name in set(run.signals) - {"available_force"}:
        np.testing.assert_array_equal(run[name], static[name], err_msg=name)
    # The interpolation has other nodes.
    np.testing.assert_allclose(run["available_force"], static["available_force"], rtol=1e-8)


@pytest.mark.parametrize("falls", [False, True])
@pytest.mark.parametrize("load", [None, ROUGH])
def test_energy_and_available_force_on_a_wet_rail_under_any_load(
    wet_drive: cl.Scenario, load: DynamicLoad | None, falls: bool
) -> None:
    body = wet_drive.drivetrain.wheelset
    if falls:
        body = with_falling(body)
    case = dataclasses.replace(wet_drive, drivetrain=Drivetrain(body), track=WET, dynamic_load=load)
    run = cl.run_scenario(case, "creep_pi")
    assert run["slope_scale"].min() == 0.29
    assert np.abs(run["energy_defect"]).max() < 1e-6 * run["drive_work"][-1]
    factor = 1.0 if load is None else load(run.time)
    np.testing.assert_allclose(run["axle_load"], body.element.axle_load * factor, rtol=1e-14)
    for i in range(0, run.time.size, 7):
        expected = cl.vehicle.available_force(
            body.with_slope(float(run["slope_scale"][i])).element,
            speed=run["speed"][i],
            axle_load=run["axle_load"][i],
            friction_scale=run["friction_scale_left"][i],
        )
        assert run["available_force"][i] == pytest.approx(float(expected), rel=1e-8)
    assert (np.abs(run["creep_force"]) <= run["available_force"] * (1.0 + 1e-8)).all()


def test_a_wheel_without_load_has_no_force(wet_drive: cl.Scenario) -> None:
    lifted = DynamicLoad(time=(0.5, 0.5, 0.7, 0.7), factor=(1.0, 0.0, 0.0, 1.0))
    run = cl.run_scenario(dataclasses.replace(wet_drive, dynamic_load=lifted), "creep_pi")
    up = (run.time >= 0.5 - 1e-9) & (run.time < 0.7 - 1e-9)
    for name in ("creep_force", "available_force", "axle_load"):
        assert (run[name][up] == 0.0).all()
        assert (run[name][~up] > 0.0).all()


def test_a_line_that_is_short_under_the_load_is_reported(wet_drive: cl.Scenario) -> None:
    body = wet_drive.drivetrain.wheelset
    contact = cl.LineContact.from_semi_width(
        semi_width=7e-3, radius=0.46, contact_modulus=115e9, wheel_load=80e3
    )
    long = dataclasses.replace(contact, length=4.2 * contact.semi_width)
    friction = cl.Friction(static=0.3, kinetic=0.3, weakening_length=0.0)
    element = cl.ForceElement(
        long, friction, table=cl.carter_griffith_table("line"), radius=body.radius, wheels=2,
        memory=True,
    )  # fmt: skip
    train = Drivetrain(dataclasses.replace(body, element=element))
    loads = [DynamicLoad(time=(0.0, 0.1), factor=(1.0, factor)) for factor in (1.1, 1.2)]
    heavy = [
        dataclasses.replace(wet_drive, drivetrain=train, dynamic_load=load, duration=0.2)
        for load in loads
    ]
    reported = r"the line contact is 3\.83 semi-widths long: its memory is that of 4"
    cl.run_scenario(heavy[0], "open_loop")
    with pytest.warns(cl.InputWarning, match=reported):
        cl.run_scenario(heavy[1], "open_loop")
    with pytest.warns(cl.InputWarning, match=reported):
        cl.run_many(heavy, "open_loop", outcomes=["slip_work"])


def test_a_load_held_over_rows_converges(wet_drive: cl.Scenario) -> None:
    """Of first order, as it is held from its value at the start of a row."""
    case = dataclasses.replace(wet_drive, dynamic_load=ROUGH, demand=cl.Profile.of(1.5e4))
    work = [
        cl.run_scenario(case, "open_loop", step=step)["creep_work"][-1]
        for step in (8e-3, 4e-3, 2e-3, 1e-3, 1e-4)
    ]
    errors = np.abs(np.array(work[:-1]) - work[-1])
    assert (errors[1:] < 0.7 * errors[:-1]).all()
    assert errors[-1] < 1e-3 * work[-1]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["friction_left", "slope"])
@pytest.mark.parametrize("start", [3.0, 3.01, 3.02, 3.03, 3.04])
def test_a_patch_shorter_than_a_step_is_met(locomotive: cl.Model, start: float, name: str) -> None:
    """Two centimetres are two fifths of a row; where it lies between rows does not matter."""
    ends = (start, start, start + 0.02, start + 0.02)
    patch: dict[str, Any] = {name: cl.Profile(ends, (1.0, 0.5, 0.5, 1.0))}
    track = cl.Track(**patch)
    wheelset = dataclasses.replace(locomotive.wheelset, resistance=Resistance())
    still = plain_scenario(wheelset, duration=0.6, demand=cl.Profile.of(2.5e4))
    case = dataclasses.replace(still, track=track)
    coarse, fine = (cl.run_scenario(case, "open_loop", step=step) for step in (5e-3, 1e-4))
    assert coarse["creep_work"][-1] == pytest.approx(fine["creep_work"][-1], rel=1e-5)
    without = cl.run_scenario(still, "open_loop")["creep_work"][-1]
    assert coarse["creep_work"][-1] > 1.0005 * without


def test_the_rows_converge_with_their_step(locomotive: cl.Model) -> None:
    ramp = cl.Profile((-5.0, 25.0), (1.1, 0.7))  # friction is that of each step's middle
    case = plain_scenario(locomotive.wheelset, track=cl.Track(friction_left=ramp), duration=1.0)

    def end(step: float) -> float:
        return float(cl.run_scenario(case, "open_loop", step=step)["creep_work"][-1])

    reference = end(5e-4)
    errors = [abs(end(step) - reference) for step in (1e-2, 5e-3)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.2)


def test_sensors_read_the_motion_and_torque_is_held(locomotive: cl.Model) -> None:
    demand = cl.Profile((0.0, 1.0), (1.0e4, 2.0e4))
    sensors = Sensors(wheel_speed_noise=0.01, vehicle_speed_noise=0.02, delay=0.03, seed=2)
    case = plain_scenario(locomotive.wheelset, demand=demand, sensors=sensors)
    probe = Probe(sample_time=0.01, seen=[])
    run = cl.run_scenario(case, probe, step=2e-3)
    samples = slice(None, None, 5)
    rim = (run["speed"] + run["slip_velocity"])[samples]
    reader = sensors.reader(1, 0.01)
    motion = zip(rim, run["speed"][samples], probe.seen, strict=True)
    for wheel, vehicle, seen in motion:
        shown = reader.read([wheel], [vehicle], 0.0)
        np.testing.assert_allclose(
            (seen.wheel_speed, seen.vehicle_speed), np.ravel(shown), rtol=1e-15
        )
    command = run["commanded_torque"]
    assert np.array_equal(
        command[:-1].reshape(-1, 5), np.repeat(command[:-1:5, np.newaxis], 5, axis=1)
    )
    np.testing.assert_allclose(command[samples], demand(run.time[samples]), rtol=1e-15)


KICKED = 0.021  # on the falling branch


def kicked(
    body: cl.Wheelset, gain: float, *, sample_time: float, delay: float, duration: float, lag: float
) -> FloatArray:
    """Deviation of the creepage from KICKED under proportional control, 1e-4 of it at the start."""
    torque = body.balanced(creepage=KICKED, speed=10.0).drive_torque
    case = plain_scenario(
        Drivetrain(body, motor=Motor(lag=lag)),
        demand=cl.Profile.of(torque),
        sensors=Sensors(delay=delay),
        controllers={"open_loop": OpenLoop(sample_time=sample_time)},
        duration=duration,
    )
    control = Proportional(sample_time=sample_time, gain=gain, reference=KICKED)
    run = cl.run_scenario(case, control, initial_creepage=KICKED * (1.0 + 1e-4))
    return np.abs(run["creepage"] / KICKED - 1.0)


@pytest.mark.filterwarnings("ignore:the run reaches")  # where no gain holds it
@pytest.mark.parametrize(("samples", "lag"), [(0, 0.0), (1, 0.0), (2, 0.0), (1, 0.004)])
def test_sampled_control_holds_the_falling_branch_as_far_as_predicted(
    rig: cl.Model, samples: int, lag: float
) -> None:
    """Just inside the window of gains a kicked creepage comes back; just outside it does not."""
    plant = stability.reduced_plant(rig.wheelset, KICKED, speed=10.0)
    given: dict[str, Any] = {"delay": samples * 2e-3, "lag": lag, "sample_time": 2e-3}
    window = stability.proportional_window(plant.pole, plant.gain, **given)
    assert plant.pole > 20.0
    assert not window.empty
    for inside, outside in (
        (1.03 * window.lowest, 0.97 * window.lowest),
        (0.97 * window.highest, 1.03 * window.highest),
    ):
        assert kicked(rig.wheelset, inside, duration=1.2, **given)[-100:].max() < 0.5e-4
        assert kicked(rig.wheelset, outside, duration=1.2, **given).max() > 10e-4


SHIPPED = [
    (path.name, controller)
    for path in sorted(cl.files.model_path("dry_wet_dry.toml").parent.glob("*.toml"))
    if "demand" in (read := tomllib.loads(path.read_text()))
    for controller in read["controllers"]
]


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:the run reaches:contactlib.InputWarning")
@pytest.mark.parametrize(("name", "controller"), SHIPPED)
def test_shipped_scenarios_run_and_balance(name: str, controller: str) -> None:
    case = cl.load_scenario(name)
    whole = cl.run_scenario(case, controller)
    assert cl.metrics(whole, case.drivetrain).energy_defect < 1e-9
    for run in whole.by_axle:
        for values in run.signals.values():
            assert np.isfinite(values).all()
        demand, slack = np.abs(run["demand"]), 1e-9 * np.abs(run["demand"]).max()
        # The drive follows a demand that falls at its rate, 50 ms and a sample later at most.
        before = np.lib.stride_tricks.sliding_window_view(np.pad(demand, (15, 0)), 16).max(axis=1)
        assert (np.abs(run["commanded_torque"]) <= before + slack).all()
        rails = np.maximum(run["friction_scale_left"], run["friction_scale_right"])
        largest = case.drivetrain.wheelset.element.friction.static * rails * run["axle_load"]
        assert (np.abs(run["creep_force"]) <= largest * (1.0 + 1e-12)).all()
        if case.initial_speed > 0.0:
            first, second = run["creep_force"][:2]
            assert first == pytest.approx(second, rel=0.05, abs=100.0)


@pytest.mark.slow
@pytest.mark.parametrize("name", LIMITED)
@pytest.mark.parametrize("speed", [0.0, 0.05, -3.0])
def test_no_controller_starts_at_no_torque_for_ever(speed: float, name: str) -> None:
    dry: dict[str, Any] = {"track": cl.Track(), "sensors": Sensors(), "duration": 6.0}
    case = wet_patch(initial_speed=speed, demand=cl.Profile.of(2.0e4), **dry)
    torque = cl.run_scenario(case, name)["commanded_torque"]
    assert torque[-1] > 0.8 * 2.0e4
    assert torque[-1] >= torque[torque.size // 2]


@pytest.mark.slow
@pytest.mark.parametrize("name", LIMITED)
@pytest.mark.parametrize(("wheel", "vehicle"), [(0.1, 0.1), (0.05, 0.05), (0.05, 0.02)])
def test_noise_on_a_dry_rail_is_no_slip(wheel: float, vehicle: float, name: str) -> None:
    sensors = Sensors(wheel_speed_noise=wheel, vehicle_speed_noise=vehicle, delay=0.01, seed=3)
    ramp = cl.Profile((0.0, 10.0), (0.0, 2.0e4))
    case = wet_patch(demand=ramp, track=cl.Track(), sensors=sensors, duration=12.0)
    controller = cl.CONTROLLERS[name].for_drivetrain(case.drivetrain, speed=10.0, sensors=sensors)
    run = cl.run_scenario(case, controller)
    assert cl.metrics(run, case.drivetrain).utilisation > 0.99


@pytest.mark.slow
def test_creep_control_beats_cutting_the_torque() -> None:
    """With each of ten sequences of noise, and with no larger share of slip work."""
    cases = [wet_patch({"seed": float(seed)}) for seed in range(10)]
    outcomes = ("limited_utilisation", "utilisation", "slip_share")
    by_controller = [cl.run_many(cases, name, outcomes, index=[0] * len(cases)) for name in LIMITED]
    limited, used, share = (
        np.stack([values[name] for values in by_controller], axis=1) for name in outcomes
    )
    baseline, pi, seeking = range(3)
    assert (limited[:, pi:] > limited[:, [baseline]] + 0.025).all()
    assert (limited[:, pi:].mean(axis=0) > limited[:, baseline].mean() + 0.03).all()
    assert used[:, seeking].mean() > used[:, baseline].mean() + 0.01
    assert (share[:, pi:].mean(axis=0) < 1.02 * share[:, baseline].mean()).all()


@pytest.mark.slow
def test_creep_control_survives_what_the_sensors_do_not_show() -> None:
    """Biases of the vehicle speed and wrong diameters that shift the creepage by up to 2 %."""
    errors = [(b, d) for b in (-0.01, -0.005, 0.0, 0.005, 0.01) for d in (-0.01, 0.0, 0.01)]
    cases = [
        wet_patch({"vehicle_speed_bias": bias, "wheel_diameter_error": diameter})
        for bias, diameter in errors
        for _ in range(3)
    ]
    outcome = "utilisation"

    def used(controller: Any) -> np.ndarray:
        return np.reshape(cl.run_many(cases, controller, (outcome,))[outcome], (len(errors), 3))

    baseline = used("threshold").mean(axis=1)
    for name in ("creep_pi", "slope_seeking"):
        utilisation = used(name)
        assert utilisation.min() > 0.87
        assert (utilisation.mean(axis=1) > baseline - 0.05).all()
        assert utilisation.mean() > baseline.mean() - 0.01
    # The creepage as shown is of no use for it.
    careful = wet_patch().controller("creep_pi")
    assert isinstance(careful, cl.traction.CreepPI)
    believing = used(dataclasses.replace(careful, creepage_error=0.0))
    shown = np.array([diameter - bias for bias, diameter in errors])
    assert believing[shown > 4e-3].max() < 0.5


@pytest.mark.slow
@pytest.mark.parametrize("name", ["creep_pi", "slope_seeking"])
def test_standstill_and_back(name: str) -> None:
    case = cl.load_scenario("standstill.toml")
    run = cl.run_scenario(case, name)
    assert run["speed"][0] == 0.0
    assert run["speed"].max() > 39.0
    assert run["speed"].min() < 0.0
    assert run["creepage"].min() < 0.0 < run["creepage"].max()
    # Noise at low speed is not taken for slip: dry rails give what is demanded.
    assert cl.metrics(run, case.drivetrain).utilisation > 0.99


def test_a_run_ends_with_its_duration_and_reports_its_progress(locomotive: cl.Model) -> None:
    parts: list[float] = []
    case = plain_scenario(locomotive.wheelset, duration=0.995)
    run = cl.run_scenario(case, "open_loop", progress=parts.append)
    assert run.time[-1] == pytest.approx(0.995)
    assert parts[-1] == 1.0
    assert parts == sorted(parts)


def test_a_variant_has_its_controllers_designed_again() -> None:
    case, late = wet_patch(), wet_patch({"delay": 0.03})
    for scenario, delay in ((case, 0.01), (late, 0.03)):
        seeking = scenario.controller("slope_seeking")
        assert isinstance(seeking, SlopeSeeking)
        assert seeking.delay == delay
    gains = [
        scenario.controller("creep_pi").proportional_gain  # type: ignore[union-attr]
        for scenario in (case, late)
    ]
    assert gains[1] < gains[0]


@pytest.mark.parametrize(
    ("controller", "step", "message"),
    [
        ("pid", None, r"controller = 'pid' must be one of the scenario's: open_loop"),
        ("open_loop", 0.0, r"step = 0.0 is out of range"),
        ("open_loop", 1e-9, r"duration = 2.0 has \d+ steps of 1e-09 s: at most"),
    ],
)
def test_refusals(locomotive: cl.Model, controller: str, step: float | None, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        cl.run_scenario(plain_scenario(locomotive.wheelset), controller, step=step)


def test_a_delay_is_a_whole_number_of_samples(locomotive: cl.Model) -> None:
    with pytest.raises(ValueError, match=r"controllers.open_loop.sample_time .* not a whole"):
        plain_scenario(locomotive.wheelset, sensors=Sensors(delay=0.015))
