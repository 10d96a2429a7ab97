"""Sensors and sampled traction controllers: what holds for all inputs, and in a closed loop."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

import contactlib as cl
from contactlib import kernel, stability
from contactlib.export.description import Description
from contactlib.traction import TractionController, total_delay
from contactlib.traction.design import peak_creepage, slip_gains

SENSORS = cl.Sensors(wheel_speed_noise=0.01, vehicle_speed_noise=0.02, delay=0.015, seed=1)
STEP = 0.005
LIMITED = ("threshold", "creep_pi", "slope_seeking")


def designed(
    name: str, model: cl.Model, speed: float = 10.0, sensors: cl.Sensors = SENSORS, **given: Any
) -> TractionController:
    drivetrain = cl.Drivetrain(model.wheelset)
    values = {"sample_time": STEP, **given}
    return cl.CONTROLLERS[name].for_drivetrain(drivetrain, speed=speed, sensors=sensors, **values)


@pytest.fixture(scope="module")
def falling(locomotive: cl.Model) -> cl.Model:
    """The locomotive, with friction that falls with slip speed: a much lower tail."""
    element = locomotive.wheelset.element
    friction = replace(element.friction, slip_rate_residual=0.4, slip_rate_decay=0.6)
    wheelset = replace(locomotive.wheelset, element=replace(element, friction=friction))
    return replace(locomotive, wheelset=wheelset)


# ---- sensors ------------------------------------------------------------------------------------


def test_sensors_delay_by_whole_samples_and_hold_the_first() -> None:
    reader = cl.Sensors(delay=0.015).reader(2, STEP)
    wheel = [reader.read([k, 10.0 + k], [20.0 + k, 0.0])[0].tolist() for k in range(6)]
    assert wheel == [[max(k - 3, 0), 10.0 + max(k - 3, 0)] for k in range(6)]
    exact = cl.Sensors().reader(1, STEP)
    read = [exact.read([float(k)], [-float(k)]) for k in range(3)]
    assert np.array(read).tolist() == [[[k], [-k]] for k in range(3)]


def test_noise_of_a_wheelset_knows_no_other() -> None:
    def read(count: int, first: int = 0, seed: int = 1) -> np.ndarray:
        reader = replace(SENSORS, seed=seed).reader(count, STEP, first=first)
        return np.array([reader.read(np.zeros(count), np.zeros(count)) for _ in range(600)])

    together = read(5)
    assert all((together[:, :, [i]] == read(1, first=i)).all() for i in range(5))
    assert (together != read(5, seed=2))[3:].all()
    # The first is held, so what comes after is independent: 5 x 597 values.
    spread = together[3:].std(axis=(0, 2))
    assert spread == pytest.approx([0.01, 0.02], rel=4.0 / np.sqrt(2.0 * 5 * 597))
    correlation = np.corrcoef(together[3:].reshape(-1, 10).T) - np.eye(10)
    assert np.abs(correlation).max() < 4.5 / np.sqrt(597)


def test_sensors_that_differ_are_read_together() -> None:
    seeds, scales, index = (1, 1, 7, 2), (0.01, 0.0, 0.03, 0.02), (4, 5, 4, 0)
    sensors = [
        replace(SENSORS, seed=float(seed), wheel_speed_noise=scale)
        for seed, scale in zip(seeds, scales, strict=True)
    ]
    still = np.zeros(4)
    reader = cl.traction.SensorReader(sensors, STEP, index)
    together = np.array([reader.read(still, still) for _ in range(300)])
    for i, (one, place) in enumerate(zip(sensors, index, strict=True)):
        alone = one.reader(1, STEP, first=place)
        expected = [alone.read(np.zeros(1), np.zeros(1)) for _ in range(300)]
        np.testing.assert_array_equal(together[:, :, [i]], expected)
    late = [SENSORS, replace(SENSORS, delay=0.0)]
    with pytest.raises(ValueError, match=r"delays of \[0, 3\] samples: they must be equal"):
        cl.traction.SensorReader(late, STEP, (0, 1))


@pytest.mark.parametrize(
    ("given_values", "message"),
    [
        ({"delay": 0.012}, "not a whole number of samples"),
        ({"seed": 0.5}, "must be a whole number"),
        ({"wheel_speed_noise": -1.0}, "out of range"),
    ],
)
def test_sensors_say_what_is_wrong(given_values: Mapping[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        cl.Sensors(**given_values).reader(1, STEP)


# ---- what holds for any measurement -------------------------------------------------------------


def sequence(count: int, samples: int, seed: int) -> list[cl.Measurement]:
    """Measurements all over: slip and skid, both directions, through standstill."""
    rng = np.random.default_rng(seed)
    demand = 3e4 * np.sin(0.02 * np.arange(samples)[:, None] + rng.uniform(0.0, 6.0, count))
    vehicle = 15.0 * np.sin(0.011 * np.arange(samples)[:, None] + rng.uniform(0.0, 6.0, count))
    slip = rng.standard_normal((samples, count)) * 10.0 ** rng.uniform(-3.0, 0.5, (samples, 1))
    return [cl.Measurement(*row) for row in zip(demand, vehicle + slip, vehicle, strict=True)]


def torques(
    controller: TractionController, measurements: Sequence[cl.Measurement], start: float = 0.5
) -> list[np.ndarray]:
    memory = controller.start(measurements[0], start * measurements[0].demand)
    found = []
    for measurement in measurements:
        torque, memory = controller.sample(measurement, memory)
        found.append(torque)
    return found


@pytest.mark.parametrize("name", cl.CONTROLLERS)
def test_many_wheelsets_are_as_many_runs_of_one(name: str, locomotive: cl.Model) -> None:
    controller, together = designed(name, locomotive), sequence(7, 400, seed=3)
    found = np.array(torques(controller, together))
    for i in range(7):
        alone = [cl.Measurement(*(part[i : i + 1] for part in row)) for row in together]
        assert (found[:, [i]] == np.array(torques(controller, alone))).all()
        scalar = [cl.Measurement(*(part[i] for part in row)) for row in together]
        assert (found[:, i] == np.array(torques(controller, scalar))).all()
    assert name == "open_loop" or np.unique(found).size > 400  # it did something


@pytest.mark.parametrize("name", cl.CONTROLLERS)
def test_no_torque_beyond_the_demand(name: str, locomotive: cl.Model) -> None:
    rows = sequence(20, 500, seed=4)
    found = np.array(torques(designed(name, locomotive), rows))
    demand = np.array([row.demand for row in rows])
    assert (np.abs(found) <= np.abs(demand)).all()
    assert (found * demand >= 0.0).all()


@pytest.mark.parametrize("name", cl.CONTROLLERS)
def test_the_other_way_is_the_mirror_image(name: str, locomotive: cl.Model) -> None:
    controller, rows = designed(name, locomotive), sequence(20, 300, seed=5)
    mirrored = [cl.Measurement(*(-part for part in row)) for row in rows]
    there, back = torques(controller, rows), torques(controller, mirrored)
    assert (np.array(there) == -np.array(back)).all()


@pytest.mark.parametrize("name", cl.CONTROLLERS)
def test_braking_mirrors_traction(name: str, locomotive: cl.Model) -> None:
    # At a steady vehicle speed: slip the other way, demand the other way.
    controller, rng = designed(name, locomotive), np.random.default_rng(6)
    slip = np.cumsum(rng.standard_normal((400, 5)), axis=0) * 0.01
    there, back = (
        np.array(
            torques(
                controller,
                [
                    cl.Measurement(np.full(5, sign * 24e3), 10.0 + sign * row, np.full(5, 10.0))
                    for row in slip
                ],
            )
        )
        for sign in (1.0, -1.0)
    )
    np.testing.assert_allclose(there, -back, rtol=1e-6, atol=1e-3)


finite = st.floats(allow_nan=False, allow_infinity=False)


@pytest.mark.parametrize("name", cl.CONTROLLERS)
@settings(derandomize=True, deadline=None, max_examples=60)
@given(rows=st.lists(st.tuples(finite, finite, finite), min_size=2, max_size=12))
def test_any_finite_measurement_gives_a_finite_torque(
    name: str, rows: list[tuple[float, float, float]], locomotive: cl.Model
) -> None:
    measured = [cl.Measurement(*(np.array([value]) for value in row)) for row in rows]
    for row, torque in zip(measured, torques(designed(name, locomotive), measured), strict=True):
        assert np.isfinite(torque).all()
        assert np.abs(torque) <= np.abs(row.demand)


@pytest.mark.parametrize("name", LIMITED)
def test_a_gripping_wheel_gets_the_demand(name: str, locomotive: cl.Model) -> None:
    # Also when the demand jumps or turns round.
    rows = [
        cl.Measurement(np.array([demand]), np.array([10.02]), np.array([10.0]))
        for demand in (1e3, 24e3, 5e3, 26e3, 0.0, 20e3)
        for _ in range(5)
    ]
    found = torques(designed(name, locomotive), rows, start=1.0)
    assert np.array(found).tolist() == [row.demand.tolist() for row in rows]


# ---- gains --------------------------------------------------------------------------------------


def linearised_loop(model: cl.Model, controller: cl.CreepPI, creepage: float, speed: float) -> Any:
    """One sample of held-speed plant, sensors and the controller itself, as a matrix.

    State: angular velocity, the measurements under way, and the controller's own memory.
    """
    wheelset = replace(model.wheelset, mass=None)
    point = wheelset.balanced(creepage=creepage, speed=speed)
    step, radius = controller.sample_time, wheelset.radius
    generator = np.zeros((2, 2))
    generator[0] = point.jacobian[0, 0], 1.0 / wheelset.inertia
    grown, pushed = expm(step * generator)[0]
    delay = SENSORS.samples_of_delay(step)
    demand = np.array(2.0 * point.drive_torque)

    def advance(state: np.ndarray) -> np.ndarray:
        omega, late, (tracked, change, integral) = state[0], state[1:-3], state[-3:]
        seen = np.append(omega, late)[delay]
        measured = cl.Measurement(demand, np.array(radius * seen), np.array(speed))
        memory = controller.start(measured, integral)
        vehicle = memory.vehicle._replace(speed=np.array(tracked), change=np.array(change))
        torque, memory = controller.sample(measured, memory._replace(vehicle=vehicle))
        onward = point.omega + grown * (omega - point.omega)
        onward += pushed * (float(torque) - point.drive_torque)
        kept = (memory.vehicle.speed, memory.vehicle.change, memory.integral)
        return np.array([onward, omega, *late[:-1], *map(float, kept)])

    rest = np.array([point.omega] * (delay + 1) + [speed, 0.0, point.drive_torque])
    np.testing.assert_allclose(advance(rest), rest, rtol=1e-9, atol=1e-9)
    sizes = np.array([1e-4] * (delay + 1) + [1e-4, 1e-4, 1.0])
    columns = [
        (advance(rest + d) - advance(rest - d)) / (2.0 * size)
        for d, size in zip(np.diag(sizes), sizes, strict=True)
    ]
    return np.array(columns).T


def test_the_peak_is_found_wherever_it_is(locomotive: cl.Model) -> None:
    body = locomotive.wheelset
    wet = cl.CreepForceTable.from_law(cl.Polach.wet(kalker_coefficient=3.7, poisson_ratio=0.28))
    far = replace(
        body.element,
        table=wet,
        friction=replace(body.element.friction, slip_rate_residual=0.4, slip_rate_decay=0.06),
    )
    for element in (body.element, far):
        for speed in (0.5, 10.0):
            found = peak_creepage(replace(body, element=element), speed)
            record = element.at_creepage(found * np.array([0.999, 1.0, 1.001]), speed=speed)
            assert np.argmax(record["creep_force"]) == 1
            most = cl.available_force(element, speed=speed)
            assert record["creep_force"][1] == pytest.approx(most, rel=1e-12)
    assert found > 5.0 * far.saturation_creepage
    coulomb = cl.Friction(static=0.21, kinetic=0.21, weakening_length=0.0)
    saturated = replace(body.element, friction=coulomb)
    at = peak_creepage(replace(body, element=saturated), 10.0)
    assert at == pytest.approx(saturated.saturation_creepage, rel=5e-3)  # where the rise ends


@pytest.mark.parametrize("constant", [False, True])
def test_designed_creep_control_is_stable_over_speeds_and_creepages(
    locomotive: cl.Model, constant: bool
) -> None:
    wheelset, beyond = locomotive.wheelset, 0
    delay = total_delay(cl.Drivetrain(wheelset), SENSORS, STEP)
    for speed in (3.0, 10.0, 20.0, 40.0):
        peak = peak_creepage(wheelset, speed)
        for creepage in peak * np.array([0.3, 0.6, 0.85, 1.0, 1.02, 1.05, 1.1, 1.3]):
            pole = float(cl.fast_pole(wheelset, float(creepage), speed=speed))
            if pole * delay > 0.3:
                continue  # beyond what a gain can be robust for
            torque = None
            if not constant:
                torque = wheelset.balanced(creepage=creepage, speed=speed).drive_torque
            controller = designed(
                "creep_pi",
                locomotive,
                reference=float(creepage),
                reference_torque=torque,
                least_slip=0.0,
            )
            assert isinstance(controller, cl.CreepPI)
            loop = linearised_loop(locomotive, controller, float(creepage), speed)
            assert np.abs(np.linalg.eigvals(loop)).max() < 1.0, (speed, creepage)
            beyond += pole > 0.0
    assert beyond >= 6  # points that a constant torque cannot hold


def test_designed_gains_are_robust(locomotive: cl.Model) -> None:
    drivetrain = cl.Drivetrain(locomotive.wheelset)
    inertia, radius = drivetrain.wheelset.inertia, drivetrain.wheelset.radius
    delay = total_delay(drivetrain, SENSORS, STEP)
    for product, bound in ((0.0, 1.6), (0.15, 1.75), (0.3, 2.7)):
        pole = product / delay
        gains = slip_gains(drivetrain, pole=pole, sensors=SENSORS, sample_time=STEP)
        proportional, integral = (gain * radius / inertia for gain in gains)
        s = 1j * np.geomspace(1e-2, 1e3, 20001)
        loop = (proportional + integral / s) * np.exp(-delay * s) / (s - pole)
        assert np.abs(1.0 / (1.0 + loop)).max() < bound
        window = stability.proportional_window(pole, delay=delay)
        assert 2.1 * window.lowest < proportional < window.highest / 2.1


def test_noise_bounds_the_gain(locomotive: cl.Model) -> None:
    # Without delay a gain could be as high as one likes.
    quick = cl.Sensors(wheel_speed_noise=0.02)
    controller = designed("creep_pi", locomotive, sensors=quick, sample_time=0.001)
    assert isinstance(controller, cl.CreepPI)
    assert controller.proportional_gain * 0.02 == pytest.approx(0.01 * 220.65e3 * 0.5)


@pytest.mark.parametrize("noise", [0.0, 0.01, 0.2])
def test_slope_seeking_is_told_no_friction(locomotive: cl.Model, noise: float) -> None:
    # The same stiffness and layer: 0.2 m/s of noise is enough to bound the gain.
    element, sensors = locomotive.wheelset.element, replace(SENSORS, wheel_speed_noise=noise)
    found = []
    for kinetic, static, weakening in ((0.21, 0.45, 1.0), (0.3, 0.33, 0.1), (0.21, 0.21, 0.0)):
        friction = replace(
            element.friction,
            kinetic=kinetic,
            static=static,
            weakening_length=weakening * element.friction.weakening_length,
        )
        other = replace(element, friction=friction)
        model = replace(locomotive, wheelset=replace(locomotive.wheelset, element=other))
        found.append(asdict(designed("slope_seeking", model, sensors=sensors)))  # type: ignore[call-overload]
    for other_fields in found[1:]:
        assert other_fields == pytest.approx(found[0], rel=1e-6)


def test_a_reference_that_no_gain_can_hold_is_refused(locomotive: cl.Model) -> None:
    steep = cl.worst_pole(locomotive.wheelset, speed=5.0).creepage
    with pytest.raises(ValueError, match=r"cannot be held at 5.0 m/s"):
        designed("creep_pi", locomotive, speed=5.0, reference=steep)
    assert designed("creep_pi", locomotive, speed=40.0, reference=steep)


# ---- in a closed loop ---------------------------------------------------------------------------


@dataclass(frozen=True)
class Run:
    """Sums over a run, and its rows; each of shape (n,) or (samples, n)."""

    utilisation: np.ndarray  # mean creep force over the mean of what friction would allow
    slip_work: np.ndarray  # [J]
    traction_work: np.ndarray  # [J]
    largest_slip: np.ndarray  # [m/s]
    speed: np.ndarray  # at the end [m/s]
    creep_force: np.ndarray
    available: np.ndarray
    slip: np.ndarray
    torque: np.ndarray


def drive(
    model: cl.Model,
    controller: TractionController,
    *,
    speed: Sequence[float],
    demand: float,
    duration: float,
    friction: Callable[[np.ndarray], np.ndarray],
    length: float = np.inf,
    sensors: cl.Sensors = SENSORS,
) -> Run:
    """Wheelsets side by side, each until the end of the track; friction is that at their place."""
    wheelset, step, n = model.wheelset, controller.sample_time, len(speed)
    start = Description(model, "wheelset").start_values
    plants = [
        kernel.NativeModel(
            "wheelset",
            wheelset.element.table.native,
            {**start, "omega": v / wheelset.radius, "speed": v, "drive_torque": 0.0},
        )
        for v in speed
    ]
    reader, memory = sensors.reader(n, step), None
    place, asked = np.zeros(n), np.full(n, demand)
    rows = []
    for _ in range(round(duration / step)):
        if (place >= length).all():
            break
        omega, forward = np.array([plant.get("omega", "speed") for plant in plants]).T
        measured = cl.Measurement(asked, *reader.read(wheelset.radius * omega, forward))
        if memory is None:
            memory = controller.start(measured, asked)
        torque, memory = controller.sample(measured, memory)
        scale = friction(place)
        for plant, given_torque, factor in zip(plants, torque, scale, strict=True):
            plant.set(drive_torque=given_torque, friction_scale=factor)
            plant.advance(step)
        after = np.array([plant.get("omega", "speed", "creep_force") for plant in plants]).T
        rows.append((*after, torque, scale, place < length))
        place = place + step * np.abs(after[1])
    omega, forward, force, torque, scale, counts = np.array(rows).transpose(1, 0, 2)
    counts = counts.astype(bool)
    slip = wheelset.radius * omega - forward
    available = peak_forces(model, np.abs(forward), scale)
    return Run(
        utilisation=np.abs((force * counts).sum(0)) / (available * counts).sum(0),
        slip_work=step * (force * slip * counts).sum(0),
        traction_work=step * (force * forward * counts).sum(0),
        largest_slip=np.abs(slip).max(0),
        speed=forward[-1],
        creep_force=force,
        available=available,
        slip=slip,
        torque=torque,
    )


def peak_forces(model: cl.Model, speed: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Largest creep force at speeds and friction factors, on a grid of speeds."""
    element, found = model.wheelset.element, np.zeros_like(speed)
    creepage = element.saturation_creepage * np.geomspace(0.05, 5.0, 800)
    grid = np.linspace(0.5, speed.max() + 0.5, 30)
    for factor in np.unique(scale):
        peaks = [
            element.at_creepage(creepage, speed=v, friction_scale=float(factor))[
                "creep_force"
            ].max()
            for v in grid
        ]
        here = scale == factor
        found[here] = np.interp(speed[here], grid, peaks)
    return found


def wet_patch(place: np.ndarray) -> np.ndarray:
    return np.where((place >= 40.0) & (place < 160.0), 0.5, 1.0)


@pytest.fixture(scope="module", params=["fixed friction", "falling friction"])
def patch_runs(
    request: pytest.FixtureRequest, locomotive: cl.Model, falling: cl.Model
) -> Mapping[str, Run]:
    """Every controller over dry, wet, dry, 260 m at three speeds, with noise of its own each."""
    model = locomotive if request.param == "fixed friction" else falling
    thrifty: Mapping[str, Any] = {"slope_seeking": {"target_elasticity": 0.3}}
    return {
        name: drive(
            model,
            designed(name, model, **thrifty.get(name, {})),
            speed=[10.0, 10.0, 15.0, 20.0],
            demand=24e3,
            duration=22.0,
            friction=wet_patch,
            length=260.0,
        )
        for name in LIMITED
    }


@pytest.mark.parametrize("name", ["creep_pi", "slope_seeking"])
def test_creep_control_beats_cutting_and_reapplying(
    patch_runs: Mapping[str, Run], name: str
) -> None:
    ours, baseline = patch_runs[name], patch_runs["threshold"]
    assert (ours.utilisation > baseline.utilisation).all()
    # More work done, and less slip work for it.
    spent, baseline_spent = (run.slip_work / run.traction_work for run in (ours, baseline))
    assert (spent < baseline_spent).all()
    assert ours.largest_slip.max() < 1.5


@pytest.mark.parametrize("name", LIMITED)
def test_the_wheel_comes_back(patch_runs: Mapping[str, Run], name: str) -> None:
    run = patch_runs[name]
    assert (run.torque >= 0.0).all()
    assert (run.torque <= 24e3).all()
    assert (run.utilisation > 0.8).all()
    assert (np.abs(run.slip[-50:]).max(axis=0) < 0.06 * run.speed).all()


def test_open_loop_runs_away(falling: cl.Model) -> None:
    run = drive(
        falling,
        designed("open_loop", falling),
        speed=[10.0],
        demand=24e3,
        duration=12.0,
        friction=wet_patch,
    )
    assert run.largest_slip[0] > 100.0
    assert run.utilisation[0] < 0.65


@pytest.mark.parametrize("share", [0.5, 1.0])
def test_slope_seeking_finds_the_peak_it_is_not_told(locomotive: cl.Model, share: float) -> None:
    nominal = designed("slope_seeking", locomotive)
    assert isinstance(nominal, cl.SlopeSeeking)
    controller = replace(nominal, first_compliance=share * nominal.first_compliance)
    factors = np.array([1.0, 0.7, 0.4])
    run = drive(
        locomotive,
        controller,
        speed=[15.0] * 3,
        demand=28e3,
        duration=10.0,
        friction=lambda place: factors,
    )
    late = slice(-800, None)
    found = run.creep_force[late].mean(axis=0) / run.available[late].mean(axis=0)
    assert (found > 0.96).all()
    # Each friction has a peak of its own, in proportion to it.
    creepage = (run.slip[late] / 15.0).mean(axis=0)
    assert creepage / creepage[0] == pytest.approx(factors, abs=0.15)


@pytest.mark.parametrize(("target", "least"), [(0.0, 0.97), (0.2, 0.85)])
def test_slope_seeking_finds_the_peak_of_another_law(
    locomotive: cl.Model, target: float, least: float
) -> None:
    # Polach's curve of a wet rail, broad: 97 % of the peak from 4 % to 12 % creepage.
    element = locomotive.wheelset.element
    law = cl.Polach.wet(kalker_coefficient=3.7, poisson_ratio=0.28)
    friction = cl.Friction(
        static=0.21, kinetic=0.21, weakening_length=0.0, slip_rate_residual=0.4, slip_rate_decay=0.6
    )
    other = cl.ForceElement(
        element.contact,
        friction,
        table=cl.CreepForceTable.from_law(law),
        radius=element.radius,
        slope_reduction=element.slope_reduction,
    )
    model = replace(locomotive, wheelset=replace(locomotive.wheelset, element=other))
    factors = np.array([1.0, 0.5])
    run = drive(
        model,
        designed("slope_seeking", model, target_elasticity=target),
        speed=[15.0] * 2,
        demand=28e3,
        duration=15.0,
        friction=lambda place: factors,
    )
    late = slice(-800, None)
    found = run.creep_force[late].mean(axis=0) / run.available[late].mean(axis=0)
    assert (found > least).all()
    # A target above zero stops well before the peak, as the peak is broad.
    curves = [
        other.at_creepage(np.linspace(0.0, 0.2, 2001), speed=15.0, friction_scale=factor)
        for factor in factors
    ]
    peaks = np.array([0.2 / 2000 * np.argmax(curve["creep_force"]) for curve in curves])
    creepage = (run.slip[late] / 15.0).mean(axis=0)
    assert ((creepage < 0.6 * peaks) == (target > 0.0)).all()


def test_a_spinning_wheel_loses_its_torque_and_a_slow_one_does_not() -> None:
    # At five times the reference, and with no integral gain, within twice the recovery time.
    limiter = cl.CreepPI(
        reference=0.01, proportional_gain=1.0, integral_gain=0.0, recovery_time=0.2
    )

    def left(creepage: float) -> float:
        measured = cl.Measurement(np.array(2e4), np.array(10.0 + 10.0 * creepage), np.array(10.0))
        memory = limiter.start(measured, 2e4)
        for _ in range(40):
            _, memory = limiter.sample(measured, memory)
        return float(memory.integral)

    assert left(0.05) == pytest.approx(0.0, abs=1.0)
    assert left(0.045) == pytest.approx(1e4, rel=0.01)
    assert left(0.039) == 2e4


def test_thresholds_are_clear_of_the_noise(locomotive: cl.Model) -> None:
    count, samples = 20, 3000
    wide = cl.Sensors(wheel_speed_noise=0.1, vehicle_speed_noise=0.05, seed=2)
    controller = designed("threshold", locomotive, sensors=wide)
    assert isinstance(controller, cl.ThresholdControl)
    reader = wide.reader(count, STEP)
    demand, rolling = np.full(count, 2e4), np.full(count, 1.0)
    memory, found = None, []
    for _ in range(samples):
        measured = cl.Measurement(demand, *reader.read(rolling, rolling))
        if memory is None:
            memory = controller.start(measured, demand)
        torque, memory = controller.sample(measured, memory)
        found.append((memory.slip, memory.wheel_speed))
        assert (torque == demand).all()
    slip, wheel = np.array(found)[1000:].transpose(1, 0, 2)
    spread = slip.std(), np.diff(wheel, axis=0).std() / STEP
    assert spread == pytest.approx(controller.noise(wide), rel=0.05)


@pytest.mark.parametrize("name", LIMITED)
def test_start_from_standstill(name: str, locomotive: cl.Model) -> None:
    run = drive(
        locomotive,
        designed(name, locomotive),
        speed=[0.0, 0.0],
        demand=24e3,
        duration=8.0,
        friction=lambda place: np.array([1.0, 0.5]),
    )
    assert run.largest_slip[0] < 0.1
    assert run.largest_slip[1] < 1.0
    assert run.utilisation[0] > 0.89  # the demand is 0.91 of what is there
    assert run.utilisation[1] > 0.7
    assert (run.speed > 1.0).all()


@pytest.mark.parametrize("name", LIMITED)
def test_braking_on_a_wet_rail_locks_no_wheel(name: str, locomotive: cl.Model) -> None:
    run = drive(
        locomotive,
        designed(name, locomotive),
        speed=[20.0, 12.0],
        demand=-24e3,
        duration=8.0,
        friction=lambda place: np.array([0.5, 0.5]),
    )
    assert run.largest_slip.max() < 1.5
    assert (run.slip[-1] < 0.0).all()
    assert (run.utilisation > (0.85 if name == "threshold" else 0.93)).all()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: cl.ThresholdControl(slip_threshold=0.01), "slip_release = 0.035 is out of range"),
        (
            lambda: cl.CreepPI(reference=-0.01, proportional_gain=1.0, integral_gain=1.0),
            "CreepPI.reference = -0.01 is out of range",
        ),
        (
            lambda: cl.SlopeSeeking(
                radius=0.5,
                inertia=250.0,
                first_compliance=1e-6,
                proportional_gain=1e4,
                integral_gain=1e4,
                delay=0.012,
            ),
            "not a whole number of samples",
        ),
    ],
)
def test_parameters_say_what_is_wrong(make: Callable[[], object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make()
