"""The figures of stability: what is drawn, read back from the lines, against the analysis."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import control
import figure_checks as checks
import numpy as np
import pytest
from falling_friction import with_falling
from matplotlib.figure import Figure
from numpy.testing import assert_allclose

import contactlib as cl
from contactlib import stability
from contactlib.figures import STABILITY_FIGURES
from contactlib.figures.stability import bode, loops, phase, slip_away
from contactlib.figures.stability import loops as gains
from contactlib.figures.stability.torsion import drawn_axle
from contactlib.stability import SteadyRollingWarning, torsion
from contactlib.stability.control_systems import creep_loop, frequencies
from contactlib.vehicle import Drivetrain, Resistance

pytestmark = pytest.mark.slow

V = 10.0
NAMES = list(STABILITY_FIGURES)


@pytest.fixture(scope="module")
def figures(rig: cl.Model) -> dict[str, Figure]:
    return {name: kind.draw(rig.wheelset, V) for name, kind in STABILITY_FIGURES.items()}


@pytest.fixture(scope="module")
def of_locomotive(locomotive: cl.Model) -> dict[str, Figure]:
    chosen = ("phase", "gains")
    return {name: STABILITY_FIGURES[name].draw(locomotive.wheelset, V) for name in chosen}


@pytest.mark.parametrize(
    ("name", "free"), [*((name, False) for name in NAMES), ("phase", True), ("gains", True)]
)
def test_figure_can_be_read(
    figures: dict[str, Figure],
    of_locomotive: dict[str, Figure],
    tmp_path: Path,
    name: str,
    free: bool,
) -> None:
    figure = (of_locomotive if free else figures)[name]
    checks.check_all(figure, tmp_path)
    for symbol in (r"$\hat{K}$", r"$\zeta_0$", "$J$", "$b$", "$V$", *(["$M$"] * free)):
        assert symbol in figure.get_supxlabel()


def test_s_curve_is_the_quasi_steady_torque(figures: dict[str, Figure], rig: cl.Model) -> None:
    axes = figures["s_curve"].axes[-1]
    fold = cl.find_fold(rig.wheelset, speed=V)
    for label, style in (
        ("stable at constant torque", "-"),
        ("unstable at constant torque", "--"),
    ):
        torque, zeta, drawn = checks.lines(axes, label)
        shown = np.isfinite(zeta)
        expected = cl.stability.quasi_steady_torque(rig.wheelset, zeta[shown], speed=V)
        assert_allclose(1e3 * torque[shown], expected, rtol=1e-12)
        assert drawn == style
        near = 1e-3 * fold.creepage
        beyond = (zeta[shown] > fold.creepage + near) & (zeta[shown] < fold.return_creepage - near)
        within = (zeta[shown] < fold.creepage - near) | (zeta[shown] > fold.return_creepage + near)
        assert not (beyond if style == "-" else within).any()
    marks = checks.marks(axes, "D")
    at = sorted(checks.place(m) for m in marks)
    expected_marks = [
        (1e-3 * fold.return_torque, fold.return_creepage),
        (1e-3 * fold.drive_torque, fold.creepage),
    ]
    assert_allclose(at, expected_marks, rtol=1e-12)
    texts = " ".join(text.get_text() for text in axes.texts)
    assert f"hysteresis {100.0 * fold.hysteresis:.1f} %" in texts
    assert f"{1e-3 * fold.drive_torque:.4g} kN m" in texts


def test_s_curves_beyond_the_law_are_noted(rig: cl.Model) -> None:
    """k_hat grows like the root of 1/friction."""
    friction = rig.wheelset.element.friction
    long = replace(friction, weakening_length=36.0 * friction.weakening_length)  # k_hat 1.8
    with pytest.warns(cl.element.ProcessZoneWarning):
        element = replace(rig.wheelset.element, friction=long)
    figure = STABILITY_FIGURES["s_curve"].draw(replace(rig.wheelset, element=element), V)
    (title,) = (
        axes.get_title(loc="left") for axes in figure.axes if "factor" in axes.get_title(loc="left")
    )
    assert title == r"Friction factor; $\hat K$ is held at 2 from 0.75 down"


def test_s_curve_marks_the_states_of_a_torque(figures: dict[str, Figure], rig: cl.Model) -> None:
    axes = figures["s_curve"].axes[-1]
    dots = checks.marks(axes, "o")
    torque = 1e3 * checks.place(dots[0])[0]
    states = rig.wheelset.equilibria(drive_torque=torque, speed=V)
    marked = [(checks.place(d)[1], d.get_markerfacecolor() == "black") for d in dots]
    assert_allclose([z for z, _ in marked], [p.creepage for p in states], rtol=1e-9)
    assert [filled for _, filled in marked] == [p.stable for p in states] == [True, False, True]


def test_poles_are_eigenvalues(figures: dict[str, Figure], rig: cl.Model) -> None:
    axes = figures["poles"].axes[0]
    for speed in (3.0, 10.0, 30.0):
        zeta, pole, style = checks.lines(axes, f"{speed:g} m/s")
        assert style == "-"
        assert np.nanmax(pole) <= 0.0
        dashed = axes.lines[1 + [line.get_label() for line in axes.lines].index(f"{speed:g} m/s")]
        assert checks.style_of(dashed) == "--"
        for i in (100, 250, 800):
            whole = np.where(np.isfinite(pole), pole, np.asarray(dashed.get_ydata()))
            point = rig.wheelset.balanced(creepage=float(zeta[i]), speed=speed)
            assert whole[i] == pytest.approx(point.eigenvalues[0], rel=1e-9, abs=1e-9)
            assert point.stable == np.isfinite(pole[i])


def test_a_bode_plot_is_that_of_a_force_that_lags(
    figures: dict[str, Figure], rig: cl.Model
) -> None:
    body, axes = rig.wheelset.without_memory(), figures["bode"].axes
    creepages = (
        bode.RISING * cl.find_fold(body, speed=V).creepage,
        cl.worst_pole(body, speed=V).creepage,
    )
    for upper, lower, creepage in zip(axes[:2], axes[2:], creepages, strict=True):
        slope = body.balanced(creepage=creepage, speed=V).creep_force_slope
        lag = 1.0 / (2.0 * np.pi * checks.place(upper.lines[-1])[0])
        for label, time in (("with memory", lag), ("without memory", 0.0)):
            hertz, size, style = checks.lines(upper, label)
            s = 2j * np.pi * hertz
            force = body.radius**2 * slope / V / (1.0 + time * s)
            expected = body.radius / V / (body.inertia * s + body.damping + force)
            assert_allclose(size, 1e5 * np.abs(expected), rtol=1e-6)
            turned = np.exp(1j * np.radians(checks.lines(lower, label)[1]))
            assert_allclose(turned, expected / np.abs(expected), atol=1e-5)
            assert style == ("-" if slope > 0.0 else "--")


def test_longest_delay_is_one_over_the_worst_pole(
    figures: dict[str, Figure], rig: cl.Model
) -> None:
    axes = figures["poles"].axes[1]
    speeds, limit, _ = checks.lines(axes, "$1/p$: no gain holds above")
    _, robust, style = checks.lines(axes, "$0.3/p$: robust below")
    assert style == "--"
    assert_allclose(robust, 0.3 * limit, rtol=1e-12)
    for i in (0, 20, 39):
        worst = cl.worst_pole(rig.wheelset, speed=float(speeds[i])).pole
        assert 1e-3 * limit[i] == pytest.approx(1.0 / worst)
    for mark, delay in zip(checks.marks(axes, "o"), (10e-3, 30e-3), strict=True):
        worst = cl.worst_pole(rig.wheelset, speed=checks.place(mark)[0]).pole
        assert 1.0 / worst == pytest.approx(delay, rel=1e-3)


def test_phase_portrait_has_the_basin_and_runs_obey_it(
    figures: dict[str, Figure], rig: cl.Model
) -> None:
    rate_axes, run_axes = figures["phase"].axes
    fold = cl.find_fold(rig.wheelset, speed=V)
    torque = phase.LOAD * fold.drive_torque
    border = cl.stability.basin(rig.wheelset, drive_torque=torque, speed=V)
    zeta, solid, _ = checks.lines(rate_axes, "small changes decay")
    _, dashed, style = checks.lines(rate_axes, "small changes grow")
    assert style == "--"
    rate = np.where(np.isfinite(solid), solid, dashed)
    # The rate of the creepage is that of the equations of motion.
    load = rig.wheelset.element.axle_load
    for i in (50, 400, 900):
        omega = (1.0 + zeta[i]) * V / rig.wheelset.radius
        motion, _ = rig.wheelset.rates(omega, V, torque, load, 1.0, 0.0)
        expected = 100.0 * rig.wheelset.radius * motion.omega_rate / V
        assert rate[i] == pytest.approx(expected, rel=1e-9)
    inside = (zeta > border.creepage) & (zeta < 0.9999 * border.highest)
    assert (rate[inside] < 0.0).all()
    assert (rate[zeta > 1.0001 * border.highest] > 0.0).all()
    runs = [line for line in run_axes.lines if len(np.asarray(line.get_xdata())) > 10]
    assert len(runs) == len(phase.STARTS)
    for run in runs:
        start, end = np.asarray(run.get_ydata())[[0, -1]]
        away = bool(start > border.highest)
        assert checks.style_of(run) == ("--" if away else "-")
        if away:
            assert end > 2.0 * border.highest
        else:
            assert end == pytest.approx(border.creepage, rel=0.01)


def test_phase_plane_has_the_separatrix(
    of_locomotive: dict[str, Figure], locomotive: cl.Model
) -> None:
    axes = of_locomotive["phase"].axes[0]
    edge, speeds, style = checks.lines(axes, "separatrix")
    assert style == "--"
    torque = phase.LOAD * cl.find_fold(locomotive.wheelset, speed=V).drive_torque
    some = cl.stability.separatrix(
        locomotive.wheelset, drive_torque=torque, speed=speeds[[0, 9, 18]]
    )
    assert_allclose(edge[[0, 9, 18]], some, rtol=1e-9)


def test_phase_plane_shows_the_speeds_that_grip(locomotive: cl.Model) -> None:
    """With much damping a torque is too large at lower speed, and slips at none at higher speed."""
    damped = replace(locomotive.wheelset, damping=1e3)
    axes = STABILITY_FIGURES["phase"].draw(damped, V).axes[0]
    edge, speeds, _ = checks.lines(axes, "separatrix")
    assert axes.get_ylim() == (speeds[0], speeds[-1])
    assert speeds.size > 6
    assert 0.7 * V < speeds[0] <= V <= speeds[-1] < 1.6 * V
    assert np.isfinite(edge).all()


def test_slip_away_points_are_on_the_integral(figures: dict[str, Figure], rig: cl.Model) -> None:
    axes = figures["slip_away"].axes[1]
    overload, exact, style = checks.lines(axes, "integral")
    assert style == "-"
    _, closed, style = checks.lines(axes, "closed form")
    assert style == "--"
    points, simulated, _ = checks.lines(axes, "simulated")
    end = slip_away.FAR * rig.wheelset.element.saturation_creepage
    highest = cl.find_fold(rig.wheelset, speed=V).drive_torque
    for part, time in zip(points, simulated, strict=True):
        torque = (1.0 + part) * highest
        integral = cl.stability.slip_away_time(
            rig.wheelset, drive_torque=torque, speed=V, start=0.0, end=end
        )
        assert 1e-3 * time == pytest.approx(integral, rel=1e-5)
    assert_allclose(
        np.exp(np.interp(np.log(points), np.log(overload), np.log(exact))), simulated, 0.01
    )
    assert_allclose(closed[overload < 0.1], exact[overload < 0.1], rtol=0.15)


def test_slip_away_ends_before_damping_holds_an_overload(locomotive: cl.Model) -> None:
    damped = replace(locomotive.wheelset, damping=2e3)
    axes = STABILITY_FIGURES["slip_away"].draw(damped, V).axes[0]
    fold = cl.find_fold(damped, speed=V)
    far = 10.0 * damped.element.saturation_creepage
    assert cl.stability.quasi_steady_torque(damped, far, speed=V) > 1.01 * fold.drive_torque
    assert axes.get_ylim()[1] == fold.return_creepage < far


@pytest.mark.parametrize("speed", [1.0, 2.78])
def test_slip_away_is_drawn_where_the_closed_form_is_far_off(
    locomotive: cl.Model, speed: float
) -> None:
    """After a flat peak friction falls slowly with slip speed: the closed form is 6 times short."""
    body, friction = locomotive.wheelset, locomotive.wheelset.element.friction
    slow = replace(
        friction,
        weakening_length=0.05 * friction.weakening_length,
        slip_rate_residual=0.3,
        slip_rate_decay=0.1,
    )
    body = replace(body, element=replace(body.element, friction=slow))
    axes = STABILITY_FIGURES["slip_away"].draw(body, speed).axes[1]
    overload, exact, _ = checks.lines(axes, "integral")
    _, closed, _ = checks.lines(axes, "closed form")
    at, simulated, _ = checks.lines(axes, "simulated")
    assert (exact > 3.0 * closed).any()
    assert at.tolist() == list(slip_away.SIMULATED)
    assert_allclose(simulated, np.exp(np.interp(np.log(at), np.log(overload), np.log(exact))), 0.03)


def test_clearing_points_are_on_their_line(figures: dict[str, Figure], rig: cl.Model) -> None:
    times, lengths = figures["clearing"].axes
    (label,) = [
        str(line.get_label()) for line in times.lines if "simulated" in str(line.get_label())
    ]
    friction, simulated, _ = checks.lines(times, label)
    at, drawn, _ = checks.lines(times, label.removeprefix("simulated, "))
    fold = cl.find_fold(rig.wheelset, speed=V)
    torque = 0.5 * (fold.return_torque + fold.drive_torque)
    for m, time in zip(friction, simulated, strict=True):
        assert time == pytest.approx(drawn[np.flatnonzero(at == m)[0]], rel=0.011)  # of bisection
        exact = cl.clearing(rig.wheelset, drive_torque=torque, speed=V, friction_scale=m).time
        assert drawn[np.flatnonzero(at == m)[0]] == pytest.approx(1e3 * exact)
    assert (np.diff(drawn) > 0.0).all()
    for line in lengths.lines:  # V times J V/r: without damping the square of the speed
        speed, length = (np.asarray(v, dtype=float) for v in (line.get_xdata(), line.get_ydata()))
        order = np.polyfit(np.log(speed), np.log(length), 1)[0]
        assert order == pytest.approx(2.0, abs=0.03)


def test_gain_windows(figures: dict[str, Figure], rig: cl.Model) -> None:
    left, right = figures["gains"].axes
    worst = cl.worst_pole(rig.wheelset, speed=V)
    plant = stability.reduced_plant(rig.wheelset, worst.creepage, speed=V)
    ratio, high, _ = checks.lines(left, "largest gain")
    _, low, _ = checks.lines(left, "smallest gain")
    assert_allclose(1e3 * low, plant.pole / plant.gain, rtol=1e-12)
    # A delay alone: p tau = theta/tan(theta), g Kp = p/cos(theta).
    theta = np.arccos(plant.pole / (1e3 * plant.gain * high))
    assert_allclose(theta / np.tan(theta), ratio, rtol=1e-6)
    ratio, sampled, style = checks.lines(left, "largest gain, sampled")
    assert style == "--"
    exact = gains.sampled_window(plant, float(ratio[10])).highest
    assert 1e3 * sampled[10] == pytest.approx(exact)
    zeta, smallest, _ = checks.lines(right, "smallest gain")
    for i in (20, 100):
        point = rig.wheelset.balanced(creepage=float(zeta[i]), speed=V)
        assert 1e3 * smallest[i] == pytest.approx(cl.creep_control_gain(rig.wheelset, point))


def test_least_gain_is_the_larger_of_two_bounds(
    of_locomotive: dict[str, Figure], locomotive: cl.Model
) -> None:
    axes = of_locomotive["gains"].axes[1]
    zeta, smallest, _ = checks.lines(axes, "smallest gain")
    _, determinant, dashed = checks.lines(axes, "determinant vanishes")
    _, trace, dotted = checks.lines(axes, "trace vanishes")
    assert dashed == "--"
    assert dotted == ":"
    assert_allclose(smallest, np.maximum(determinant, trace), rtol=1e-8, atol=1e-6)
    # They are at the eigenvalues: one zero, or a sum of zero.
    i = 60
    point = locomotive.wheelset.balanced(creepage=float(zeta[i]), speed=V)
    linear = locomotive.wheelset.linearize(point)
    at_bounds = [
        np.linalg.eigvals(linear.A - 1e3 * bound * linear.B[:, :1] @ linear.C[2:3])
        for bound in (determinant[i], trace[i])
    ]
    assert np.abs(at_bounds[0]).min() < 1e-10 * np.abs(at_bounds[0]).max()
    assert abs(at_bounds[1].sum()) < 1e-8 * np.abs(at_bounds[1]).max()


def test_loop_is_held_with_one_encirclement(figures: dict[str, Figure], rig: cl.Model) -> None:
    locus, curve = figures["loop"].axes
    worst = cl.worst_pole(rig.wheelset, speed=V)
    plant = stability.reduced_plant(rig.wheelset, worst.creepage, speed=V)
    delay = loops.DELAY_RATIO / plant.pole
    window = stability.proportional_window(plant.pole, plant.gain, delay=delay)
    texts = [text.get_text() for text in locus.texts]
    for bound in window:  # the locus meets the axis at the window's ends
        assert f"{1e-3 * bound:.4g} kN m" in texts
    point = rig.wheelset.balanced(creepage=worst.creepage, speed=V)
    gain = float(np.sqrt(window.lowest * window.highest))
    loop = creep_loop(rig.wheelset, point, proportional_gain=gain, delay=delay)
    nyquist = control.nyquist_response(loop, np.append(0.0, frequencies(loop)))
    x, y, _ = checks.lines(curve, "loop, rising frequency")
    assert_allclose(x + 1j * y, nyquist.response)
    # The winding of the drawn curve and its mirror image around -1.
    winding = np.sum(np.diff(np.unwrap(np.angle(x + 1j * y + 1.0)))) / np.pi
    assert round(winding) == -nyquist.count == (loop.poles().real > 0.0).sum() == 1
    assert curve.get_title(loc="left").endswith(": the point is held")
    crossing = sorted(checks.place(line)[0] for line in curve.lines if line.get_marker() == "o")
    assert_allclose(crossing, [-gain / window.lowest, -gain / window.highest], rtol=1e-3)
    solid, dashed = (checks.lines(locus, name) for name in ("gains that hold", "gains that do not"))
    assert (solid[2], dashed[2]) == ("-", "--")


def test_effective_slope_and_limit_cycles(figures: dict[str, Figure], rig: cl.Model) -> None:
    slopes, amplitudes = figures["torsion"].axes
    drivetrain = Drivetrain(rig.wheelset, axle=drawn_axle(rig.wheelset))
    assert drivetrain.torsional_frequency == pytest.approx(100.0 * np.pi)
    assert drivetrain.torsional_damping_ratio == pytest.approx(0.01)
    worst = cl.worst_pole(rig.wheelset, speed=V).creepage
    point = rig.wheelset.balanced(creepage=worst, speed=V)
    size, fall, _ = checks.lines(slopes, f"at {100.0 * worst:.2g} % mean creepage")
    expected = torsion.effective_slope(rig.wheelset, point, size[::60])
    assert_allclose(1e3 * fall[::60], -expected, rtol=1e-12)
    limit = -1e-3 * torsion.torsional_threshold(drivetrain, speed=V)
    dots = checks.marks(slopes, "o")
    assert {line.get_markerfacecolor() for line in dots} == {"black", "white"}
    assert all(checks.place(line)[1] == limit for line in dots)
    mean, stable, solid = checks.lines(amplitudes, "stable")
    low_mean, unstable, dashed = checks.lines(amplitudes, "unstable")
    assert (solid, dashed) == ("-", "--")
    both = torsion.bistable_range(drivetrain, speed=V)
    assert both is not None
    assert low_mean[0] == pytest.approx(both[0], rel=1e-3)
    assert mean[-1] == low_mean[-1] == pytest.approx(both[1], rel=1e-5)
    assert stable[-1] == pytest.approx(unstable[-1], rel=0.01)  # they meet


def test_simulated_amplitudes_are_on_the_stable_branch(
    figures: dict[str, Figure], rig: cl.Model
) -> None:
    axes = figures["torsion"].axes[1]
    mean, stable, _ = checks.lines(axes, "stable")
    centres, sizes, _ = checks.lines(axes, "simulated")
    swinging = sizes > 1e-3
    assert 4 <= swinging.sum() < sizes.size
    assert_allclose(sizes[swinging], np.interp(centres[swinging], mean, stable), rtol=0.03)
    drivetrain = Drivetrain(rig.wheelset, axle=drawn_axle(rig.wheelset))
    both = torsion.bistable_range(drivetrain, speed=V)
    assert both is not None
    for centre in np.unique(centres):  # in the bistable range, and only there, the kick decides
        one_rests = len({bool(kept) for kept in swinging[centres == centre]}) == 2
        assert one_rests == (both[0] < centre < both[1])


@pytest.mark.parametrize(
    ("changes", "remedy"),
    [
        (
            {"damping": 1e5},
            r"a lower wheelset\.damping \(it is 100000\) or a higher friction\.static",
        ),
        (
            {"layer_compliance": 3e-12},
            r"a lower wheelset\.layer_compliance \(it is 3e-12\) or a lower",
        ),
    ],
)
def test_a_missing_fold_names_what_flattens_the_curve(
    changes: dict[str, float], remedy: str
) -> None:
    body = cl.load_model("roller_rig.toml").wheelset
    of_body: dict[str, Any] = {name: value for name, value in changes.items() if name == "damping"}
    of_element: dict[str, Any] = {
        name: value for name, value in changes.items() if name != "damping"
    }
    flat = replace(body, element=replace(body.element, **of_element), **of_body)
    with pytest.raises(ValueError, match=f"no fold; it needs {remedy}"):
        cl.find_fold(flat, speed=V)
    figure = STABILITY_FIGURES["creep_curve"].draw(flat, V)
    labels = [str(line.get_label()) for line in figure.axes[0].lines]
    assert "stable" in labels
    assert "unstable at constant torque" not in labels


def test_a_free_vehicle_is_not_held(of_locomotive: dict[str, Figure], locomotive: cl.Model) -> None:
    drawn = {name: of_locomotive[name] for name in ("phase", "gains")}
    drawn["clearing"] = STABILITY_FIGURES["clearing"].draw(locomotive.wheelset, V)
    for figure in drawn.values():
        caption = figure.get_supxlabel().replace("\u00a0", " ")
        assert "(held)" not in caption
        assert "$V$ 10 m/s." in caption


@pytest.mark.parametrize("speed", [3.0, 10.0])
def test_the_range_of_limit_cycles_holds_their_curve(rig: cl.Model, speed: float) -> None:
    """At low speed, and where friction falls slowly, the bistable range goes far."""
    body = with_falling(rig.wheelset)
    axes = STABILITY_FIGURES["torsion"].draw(body, speed).axes[1]
    drivetrain = Drivetrain(body, axle=drawn_axle(body))
    both = torsion.bistable_range(drivetrain, speed=speed)
    assert both is not None
    assert axes.get_xlim()[1] > both[1] > 3.0 * cl.worst_pole(body, speed=speed).creepage
    mean, stable, _ = checks.lines(axes, "stable")
    _, unstable, _ = checks.lines(axes, "unstable")
    assert mean[-1] == pytest.approx(both[1], rel=1e-3)
    assert stable[-1] == pytest.approx(unstable[-1], rel=0.05)
    assert axes.get_ylim()[1] > stable.max()


def test_a_legend_of_limit_cycles_names_only_what_is_drawn(rig: cl.Model) -> None:
    """At high speed the wheels do not vibrate: rest is stable at any mean creepage."""
    for speed in (150.0, 100.0, 30.0):
        axes = STABILITY_FIGURES["torsion"].draw(rig.wheelset, speed).axes[1]
        named = [line for line in axes.lines if not str(line.get_label()).startswith("_")]
        assert all(np.isfinite(np.asarray(line.get_ydata(), dtype=float)).any() for line in named)
        labels = [line.get_label() for line in named]
        assert ("unstable" in labels) == (speed < 150.0)
        bistable = [str(patch.get_label()).startswith("bistable, ") for patch in axes.patches]
        assert any(bistable) == (speed < 100.0)
        assert len(set(labels)) == len(labels)


def test_figures_without_return_and_with_falling_friction(
    rig: cl.Model, locomotive: cl.Model, tmp_path: Path
) -> None:
    undamped = replace(rig.wheelset, damping=0.0)
    figure = STABILITY_FIGURES["s_curve"].draw(undamped, V)
    (only,) = checks.marks(figure.axes[-1], "D")
    assert checks.place(only)[1] == cl.find_fold(undamped, speed=V).creepage
    checks.check_layout(figure)
    figure = STABILITY_FIGURES["s_curve"].draw(with_falling(locomotive.wheelset), V)
    checks.check_layout(figure)
    assert "slip-rate" in figure.get_supxlabel()


def test_a_run_inside_the_basin_has_the_colour_of_grip(locomotive: cl.Model) -> None:
    """Also if it later reaches speeds at which no grip holds the torque."""
    light = replace(with_falling(locomotive.wheelset), mass=20e3)
    axes = STABILITY_FIGURES["phase"].draw(light, V).axes[0]
    edge, at, _ = checks.lines(axes, "separatrix")
    starts = [checks.place(line) for line in checks.marks(axes, ".")]
    solid = [line.get_color() == "#0072B2" for line in checks.marks(axes, ".")]
    assert solid == [zeta < np.interp(v, at, edge) for zeta, v in starts]


@pytest.mark.parametrize("damping", [0.0, 10.0])
def test_a_speed_that_nothing_brings_back_is_taken_as_constant(
    locomotive: cl.Model, damping: float
) -> None:
    """A constant resistance leaves an eigenvalue of zero; with damping no gain holds the speed."""
    drifting = replace(locomotive.wheelset, resistance=Resistance(constant=1e3), damping=damping)
    held = replace(drifting, mass=None)
    axes = STABILITY_FIGURES["gains"].draw(drifting, V).axes[1]
    zeta, smallest, _ = checks.lines(axes, "smallest gain")
    expected = [
        cl.creep_control_gain(held, held.balanced(creepage=float(z), speed=V)) for z in zeta[::50]
    ]
    assert_allclose(1e3 * smallest[::50], expected)
    figure = STABILITY_FIGURES["loop"].draw(drifting, V)
    assert "Constant vehicle speed" in figure.get_supxlabel()
    x, _, _ = checks.lines(figure.axes[1], "loop, rising frequency")
    assert 1.0 < np.abs(x).max() < 10.0


@pytest.mark.parametrize("name", ["phase", "gains"])
def test_figures_of_steady_rolling_warn_of_memory(
    rig: cl.Model, figures: dict[str, Figure], name: str
) -> None:
    element = replace(rig.wheelset.element, memory=True)
    body = replace(rig.wheelset, element=element)
    with pytest.warns(SteadyRollingWarning, match=f"stability_{name} takes rolling as steady"):
        figure = STABILITY_FIGURES[name].draw(body, V)
    for axes, expected in zip(figure.axes, figures[name].axes, strict=True):
        for line, same in zip(axes.lines, expected.lines, strict=True):
            np.testing.assert_array_equal(line.get_xydata(), same.get_xydata())
