"""The rivals of the benchmarks are right, and the benchmarks run; no time is asserted."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import bench_kernel
import bench_runs
import bench_table
import numpy as np
import pytest
import report
import scaling
import wheelset_rival as rival
from timing import Case, interleaved
from wet_patch import CONTROLLER, many, wet_patch
from wheelset_batch import drive

import contactlib as cl
from contactlib.traction import stacked


@pytest.fixture(scope="module")
def compiler() -> None:
    """What compiles the rivals in C; it is not needed to run contactlib."""
    pytest.importorskip("ziglang")


def test_rivals_of_the_table_are_right() -> None:
    bench_table.check()


@pytest.mark.tools
@pytest.mark.usefixtures("compiler")
def test_rivals_of_the_kernel_are_right() -> None:
    bench_kernel.check()


@pytest.mark.tools
@pytest.mark.usefixtures("compiler")
def test_force_in_the_plane_is_nearer_to_contact_than_its_rivals() -> None:
    # Tables of our own law have its error, and what interpolation adds.
    for group, errors in bench_kernel.plane_errors().items():
        found = {who: np.sqrt(np.mean(error**2)) for who, error in errors.items()}
        ours, *others = (rms for who, rms in found.items() if "USETAB" not in who)
        assert ours < 0.0002 if group == "lin" else 2.0 * ours < min(others)
        assert found["like USETAB, 2 x finer"] < max(found["like USETAB"], 1.5 * ours)
    assert len(report.plane_lines()) == 11


@pytest.mark.slow
def test_rivals_of_the_runs_are_right() -> None:
    bench_runs.check(duration=0.5)


@pytest.mark.slow
def test_closed_form_and_table_of_the_batch_are_the_law() -> None:
    x = np.concatenate([np.geomspace(1e-6, 50.0, 60), [1.0, 5.999, 6.0]])
    for k_hat in (0.1, 0.3, 1.5):
        law, nodes = cl.CarterGriffith(k_hat=k_hat), rival.tabulate(k_hat)
        exact = np.column_stack([law.traction_ratio(x), law.slope(x)])
        solved = [rival.line_law(v, k_hat) for v in x.tolist()]
        np.testing.assert_allclose(solved, exact, rtol=1e-11, atol=1e-13)
        # At a friction of a quarter the law's k_hat is twice that of its own.
        looked_up = [rival.law(nodes, 0.5 * k_hat, 0.25, v) for v in x.tolist()]
        np.testing.assert_allclose(looked_up, exact, atol=2e-3)
        np.testing.assert_allclose(np.array(looked_up)[:, 0], exact[:, 0], atol=5e-6)


def test_controller_of_the_batch_is_the_shipped_one() -> None:
    scenario = wet_patch(10.0)
    shipped, run = (
        stacked([scenario.controller(CONTROLLER)]),
        rival.records([scenario], CONTROLLER)[0],
    )
    random = np.random.default_rng(5)
    vehicle = 10.0 + 0.003 * np.arange(400) + 0.02 * random.standard_normal(400)
    wheel = vehicle + np.abs(np.cumsum(0.05 * random.standard_normal(400)))
    memory = np.zeros(4)
    rival.start(run, memory)
    first = cl.Measurement(*(np.array([v]) for v in (run.demand, wheel[0], run.speed, run.demand)))
    kept, torque = shipped.start(first, run.demand), first.torque
    limited = 0
    for u, v in zip(wheel, vehicle, strict=True):
        measured = cl.Measurement(first.demand, np.array([u]), np.array([v]), torque)
        torque, kept = shipped.sample(measured, kept)
        assert rival.control(run, memory, u, v) == pytest.approx(torque[0], rel=1e-10, abs=1e-6)
        limited += bool(torque[0] < run.demand)
    assert 50 < limited < 400  # both of its states have been seen


@pytest.mark.slow
def test_batch_converges_with_second_order() -> None:
    # Under the first torque, on dry rails: nothing jumps.
    run = rival.records([wet_patch(10.0, duration=100.0)], CONTROLLER)[0]
    run.creepage *= 0.5
    ends = []
    for per_sample in (5, 10, 20, 40):
        found = np.empty(len(rival.OUTCOMES))
        drive(run, per_sample, per_sample, found, np.empty(0))
        ends.append(found[[0, 1, 3]])
    steps = np.abs(np.diff(ends, axis=0))
    order = np.log2(steps[:-1] / steps[1:])
    np.testing.assert_allclose(order[-1], 2.0, atol=0.25)


def test_what_the_rivals_do_not_know_is_refused() -> None:
    scenario = cl.load_scenario("dry_wet_dry.toml")
    with pytest.raises(ValueError, match="not a rigid wheelset that meets a patch"):
        rival.numbers(scenario, "creep_pi")


@pytest.mark.slow
def test_many_differ_and_run() -> None:
    scenarios = many(3, 10.0, duration=0.2)
    found = bench_runs.ensemble(scenarios)
    assert len(set(found["slip_work"].tolist())) == 3
    assert not found["failed"].any()
    batch = bench_runs.of_all(bench_runs.batch(rival.records(scenarios, CONTROLLER), 0.2))
    ours = np.column_stack([found[name] for name in bench_runs.OUTCOMES])
    np.testing.assert_allclose(batch, ours, rtol=1e-3)


def test_turns_are_taken_and_work_is_counted() -> None:
    said: list[str] = []
    case = Case(
        "speaking",
        8.0,
        "ns",
        {name: lambda name=name: said.append(name) for name in "abc"},  # type: ignore[misc]
        {"c": ">= 1"},
        clock=lambda: float(len(said)),  # each word takes a second
        less_work={"c": 2.0},
    )
    seconds = interleaved(case, rounds=4, least=1.0)
    assert seconds == dict.fromkeys("abc", 1.0)
    assert case.figure("a", 1.0) == 1e9 / 8.0
    assert case.times_faster("a", "c", seconds) == 4.0
    lines = report.rows(case, rounds=2, least=1.0)
    assert lines[1] == "| speaking | a: 125000000 ns | c: 500000000 ns | 4 | >= 1 |"
    assert replace(case, ours=2).pairs() == [("a", "c"), ("b", "c")]


@pytest.mark.tools
@pytest.mark.usefixtures("compiler")
def test_report_is_a_table() -> None:
    cases = [*bench_kernel.cases(64), *bench_table.cases(64), *bench_runs.cases(2, 0.1, fleet=2)]
    for case in cases:
        for line in report.rows(case, rounds=1, least=1e-6):
            assert re.fullmatch(r"\| [^|]+ \| [^|]+ \| [^|]+ \| [0-9.e+-]+ \| [^|]* \|", line), line
    assert len(report.accuracy_lines(0.1)) >= 6
    assert any("1 | " in line for line in report.plan_lines(measured=3))
    assert "Python" in report.machine()


def test_linear_cost_is_found(tmp_path: Path) -> None:
    n = np.array([10.0, 100.0, 1000.0, 10_000.0])
    line = scaling.fitted(n, 5.0 + 3.0 * n)
    assert line[:3] == pytest.approx((5.0, 3.0, 0.0), abs=1e-9)
    assert line.exponent == pytest.approx(1.0, abs=1e-3)
    square = scaling.fitted(n, n**2)
    assert square.exponent == pytest.approx(2.0)
    assert square.misfit > 0.5
    assert scaling.seconds(2, 0.1) > 0.0
    assert 0 < scaling.peak_memory(2, 0.1) < 1e9
    scaling.draw([scaling.Panel("runs", n, 3.0 * n, "s", "time")] * 2, tmp_path / "figure.png")
    assert (tmp_path / "figure.png").stat().st_size > 10_000
