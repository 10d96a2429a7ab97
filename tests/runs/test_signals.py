"""Signals of the contact that a run computes on request, through every door."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from plain_scenario import controls

import contactlib as cl
from contactlib.runs.signals import of_contacts, units

ASKED = ("k_hat", "saturation_creepage", "process_zone_ratio", "force_gradient", "force_limited")


def scenario_of(name: str, duration: float = 4.0, **changes: Any) -> cl.Scenario:
    """A shipped scenario with other properties of its force element."""
    case = replace(cl.load_scenario(name), duration=duration)
    wheelset = case.drivetrain.wheelset
    wheelset = replace(wheelset, element=replace(wheelset.element, **changes))
    return replace(case, drivetrain=replace(case.drivetrain, wheelset=wheelset))


@pytest.mark.parametrize("name", ["dry_wet_dry.toml", "split_friction.toml", "soft_patch.toml"])
def test_signals_are_those_of_the_force_element_at_the_state(name: str) -> None:
    case = scenario_of(name, 6.5, memory=False)
    element = case.drivetrain.wheelset.element
    run = cl.run_scenario(case, "open_loop", signals=units(of_contacts_without_memory()))
    sides: dict[str, Any] = {}
    for side in ("left", "right"):
        sides[side] = {name: np.empty(run.time.size) for name in of_contacts_without_memory()}
        for slope in np.unique(run["slope_scale"]):
            rows = run["slope_scale"] == slope
            softer = replace(element, slope_reduction=element.slope_reduction * slope)
            found = softer.evaluate(
                omega=run[f"omega_{side}"][rows],
                speed=run["speed"][rows],
                axle_load=run["axle_load"][rows],
                friction_scale=run[f"friction_scale_{side}"][rows],
            )
            for signal, values in sides[side].items():
                values[rows] = found[signal]
                if of_contacts()[signal].unit in ("N", "N.s/m"):
                    values[rows] *= 0.5
        for signal, values in sides[side].items():
            np.testing.assert_allclose(run[f"{signal}_{side}"], values, rtol=1e-9, err_msg=signal)
    left, right = sides["left"], sides["right"]
    assert (run["k_hat"] == 0.5 * (left["k_hat"] + right["k_hat"])).all()
    np.testing.assert_allclose(
        run["force_gradient"], left["force_gradient"] + right["force_gradient"]
    )
    flag = "force_limited"
    assert (run[flag] == np.maximum(left[flag], right[flag])).all()


def last_of(name: str, result: cl.Result) -> float:
    return float(result[name][-1])


def of_contacts_without_memory() -> dict[str, Any]:
    absent = {"sticking", "unslipped", "contact_temperature"}
    return {name: signal for name, signal in of_contacts().items() if name not in absent}


def test_a_hot_contact_has_the_temperature_of_the_force_element() -> None:
    friction = cl.load_scenario("dry_wet_dry.toml").drivetrain.wheelset.element.friction
    friction = replace(friction, slip_rate_decay=0.0, softening_temperature=800.0)
    hot = scenario_of("dry_wet_dry.toml", memory=False, friction=friction)
    element = hot.drivetrain.wheelset.element
    run = cl.run_scenario(hot, "open_loop", signals=["contact_temperature", "k_hat"])
    found = element.evaluate(
        omega=run["omega"],
        speed=run["speed"],
        friction_scale=run["friction_scale_left"],
    )
    temperature = run["contact_temperature"]
    np.testing.assert_allclose(temperature, found["contact_temperature"], rtol=1e-9)
    assert temperature.max() > 10.0


def test_the_memory_of_a_steady_contact_is_that_of_steady_rolling() -> None:
    kept = scenario_of("dry_wet_dry.toml", memory=True)
    run = cl.run_scenario(kept, "open_loop", signals=["unslipped", "sticking", "sticking_left"])
    assert run["unslipped"][0] == run["sticking"][0]
    assert 0.0 < run["sticking"][0] < 1.0
    assert (run["sticking_left"] == run["sticking"]).all()
    assert np.abs(run["unslipped"] - run["sticking"]).max() > 1e-5


def test_every_door_gives_the_same_signals() -> None:
    case = scenario_of("dry_wet_dry.toml")
    run = cl.run_scenario(case, "creep_pi", signals=ASKED)
    assert list(run.signals)[-len(ASKED) :] == list(ASKED)
    last = cl.run_many(
        [case],
        "creep_pi",
        metrics={name: partial(last_of, name) for name in ASKED},
        signals=ASKED,
        step=5e-3,
        tolerance=1e-7,
    )
    assert {name: last[name][0] for name in ASKED} == {name: run[name][-1] for name in ASKED}
    plant = cl.Plant(case)
    first = cl.run_scenario(case, "open_loop", signals=ASKED)
    assert [plant[name] for name in ASKED] == [first[name][0] for name in ASKED]
    assert "k_hat" not in cl.run_scenario(case, "creep_pi").signals
    assert run.to_xarray()["k_hat"].attrs["long_name"] == of_contacts()["k_hat"].description

    torque, _ = controls("rig")
    rig = cl.load_model("roller_rig.toml").wheelset
    free = cl.simulate(rig, torque, initial_speed=10.0, duration=0.1, signals=["k_hat_right"])
    assert free["k_hat_right"] == pytest.approx(rig.element.k_hat)

    vehicle = replace(cl.load_scenario("four_axles.toml"), duration=0.1)
    of_axles = cl.run_scenario(vehicle, "open_loop", signals=["k_hat"])
    assert of_axles["k_hat"].shape == (of_axles.time.size, 4)
    # The rear axles carry more in traction, and k_hat of an ellipse falls with the load.
    loads, k_hats = of_axles["axle_load"][-1], of_axles["k_hat"][-1]
    assert (np.argsort(loads) == np.argsort(-k_hats)).all() or np.ptp(k_hats) == 0.0


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        (["k_hatt"], r"signals: 'k_hatt' is not one; did you mean 'k_hat'\?"),
        ("k_hat", r"signals = 'k_hat' must be a list, such as \['k_hat'\]"),
        (["contact_temperature_left"], r"needs friction that falls with temperature"),
        (["unslipped"], r"'unslipped' needs \[contact\] memory = true"),
    ],
)
def test_signals_that_a_run_does_not_have_are_refused(asked: Any, message: str) -> None:
    case = scenario_of("dry_wet_dry.toml", 0.1, memory=False)
    with pytest.raises(ValueError, match=message):
        cl.run_scenario(case, "open_loop", signals=asked)
    with pytest.raises(ValueError, match=message):
        cl.run_many([case], "open_loop", signals=asked)
    with pytest.raises(ValueError, match=message):
        cl.simulate(case.drivetrain.wheelset, controls("rig")[0], initial_speed=10.0, signals=asked)
