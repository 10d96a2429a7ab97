"""Settings that controllers declare for a search, and controllers that are made with others."""

from __future__ import annotations

import dataclasses
import re
from typing import Any, ClassVar

import pytest

import contactlib as cl
from contactlib.traction import CONTROLLERS, Measurement
from contactlib.traction.search import WIDEST, Searched


class Mine(cl.SampledController):
    """As a user writes it: what `__init__` derives from its arguments is not an argument."""

    sample_time = 0.01
    search_ranges: ClassVar[Any] = {"slip": (0.02, 0.5), "gain": (1e3, 5e4)}

    def __init__(self, slip: float = 0.1, gain: float = 5e3, name: str = "mine") -> None:
        self.slip, self.gain, self.name = slip, gain, name
        self.step = 0.1 * gain

    def torque(self, measurement: Measurement[float]) -> float:
        return measurement.demand


def ranging(ranges: Any) -> Mine:
    """Controller that only declares its settings."""

    class Ranged(Mine):
        search_ranges: ClassVar[Any] = ranges

    return Ranged()


class Converts(Mine):
    def __init__(self, slip: float = 0.36, gain: float = 5e3) -> None:
        super().__init__(slip / 3.6, gain)


class Forgets(Mine):
    search_ranges: ClassVar = {"slip": (0.02, 0.5)}

    def __init__(self, slip: float = 0.1, lag: float = 0.0) -> None:
        super().__init__(slip)


class Stumbles(Mine):
    def __init__(self, slip: float = 0.1, gain: float = 5e3) -> None:
        super().__init__(slip, gain)
        if slip > 0.3:
            raise KeyError("slip")
        if gain > 1e4:
            raise ValueError("gain and slip contradict each other")


def test_a_controller_is_made_anew_with_what_follows_from_its_settings() -> None:
    control = Mine(0.2, name="other")
    searched = Searched("mine", control)
    made = searched.changed({"slip": 2.0, "gain": 0.5})
    assert (made.slip, made.gain, made.step, made.name) == (0.4, 2.5e3, 250.0, "other")
    assert control.slip == 0.2  # as before
    assert searched.factors("slip") == pytest.approx((0.1, 2.5))
    widest = dict.fromkeys(searched.ranges, 1e6)
    assert (searched.changed(widest).slip, searched.changed(widest).gain) == (0.5, 5e4)


def test_settings_that_contradict_each_other_make_no_controller() -> None:
    searched = Searched("mine", Stumbles())
    assert searched.changed({"slip": 1.0, "gain": 3.0}) is None
    with pytest.raises(
        RuntimeError, match=r"Stumbles with \{'slip': 0.4\}: KeyError: 'slip' \(tes"
    ):
        searched.changed({"slip": 4.0})


@pytest.mark.parametrize(
    ("control", "message"),
    [
        (
            ranging(None),
            "x: the class Ranged declares no settings to search: write into it search_ranges = "
            "{'slip': (0.025, 0.4), 'gain': (1250.0, 20000.0)}, the lowest and the highest value",
        ),
        (CONTROLLERS["open_loop"](), "x is an OpenLoop, which has no settings to search"),
        (
            ranging({"slib": (0.02, 0.5)}),
            "x: Ranged.search_ranges: 'slib' is not an argument of the class; did you",
        ),
        (
            ranging({"name": (0.02, 0.5)}),
            "x: Ranged.search_ranges['name'] = (0.02, 0.5) must be the lowest and the high",
        ),
        (ranging({"slip": (0.2, 0.5)}), "two numbers of one sign, and slip = 0.1 between them"),
        (
            ranging({"slip": (0.0, 0.5)}),
            "x: Ranged.search_ranges['slip'] = (0.0, 0.5) must be the lowest",
        ),
        (ranging({"slip": 0.5}), "x: Ranged.search_ranges['slip'] = 0.5 must be the lowest"),
        (Converts(), "keeps slip = 0.02777"),
        (Forgets(), "Forgets must keep its argument lag as self.lag, as a search makes"),
    ],
)
def test_what_cannot_be_searched_is_reported(control: Any, message: str) -> None:
    with pytest.raises(ValueError, match=re.escape(message)):
        Searched("x", control)


@pytest.mark.parametrize("kind", ["threshold", "creep_pi", "slope_seeking"])
def test_a_shipped_controller_is_searched_around_its_design(kind: str) -> None:
    control: Any = cl.load_scenario("dry_wet_dry.toml").controller(kind)
    searched = Searched(kind, control)
    for name, (low, high) in searched.ranges.items():
        value, limits = getattr(control, name), control.quantities()[name]
        assert low == max(value / WIDEST, limits.at_least)
        assert high == value * WIDEST or not limits.allow(value * WIDEST)
        assert limits.allow(low)
        assert limits.allow(high)
    zero = dataclasses.replace(control, speed_filter_time=0.0)
    assert "speed_filter_time" not in Searched(kind, zero).ranges
