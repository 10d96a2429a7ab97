"""The tables of the laws: certificates, sizes, corners, and what an element makes of them."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Literal

import numpy as np
import platformdirs
import pytest
from cohesive_layer import CohesiveZoneWithLayer

import contactlib as cl
from contactlib import kernel
from contactlib.element import ProcessZoneWarning
from contactlib.laws.cohesive_layer import solve_zones
from contactlib.laws.friction import EXPONENTIAL
from contactlib.laws.layer import full_stick
from contactlib.table import law_tables
from contactlib.table.building import CORNER_GRIDS
from contactlib.table.law_tables import build_carter_griffith_table

RATIO = 0.45 / 0.21


def assert_holds(
    table: cl.CreepForceTable,
    law_at: object,
    k_hats: list[float],
    n: int,
    targets: tuple[float, float] = (1e-8, 1e-4),
    largest: int = 2_000_000,
) -> None:
    """The certificate at points and k_hats of its own."""
    random = np.random.default_rng(20260102)
    assert table.max_error <= targets[0]
    assert table.max_slope_error <= targets[1]
    assert len(table.data) <= largest
    for k_hat in k_hats:
        law = law_at(k_hat)  # type: ignore[operator]
        x = np.concatenate([10.0 ** random.uniform(-9.0, 5.0, n // 2), random.uniform(0, 4, n)])
        ratio, slope = law.evaluate(x)
        # A certificate is a largest value found, so others may exceed it a little.
        assert np.abs(table.traction_ratio(x, k_hat) - ratio).max() <= 2.0 * table.max_error
        assert np.abs(table.slope(x, k_hat) - slope).max() <= 2.0 * table.max_slope_error
        assert table.traction_ratio(0.0, k_hat) == 0.0


def test_elliptic_table() -> None:
    k_hats = (10.0 ** np.random.default_rng(1).uniform(-7.0, np.log10(2.0), 25)).tolist()
    assert_holds(
        cl.carter_griffith_table("elliptic"),
        lambda k: cl.CarterGriffith(k_hat=k, contact="elliptic"),
        [0.0, *k_hats, 2.0],
        400,
    )


@pytest.mark.parametrize("contact", ["line", "elliptic"])
def test_shipped_tables_are_what_the_law_gives(contact: str) -> None:
    shipped = cl.CreepForceTable.load(kernel.shipped_path(contact))
    built = build_carter_griffith_table(contact)
    assert (shipped.law, shipped.cells, shipped.certificate_points) == (
        built.law,
        built.cells,
        built.certificate_points,
    )
    x, k_hat = np.geomspace(1e-6, 1e3, 200), np.array([[0.0], [1e-4], [0.3], [2.0]])
    np.testing.assert_allclose(
        shipped.traction_ratio(x, k_hat), built.traction_ratio(x, k_hat), atol=1e-12
    )


K_HATS = [0.0, 1e-8, 3e-4, 0.004, 0.07, 0.3, 0.61, 1.13, 1.94, 2.0]


def test_coarse_cohesive_table(cohesive_table: cl.CreepForceTable) -> None:
    law_at = partial(cl.CohesiveZone, static_to_kinetic=RATIO)
    assert_holds(cohesive_table, lambda k: law_at(k_hat=k), K_HATS[::3], 2000, (1e-4, 3e-3))
    assert cohesive_table.static_to_kinetic == RATIO
    assert cohesive_table.options["contact"] == "line"


def off_by(table: cl.CreepForceTable, log_t: list[float], k_hats: list[float], lam: float) -> float:
    """Largest error of a line contact's table with a layer, at states of the law."""
    errors = []
    for v in log_t:
        states = solve_zones(v, np.array(k_hats), lam, table.static_to_kinetic or 0.0, EXPONENTIAL)
        x, q = np.transpose([(state.creepage, state.ratio) for state in states])
        errors.append(np.abs(table.traction_ratio(x, k_hats, lam) - q).max())
    return float(max(errors))


def test_coarse_cohesive_table_with_layers(
    cohesive_table: cl.CreepForceTable, layered_cohesive_table: cl.CreepForceTable
) -> None:
    table, x = layered_cohesive_table, np.geomspace(1e-3, 1e3, 60)
    assert table.max_layer_error < 2e-3
    for lam in (1e-6, 0.004, 0.4, 7.0, 300.0):
        assert off_by(table, [-2.0, -0.4, 0.5, 2.0], [0.03, 0.35, 1.9], lam) < 4e-3
    for lam in (0.03, 0.5, 4.0):
        slopes = table.slope(0.0, [0.0, 0.3, 1.7], lam)
        assert np.ptp(slopes) < 1e-6
        assert slopes[0] == pytest.approx(2.0 * float(full_stick(np.array(0.5 * lam))[0]), rel=2e-4)
    assert table.traction_ratio(1e60, 0.4, 0.5) == 1.0
    assert np.array_equal(table.traction_ratio(x, 0.4), cohesive_table.traction_ratio(x, 0.4))
    thin = table.traction_ratio(x, 0.4, 1e-9) - table.traction_ratio(x, 0.4)
    assert np.abs(thin).max() < 0.01
    assert table.without_layers().data == cohesive_table.data


@pytest.mark.slow
@pytest.mark.parametrize(
    ("contact", "ratio"),
    [
        ("line", RATIO),
        ("elliptic", 11.0 / 7.0),
        *(
            pytest.param(contact, ratio, marks=pytest.mark.reference)
            for contact in ("line", "elliptic")
            for ratio in (1.02, 1.2, 3.0, 8.0)
        ),
    ],
)
def test_cohesive_table_with_layers(contact: Literal["line", "elliptic"], ratio: float) -> None:
    """The error is 0.0001 for layer ratios from 0.03 to 10, 0.001 for any."""
    table = cl.table.cohesive_table(contact, ratio, layers=True)
    assert table.max_layer_error < 1e-3
    assert len(table.data) < 4_000_000
    random, off = np.random.default_rng(54), {}
    n, points = (9, 15) if contact == "line" else (4, 2)  # an ellipse takes seconds a point
    lams = np.geomspace(0.0004, 9.0, n).tolist()
    for k_hat, lam in zip((table.k_max * random.random(n) ** 2).tolist(), lams, strict=True):
        law = CohesiveZoneWithLayer(
            k_hat=k_hat, static_to_kinetic=ratio, layer_ratio=lam, contact=contact
        )
        x = (1.0 + lam) * 10.0 ** random.uniform(-1.5, 1.2, points)
        (q, slope), (found, rise) = law.evaluate(x), table.evaluate(x, k_hat, lam)
        off[lam] = np.abs(found - q).max()
        assert np.abs(rise - slope).max() < 0.01
        assert table.slope(0.0, k_hat, lam) == pytest.approx(law.slope(0.0), abs=1e-4)
        x = np.geomspace(1e-3, 1e5, 500)
        assert table.traction_ratio(x, k_hat, lam).max() < ratio
        thin = table.traction_ratio(x, k_hat, 1e-4) - table.traction_ratio(x, k_hat)
        assert np.abs(thin).max() < 2e-3
    assert max(off.values()) < 1e-3
    assert max(error for lam, error in off.items() if lam > 0.03) < 1e-4


def test_layers_need_the_exponential_weakening() -> None:
    other = cl.Friction.from_function(lambda u: 0.21 + 0.12 / (1.0 + u / 2e-6) ** 3)
    with pytest.raises(ValueError, match="layers = True needs the exponential weakening, not"):
        cl.table.cohesive_table("line", other.ratio, other.weakening, layers=True)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("contact", "ratio", "n"),
    [
        ("line", RATIO, 2000),
        ("elliptic", RATIO, 400),
        ("line", 1.02, 400),
        *(
            pytest.param(contact, ratio, 400, marks=pytest.mark.reference)
            for contact in ("line", "elliptic")
            for ratio in (1.01, 1.015, 1.05, 1.1, 1.2, 2.5, 6.0, 30.0)
        ),
    ],
)
def test_cohesive_table(contact: Literal["line", "elliptic"], ratio: float, n: int) -> None:
    table = cl.table.cohesive_table(contact, ratio)
    law_at = partial(cl.CohesiveZone, static_to_kinetic=ratio, contact=contact)
    k_hats = [table.k_max * (k_hat / 2.0) for k_hat in K_HATS]
    largest = 1_000_000 if ratio > 1.05 else 4_000_000
    assert_holds(table, lambda k: law_at(k_hat=k), k_hats, n, largest=largest)
    assert table.k_max == pytest.approx(min(2.0, (24.0 * (ratio - 1.0) / np.pi) ** 0.5))
    assert table.cells in CORNER_GRIDS[4 if contact == "line" else 5]
    assert cl.table.cohesive_table(contact, ratio) is table


@pytest.mark.reference
@pytest.mark.parametrize("contact", ["line", "elliptic"])
@pytest.mark.parametrize("kind", ["function", "samples"])
def test_table_of_another_weakening(contact: Literal["line", "elliptic"], kind: str) -> None:
    samples = cl.Friction.from_samples([0.0, 1e-6, 2e-6, 5e-6], [0.33, 0.26, 0.22, 0.21])
    function = cl.Friction.from_function(lambda u: 0.21 + 0.12 / (1.0 + u / 2e-6) ** 3)
    friction, targets = (function, (1e-6, 1e-4)) if kind == "function" else (samples, (3e-5, 1e-2))
    table = cl.table.cohesive_table(contact, friction.ratio, friction.weakening)
    law_at = partial(
        cl.CohesiveZone,
        static_to_kinetic=friction.ratio,
        contact=contact,
        weakening=friction.weakening,
    )
    assert_holds(table, lambda k: law_at(k_hat=k), K_HATS, 400, targets)


@pytest.mark.parametrize("ratio", [1.005, 31.0])
def test_friction_ratios_without_a_table_are_refused(ratio: float) -> None:
    with pytest.raises(ValueError, match=r"static_to_kinetic = .* and >= 1.01 and <= 30"):
        cl.table.cohesive_table("line", ratio)


@pytest.fixture
def built(
    cohesive_table: cl.CreepForceTable, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> list[float]:
    """Friction ratios of the tables that a process builds, with a user's cache of its own."""
    ratios: list[float] = []

    def build(*_: object, static_to_kinetic: float, **__: object) -> cl.CreepForceTable:
        ratios.append(static_to_kinetic)
        return cohesive_table

    monkeypatch.setattr(platformdirs, "user_cache_path", lambda *_, **__: tmp_path / "cache")
    monkeypatch.setattr(cl.CreepForceTable, "from_law", build)
    monkeypatch.setattr(law_tables, "_cohesive", {})
    return ratios


def in_a_new_process(ratio: float) -> cl.CreepForceTable:
    law_tables._cohesive.clear()
    return cl.table.cohesive_table("line", ratio)


def test_a_table_is_built_once_for_a_user(built: list[float], tmp_path: Path) -> None:
    first = in_a_new_process(1.5)
    assert in_a_new_process(1.5).data == first.data
    assert built == [1.5]
    in_a_new_process(1.6)
    assert built == [1.5, 1.6]
    for path in (tmp_path / "cache" / "tables").iterdir():
        path.write_bytes(first.data[:-1])
    assert in_a_new_process(1.5).data == first.data
    assert in_a_new_process(1.5).data == first.data
    assert built == [1.5, 1.6, 1.5]


def test_a_table_of_other_sources_is_not_read(
    built: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    in_a_new_process(1.5)
    monkeypatch.setattr(law_tables, "_sources", lambda: "0" * 16)
    in_a_new_process(1.5)
    assert built == [1.5, 1.5]


def test_a_cache_that_cannot_be_written_costs_time_alone(
    built: list[float], tmp_path: Path
) -> None:
    (tmp_path / "cache").write_text("a file where the folder should be")
    assert in_a_new_process(1.5).data == in_a_new_process(1.5).data
    assert built == [1.5, 1.5]


def test_the_cache_does_not_grow_without_end(
    built: list[float], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(law_tables, "MAX_KEPT", 2)
    in_a_new_process(1.9)
    with monkeypatch.context() as other_release:
        other_release.setattr(law_tables, "_sources", lambda: "0" * 16)
        in_a_new_process(1.8)
    for ratio in (1.6, 1.5):
        in_a_new_process(ratio)
        left = {path.name.split("_")[2] for path in (tmp_path / "cache" / "tables").iterdir()}
        assert len(left) == 2
        assert str(ratio) in left
        assert "1.8" not in left


@pytest.mark.parametrize("k_hat", [0.02, 0.3, 2.0])
def test_cohesive_table_has_the_law_s_corner_and_no_other(
    cohesive_table: cl.CreepForceTable, k_hat: float
) -> None:
    corner = cl.CohesiveZone(k_hat=k_hat, static_to_kinetic=RATIO).sliding_creepage
    near = corner + 1e-7 * np.array([-1.0, 1.0])
    assert np.ptp(cohesive_table.traction_ratio(near, k_hat)) < 1e-6
    assert np.ptp(cohesive_table.slope(near, k_hat)) < 1e-5  # the slope is continuous
    x = np.union1d(np.geomspace(1e-9, 1e6, 4000), np.linspace(0.9, 3.0, 4000))
    sign = np.sign(cohesive_table.slope(x, k_hat))
    assert (np.diff(sign[sign != 0.0]) != 0.0).sum() == 1


@pytest.fixture
def parts() -> tuple[cl.LineContact, cl.Friction]:
    contact = cl.LineContact.from_semi_width(
        semi_width=5e-3, radius=0.5, contact_modulus=115.4e9, wheel_load=220e3
    )
    return contact, cl.friction_with_k_hat(contact, k_hat=0.3, static=0.45, kinetic=0.21)


def test_element_with_cohesive_table(
    parts: tuple[cl.LineContact, cl.Friction], cohesive_table: cl.CreepForceTable
) -> None:
    contact, friction = parts
    element = cl.ForceElement(contact, friction, table=cohesive_table, radius=0.5)
    zeta = element.saturation_creepage * np.linspace(-5.0, 5.0, 101)
    law = cl.CohesiveZone(k_hat=element.k_hat, static_to_kinetic=friction.ratio)
    expected = 0.21 * 220e3 * law.traction_ratio(np.linspace(-5.0, 5.0, 101))
    record = element.at_creepage(zeta, speed=10.0)
    np.testing.assert_allclose(
        record["creep_force"], expected, atol=0.21 * 220e3 * cohesive_table.max_error
    )
    assert not record["force_limited"].any()  # this law has f_s
    # All partial derivatives, to the load too, of a table with a corner.
    given = {"omega": 20.4, "speed": 10.0, "axle_load": 180e3}
    base = element.evaluate(**given)
    for name, field in (("omega", "omega"), ("speed", "speed"), ("axle_load", "load")):
        h = 1e-6 * given[name]
        there, back = (element.force(**{**given, name: given[name] + s * h}) for s in (1.0, -1.0))
        assert base[f"force_by_{field}"] == pytest.approx((there - back) / (2.0 * h), rel=1e-6)


def test_element_refuses_a_table_of_another_contact_or_friction(
    parts: tuple[cl.LineContact, cl.Friction], cohesive_table: cl.CreepForceTable
) -> None:
    contact, friction = parts
    with pytest.raises(ValueError, match=r"contact=elliptic.* but ForceElement.contact is line"):
        cl.ForceElement(contact, friction, table=cl.carter_griffith_table("elliptic"), radius=0.5)
    other = cl.friction_with_k_hat(contact, k_hat=0.3, static=0.4, kinetic=0.21)
    with pytest.raises(ValueError, match=r"ratio = 1.90.* must be 2.142"):
        cl.ForceElement(contact, other, table=cohesive_table, radius=0.5)
    linear = cl.Friction.from_samples([0.0, 2e-6], [0.45, 0.21])
    with pytest.raises(ValueError, match=r"weakening is 'samples'.* 'exponential'"):
        cl.ForceElement(contact, linear, table=cohesive_table, radius=0.5)


def test_the_warning_is_for_the_limit_only(
    parts: tuple[cl.LineContact, cl.Friction], cohesive_table: cl.CreepForceTable
) -> None:
    contact, _ = parts
    long = cl.friction_with_k_hat(contact, k_hat=0.6, static=0.45, kinetic=0.21)
    assert cl.laws.process_zone_ratio(contact, long) == pytest.approx(1.732, abs=1e-3)
    with pytest.warns(ProcessZoneWarning, match=r"1.73 is above 0.5"):
        cl.ForceElement(contact, long, table=cl.carter_griffith_table("line"), radius=0.5)
    cl.ForceElement(contact, long, table=cohesive_table, radius=0.5)  # warnings are errors here


@pytest.mark.parametrize(
    "law",
    [
        cl.Polach.dry(),
        cl.Polach.wet(),
        cl.MeasuredCurve.from_csv(
            Path(__file__).parents[2] / "models" / "eurosprinter_engel1998.csv"
        ),
    ],
    ids=["polach dry", "polach wet", "measured"],
)
def test_tables_of_one_axis(law: cl.Polach | cl.MeasuredCurve) -> None:
    table = cl.CreepForceTable.from_law(law)
    assert table.one_axis
    assert table.max_error <= 1e-8
    x = np.concatenate([[0.0], np.geomspace(1e-9, 1e5, 3000), np.linspace(0.0, 30.0, 3001)])
    for k_hat in (0.0, 0.3, 2.0):
        np.testing.assert_allclose(table.traction_ratio(x, k_hat), law.traction_ratio(x), atol=2e-8)
        np.testing.assert_allclose(table.slope(x, k_hat), law.slope(x), atol=2e-4)
    np.testing.assert_array_equal(table.traction_ratio(-x, 0.1), -table.traction_ratio(x, 0.1))
