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
from wet_patch import CONTROLLER, many

import contactlib as cl


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
def test_lateral_and_spin_force_is_nearer_to_contact_than_its_rivals() -> None:
    """And its errors are those that the guide states."""
    page = (Path(report.__file__).parents[1] / "docs/howto/lateral_spin.md").read_text("utf-8")
    rows = {"long": "longitudinal", "comb30": "both, 30 degrees", "latspin": "spin and lateral"}
    # Tables of our own law have its error, and what interpolation adds.
    for group, errors in bench_kernel.lateral_spin_errors().items():
        rms_of = {who: np.sqrt(np.mean(error**2)) for who, error in errors.items()}
        ours, *others = (rms for who, rms in rms_of.items() if "USETAB" not in who)
        assert ours < 0.0002 if group == "lin" else 2.0 * ours < min(others)
        assert rms_of["like USETAB, 2 x finer"] < max(rms_of["like USETAB"], 1.5 * ours)
        stated = re.search(rf"\| {rows.get(group)} \| ([\d.]+) \(", page)
        largest = np.hypot(*errors["contactlib"].T).max()
        assert bool(stated) == (group in rows)
        assert not stated or f"{largest:.{len(stated[1]) - 2}f}" == stated[1]
    assert len(report.lateral_spin_lines()) == 11


@pytest.mark.slow
def test_rivals_of_the_runs_are_right() -> None:
    bench_runs.check(duration=0.5)


def test_what_the_rivals_do_not_know_is_refused() -> None:
    scenario = cl.load_scenario("dry_wet_dry.toml")
    with pytest.raises(ValueError, match="not a rigid wheelset that meets a patch"):
        rival.numbers(scenario, "creep_pi")


@pytest.mark.slow
def test_many_differ_and_run() -> None:
    scenarios = many(3, 10.0, duration=0.2)
    outcomes = bench_runs.ensemble(scenarios)
    assert len(set(outcomes["slip_work"].tolist())) == 3
    assert not outcomes["failed"].any()
    batch = bench_runs.of_all(bench_runs.batch(rival.records(scenarios, CONTROLLER), 0.2))
    ours = np.column_stack([outcomes[name] for name in bench_runs.OUTCOMES])
    np.testing.assert_allclose(batch, ours, rtol=1e-3)


def test_turns_are_taken_and_work_is_counted() -> None:
    calls: list[str] = []
    case = Case(
        "speaking",
        8.0,
        "ns",
        {name: lambda name=name: calls.append(name) for name in "abc"},  # type: ignore[misc]
        {"c": ">= 1"},
        clock=lambda: float(len(calls)),  # each call takes a second
        less_work={"c": 2.0},
    )
    seconds = interleaved(case, rounds=4, shortest=1.0)
    assert seconds == dict.fromkeys("abc", 1.0)
    assert case.figure("a", 1.0) == 1e9 / 8.0
    assert case.times_faster("a", "c", seconds) == 4.0
    lines = report.rows(case, rounds=2, shortest=1.0)
    assert lines[1] == "| speaking | a: 125000000 ns | c: 500000000 ns | 4 | >= 1 |"
    assert replace(case, ours=2).pairs() == [("a", "c"), ("b", "c")]


@pytest.mark.tools
@pytest.mark.usefixtures("compiler")
def test_report_is_a_table() -> None:
    cases = [*bench_kernel.cases(64), *bench_table.cases(64), *bench_runs.cases(2, 0.1, fleet=2)]
    for case in cases:
        for line in report.rows(case, rounds=1, shortest=1e-6):
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
