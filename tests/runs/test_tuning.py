"""Search for settings of controllers, and sensors that err."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from own_controller import SlipPI
from plain_scenario import wet_patch

import contactlib as cl
from contactlib.files.scenario import ControllerDesign
from contactlib.runs.tuning import UNSEEN, erring
from contactlib.traction import Measurement
from contactlib.traction.search import WIDEST

LIMITED = "limited_utilisation"


@pytest.fixture(scope="module")
def patch() -> cl.Scenario:
    """The wet patch, shorter."""
    track = cl.Track(friction_left=cl.Profile((30.0, 30.0, 70.0, 70.0), (1.0, 0.545, 0.545, 1.0)))
    return wet_patch(track=track, duration=8.0)


@pytest.mark.slow
def test_a_search_mends_a_controller_that_somebody_has_spoilt(patch: cl.Scenario) -> None:
    spoilt = ControllerDesign("threshold", {"ramp_time": 8.0, "reapply_fraction": 0.4})
    scenario = replace(patch, controllers={"spoilt": spoilt})
    tuning = cl.tune([scenario], "spoilt", trials=120, seeds=2)
    assert tuning.trials == 120
    assert tuning.tuned.shape == (1, 2, 10)
    assert tuning.tuned.mean() > tuning.designed.mean() + 0.05
    assert all(1.0 / WIDEST <= factor <= WIDEST for factor in tuning.factors.values())
    # The outcomes are those of the controller found, with noise that the search has not seen.
    again = cl.run_many(
        [replace(patch, controllers={"found": tuning.controllers[0]})] * 10,
        "found",
        [LIMITED],
        index=range(UNSEEN, UNSEEN + 10),
    )
    assert np.array_equal(again[LIMITED], tuning.tuned[0, 0])


@pytest.mark.slow
def test_a_search_gives_the_same_each_time_and_nothing_worse_than_the_design(
    patch: cl.Scenario,
) -> None:
    first, second = (cl.tune([patch], "creep_pi", trials=60, seeds=1) for _ in range(2))
    assert first.factors == second.factors
    tried, design = (
        cl.run_many([replace(patch, controllers={"x": c})], "x", [LIMITED, "utilisation"])
        for c in (first.controllers[0], patch.controller("creep_pi"))
    )
    assert sum(float(tried[n][0]) for n in tried) >= sum(float(design[n][0]) for n in design)


@pytest.mark.slow
def test_settings_are_read_from_a_file_as_they_were_found(
    patch: cl.Scenario, tmp_path: Path
) -> None:
    file = Path(cl.files.model_path("dry_wet_dry.toml"))
    text = file.read_text().split("[controllers")[0]
    for name in ("threshold", "creep_pi", "slope_seeking"):
        tuning = cl.tune([replace(patch, duration=4.0)], name, trials=60, seeds=1)
        path = tmp_path / f"{name}.toml"
        path.write_text(text + tuning.section(name, patch.controllers[name]))
        read = cl.load_scenario(path).controller(name)
        keys = [*tuning.factors, *(["reference_torque"] if name == "creep_pi" else [])]
        for key in keys:
            assert getattr(read, key) == pytest.approx(
                getattr(tuning.controllers[0], key), rel=5e-4
            )


class Held(SlipPI):
    """A controller with a state, which holds much too little slip."""

    search_ranges: ClassVar = {"slip": (0.001, 0.4)}

    def __init__(self, slip: float = 0.002) -> None:
        super().__init__(slip)


@dataclass  # neither frozen nor hashable
class Share:
    """A controller of many wheelsets."""

    sample_time: float = 0.01
    share: float = 0.2
    search_ranges: ClassVar = {"share": (0.1, 1.0)}

    def start(self, measurement: Measurement[Any], torque: Any) -> None:
        return None

    def sample(self, measurement: Measurement[Any], memory: None) -> tuple[Any, None]:
        return self.share * measurement.demand, None


@pytest.mark.parametrize(
    ("control", "name"),
    [pytest.param(Held(), "slip", marks=pytest.mark.slow), (Share(), "share")],
)
def test_a_controller_of_your_own_is_searched_as_it_declares(
    patch: cl.Scenario, control: Any, name: str
) -> None:
    short = replace(patch, duration=2.0, controllers={"mine": control})
    other = replace(short, initial_speed=8.0)
    tuning = cl.tune([short, other], "mine", trials=60)
    low, high = control.search_ranges[name]
    value = getattr(tuning.controllers[0], name)
    assert low <= value <= high
    assert value == pytest.approx(tuning.factors[name] * getattr(control, name))
    assert value > 2.0 * getattr(control, name)
    assert (tuning.tuned > tuning.designed + 0.1).all()
    section = tuning.section("mine", control)
    assert section.startswith(f"# mine is a controller of your own: {type(control).__name__}(")
    assert f"{name}={value:.4g}" in section
    with pytest.raises(ValueError, match="must be what the scenario has as mine"):
        tuning.section("mine", "threshold")


def test_scenarios_of_one_name_are_refused(patch: cl.Scenario) -> None:
    control = patch.controller("threshold")
    with pytest.raises(ValueError, match="two of the scenarios have the name 'Wet patch on dry "):
        cl.runs.sensor_errors([patch, patch], {"threshold": [control, control]}, noises=2)


def test_what_cannot_be_searched_reports_it(patch: cl.Scenario) -> None:
    mixed = replace(patch, controllers={"threshold": Held()})
    with pytest.raises(ValueError, match="one class in all scenarios: ThresholdControl, Held"):
        cl.tune([patch, mixed], "threshold")
    with pytest.raises(ValueError, match=r"such as \[scenario\]"):
        cl.tune(patch, "threshold")  # type: ignore[arg-type]


def test_an_error_of_the_sensors_is_that_of_a_scenario_with_it(patch: cl.Scenario) -> None:
    patch, control = replace(patch, duration=4.0), patch.controller("threshold")
    errors = cl.runs.sensor_errors([patch], {"threshold": [control]}, noises=2)
    assert errors.dims == ("scenario", "controller", "error", "noise")
    biased = replace(patch, sensors=replace(patch.sensors, vehicle_speed_bias=-0.02))
    index = range(UNSEEN, UNSEEN + 2)
    for case, error in ((patch, "as in the file"), (biased, "vehicle speed -2 %")):
        expected = cl.run_many([case] * 2, control, [LIMITED], index=index)[LIMITED]
        assert np.array_equal(errors.sel(error=error).values[0, 0], expected)
    silent = erring(patch.sensors, control.sample_time)["noise x 0"]
    assert silent.wheel_speed_noise == silent.vehicle_speed_noise == 0.0
    assert erring(patch.sensors, 0.01)["delay + 20 ms"].delay == pytest.approx(0.03)
