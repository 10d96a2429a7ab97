"""The fit against other solutions, on made-up data whose truth is known, and on a locomotive's."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.optimize import curve_fit
from scipy.stats import f as f_distribution
from scipy.stats import t as t_distribution

from contactlib import (
    CarterGriffith,
    EllipticContact,
    Friction,
    LineContact,
    Polach,
    TractionData,
    friction_with_k_hat,
)
from contactlib.base.quantities import FloatArray
from contactlib.base.writing import package_folder
from contactlib.laws import (
    ContactHeat,
    FitResult,
    Softening,
    ThermalContact,
    saturation_creepage,
)
from contactlib.laws.fit import fit

CARTER: dict[str, Any] = {"contact": "line", "k_hat": 0.0}
# The contact ellipse, and zeta0 = 2 mu0 p0/E* at the fitted mu0.
POLACH: dict[str, Any] = {"saturation_creepage": 0.00364}
COULOMB: dict[str, Any] = {**CARTER, "saturation_creepage": 1e-6}


@pytest.fixture(scope="module")
def locomotive() -> TractionData:
    path = package_folder("models") / "eurosprinter_engel1998.csv"
    return TractionData.from_csv(path, speed=10.0)


@pytest.fixture(scope="module")
def unweakened(locomotive: TractionData) -> FitResult:
    return fit(CarterGriffith, locomotive, contact="line")


@pytest.fixture(scope="module")
def polach(locomotive: TractionData) -> FitResult:
    return fit(Polach, locomotive, slip_rate=True, **POLACH)


def carter(zeta: FloatArray, kinetic: float, saturation: float) -> FloatArray:
    return np.asarray(kinetic * (1.0 - np.maximum(1.0 - zeta / saturation, 0.0) ** 2))


def made_up(seed: int, noise: float = 0.01) -> TractionData:
    zeta = np.linspace(0.001, 0.03, 40)
    scatter = np.random.default_rng(seed).normal(0.0, noise, 40)
    return TractionData(zeta, carter(zeta, 0.3, 0.012) + scatter)


def test_the_locomotives_polach(polach: FitResult) -> None:
    assert polach.rmse == pytest.approx(0.0246, rel=0.05)
    # Its traction at these creepages sees 1/kS - 1/kA, so the two are known only together.
    assert polach.estimates["slip_reduction"].identifiable
    assert not polach.estimates["adhesion_reduction"].identifiable
    assert "adhesion_reduction and slip_reduction are known only together" in str(polach)


def test_the_locomotives_carter_with_falling_friction(locomotive: TractionData) -> None:
    result = fit(CarterGriffith, locomotive, slip_rate=True, **CARTER)
    assert result.rmse == pytest.approx(0.0283, rel=0.05)
    # The friction falls, but the data end before it shows where to.
    low, high = result.estimates["slip_rate_decay"].interval
    assert result.estimates["slip_rate_decay"].identifiable
    assert low > 0.1
    assert high < 0.5
    assert not result.estimates["slip_rate_residual"].identifiable


@pytest.mark.slow
def test_the_locomotives_data_do_not_identify_k_hat(unweakened: FitResult) -> None:
    assert unweakened.rmse == pytest.approx(0.0344, rel=0.05)
    k_hat = unweakened.estimates["k_hat"]
    assert k_hat.value == 0.0
    assert not k_hat.identifiable
    assert np.isnan(k_hat.standard_error)
    assert k_hat.interval[0] == 0.0
    (caveat,) = unweakened.caveats
    assert caveat.startswith("k_hat is not identifiable: at 95 % the data allow 0 to 0.1")


def test_coulomb_friction_is_the_mean(locomotive: TractionData) -> None:
    result = fit(CarterGriffith, locomotive, level=0.9, **COULOMB)
    mu = locomotive.traction_coefficient
    assert result.values["kinetic"] == pytest.approx(mu.mean(), rel=1e-9)
    assert result.rmse == pytest.approx(mu.std(), rel=1e-12)
    error = mu.std(ddof=1) / np.sqrt(mu.size)
    reach = t_distribution.ppf(0.95, mu.size - 1) * error
    assert result.estimates["kinetic"].standard_error == pytest.approx(error, rel=1e-6)
    expected = (mu.mean() - reach, mu.mean() + reach)
    assert result.estimates["kinetic"].interval == pytest.approx(expected)


def test_estimates_errors_and_correlation_are_those_of_another_solver() -> None:
    data = made_up(0)
    values, covariance = curve_fit(
        carter, data.creepage, data.traction_coefficient, (0.3, 0.012), xtol=1e-12
    )
    result = fit(CarterGriffith, data, **CARTER)
    errors = np.sqrt(np.diag(covariance))
    estimates = list(result.estimates.values())
    assert list(result.estimates) == ["kinetic", "saturation_creepage"]
    assert [e.value for e in estimates] == pytest.approx(values, rel=1e-5)
    assert [e.standard_error for e in estimates] == pytest.approx(errors, rel=1e-3)
    assert result.correlation[0, 1] == pytest.approx(
        covariance[0, 1] / (errors[0] * errors[1]), abs=1e-3
    )
    np.testing.assert_allclose(np.diag(result.correlation), 1.0)
    np.testing.assert_allclose(
        result.residuals, data.traction_coefficient - carter(data.creepage, *values), atol=1e-6
    )


@pytest.mark.slow
def test_an_end_of_a_profile_is_where_the_sum_of_squares_has_it(
    locomotive: TractionData, unweakened: FitResult
) -> None:
    n = locomotive.creepage.size
    upper = unweakened.estimates["k_hat"].interval[1]
    held = fit(CarterGriffith, locomotive, contact="line", k_hat=upper)
    rise = np.sum(held.residuals**2) / np.sum(unweakened.residuals**2)
    assert rise == pytest.approx(1.0 + f_distribution.ppf(0.95, 1, n - 3) / (n - 3), abs=2e-4)


@pytest.mark.parametrize("runs", [20, pytest.param(80, marks=pytest.mark.slow)])
def test_intervals_hold_the_truth_at_their_level(runs: int) -> None:
    held = np.zeros(2)
    for seed in range(runs):
        result = fit(CarterGriffith, made_up(seed, 0.005), level=0.8, **CARTER)
        intervals = [e.interval for e in result.estimates.values()]
        held += [a < v < b for (a, b), v in zip(intervals, (0.3, 0.012), strict=True)]
    deviation = np.sqrt(0.8 * 0.2 / runs)
    np.testing.assert_allclose(held / runs, 0.8, atol=3.0 * deviation)


def test_k_hat_is_recovered_where_the_data_determine_it() -> None:
    law = CarterGriffith(k_hat=0.4)
    zeta = np.geomspace(0.001, 0.1, 80)
    noise = np.random.default_rng(5).normal(0.0, 0.003, 80)
    data = TractionData(zeta, 0.25 * law.traction_ratio(zeta / 0.01) + noise)
    result = fit(CarterGriffith, data, contact="line")
    assert result.caveats == ()
    truth = {"kinetic": 0.25, "saturation_creepage": 0.01, "k_hat": 0.4}
    for name, value in truth.items():
        low, high = result.estimates[name].interval
        assert low < value < high
        assert high - low < 0.2 * value


def falling(zeta: FloatArray, speed: FloatArray) -> FloatArray:
    """Carter-Griffith with falling friction, a law for each point; k_hat 0.3, A 0.3, B 0.4 s/m."""
    g = 0.7 * np.exp(-0.4 * np.abs(zeta) * speed) + 0.3
    ratio = [
        float(CarterGriffith(k_hat=float(0.3 / np.sqrt(share))).traction_ratio(z / (0.01 * share)))
        for z, share in zip(zeta, g, strict=True)
    ]
    return np.asarray(0.25 * g * ratio)


def test_slip_speed_scales_friction_creepage_and_k_hat() -> None:
    zeta = np.append(np.geomspace(0.001, 0.3, 30), -0.02)
    speed = np.where(np.arange(31) % 2, 5.0, 20.0)
    data = TractionData(zeta, falling(zeta, speed), speed)
    held: dict[str, Any] = {"k_hat": 0.3, "slip_rate_residual": 0.3, "slip_rate_decay": 0.4}
    result = fit(CarterGriffith, data, slip_rate=True, saturation_creepage=0.01, **held)
    assert result.values["kinetic"] == pytest.approx(0.25, rel=1e-6)
    np.testing.assert_allclose(result.residuals, 0.0, atol=1e-6)
    np.testing.assert_allclose(
        result.traction_coefficient(zeta, speed), falling(zeta, speed), atol=1e-6
    )
    with pytest.raises(ValueError, match="a speed is needed"):
        result.traction_coefficient(zeta)


@pytest.mark.slow
def test_polachs_reductions_are_not_distinguished_from_the_scale_of_creepage() -> None:
    law = Polach.dry()
    zeta = np.geomspace(0.0002, 0.02, 60)
    noise = np.random.default_rng(2).normal(0.0, 0.001, 60)
    data = TractionData(zeta, 0.3 * law.traction_ratio(zeta / 0.004) + noise)
    result = fit(Polach, data, ranges={"saturation_creepage": (1e-4, 0.1)})
    for name in ("saturation_creepage", "adhesion_reduction", "slip_reduction"):
        assert not result.estimates[name].identifiable
        assert np.isnan(result.estimates[name].standard_error)
    together = "saturation_creepage, adhesion_reduction, slip_reduction"
    assert f"Only combinations of {together} are identifiable." in result.caveats
    assert result.estimates["kinetic"].identifiable
    assert result.estimates["kinetic"].standard_error > 0.0
    # Their quotients are: at half the true scale they are half the true reductions.
    half = fit(Polach, data, saturation_creepage=0.002)
    for name, truth in (("adhesion_reduction", 0.5), ("slip_reduction", 0.2)):
        low, high = half.estimates[name].interval
        assert low < truth < high


@pytest.fixture(scope="module")
def wheel() -> EllipticContact:
    return EllipticContact.from_semi_axes(
        semi_axis_x=6.304e-3,
        semi_axis_y=12.61e-3,
        wheel_load=106.7e3,
        contact_modulus=82e9 / 0.72,
        poisson_ratio=0.28,
    )


@pytest.mark.slow
def test_heat_explains_the_locomotives_fall_with_a_parameter_less(
    locomotive: TractionData, wheel: EllipticContact
) -> None:
    given: dict[str, Any] = {"k_hat": 0.0, "contact": "elliptic"}
    hot = fit(CarterGriffith, locomotive, heat=ContactHeat(contact=wheel), **given)
    assert hot.rmse < 0.0290
    softening = hot.estimates["softening_temperature"]
    assert softening.identifiable
    assert 600.0 < softening.value < 1200.0
    falling = fit(CarterGriffith, locomotive, slip_rate=True, **given)
    assert hot.rmse == pytest.approx(falling.rmse, rel=0.015)
    assert hot.bic < falling.bic
    assert abs(hot.aic - falling.aic) < 2.0
    flat = LineContact.from_semi_width(
        semi_width=6.304e-3, radius=0.56, contact_modulus=82e9 / 0.72, wheel_load=106.7e3
    )
    given["contact"] = "line"
    longer = fit(CarterGriffith, locomotive, heat=ContactHeat(contact=flat), **given)
    assert longer.rmse < 0.0290
    value = longer.values["softening_temperature"]
    assert value / softening.value == pytest.approx(1.24, abs=0.02)
    # Another law of the rise has another softening temperature: the fall alone does not fix it.
    other = fit(Polach, locomotive, heat=ContactHeat(contact=wheel), **POLACH)
    assert other.values["softening_temperature"] < softening.interval[0]
    assert other.bic < hot.bic


@pytest.mark.slow
def test_a_layer_explains_the_locomotives_slope(
    locomotive: TractionData, wheel: EllipticContact
) -> None:
    heat = ContactHeat(contact=wheel)
    layered = fit(CarterGriffith, locomotive, heat=heat, layer=wheel, k_hat=0.0)
    assert layered.rmse < 0.0268
    assert layered.caveats == ()
    zeta0_free = fit(CarterGriffith, locomotive, heat=heat, k_hat=0.0, contact="elliptic")
    assert layered.bic < zeta0_free.bic - 10.0  # as many parameters
    cold = fit(CarterGriffith, locomotive, layer=wheel, k_hat=0.0)
    assert cold.bic > layered.bic + 50.0
    weakened = fit(CarterGriffith, locomotive, heat=heat, layer=wheel, k_hat=0.3)
    assert weakened.rmse < 0.0278
    k_hat = fit(CarterGriffith, locomotive, heat=heat, layer=wheel).estimates["k_hat"]
    assert k_hat.interval == pytest.approx((0.0, 0.196), abs=0.005)


@pytest.mark.parametrize("k_hat", [0.0, 0.3])
@pytest.mark.parametrize("shape", ["line", pytest.param("elliptic", marks=pytest.mark.slow)])
def test_a_layer_is_recovered(wheel: EllipticContact, shape: str, k_hat: float) -> None:
    line = LineContact.from_semi_width(
        semi_width=6e-3, radius=0.5, contact_modulus=115.4e9, wheel_load=100e3
    )
    contact = wheel if shape == "elliptic" else line
    ratio = 2e-13 * contact.tangential_modulus / (2.0 * contact.semi_width)
    law = CarterGriffith(k_hat=k_hat, contact=shape, layer_ratio=ratio)  # type: ignore[arg-type]
    clean = Friction(static=0.3, kinetic=0.3, weakening_length=0.0)
    x = np.geomspace(0.05, 50.0, 40)
    zeta = x * saturation_creepage(contact, clean)
    data = TractionData(zeta, 0.3 * law.traction_ratio(x))
    fitted = fit(CarterGriffith, data, layer=contact)
    assert fitted.values["layer_compliance"] == pytest.approx(2e-13, rel=2e-4)
    assert fitted.values["k_hat"] == pytest.approx(k_hat, abs=2e-4)
    assert fitted.values["saturation_creepage"] == pytest.approx(zeta[0] / x[0], rel=1e-4)
    assert fitted.law.layer_ratio == pytest.approx(ratio, rel=2e-4)  # type: ignore[attr-defined]
    np.testing.assert_allclose(fitted.residuals, 0.0, atol=1e-5)
    held = fit(CarterGriffith, data, layer=contact, layer_compliance=2e-13, k_hat=k_hat)
    assert list(held.estimates) == ["kinetic"]
    with pytest.raises(ValueError, match=f"must be the layer's, '{shape}'"):
        fit(CarterGriffith, data, layer=contact, contact="other")
    with pytest.raises(ValueError, match="not for Polach"):
        fit(Polach, data, layer=contact)


@pytest.mark.parametrize("k_hat", [0.0, pytest.param(0.25, marks=pytest.mark.slow)])
def test_softening_temperature_is_recovered(k_hat: float) -> None:
    line = LineContact.from_semi_width(
        semi_width=6e-3, radius=0.5, contact_modulus=115.4e9, wheel_load=100e3
    )
    heat = ContactHeat(contact=line)
    friction = friction_with_k_hat(line, k_hat=k_hat, static=0.45, kinetic=0.3)
    made = ThermalContact(heat=heat, friction=friction, softening=Softening.linear(700.0))
    zeta, speed = np.geomspace(5e-4, 0.5, 40), np.where(np.arange(40) % 2, 5.0, 30.0)
    data = TractionData(zeta, made.traction_coefficient(zeta, speed), speed)
    fitted = fit(CarterGriffith, data, heat=heat, k_hat=k_hat, contact="line")
    assert fitted.values["softening_temperature"] == pytest.approx(700.0, rel=1e-3)
    assert fitted.values["kinetic"] == pytest.approx(0.3, rel=1e-3)
    zeta0 = made.saturation_creepage
    assert fitted.values["saturation_creepage"] == pytest.approx(zeta0, rel=1e-3)
    np.testing.assert_allclose(
        fitted.traction_coefficient(zeta, speed), data.traction_coefficient, atol=1e-4
    )


def test_criteria_count_parameters() -> None:
    data = made_up(0)
    free = fit(CarterGriffith, data, **CARTER)
    held = fit(CarterGriffith, data, **CARTER, kinetic=free.values["kinetic"])
    assert free.aic - held.aic == pytest.approx(2.0, abs=1e-6)
    assert free.bic - held.bic == pytest.approx(np.log(40.0), abs=1e-6)


def test_heat_is_for_its_own_contact_and_takes_the_place_of_slip_rate() -> None:
    line = LineContact.from_semi_width(
        semi_width=6e-3, radius=0.5, contact_modulus=115.4e9, wheel_load=100e3
    )
    heat, data = ContactHeat(contact=line), made_up(0)
    with pytest.raises(ValueError, match="heat needs data with a speed"):
        fit(CarterGriffith, data, heat=heat, **CARTER)
    moving = TractionData(data.creepage, data.traction_coefficient, 10.0)
    with pytest.raises(ValueError, match="slip_rate = True cannot be combined with heat"):
        fit(CarterGriffith, moving, heat=heat, slip_rate=True, **CARTER)
    with pytest.raises(ValueError, match=r"heat\.shape = 'line' must be the law's contact"):
        fit(CarterGriffith, moving, heat=heat, contact="elliptic")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"slip_rate": True}, "slip_rate needs data with a speed"),
        ({"ranges": {"k_hat": (0.0, 3.0)}}, r"ranges\['k_hat'\] = 3\.0"),
        ({"ranges": {"k_hat": (0.5, 0.5)}}, "k_hat has no range"),
        ({"ranges": {"k_hats": (0.0, 1.0)}}, "k_hats is not a free parameter"),
        ({"kinetic": 0.3, "saturation_creepage": 0.01, "k_hat": 0.1}, "0 free parameters"),
    ],
)
def test_bad_options_are_refused(options: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        fit(CarterGriffith, made_up(0), **options)


def test_what_no_data_can_bear_is_refused() -> None:
    with pytest.raises(ValueError, match="2 points for 2 free"):
        fit(CarterGriffith, TractionData([0.01, 0.02], [0.1, 0.2]), **CARTER)
    with pytest.raises(ValueError, match="no point of the data has a creepage"):
        fit(CarterGriffith, TractionData([0.0] * 5, [0.1] * 5), **CARTER)
    with pytest.raises(TypeError, match="k_hut"):
        fit(CarterGriffith, made_up(0), k_hut=0.3)
