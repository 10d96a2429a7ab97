"""Flash temperature, and friction that falls with it: identities, orders, other solutions."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import minimize_scalar
from scipy.special import ellipe, ellipk
from thermal_strips import (
    ThermalZone,
    example,
    local_traction_coefficient,
    solve_strip,
    solve_thermal_zone,
)

import contactlib as cl
from contactlib.base.quantities import FloatArray
from contactlib.laws import ContactHeat, Softening, ThermalContact, ThermalMaterial
from contactlib.laws.heat import MEAN, MEANS, STEEL, flash_profile
from contactlib.laws.thermal_contact import friction_factor

MODULUS = 115.4e9
COULOMB = cl.Friction(static=0.3, kinetic=0.3, weakening_length=0.0)


def linear(temperature: FloatArray) -> tuple[FloatArray, FloatArray]:
    return 1.0 - temperature, np.full_like(temperature, -1.0)


def constant(temperature: FloatArray) -> tuple[FloatArray, FloatArray]:
    return np.ones_like(temperature), np.zeros_like(temperature)


def line(peak_pressure: float = 0.8e9, semi_width: float = 6e-3) -> cl.LineContact:
    return cl.LineContact.from_semi_width(
        semi_width=semi_width,
        radius=0.5 * MODULUS * semi_width / peak_pressure,
        contact_modulus=MODULUS,
        wheel_load=100e3,
    )


def ellipse(peak_pressure: float = 0.8e9, semi_width: float = 6e-3) -> cl.EllipticContact:
    return cl.EllipticContact.from_semi_axes(
        semi_axis_x=semi_width,
        semi_axis_y=1.5 * semi_width,
        wheel_load=np.pi * peak_pressure * semi_width**2,
        contact_modulus=MODULUS,
    )


def hot(contact: Any, **others: Any) -> ThermalContact:
    given: dict[str, Any] = {"friction": COULOMB, "softening": Softening.linear(800.0)}
    return ThermalContact(heat=ContactHeat(contact=contact), **given | others)


def order(x: Any, y: Any) -> float:
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])


# ---- the source ----


def test_profile_is_its_integral() -> None:
    for xi in (0.999, 0.6, 0.0, -0.4, -0.99, -1.0, -1.01, -1.7, -30.0):

        def root(v: float, at: float = xi) -> float:  # eta = at + v**2
            return float(2.0 * np.sqrt(max((1.0 - at - v * v) * (1.0 + at + v * v), 0.0)))

        start, end = np.sqrt(max(-1.0 - xi, 0.0)), np.sqrt(1.0 - xi)
        expected = quad(root, start, end, epsabs=1e-13, epsrel=1e-13, limit=400)[0]
        assert flash_profile(xi) == pytest.approx(expected, abs=1e-10)
    m = np.linspace(0.001, 0.999, 101)
    elliptic = (2.0 * m - 1.0) * ellipe(m) + (1.0 - m) * ellipk(m)
    profile = flash_profile(1.0 - 2.0 * m)
    np.testing.assert_allclose(profile, 4.0 * np.sqrt(2.0) / 3.0 * elliptic, atol=1e-13)


def test_numbers_of_the_profile() -> None:
    assert flash_profile(-1.0) == pytest.approx(4.0 * np.sqrt(2.0) / 3.0, rel=1e-14)
    top = minimize_scalar(
        lambda xi: -float(flash_profile(xi)), bounds=(-1.0, 0.0), method="bounded"
    )
    assert (round(top.x, 3), round(-top.fun, 5)) == (-0.652, 2.18831)
    angle = np.pi * (np.arange(2000) + 0.5) / 2000
    mean = np.mean(2.0 * np.sin(angle) ** 2 * flash_profile(np.cos(angle)))
    assert mean == pytest.approx(MEAN, abs=1e-9)
    assert round(MEAN, 5) == 1.57202
    # Far behind, the heat of the whole contact lies in one place.
    assert flash_profile(-1e8) == pytest.approx(0.5 * np.pi * 1e-4, rel=1e-7)


def test_two_bodies_share_by_the_roots_of_their_speeds() -> None:
    heat = ContactHeat(contact=line())
    assert heat.peclet_number(0.0, 0.05) == pytest.approx(10.8, abs=0.1)
    zeta, speed = np.array([-1.0, -0.4, -1e-3, 0.0, 0.3, 3.0]), 12.0
    roots = np.sqrt(speed * (1.0 + zeta)), np.sqrt(speed)
    np.testing.assert_allclose(heat.wheel_share(zeta, speed), roots[0] / (roots[0] + roots[1]))
    # Steel on steel: the slip speed over the sum of the roots is their difference.
    unit = MEAN * heat.contact.peak_pressure * np.sqrt(heat.contact.semi_width / np.pi)
    expected = unit / STEEL.effusivity * np.abs(roots[0] - roots[1])
    np.testing.assert_allclose(heat.mean_rise(zeta, speed), expected, rtol=1e-12, atol=1e-12)
    # Another wheel, as each body with its share of the flux alone: both surfaces are equally hot.
    copper = ThermalMaterial(conductivity=390.0, density=8900.0, heat_capacity=385.0)
    other = ContactHeat(contact=line(), wheel=copper)
    share, rise = other.wheel_share(0.3, speed), other.mean_rise(0.3, speed)
    flux = unit * 0.3 * speed / np.sqrt(speed)
    assert share * flux / (copper.effusivity * np.sqrt(1.3)) == pytest.approx(float(rise))
    assert (1.0 - share) * flux / STEEL.effusivity == pytest.approx(float(rise))


def test_bulk_temperatures_meet_at_their_weighted_mean() -> None:
    warm = ContactHeat(contact=line(), wheel_temperature=90.0, rail_temperature=30.0)
    assert warm.entry_temperature(0.0, 5.0) == pytest.approx(60.0)
    assert warm.entry_temperature(-1.0, 5.0) == pytest.approx(30.0)
    cold = ContactHeat(contact=line())
    given: dict[str, Any] = {"friction_coefficient": 0.3, "creepage": 0.1, "speed": 9.0}
    xi = np.linspace(-1.0, 1.0, 9)
    raised = warm.temperature(xi, **given) - cold.temperature(xi, **given)
    np.testing.assert_allclose(raised, warm.entry_temperature(0.1, 9.0))


def test_mean_over_an_ellipse_is_that_of_its_places() -> None:
    heat = ContactHeat(contact=ellipse())
    nodes, weights = np.polynomial.legendre.leggauss(60)
    angle = 0.5 * np.pi * nodes
    eta, xi = np.sin(angle)[:, np.newaxis], np.sin(angle)
    w = np.cos(angle)[:, np.newaxis]
    temperature = heat.temperature(w * xi, eta, friction_coefficient=0.3, creepage=0.05, speed=20.0)
    pressure = w**3 * np.cos(angle) ** 2 * weights[:, np.newaxis] * weights
    mean = (temperature * pressure).sum() / pressure.sum()
    assert mean == pytest.approx(0.3 * float(heat.mean_rise(0.05, 20.0)), rel=1e-6)
    assert MEANS["elliptic"] / MEAN == pytest.approx(0.838698, abs=1e-6)


# ---- the local solution ----

STATES = [(0.4, 0.0), (0.97, 0.0), (1.7, 0.0), (12.0, 0.0), (0.7, 0.3), (1.6, 0.3), (9.0, 0.3)]


@pytest.mark.parametrize(("x", "k_hat"), STATES)
def test_with_constant_friction_it_is_the_law(x: float, k_hat: float) -> None:
    zone = solve_thermal_zone(x, rise=100.0, fall=constant, k_hat=k_hat)
    law = cl.CarterGriffith(k_hat=k_hat)
    assert zone.creepage == pytest.approx(x, rel=1e-13)
    assert zone.traction_ratio == pytest.approx(float(law.traction_ratio(x)), rel=1e-13)
    assert zone.stick_boundary == pytest.approx(float(law.stick_boundary(x)), abs=1e-12)
    np.testing.assert_allclose(zone.slip_rate, law.slip_rate(zone.position, x), rtol=1e-9)
    if zone.stick_boundary < 1.0:
        ahead = zone.stick_boundary + (1.0 - zone.stick_boundary) * np.linspace(0.01, 1.0, 9)
        expected = law.shear_traction(ahead, x)
        np.testing.assert_allclose(zone.stick_traction(ahead), expected, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("fall", [constant, linear])
@pytest.mark.parametrize(("x", "k_hat"), STATES)
def test_heat_is_the_frictional_power(x: float, k_hat: float, fall: Callable[..., Any]) -> None:
    # In the limit law a part of the power is the fracture energy (f_s - f_d) Delta p(c) of the
    # stick boundary.
    zone = solve_thermal_zone(x, rise=0.15, fall=fall, k_hat=k_hat)
    c = zone.stick_boundary
    fracture = k_hat**2 * np.sqrt((1.0 - c) * (1.0 + c))
    assert zone.heat == pytest.approx(zone.traction_ratio * x - fracture, abs=1e-10)
    # Traction times slip rate at the nodes, with their weights in y = sqrt(c - xi).
    n = zone.position.size
    y, tau = np.sqrt(c - zone.position), np.sqrt((c - zone.position) / (1.0 + c))
    pressure = np.sqrt((1.0 - zone.position) * (1.0 + zone.position))
    weight = np.sqrt(1.0 + c) * np.pi / (2 * n + 1) * np.sqrt(1.0 - tau**2)
    flux = zone.fraction * pressure * zone.slip_rate
    assert zone.heat == pytest.approx(2.0 / np.pi * np.sum(weight * 2.0 * y * flux), abs=1e-10)


def test_full_slip_has_the_known_forces() -> None:
    expected = {0.1: 0.90824, 0.2: 0.83062, 0.5: 0.65749, 1.0: 0.48393, 2.0: 0.31415}
    for r, q in expected.items():
        zone = solve_thermal_zone(1e8, rise=1e-8 * r, fall=linear)
        assert zone.traction_ratio == pytest.approx(q, abs=6e-6)
    hardly = solve_thermal_zone(1e8, rise=0.5e-8, fall=linear)
    assert hardly.fraction.min() == pytest.approx(0.56, abs=0.005)
    # Much heat: the flux makes the whole contact softening-hot, so it is Abel's 1/sqrt(1 - xi).
    soft = solve_thermal_zone(1e8, rise=3e-6, fall=linear, nodes=120)
    assert 300 * soft.traction_ratio == pytest.approx(4 * np.sqrt(2) * MEAN / np.pi**2, rel=0.01)


def test_full_slip_is_that_of_cells() -> None:
    def force(cells: int, r: float) -> float:
        edges = np.linspace(1.0, -1.0, cells + 1)
        middle = 0.5 * (edges[1:] + edges[:-1])
        pressure = np.sqrt(1.0 - middle**2)
        gap = np.maximum(edges[:, np.newaxis] - middle, 0.0)
        kernel = 2.0 * (np.sqrt(gap[:-1]) - np.sqrt(gap[1:])).T
        matrix = np.eye(cells) + r / MEAN * kernel * pressure
        return float(pressure @ np.linalg.solve(matrix, np.ones(cells)) / pressure.sum())

    exact = solve_thermal_zone(1e8, rise=1e-8, fall=linear).traction_ratio
    cells = np.array([50, 100, 200, 400])
    errors = np.abs([force(int(n), 1.0) - exact for n in cells])
    assert order(cells, errors) < -1.2
    assert errors[-1] < 2e-4


@pytest.mark.parametrize(("x", "k_hat"), [(0.5, 0.0), (1.3, 0.0), (0.9, 0.3)])
def test_partial_slip_satisfies_its_equations(x: float, k_hat: float) -> None:
    rise = 0.3
    zone = solve_thermal_zone(x, rise=rise, fall=linear, k_hat=k_hat)
    c, width = zone.stick_boundary, np.sqrt(1.0 + zone.stick_boundary)
    steps = 2.0 * np.arange(zone.series.size) + 1.0

    def at_tau(tau: FloatArray) -> tuple[FloatArray, FloatArray]:  # F and slip rate
        angle = np.arccos(tau)[..., np.newaxis]
        fraction = 1.0 + (zone.series * np.sin(steps * angle) / np.sin(angle)).sum(axis=-1)
        bends = width * (zone.series * np.cos(steps * angle)).sum(axis=-1)
        y = width * tau
        edge = zone.creepage - 1.0 - width**2 * zone.series[0] / 2.0 if c == 1.0 else 0.0
        return fraction, np.sqrt(1.0 - c + y * y) * (y + zone.release / y + bends) + edge

    # The slip rate is the creepage less the strain of the traction, and nothing where it sticks.
    n = 20_000
    s = np.cos(np.pi * (np.arange(n) + 0.5) / n)
    behind = s < c
    traction = np.empty(n)
    traction[~behind] = zone.stick_traction(s[~behind])
    tau = np.sqrt(c - s[behind]) / width
    traction[behind] = at_tau(tau)[0] * np.sqrt(1.0 - s[behind] ** 2)
    places = np.cos(np.pi * np.arange(200, n, 400) / n)
    places = places[np.abs(places - c) > (0.1 if k_hat else 0.02)]
    strain = (traction * np.sqrt(1.0 - s**2) / (places[:, np.newaxis] - s)).sum(axis=1) / n
    rate = np.zeros_like(places)
    slips = places < c
    rate[slips] = at_tau(np.sqrt(c - places[slips]) / width)[1]
    tolerance = 2e-2 if k_hat else 2e-4  # of the sum, across a singularity or a kink
    np.testing.assert_allclose(rate, x - strain, atol=tolerance)
    assert zone.traction_ratio == pytest.approx(
        2.0 / n * (traction * np.sqrt(1.0 - s**2)).sum(), abs=0.2 * tolerance
    )

    # The temperature is that of the flux.
    def source(v: float, end: float) -> float:  # eta = xi + v**2
        tau = np.array(np.sqrt(max(end * end - v * v, 1e-30)) / width)
        fraction, slip_rate = at_tau(tau)
        eta = c - (width * float(tau)) ** 2
        return float(2.0 * fraction * slip_rate * np.sqrt(1.0 - eta * eta))

    for i in (3, 15, 28):
        end = np.sqrt(c - zone.position[i])
        expected = rise / MEAN * quad(source, 0.0, end, args=(end,), limit=200)[0]
        assert zone.temperature[i] == pytest.approx(expected, abs=2e-7)
        assert zone.fraction[i] == pytest.approx(1.0 - expected, abs=2e-7)


@pytest.mark.parametrize(("x", "k_hat"), [(0.6, 0.0), (3.0, 0.0), (1.2, 0.3)])
def test_errors_fall_like_the_fifth_power_of_the_nodes(x: float, k_hat: float) -> None:
    def force(nodes: int) -> float:
        zone = solve_thermal_zone(x, rise=0.2, fall=linear, k_hat=k_hat, nodes=nodes)
        return zone.traction_ratio

    nodes, exact = np.array([6, 9, 13, 19]), force(96)
    errors = [abs(force(int(n)) - exact) for n in nodes]
    assert order(nodes, errors) < -4.3
    assert abs(force(32) - exact) < 2e-8


def test_full_slip_follows_partial_slip_without_a_step() -> None:
    def state(x: float) -> ThermalZone:
        return solve_thermal_zone(x, rise=0.2, fall=linear)

    low, high = 0.5, 1.0
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if state(middle).stick_boundary < 1.0 else (low, middle)
    before, after = state(low), state(high)
    assert before.stick_boundary < 1.0 == after.stick_boundary
    for name in ("traction_ratio", "heat", "temperature", "slip_rate"):
        np.testing.assert_allclose(getattr(after, name), getattr(before, name), atol=1e-6)


# ---- the closed form ----


@cache
def nodes_of_strips(count: int = 14) -> tuple[FloatArray, FloatArray]:
    at, weight = np.polynomial.legendre.leggauss(count)
    w = np.cos(0.25 * np.pi * (at + 1.0))
    return w, 0.375 * np.pi * weight * w**3


def local(x: float, number: float, shape: str, k_hat: float = 0.0) -> float:
    """Traction ratio by the local solution, with 16 nodes; right to 1e-6."""
    if shape == "line":
        zone = solve_thermal_zone(x, rise=number, fall=linear, k_hat=k_hat, nodes=16)
        return zone.traction_ratio
    rise = number * MEAN / MEANS[shape]
    zones = [
        solve_thermal_zone(x / w, rise=rise * w**2.5, fall=linear, k_hat=k_hat / w, nodes=12)
        for w in nodes_of_strips()[0]
    ]
    return float(nodes_of_strips()[1] @ [zone.traction_ratio for zone in zones])


def closed(x: FloatArray, number: float, shape: Any, k_hat: float = 0.0) -> FloatArray:
    g = friction_factor(x, number, k_hat=k_hat, contact=shape)
    laws = [cl.CarterGriffith(k_hat=k_hat / np.sqrt(factor), contact=shape) for factor in g]
    q = [float(law.traction_ratio(at)) for law, at in zip(laws, x / g, strict=True)]
    return np.asarray(g * q)


@pytest.mark.parametrize(("shape", "largest"), [("line", 0.0005), ("elliptic", 0.0007)])
def test_closed_form_in_full_slip(shape: str, largest: float) -> None:
    r = np.geomspace(1e-2, 1e3, 21)
    far = 1e8
    factor = friction_factor(far, r / far, contact=shape)
    exact = [local(far, ratio / far, shape) for ratio in r]
    assert np.abs(factor - exact).max() < largest + 5e-5
    mean_field = 1.0 / (1.0 + r) - exact
    expected = {"line": 0.019, "elliptic": 0.009}[shape]
    assert np.abs(mean_field).max() == pytest.approx(expected, abs=0.0006)


@pytest.mark.parametrize("shape", ["line", "elliptic"])
@pytest.mark.parametrize(("k_hat", "number"), [(0.1, 0.1), (0.3, 0.075), (0.5, 0.03)])
def test_closed_form_with_weakening_over_microns(shape: str, k_hat: float, number: float) -> None:
    x = np.concatenate([np.linspace(0.2, 2.4, 12), [4.0, 10.0, 100.0]])
    exact = [local(float(v), number, shape, k_hat) for v in x]
    np.testing.assert_allclose(closed(x, number, shape, k_hat), exact, atol=0.004)


@pytest.mark.parametrize(
    "speed",
    [pytest.param(1.0, marks=pytest.mark.slow), 10.0, pytest.param(80.0, marks=pytest.mark.slow)],
)
def test_closed_form_of_the_guide_s_example(speed: float) -> None:
    contact, zeta = example(), np.array([0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0])
    solved = local_traction_coefficient(contact, zeta, speed)
    error = np.abs(contact.traction_coefficient(zeta, speed) - solved) / contact.friction.kinetic
    assert error.max() < 0.00095


# ---- the force element ----


def element(contact: Any, **others: Any) -> cl.ForceElement:
    given = {"static": 0.3, "kinetic": 0.3, "weakening_length": 0.0, "softening_temperature": 800.0}
    shape = "elliptic" if isinstance(contact, cl.EllipticContact) else "line"
    table = cl.carter_griffith_table(shape)
    return cl.ForceElement(contact, cl.Friction(**given | others), table=table, radius=0.5)


@pytest.mark.parametrize(
    ("k_hat", "pressures"), [(0.0, (0.3e9, 0.8e9, 1.5e9)), (0.3, (0.3e9, 0.8e9, 1.3e9))]
)
def test_element_is_the_local_solution(k_hat: float, pressures: tuple[float, ...]) -> None:
    zeta = np.array([5e-4, 2e-3, 4e-3, 6e-3, 9e-3, 0.03, 0.15, 1.0, -0.004])
    for pressure in pressures:
        contact = line(pressure)
        ratio = 3.0 if k_hat else 1.0  # a short weakening zone
        cold = cl.friction_with_k_hat(contact, k_hat=k_hat, static=0.3 * ratio, kinetic=0.3)
        length = cold.weakening_length
        warm = element(contact, static=0.3 * ratio, weakening_length=length)
        solved = hot(contact, friction=cold)
        for speed in (1.0, 12.0, 80.0):
            outputs = warm.at_creepage(zeta, speed=speed)
            exact = local_traction_coefficient(solved, zeta, speed)
            exact = np.clip(exact, -0.3 * ratio, 0.3 * ratio)  # static friction
            np.testing.assert_allclose(outputs["traction_coefficient"], exact, atol=0.004 * 0.3)
            closed_form = solved.mean_temperature(zeta, speed)
            np.testing.assert_allclose(outputs["contact_temperature"], closed_form, atol=0.01)


@pytest.mark.parametrize("make", [line, ellipse])
def test_element_at_zero_creepage_is_cold(make: Callable[[], Any]) -> None:
    warm, cold = element(make()), element(make(), softening_temperature=0.0)
    heated, other = (e.at_creepage([0.0, 1e-9], speed=40.0) for e in (warm, cold))
    assert heated["contact_temperature"][0] == 0.0
    np.testing.assert_allclose(heated["force_gradient"], other["force_gradient"], rtol=1e-5)
    assert np.all(other["contact_temperature"] == 0.0)


def test_steel_is_the_default() -> None:
    assert element(line()).friction.thermal_effusivity == pytest.approx(STEEL.effusivity, rel=1e-4)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"softening_temperature": 0.5}, r"softening_temperature = 0\.5 .* 0 .* or >= 1"),
        ({"softening_temperature": -1.0}, r"softening_temperature = -1\.0 .*>= 0"),
        ({"thermal_effusivity": 0.0}, r"thermal_effusivity = 0\.0 .*>= 0\.001"),
        (
            {"slip_rate_decay": 0.5},
            r"800\.0 and .*slip_rate_decay = 0\.5 both lower friction",
        ),
    ],
)
def test_bad_friction_is_refused(given: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        element(line(), **given)


@pytest.mark.parametrize("coefficient", [[0.4, 0.38, 0.3, 0.1], [0.4, 0.25, 0.18, 0.15]])
def test_closed_form_of_sampled_softening(coefficient: list[float]) -> None:
    sampled = hot(line(), softening=Softening([0.0, 200.0, 400.0, 800.0], coefficient))
    zeta = np.array([0.004, 0.01, 0.05, 0.1, 0.3, 1.0])
    computed = sampled.traction_coefficient(zeta, 20.0)
    exact = local_traction_coefficient(sampled, zeta, 20.0)
    np.testing.assert_allclose(computed, exact, atol=0.03 * 0.3)


def test_samples_on_a_line_are_linear_softening() -> None:
    two = hot(line())
    four = hot(line(), softening=Softening([0.0, 100.0, 500.0, 800.0], [0.8, 0.7, 0.3, 0.0]))
    zeta = np.array([-0.3, 0.001, 0.02, 0.4])
    for solve in (
        ThermalContact.traction_coefficient,
        ThermalContact.mean_temperature,
        local_traction_coefficient,
    ):
        first, second = (solve(contact, zeta, 15.0) for contact in (two, four))
        np.testing.assert_allclose(first, second, rtol=1e-9)


def test_warm_bodies_are_a_contact_of_less_friction() -> None:
    heat = ContactHeat(contact=line(), wheel_temperature=200.0, rail_temperature=200.0)
    warm = ThermalContact(heat=heat, friction=COULOMB, softening=Softening.linear(800.0))
    weak = cl.Friction(static=0.225, kinetic=0.225, weakening_length=0.0)
    same = hot(line(), friction=weak, softening=Softening.linear(600.0))
    zeta = np.array([0.001, 0.01, 0.2])
    for solve in (ThermalContact.traction_coefficient, local_traction_coefficient):
        first, second = (solve(contact, zeta, 30.0) for contact in (warm, same))
        np.testing.assert_allclose(first, second, rtol=1e-9)


@pytest.mark.parametrize("zeta", [0.001, 0.01, -0.3])
def test_strip_has_the_force_and_the_heat(zeta: float) -> None:
    contact = hot(line())
    strip = solve_strip(contact, zeta, 30.0)
    assert np.all(np.diff(strip.position) < 0.0)
    assert np.all(strip.heat_flux >= 0.0)
    assert np.all(strip.friction_coefficient <= 0.3)
    spacing = -np.diff(strip.position, prepend=1.0, append=-1.0)
    weight = 0.5 * (spacing[1:] + spacing[:-1])
    load = 0.5 * np.pi * contact.heat.contact.peak_pressure  # over semi-width and length
    expected = float(local_traction_coefficient(contact, zeta, 30.0))
    assert weight @ strip.shear_traction / load == pytest.approx(expected, rel=0.003)
    assert weight @ strip.heat_flux / load == pytest.approx(30.0 * zeta * expected, rel=0.01)


def test_bad_input_is_refused() -> None:
    falling = cl.Friction(
        static=0.3, kinetic=0.3, weakening_length=0.0, slip_rate_decay=1.0, slip_rate_residual=0.5
    )
    with pytest.raises(ValueError, match="must not fall with slip speed"):
        hot(line(), friction=falling)
    scorched = ContactHeat(contact=line(), wheel_temperature=2000.0)
    contact = ThermalContact(heat=scorched, friction=COULOMB, softening=Softening.linear(800.0))
    with pytest.raises(ValueError, match="wheel_temperature = 2000"):
        contact.traction_coefficient(0.1, 10.0)
    with pytest.raises(ValueError, match="contact = 'round'"):
        friction_factor(1.0, 0.1, contact="round")


@pytest.mark.parametrize(
    ("temperature", "coefficient", "message"),
    [
        ([0.0], [0.4], "at least 2"),
        ([0.0, 100.0], [0.4, 0.3, 0.2], "two rows of one length"),
        ([1.0, 100.0], [0.4, 0.3], "must begin with 0 and be strictly increasing"),
        ([0.0, 100.0, 100.0], [0.4, 0.3, 0.2], "must begin with 0 and be strictly increasing"),
        ([0.0, 100.0], [0.4, 0.4], "and fall"),
        ([0.0, 100.0], [0.4, -0.1], r"coefficient = -0.1 .*>= 0"),
    ],
)
def test_bad_samples_are_refused(
    temperature: list[float], coefficient: list[float], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        Softening(temperature, coefficient)
