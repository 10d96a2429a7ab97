"""The locomotive in Exudyn: limits with known solutions, statics, energy, and the coupling."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from locomotive_train.vehicle import (
    AXLES,
    ENDS,
    SHAFT,
    SPIN,
    TRAIN,
    Alignment,
    Locomotive,
    Vehicle,
    directions,
    dot,
)
from outside_tools import module

import contactlib as cl
from contactlib.base.quantities import FloatArray
from contactlib.traction import OpenLoop

if TYPE_CHECKING:
    from locomotive_train.run import Run

pytestmark = pytest.mark.tools

DURATION = 5.0
THERE_AND_BACK = cl.Profile((0.0, 1.5, 3.0, 3.6, DURATION), (0.0, 28e3, 28e3, 8e3, 8e3))
Simulate = Callable[..., "Run"]


@pytest.fixture(scope="module")
def scenario() -> cl.Scenario:
    return cl.load_scenario("dry_wet_dry.toml")


@pytest.fixture(scope="module")
def locomotive(scenario: cl.Scenario) -> Locomotive:
    return Locomotive(Vehicle.load(), scenario.drivetrain.wheelset.without_memory())


@pytest.fixture(scope="module")
def simulate(scenario: cl.Scenario, tmp_path_factory: pytest.TempPathFactory) -> Simulate:
    run = module("locomotive_train.run").simulate
    wheelset = scenario.drivetrain.wheelset.without_memory()
    model = replace(cl.load_model("locomotive.toml"), wheelset=wheelset)
    fmu = tmp_path_factory.mktemp("fmu") / "wheels.fmu"
    cl.export_fmu(model, fmu, implicit=True, fmi_version=3, wheels=8)
    return lambda locomotive, *args, **how: run(locomotive, fmu, *args, **how)


@pytest.fixture(scope="module")
def slip_away(locomotive: Locomotive, simulate: Simulate) -> Run:
    return simulate(locomotive, THERE_AND_BACK, duration=DURATION, step=1e-3)


def test_stiff_and_equally_loaded_it_is_one_wheelset(
    locomotive: Locomotive, simulate: Simulate
) -> None:
    single = cl.simulate(
        locomotive.wheelset,
        cl.TorqueControl(THERE_AND_BACK),
        initial_speed=10.0,
        initial_creepage=0.0,
        duration=DURATION,
        output_interval=1e-3,
    )
    low: dict[str, Any] = dict.fromkeys(
        ("bogie_height", "body_height", "link_height", "secondary_height", "drawhook_height"), 0.0
    )
    v, longer = locomotive.vehicle, 150.0  # bogies that no moment of a motor tips
    roll, pitch, yaw = v.bogie_inertia
    stiff = replace(
        v,
        **low,
        conicity=0.0,  # its spin would cost force
        half_wheelbase=longer * v.half_wheelbase,
        bogie_inertia=(roll, longer**2 * pitch, longer**2 * yaw),
        quill_stiffness=4e7,
        quill_damping=6e4,
        primary_stiffness=(2e8, *v.primary_stiffness[1:]),
        primary_damping=(5e5, *v.primary_damping[1:]),
        link_stiffness=2e9,
        link_damping=5e6,
        drawbar_stiffness=1e9,
        drawbar_damping=2e6,
    )
    four = replace(locomotive, vehicle=stiff)
    run = simulate(four, THERE_AND_BACK, duration=DURATION, step=1e-3)
    assert single["creepage"].max() > 2.0  # it slipped away
    assert single["creepage"][-1] < 0.01  # and came back
    expected = np.interp(run.time, single.time, single["omega"])
    np.testing.assert_allclose(
        run.rates[:, SPIN], np.repeat(expected[:, None], AXLES, axis=1), rtol=5e-3
    )
    speed = np.interp(run.time, single.time, single["speed"])
    np.testing.assert_allclose(run.rates[:, TRAIN], speed, rtol=5e-4)


def test_coupling_is_of_first_order(locomotive: Locomotive, simulate: Simulate) -> None:
    steps = 1e-3 / 2.0 ** np.arange(3)
    given: dict[str, Any] = {"duration": 0.25, "speed": 20.0}
    torque = cl.Profile.of(20e3)
    ends = [
        simulate(locomotive, torque, step=step, **given).rates[-1, SPIN] for step in steps.tolist()
    ]
    change = np.linalg.norm(np.diff(ends, axis=0), axis=1)
    assert np.log2(change[0] / change[1]) == pytest.approx(1.0, abs=0.1)


def test_the_leading_axle_of_each_bogie_slips_away_first(slip_away: Run) -> None:
    away = (slip_away.creepage > 0.05).argmax(axis=0)
    assert 0 < away[0] < away[2] < away[1]
    assert slip_away.creepage[:, 3].max() < 0.05  # the axle that the others load
    assert slip_away.creepage[-1].max() < 0.02  # all came back


def test_energy_is_conserved(slip_away: Run) -> None:
    check_energy(slip_away)


def test_energy_is_conserved_in_a_curve(locomotive: Locomotive, simulate: Simulate) -> None:
    curved = replace(locomotive, alignment=Alignment(1e-3))
    check_energy(simulate(curved, THERE_AND_BACK, duration=4.0, step=1e-3))


def check_energy(run: Run) -> None:
    """Work of the motors, stored energy and losses, by trapezes of the powers at the rows."""
    locomotive, vehicle = run.locomotive, run.locomotive.vehicle
    q, rates = run.coordinates, run.rates
    twist, twisting = q[:, SHAFT] - q[:, SPIN], rates[:, SHAFT] - rates[:, SPIN]
    turning = angular_velocity(run)
    pitching = dot(turning[:, [1, 1, 2, 2]], run.motion.axle)
    # A motor turns the shaft against the bogie; its rotor turns the bogie as it accelerates.
    ratio = 1.0 + 1.0 / vehicle.gear_ratio
    moved = rates[:, SHAFT] + (ratio - 1.0) * pitching
    drive = float((run.torque[:-1] * np.diff(run.time)[:, None] * middle(moved)).sum())
    creep, lateral, moment = run.forces
    motion, train = run.motion, locomotive.wheelset.resistance
    speed = rates[:, TRAIN]
    powers = {
        "rotors": (run.shaft_torque * ratio * pitching).sum(axis=1),
        "slip": (creep * motion.slip).sum(axis=(1, 2)),
        "across": -(lateral * motion.lateral_velocity).sum(axis=(1, 2)),
        "spin": -(moment * motion.spin_velocity).sum(axis=(1, 2)),
        "bearings": locomotive.wheelset.damping
        * (rates[:, SPIN] * (rates[:, SPIN] - pitching)).sum(axis=1),
        "quills": vehicle.quill_damping * (twisting**2).sum(axis=1),
        "train": AXLES
        * (train.constant + train.linear * speed + train.quadratic * speed**2)
        * speed,
    }
    potential, damping = springs_energy(run, turning)
    potential += 0.5 * vehicle.quill_stiffness * (twist**2).sum(axis=1)
    lost = sum(np.trapezoid(power, run.time) for power in (*powers.values(), damping))
    stored = kinetic_energy(run, turning) + potential
    assert np.trapezoid(powers["slip"], run.time) > 0.2 * drive  # it slipped away
    assert stored[-1] - stored[0] + lost == pytest.approx(drive, rel=1e-5)


def middle(values: FloatArray) -> FloatArray:
    return np.asarray(0.5 * (values[1:] + values[:-1]))


def placed(run: Run) -> tuple[FloatArray, FloatArray]:
    """Coordinates and rates of the seven bodies."""
    at = (run.coordinates + run.locomotive.reference)[:, :42]
    return at.reshape(-1, 7, 6), run.rates[:, :42].reshape(-1, 7, 6)


def angular_velocity(run: Run) -> FloatArray:
    at, moving = placed(run)
    return np.asarray(np.einsum("tbi,tbij->tbj", moving[..., 3:], directions(at[..., 3:])[0]))


def kinetic_energy(run: Run, turning: FloatArray) -> FloatArray:
    at, moving = placed(run)
    locomotive, v = run.locomotive, run.locomotive.vehicle
    mass = np.array([v.body_mass, *[v.bogie_mass] * 2, *[v.wheelset_mass] * AXLES])
    inertia = np.array([v.body_inertia, *[v.bogie_inertia] * 2, *[(v.wheelset_inertia,) * 3] * 4])
    in_body = np.einsum("tbij,tbj->tbi", directions(at[..., 3:])[1], turning)
    twice = mass * (moving[..., :3] ** 2).sum(axis=-1) + (inertia * in_body**2).sum(axis=-1)
    wheels = locomotive.wheel_inertia * run.rates[:, SPIN] ** 2
    shafts = locomotive.shaft_inertia * run.rates[:, SHAFT] ** 2
    train = v.train_mass * run.rates[:, TRAIN] ** 2
    return np.asarray(0.5 * (twice.sum(axis=1) + (wheels + shafts).sum(axis=1) + train))


def springs_energy(run: Run, turning: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Energy in the springs, and the power that their dampers take."""
    springs = module("locomotive_train.system").springs
    at, moving = placed(run)
    axes, v, track = directions(at[..., 3:])[1], run.locomotive.vehicle, run.locomotive.alignment
    stored, lost = np.zeros((2, len(run.time)))

    def point(body: int, place: tuple[float, ...]) -> tuple[FloatArray, FloatArray]:
        if body < 0:
            return np.array(place), np.zeros(3)
        arm = np.einsum("i,tij->tj", place, axes[:, body])
        return at[:, body, :3] + arm, moving[:, body, :3] + np.cross(turning[:, body], arm)

    for first, other, place, place_other, (stiffness, damping) in springs(run.locomotive):
        (from_, leaving), (to, coming) = point(first, place), point(other, place_other)
        first_axes = axes[:, first] if first >= 0 else np.eye(3)
        stretch = (first_axes @ (to - from_)[..., None])[..., 0]
        rate = (first_axes @ (coming - leaving)[..., None])[..., 0]
        stored += 0.5 * (stretch**2) @ stiffness[:3]
        lost += (rate**2) @ damping[:3]
        if stiffness[5]:
            forward, aside = axes[:, first, 0], axes[:, first, 1]
            yaw = np.arctan2(dot(aside, axes[:, other, 0]), dot(forward, axes[:, other, 0]))
            stored += 0.5 * stiffness[5] * yaw**2
            lost += damping[5] * dot(axes[:, first, 2], turning[:, other] - turning[:, first]) ** 2
    hook, velocity = point(0, (-v.half_length, 0.0, v.drawhook_height - v.body_height))
    distance, offset = track.of(hook[:, 0], hook[:, 1])
    heading = track.curvature * distance
    along = velocity[:, 0] * np.cos(heading) + velocity[:, 1] * np.sin(heading)
    rate = along / (1.0 - track.curvature * offset) - run.rates[:, TRAIN]
    stretch = distance - (run.locomotive.reference[0] - v.half_length) - run.coordinates[:, TRAIN]
    stored += 0.5 * v.drawbar_stiffness * stretch**2
    return stored, lost + v.drawbar_damping * rate**2


def test_a_start_does_not_chatter(locomotive: Locomotive, simulate: Simulate) -> None:
    ramp = cl.Profile((0.0, 1.0), (0.0, 12e3))

    force = simulate(locomotive, ramp, duration=1.5, speed=0.5, step=1e-3).creep_force
    ways = np.abs(np.diff(force, axis=0)).sum(axis=0) / np.ptp(force, axis=0)
    assert (ways < 1.5).all()  # up and down; once up is 1


def planar(locomotive: Locomotive) -> cl.vehicle.Vehicle:
    """The same vehicle with loads by statics; its rotors turn the other way than its axles."""
    v = locomotive.vehicle
    axle = np.array([0.0, 2.0 * v.half_wheelbase])
    return cl.vehicle.Vehicle(
        position=tuple(np.r_[axle, axle + 2.0 * v.half_pivot_distance].tolist()),
        body_mass=v.body_mass,
        bogie_mass=v.bogie_mass,
        wheelset_mass=v.wheelset_mass,
        train_mass=v.train_mass,
        body_height=v.body_height,
        bogie_height=v.bogie_height,
        pivot_height=v.link_height,
        coupler_height=v.drawhook_height,
        pitch_inertia=locomotive.wheel_inertia - v.gear_ratio * v.rotor_inertia,
    )


def test_load_transfer_is_that_of_statics(locomotive: Locomotive, simulate: Simulate) -> None:
    run = simulate(
        locomotive,
        cl.Profile((0.0, 2.0), (0.0, 20e3)),
        duration=10.0,
        step=2e-3,
    )
    wheelset, second = locomotive.wheelset, 500
    rising = (run.rates[-1] - run.rates[-1 - second]) / (run.time[-1] - run.time[-1 - second])
    turned = locomotive.wheel_inertia * rising[SPIN] + locomotive.shaft_inertia * rising[SHAFT]
    creep = (20e3 - turned - wheelset.damping * run.rates[-1, SPIN]) / wheelset.radius
    loads = planar(locomotive).loads(
        creep, acceleration=rising[TRAIN], radius=wheelset.radius, omega_rate=rising[SPIN]
    )
    assert np.ptp(loads) > 3e4
    # The body pitches on its springs, so that the coupler sinks.
    np.testing.assert_allclose(run.load[-1], loads, rtol=1.2e-3)


def test_a_run_with_loads_by_statics_slips_away_alike(
    locomotive: Locomotive, simulate: Simulate
) -> None:
    """Without conicity, whose spin takes force; springs let the body pitch and the coupler sink."""
    ramp, duration = cl.Profile((0.0, 9.0), (0.0, 28e3)), 12.0
    cylinders = replace(locomotive, vehicle=replace(locomotive.vehicle, conicity=0.0))
    run = simulate(cylinders, ramp, duration=duration, step=1e-3)
    vehicle = planar(locomotive)
    wheelset = replace(locomotive.wheelset, mass=vehicle.mass / AXLES)
    scenario = replace(
        cl.load_scenario("four_axles.toml"),
        drivetrain=cl.vehicle.Drivetrain(wheelset),
        vehicle=vehicle,
        track=cl.Track(),
        demand=ramp,
        duration=duration,
        controllers={"open_loop": OpenLoop(sample_time=0.002)},
    )
    statics = cl.run_scenario(scenario, "open_loop")
    times = [
        [float(time[slipping.argmax()]) for slipping in (creepage > 0.05).T]
        for time, creepage in ((run.time, run.creepage), (statics.time, statics["creepage"]))
    ]
    assert times[0][3] == times[1][3] == 0.0  # the axle that the others load holds
    np.testing.assert_allclose(times[1], times[0], atol=0.02)
    assert times[1][0] < times[1][2] < times[1][1]
    for at in (2.0, 4.0, 6.0):
        now, then = np.searchsorted(run.time, at), np.searchsorted(statics.time, at)
        np.testing.assert_allclose(statics["axle_load"][then], run.load[now], rtol=5e-3)


def linear_curving(locomotive: Locomotive, speed: float) -> tuple[FloatArray, FloatArray]:
    """Offsets [m] and lateral forces [N] of the axles in a steady curve, by Kalker's coefficients.

    Unknowns are offset and yaw against the track of body, bogies and axles.
    """
    v, k, r = locomotive.vehicle, locomotive.alignment.curvature, locomotive.wheelset.radius
    element, s = locomotive.wheel, locomotive.vehicle.half_gauge
    contact: Any = element.contact
    a, b = contact.semi_axis_x, contact.semi_axis_y
    shear = contact.contact_modulus * (1.0 - contact.poisson_ratio) * element.slope_reduction
    c11, c22, c23, c33 = cl.laws.kalker_coefficients(a / b, contact.poisson_ratio)
    c11, c22 = shear * a * b * c11, shear * a * b * c22
    c23, c33 = shear * (a * b) ** 1.5 * c23, shear * (a * b) ** 2 * c33
    matrix, right = np.zeros((14, 14)), np.zeros(14)

    def spring(body: int, other: int, x: float, across: float, yawing: float) -> None:
        aside, yaw = np.zeros((2, 14))
        aside[[2 * other, 2 * body, 2 * body + 1]] = 1.0, -1.0, -x
        yaw[[2 * other + 1, 2 * body + 1]] = 1.0, -1.0
        for row, curve, stiffness in ((aside, 0.5 * k * x * x, across), (yaw, k * x, yawing)):
            matrix[:] += stiffness * np.outer(row, row)
            right[:] -= stiffness * curve * row

    boxes = 2.0 * v.primary_stiffness[0] * v.half_boxes**2
    for bogie, end in ((1, 1.0), (2, -1.0)):
        across = 2.0 * v.secondary_stiffness[1]
        spring(0, bogie, end * v.half_pivot_distance, across, v.yaw_stiffness)
        for axle, x in ((2 * bogie + 1, v.half_wheelbase), (2 * bogie + 2, -v.half_wheelbase)):
            spring(bogie, axle, x, 2.0 * v.primary_stiffness[1], boxes)
    masses = (v.body_mass, *[v.bogie_mass] * 2, *[v.wheelset_mass] * AXLES)
    right[::2] -= np.array(masses) * speed**2 * k
    for y in range(6, 14, 2):
        matrix[y, y + 1] -= 2.0 * c22
        right[y] -= 2.0 * c23 * k
        matrix[y + 1, y] += 2.0 * s * c11 * v.conicity / r
        matrix[y + 1, y + 1] += 2.0 * c23
        right[y + 1] -= 2.0 * (s * s * c11 + c33) * k
    solution = np.linalg.solve(matrix, right)
    return np.asarray(solution[6::2]), np.asarray(2.0 * (c22 * solution[7::2] - c23 * k))


def test_steady_curving_is_kalkers(locomotive: Locomotive, simulate: Simulate) -> None:
    curvature, tolerance = 1.0 / 5000.0, 0.025
    curved = replace(locomotive, alignment=Alignment(curvature))
    coasting = cl.Profile.of(900.0)
    run = simulate(curved, coasting, duration=22.0, step=2e-3, speed=5.0)
    speed = float(run.rates[-1, TRAIN])
    offset, force = linear_curving(curved, speed)
    assert (force[::2] < 0.0).all()  # outwards on the leading axles
    assert (force[1::2] > 0.0).all()
    np.testing.assert_allclose(run.motion.offset[-1], offset, rtol=tolerance)
    np.testing.assert_allclose(run.forces[1][-1].sum(axis=1), force, rtol=tolerance)
    camber = locomotive.vehicle.conicity / locomotive.wheelset.radius
    spin = np.broadcast_to(curvature - camber * ENDS, (AXLES, 2))
    np.testing.assert_allclose(run.motion.spin_velocity[-1] / speed, spin, rtol=1e-3)


def test_another_weight_than_that_of_the_loads_is_refused(locomotive: Locomotive) -> None:
    heavy = replace(locomotive.vehicle, body_mass=70e3)
    with pytest.raises(ValueError, match=r"Vehicle\.mass = 106.* must be .* 882600"):
        replace(locomotive, vehicle=heavy)
