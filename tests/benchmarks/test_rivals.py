"""The rivals of the benchmarks are right, and the benchmarks run; no time is asserted."""

from __future__ import annotations

import math
import re
from pathlib import Path

import bench_kernel
import bench_lateral_spin
import bench_runs
import bench_table
import numpy as np
import pytest
import scaling
from bench_kernel import CELLS, POLACH
from bench_lateral_spin import NU, lateral_spin_law, like_usetab, normalizing, rates_of
from bench_table import END, ERROR, K_HAT, K_HATS
from rivals import CHermite, fastsim, polach, polach_with_spin
from scipy.integrate import quad
from timing import compare

import contactlib as cl


@pytest.fixture(scope="module")
def compiler() -> None:
    """What compiles the rivals in C; it is not needed to run contactlib."""
    pytest.importorskip("ziglang")


def test_rivals_of_the_table_are_right() -> None:
    law, x = cl.CarterGriffith(k_hat=K_HAT), bench_table.some_points()
    k_hat = np.random.default_rng(2).uniform(*K_HATS, x.size)
    spline = bench_table.cubic_spline(law)
    np.testing.assert_allclose(spline(x), law.traction_ratio(x), rtol=0.0, atol=ERROR)
    both = cl.carter_griffith_table(contact="line").traction_ratio(x, k_hat)
    surface = bench_table.bivariate_spline().ev
    np.testing.assert_allclose(surface(x, k_hat), both, rtol=0.0, atol=ERROR)


@pytest.mark.tools
@pytest.mark.usefixtures("compiler")
def test_rivals_of_the_kernel_are_right() -> None:
    x = np.random.default_rng(3).uniform(-END, END, 5000)
    law = cl.CarterGriffith(k_hat=K_HAT)
    found, slope = np.empty_like(x), np.empty_like(x)
    polach(POLACH, x, found)
    np.testing.assert_allclose(found, POLACH.traction_ratio(x), rtol=1e-13)
    CHermite(law, end=END, cells=CELLS)(x, found, slope)
    np.testing.assert_allclose(found, law.traction_ratio(x), atol=ERROR)
    np.testing.assert_allclose(slope, law.slope(x), atol=1e-5)
    g, creepages = np.array([0.25, 1.0, 4.0]), np.array([[1.0, -0.25, 4.0]] * 3)
    places = like_usetab().places(g, creepages)  # nodes: u is 1/2, -1/5 and 4/5
    np.testing.assert_allclose(like_usetab()(places), lateral_spin_law(g, creepages), atol=1e-12)


@pytest.mark.tools
@pytest.mark.usefixtures("compiler")
def test_polach_with_spin_is_linear_theory_his_formula_and_all_of_the_friction() -> None:
    g, zeta = 1.5, np.linspace(-9.0, 9.0, 50)
    c = cl.laws.kalker_coefficients(g, NU)[:3]
    rows = np.concatenate([[[g, *c]] * 3, 1e-6 * np.eye(3)], axis=1)
    linear = np.array([[c[0], 0.0], [0.0, c[1]], [0.0, c[2]]])
    np.testing.assert_allclose(polach_with_spin(rows), -1e-6 * linear, rtol=1e-4)
    straight = np.pad(np.column_stack([np.tile([g, *c], (50, 1)), zeta]), ((0, 0), (0, 2)))
    law = cl.Polach(adhesion_reduction=1.0, slip_reduction=1.0)
    ratio = law.traction_ratio(4.0 / (3.0 * np.pi) * c[0] * zeta)
    np.testing.assert_allclose(polach_with_spin(straight)[:, 0], -ratio, atol=1e-14)
    sliding = polach_with_spin(np.array([[g, *c, 0.6e6, -0.8e6, 0.1]]))
    np.testing.assert_allclose(sliding, [[-0.6, 0.8]], atol=1e-5)


def simplified_theory(rate: float) -> float:
    """Force over mu P of Kalker's simplified theory in pure longitudinal creepage, exactly.

    A strip of half-length w sticks from its leading edge until rate (w - xi) meets the bound
    w**2 - xi**2, so at xi = rate - w, and slides behind. Integrated along the strip that is
    2 rate w**2 - rate**2 w + rate**3/6, or 4 w**3/3 where nothing sticks.
    """

    def strip(eta: float) -> float:
        w = math.sqrt(max(0.0, 1.0 - eta * eta))
        if rate >= 2.0 * w:
            return 4.0 / 3.0 * w**3
        return 2.0 * rate * w**2 - rate**2 * w + rate**3 / 6.0

    # The strips beyond this one slide as a whole.
    sliding = math.sqrt(max(0.0, 1.0 - 0.25 * rate**2))
    parts = [(0.0, sliding), (sliding, 1.0)]
    return 4.0 / math.pi * sum(quad(strip, *part, epsabs=1e-13)[0] for part in parts)


@pytest.mark.tools
@pytest.mark.usefixtures("compiler")
def test_fastsim_converges_to_its_theory_has_kalkers_slope_and_depends_on_no_direction() -> None:
    for rate in (0.3, 1.2, 3.0):
        exact, given = simplified_theory(rate), np.array([[rate, 0.0, 0.0, 0.0]])
        error = [fastsim(given, strips=n, elements=n)[0, 0] - exact for n in (40, 80)]
        assert abs(error[1]) < 2e-4
        assert 1.5 < np.log2(error[0] / error[1]) < 2.5
    # Linear theory: F = 3 pi/4 x along and across, and G (a b)**1.5 c23 phi.
    g = 1.5
    creepages = 1e-5 * np.eye(3)
    slopes = fastsim(rates_of(np.full(3, g), creepages), strips=400, elements=400) / 1e-5
    c23 = -cl.laws.kalker_coefficients(g, NU).c23 / normalizing(np.array([g]))[0, 2]
    np.testing.assert_allclose(
        slopes, [[0.75 * np.pi, 0.0], [0.0, 0.75 * np.pi], [0.0, c23]], rtol=1e-3, atol=1e-3
    )
    skew = fastsim(np.array([[0.8, 0.0, 0.0, 0.0], [0.48, 0.64, 0.0, 0.0]]), strips=20, elements=20)
    np.testing.assert_allclose(skew[1], skew[0, 0] * np.array([0.6, 0.8]), rtol=1e-12)
    # It slides as a whole: Coulomb, with what the grid makes of the pressure's integral.
    sliding = fastsim(np.array([[0.6e4, -0.8e4, 0.1, 0.1]]), strips=100, elements=100)
    np.testing.assert_allclose(sliding, [[0.6, -0.8]], rtol=1e-3)


@pytest.mark.tools
@pytest.mark.usefixtures("compiler")
def test_lateral_and_spin_force_is_nearer_to_contact_than_its_rivals() -> None:
    """And its errors are those that the guide states."""
    page = (Path(__file__).parents[2] / "docs/explanation/validation.md").read_text("utf-8")
    rows = {"long": "longitudinal", "comb30": "both, 30 degrees", "latspin": "spin and lateral"}
    # Tables of our own law have its error, and what interpolation adds.
    for group, errors in bench_lateral_spin.lateral_spin_errors().items():
        rms_of = {who: np.sqrt(np.mean(error**2)) for who, error in errors.items()}
        ours, *others = (rms for who, rms in rms_of.items() if "USETAB" not in who)
        assert ours < 0.0002 if group == "lin" else 2.0 * ours < min(others)
        assert rms_of["like USETAB, 2 x finer"] < max(rms_of["like USETAB"], 1.5 * ours)
        stated = re.search(rf"\| {rows.get(group)} \| ([\d.]+) \(", page)
        largest = np.hypot(*errors["contactlib"].T).max()
        assert bool(stated) == (group in rows)
        assert not stated or f"{largest:.{len(stated[1]) - 2}f}" == stated[1]


@pytest.mark.slow
@pytest.mark.parametrize("speed", bench_runs.SPEEDS)
def test_rivals_of_the_runs_are_right(speed: float) -> None:
    duration = 0.5
    _, creepages = bench_runs.reference(speed, duration)
    for name, error in bench_runs.accuracy(speed, duration).items():
        as_it_is, fine = (2e-4, 1e-6) if speed >= 10.0 else (2e-3, 2e-6)
        limits = {"10 ms": as_it_is, "numba": 2e-3, "LSODA": 2e-4, "contactlib": fine}
        limit = next(limit for word, limit in limits.items() if word in name)
        assert error < limit, f"{name} at {speed} m/s: {error}"
    scenario = bench_runs.wet_patch(speed, duration=duration)
    result = cl.run_scenario(scenario, bench_runs.CONTROLLER, step=bench_runs.STEP)
    largest = np.abs(creepages).max()
    assert np.abs(result["creepage"] - creepages).max() < 1e-4 * largest


def test_turns_are_taken_and_work_is_counted(capsys: pytest.CaptureFixture[str]) -> None:
    calls: list[str] = []
    subjects = {name: lambda name=name: calls.append(name) for name in "abc"}
    compare(
        "speaking",
        8.0,
        "ns",
        subjects,
        less_work={"c": 2.0},
        clock=lambda: float(len(calls)),  # each call takes a second
        rounds=4,
        shortest=1.0,
    )
    title, *lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert title == ["speaking"]
    assert lines == [
        ["a", "1.25e+08", "ns", "1"],
        ["b", "1.25e+08", "ns", "1"],
        ["c", "5e+08", "ns", "4"],
    ]


@pytest.mark.tools
@pytest.mark.usefixtures("compiler")
def test_benchmarks_run(capsys: pytest.CaptureFixture[str]) -> None:
    how = {"rounds": 1, "shortest": 1e-6}
    bench_table.main(64, **how)
    bench_kernel.traction(64, **how)
    bench_kernel.elements(64, **how)
    bench_lateral_spin.main(64, **how)
    bench_lateral_spin.print_errors()
    bench_runs.main(2, 0.1, **how)
    bench_runs.threads(2, 0.1, **how)
    assert "random x" in capsys.readouterr().out
    assert scaling.seconds(2, 0.1) > 0.0
    assert 0 < scaling.peak_memory(2, 0.1) < 1e9
