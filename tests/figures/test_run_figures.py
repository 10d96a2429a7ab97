"""The figures of a run: their notes on the ramp, the speed, the peak and the return."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from falling_friction import with_falling
from matplotlib.figure import Figure
from plain_scenario import controls

import contactlib as cl
from contactlib import figures
from contactlib.figures.style import AT_CONSTANT_TORQUE


def return_note(model: cl.Model, name: str, slower: float = 1.0) -> str:
    """The note of the fold diagram where the ramp comes back, with a slower fall."""
    torque, creep = controls(name)
    ramp = torque.reference
    top = int(np.argmax(ramp.value)) + 1  # end of the highest torque
    fall = [ramp.at[top] + slower * (at - ramp.at[top]) for at in ramp.at[top:]]
    control = cl.TorqueControl(cl.Profile((*ramp.at[:top], *fall), ramp.value))
    run = cl.simulate(model.wheelset, control, initial_speed=10.0)
    held = cl.simulate(model.wheelset, creep, initial_speed=10.0)
    figure = figures.fold_diagram(model.wheelset, run, held, speed=10.0, title="")
    texts = [text.get_text().replace("\n", " ") for text in figure.axes[0].texts]
    return next((text for text in texts if "lags" in text), "").replace("\N{NO-BREAK SPACE}", " ")


@pytest.mark.parametrize("name", ["rig", "locomotive"])
def test_a_fast_ramp_reports_why_it_returns_late(name: str, request: pytest.FixtureRequest) -> None:
    """Below the return by J domega/dt, with which the slowing wheel drives the contact too."""
    model: cl.Model = request.getfixturevalue(name)
    note, body = return_note(model, name), model.wheelset
    match = re.match(r"grip at ([\d.]+) kN m: the spinning wheel lags behind the ramp", note)
    assert match is not None
    run = cl.simulate(body, controls(name)[0], initial_speed=10.0)
    spins = run.time > run.time[run["creepage"].argmax()]
    fold = cl.find_fold(body, speed=10.0)
    at = np.flatnonzero(spins & (run["creepage"] < fold.creepage))[0]
    slowing = np.gradient(run["omega"], run.time)[at]
    held = body.radius * run["creep_force"][at] + body.damping * run["omega"][at]
    assert slowing < 0.0
    assert 1e3 * float(match[1]) == pytest.approx(held + body.inertia * slowing, abs=60.0)


@pytest.mark.filterwarnings("ignore:the run reaches")  # a slip work that the rig cannot cool
def test_a_slow_ramp_returns_at_the_return(rig: cl.Model) -> None:
    assert return_note(rig, "rig", slower=10.0) == ""


def fold_diagram(wheelset: cl.Wheelset, *torque: float) -> Figure:
    """Of a ramp through these torques [N.m], one each second."""
    ramp = cl.TorqueControl(cl.Profile(tuple(map(float, range(len(torque)))), torque))
    run = cl.simulate(wheelset, ramp, initial_speed=10.0)
    held = cl.simulate(wheelset, controls("rig")[1], initial_speed=10.0, duration=1.0)
    return figures.fold_diagram(wheelset, run, held, speed=10.0, title="Mine")


@pytest.mark.parametrize(
    ("torque", "label"),
    [
        ((24e3, 26e3), "torque ramped up"),
        ((24e3, 26e3, 24e3), "torque ramped up and down"),
        ((26e3, 24e3), "torque ramped down"),
        ((24e3, 24e3), "constant torque"),
    ],
)
def test_the_legend_names_where_the_torque_went(
    rig: cl.Model, torque: tuple[float, ...], label: str
) -> None:
    axes = fold_diagram(rig.wheelset, *torque).axes[0]
    assert label in [line.get_label() for line in axes.lines]


def test_a_title_notes_that_the_speed_changes(rig: cl.Model) -> None:
    steady = "Mine: steady creepage at $V$ = 10 m/s"
    assert fold_diagram(rig.wheelset, 24e3, 24e3).axes[0].get_title(loc="left") == steady
    light = replace(rig.wheelset, mass=5e3)
    title = fold_diagram(light, 24e3, 24e3).axes[0].get_title(loc="left")
    first, second = title.splitlines()
    assert first == steady
    match = re.fullmatch(r"runs at \$V\$ = 10 to ([\d.]+) m/s", second)
    assert match is not None
    assert float(match[1]) > 15.0


def test_the_held_point_lies_on_the_curve_of_its_own_speed(locomotive: cl.Model) -> None:
    damped = replace(locomotive.wheelset, damping=100.0)
    held = cl.simulate(damped, controls("locomotive")[1], initial_speed=10.0)
    ramp = cl.TorqueControl(cl.Profile((0.0, 1.0), (20e3, 21e3)))
    run = cl.simulate(damped, ramp, initial_speed=10.0)
    figure = figures.fold_diagram(damped, run, held, speed=10.0, title="")
    (axes,), speed = figure.axes, f"at {held['speed'][-1]:.3g} m/s"
    of = {str(line.get_label()): np.asarray(line.get_xydata()) for line in axes.lines}
    (point,) = of[f"held by creep control {speed}"]

    def beside(*branches: np.ndarray) -> float:
        """Torque between the point and a curve at its creepage, over the torque [1]."""
        drawn = np.concatenate(branches)
        drawn = drawn[np.isfinite(drawn).all(axis=1)]
        torque, creepage = drawn[np.argsort(drawn[:, 1])].T
        return abs(float(np.interp(point[1], creepage, torque) / point[0]) - 1.0)

    steady = next(i for i, line in enumerate(axes.lines) if "steady" in str(line.get_label()))
    at_own_speed = [np.asarray(line.get_xydata()) for line in axes.lines[steady : steady + 2]]
    assert beside(*at_own_speed) < 1e-4
    first = [of[label] for label in AT_CONSTANT_TORQUE]
    assert beside(*first) > 0.02


def test_without_damping_a_note_gives_the_torque_below_which_it_returns(rig: cl.Model) -> None:
    undamped = replace(rig.wheelset, damping=0.0)
    sliding = undamped.radius * undamped.element.friction.kinetic * undamped.element.axle_load
    note = f"above {1e-3 * sliding:.4g} kN m"
    drawn = (
        fold_diagram(undamped, 24e3, 24e3),
        figures.STABILITY_FIGURES["s_curve"].draw(undamped, 10.0),
    )
    for figure in drawn:
        texts = [text.get_text() for text in figure.axes[-1].texts]
        assert any("no return" in text and note in text for text in texts)


def marked(figure: Figure) -> dict[str, tuple[float, float]]:
    """Places of the notes of a creep curve, by the words before their numbers."""
    texts = figure.axes[0].texts
    return {re.split(r" at |: |\$", text.get_text())[0]: text.xy for text in texts}  # type: ignore[attr-defined]


@pytest.mark.parametrize("damping", [0.0, 5.0, 50.0, 2e3])
def test_a_creep_curve_marks_peak_fold_and_return(rig: cl.Model, damping: float) -> None:
    """The return within the axis, or where to find it."""
    body = replace(rig.wheelset, damping=damping)
    curve = cl.vehicle.CreepCurve(body, speed=10.0)
    figure = figures.creep_curve(body, speed=10.0)
    notes, (low, high) = marked(figure), figure.axes[0].get_xlim()
    assert low == 0.0
    (name,) = {"fold", "peak and fold"} & set(notes)
    assert notes[name][0] == curve.fold.creepage
    if curve.fold.return_creepage < high:
        assert notes["return"][0] == curve.fold.return_creepage
    elif np.isfinite(curve.fold.return_creepage):
        assert notes["return"][0] == high
        (text,) = (t.get_text() for t in figure.axes[0].texts if "return" in t.get_text())
        assert text.endswith("%\u00a0\N{RIGHTWARDS ARROW}".replace("\u00a0", " "))
    else:
        assert "no return" in notes
    lines = {str(line.get_label()): line for line in figure.axes[0].lines}
    carter, stable = lines["Carter (Coulomb friction)"], lines[AT_CONSTANT_TORQUE[0]]
    assert carter.get_zorder() > stable.get_zorder()  # visible where they meet
    assert carter.get_linewidth() < 0.5 * stable.get_linewidth()
    dots = [line for line in figure.axes[0].lines if line.get_marker() == "o"]
    assert curve.peak.creepage in [np.asarray(dot.get_xdata())[0] for dot in dots] or (
        name == "peak and fold"
    )


@pytest.mark.filterwarnings("ignore:process zone")
def test_a_creep_curve_beyond_the_law_notes_it(locomotive: cl.Model) -> None:
    body, friction = locomotive.wheelset, locomotive.wheelset.element.friction
    long = replace(
        friction,
        weakening_length=20.0 * friction.weakening_length,
        slip_rate_residual=0.1,
        slip_rate_decay=3.0,
    )
    beyond = replace(body, element=replace(body.element, friction=long))
    figure = figures.creep_curve(beyond, speed=10.0)
    title, held, zone = figure.axes[0].get_title(loc="left").splitlines()
    assert "process zone ratio" not in title
    match = re.fullmatch(r"\$\\hat K\$ is held at 2, the law's largest, from ([\d.]+) % on", held)
    assert match is not None
    at = beyond.element.at_creepage([0.009 * float(match[1]), 0.0101 * float(match[1])], speed=10.0)
    assert at["k_hat_limited"].tolist() == [0.0, 1.0]
    assert zone.startswith("process zone ratio 8.9 > 0.5") or "process zone ratio" in zone
    inside = figures.creep_curve(body, speed=10.0).axes[0].get_title(loc="left")
    assert "\n" not in inside


def test_a_measured_creep_curve_ends_with_its_last_point(rig: cl.Model) -> None:
    zeta = np.linspace(0.001, 0.12, 60)
    mu = 0.30 * np.tanh(zeta / 0.008) * (0.55 + 0.45 * np.exp(-zeta / 0.05))
    curve = cl.MeasuredCurve(zeta, mu)
    element = cl.ForceElement.from_curve(curve, rig.wheelset.element.contact, radius=0.5)
    wheelset = replace(rig.wheelset, element=element)
    drawn = {
        name: kind.draw(wheelset, 10.0).axes
        for name, kind in figures.STABILITY_FIGURES.items()
        if name in ("creep_curve", "poles", "gains")
    }
    for axes in (drawn["creep_curve"][0], drawn["poles"][0], drawn["gains"][1]):
        assert axes.get_xlim()[1] == pytest.approx(0.12, rel=0.03)
        drawn_to = [
            np.nanmax(np.asarray(line.get_xdata(), dtype=float))
            for line in axes.lines
            if line.get_linewidth() > 1.0
        ]
        assert max(drawn_to) == pytest.approx(0.12)
    (axes,) = drawn["creep_curve"]
    (points,) = (line for line in axes.lines if line.get_label() == "measured points")
    assert np.asarray(points.get_xydata()) == pytest.approx(np.column_stack([zeta, mu]))
    assert "Carter" not in str([line.get_label() for line in axes.lines])
    for other in (r"\hat K", r"\zeta_0", "f_d"):
        assert other not in axes.get_title(loc="left") + str(axes.texts)


def test_carter_s_curve_of_an_ellipse_sticks_beyond_saturation_of_strips(
    locomotive: cl.Model,
) -> None:
    element = locomotive.wheelset.element
    figure = figures.creep_curve(locomotive.wheelset, speed=10.0)
    carter = next(line for line in figure.axes[0].lines if str(line.get_label())[:6] == "Carter")
    zeta, drawn = np.asarray(carter.get_data())
    at_saturation = np.interp(element.saturation_creepage, zeta, drawn)
    assert 0.998 < at_saturation / element.friction.kinetic < 1.0 - 1e-4
    assert drawn[-1] == pytest.approx(element.friction.kinetic, rel=1e-12)


def test_a_creep_curve_gives_its_peak_and_friction_in_numbers(
    rig: cl.Model, locomotive: cl.Model
) -> None:
    def texts_of(wheelset: cl.Wheelset) -> str:
        figure = figures.creep_curve(wheelset, speed=10.0)
        return "; ".join(text.get_text() for text in figure.axes[0].texts)

    fold = cl.find_fold(rig.wheelset, speed=10.0)
    force = rig.wheelset.element.at_creepage(fold.creepage, speed=10.0)
    peak = f"fold: {float(force['traction_coefficient']):.3g} at {100.0 * fold.creepage:.2f} %"
    assert peak in texts_of(rig.wheelset)
    assert "$f_d$ = 0.21; " in texts_of(rig.wheelset) + "; "
    assert re.search(
        r"\$f_d\$ = 0\.21, 0\.\d+ at this", texts_of(with_falling(locomotive.wheelset))
    )
