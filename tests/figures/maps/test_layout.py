"""What a figure of a sweep shows along which axis, and its words."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from map_data import DESCRIBED, FRICTION, LOAD, analysed, compared, grid
from numpy.testing import assert_allclose, assert_array_equal
from strategies import examples

from contactlib.figures import draw_maps, map_figure
from contactlib.figures.maps.layout import layout
from contactlib.figures.maps.meaning import words
from contactlib.files import model_path


def test_long_axes_are_those_of_the_map() -> None:
    def outcome(a: Any, b: Any, c: Any, d: Any) -> Any:
        return a + b + c + d

    made = grid(
        {"critical_torque": outcome}, length=[1, 2, 3], friction=FRICTION, damping=[1, 2], load=LOAD
    )
    chosen = layout(made, "critical_torque")
    assert [axis.name for axis in chosen.axes] == ["friction", "load"]
    assert chosen.further is not None
    assert chosen.further.name == "length"
    assert chosen.note == "Shown at damping of the drive 2\u00a0N m s."
    assert [case.further for case in chosen.cases] == [
        f"length of the patch {i}\u00a0m" for i in (1, 2, 3)
    ]
    load, friction = np.meshgrid(LOAD, FRICTION, indexing="ij")
    for length, case in zip((1.0, 2.0, 3.0), chosen.cases, strict=True):
        assert_allclose(case.values, length + friction + 2.0 + load)


def test_an_axis_that_does_not_matter_is_left_out() -> None:
    chosen = layout(analysed()[["torque_margin"]], "torque_margin")
    assert [axis.name for axis in chosen.axes] == ["load"]
    assert chosen.note == f"Does not depend on {DESCRIBED['friction'][1]}."
    assert_allclose(chosen.cases[0].values, LOAD / 205e3 - 1.0)


def test_captions_break_no_word_and_sentences_end_once() -> None:
    made = analysed().copy(deep=True)
    made.attrs |= {
        "source": "Scenario: mine.toml; the rest\n is chosen.\n ",
        "vehicle": json.dumps(tomllib.loads(model_path("locomotive.toml").read_text())),
    }
    long = "undividable" * 6
    for axis in made.coords.values():
        axis.attrs["long_name"] = f"{long}, axis {axis.name} of a stress-intensity"
    figure = map_figure(made, "critical_torque")
    caption = " ".join(figure.legends[0].get_title().get_text().split("\n")).replace("\u00a0", " ")
    assert "the rest is chosen. Unless varied: " in caption
    assert "$f_s$ 0.45" in caption
    assert "2 wheels of $P$ 110.3 kN" in caption
    assert not re.search(r"\.\s*\.", caption)
    assert caption.endswith(".")
    labels = [label for axes in figure.axes for label in (axes.get_xlabel(), axes.get_ylabel())]
    for label in labels[:2]:
        assert long in label
        assert "stress-intensity" in label


@pytest.mark.parametrize("vehicle", ["", "no JSON", "[1]", '{"contact": 3}', '{"law": {}}'])
def test_a_sweep_without_a_wheelset_is_drawn_too(vehicle: str) -> None:
    made = analysed().copy(deep=True)
    made.attrs["vehicle"] = vehicle
    caption = map_figure(made, "critical_torque").legends[0].get_title().get_text()
    assert "Unless" not in caption


def test_an_axis_without_a_label_is_named_in_words() -> None:
    made = analysed().copy(deep=True)
    made["load"].attrs["long_name"] = "vehicle.contact.normal_load"
    assert words(made["load"]).name == "vehicle contact normal load"
    made["load"].attrs["long_name"] = "load (max. of 2)"
    assert words(made["load"]).name == "load (max. of 2)"


def test_values_are_sorted_and_at_most_nine_maps_are_drawn() -> None:
    length = np.arange(20.0)[::-1]
    made = grid(
        {"critical_torque": lambda f, p, s: f + p + s},
        friction=FRICTION[::-1],
        load=LOAD,
        length=length,
    )
    chosen = layout(made, "critical_torque")
    assert_array_equal(chosen.axes[0], FRICTION)
    assert chosen.further is not None
    assert len(chosen.cases) == 9
    assert_array_equal(chosen.further[[0, -1]], [0.0, 19.0])
    for at, case in zip(chosen.further.values, chosen.cases, strict=True):
        assert_allclose(case.values, FRICTION + LOAD[:, None] + at)


SIZES = {"": 1.0, "m": 1e-3, "k": 1e3, "M": 1e6, "G": 1e9}


@examples(60)
@given(st.floats(-2.0, 11.0), st.sampled_from(["N", "N.m", "J", "s", "m"]))
def test_prefixes_keep_the_quantity(power: float, unit: str) -> None:
    array = xr.DataArray([0.0, -(10.0**power)], name="x", attrs={"units": unit})
    found = words(array)
    prefix = found.unit.removesuffix(unit.replace(".", " "))
    assert found.factor * SIZES[prefix] == pytest.approx(1.0)
    if -3.0 < power < 12.0 and unit in {"N", "N.m", "J"}:
        assert 10.0**power * found.factor < 1e3 * 1.000001


def test_labels() -> None:
    def label(name: str, unit: str, value: float, **attrs: str) -> str:
        return words(xr.DataArray([value], name=name, attrs={"units": unit, **attrs})).label

    assert label("largest_creepage", "1", 0.1, display_units="%") == "largest creepage  [%]"
    assert label("jerk", "m/s3", 2.0) == "jerk  [m/s$^3$]"
    assert label("critical_torque", "N.m", 2e4, long_name="a sentence") == "critical torque  [kN m]"
    axis = xr.DataArray([2e4], dims="mass", name="mass", attrs={"units": "kg", "long_name": "US$"})
    assert words(axis.assign_coords(mass=axis)["mass"]).label == r"US\$  [t]"


def test_every_outcome_has_its_files(tmp_path: Path) -> None:
    made = compared().isel(length=0, drop=True)
    made["seed"] = 1.0  # of no axis
    written = draw_maps(made, tmp_path / "new" / "maps")
    expected = ["adhesion_utilisation", "slip_work", "recovery_time"]
    assert [path.name for path in written] == [
        f"{n}.{kind}" for n in expected for kind in ("png", "svg")
    ]
    assert all(path.stat().st_size > 1000 for path in written)


def test_unknown_outcomes_are_refused() -> None:
    message = "outcome = 'stabel' must be one of: critical_torque, .*stable"
    with pytest.raises(ValueError, match=message):
        map_figure(analysed(), "stabel")
