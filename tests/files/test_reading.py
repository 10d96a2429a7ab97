"""Readers of untrusted files: right, or refused in one line; never anything else."""

from __future__ import annotations

import datetime
import math
import re
import tomllib
import warnings
from contextlib import suppress
from pathlib import Path

import pytest
import xarray
from broken_files import (
    MODELS,
    READERS,
    changed,
    kind_of,
    places,
    refusal,
    toml_file,
)
from hypothesis import HealthCheck, given
from hypothesis import strategies as st
from strategies import examples

import contactlib as cl
from contactlib.base.quantities import Parameter, declared
from contactlib.files.model import RUN
from contactlib.files.reading import loading, read_section, shipped_files
from contactlib.files.scenario import SECTIONS as OF_SCENARIO
from contactlib.files.sections import VEHICLE_SECTIONS, Keys
from contactlib.runs.sweep.ensemble import read_dataset, write_dataset
from contactlib.runs.sweep.loading import KEYS as OF_SWEEP
from contactlib.runs.sweep.sampling import draw, points, sample, values_of

FILES = sorted((*MODELS.glob("*.toml"), *MODELS.glob("*.csv")))
TOML = [path for path in FILES if path.suffix == ".toml"]
few = examples(60, [HealthCheck.function_scoped_fixture, HealthCheck.too_slow])


def test_shipped_files_are_listed_by_kind() -> None:
    assert shipped_files() == {
        kind: [path.name for path in TOML if kind_of(path) == kind]
        for kind in ("model", "scenario", "sweep")
    }


WORDS = ["", "5 mm", "5 kN", "nan", "1e999 m", "\0", "a\nb", "..", "/x.toml", "x" * 5000, "\u2028"]
WORDS += [path.name for path in TOML]
NUMBERS = [0, -1, 1, 2**63, 10**400, 10**9, 0.0, -0.0, 1e-320, 1e308, -1e308]
DAY = datetime.date(2000, 2, 29)
VALUES = st.recursive(
    st.sampled_from([*WORDS, *NUMBERS, float("nan"), float("inf"), True, False, DAY])
    | st.floats()
    | st.integers(),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(st.sampled_from(["values", "count", "x", "a\nb"]), inner, max_size=3)
    ),
    max_leaves=6,
)


@few
@given(data=st.data())
def test_changed_models_scenarios_and_sweeps(data: st.DataObject, tmp_path: Path) -> None:
    path = data.draw(st.sampled_from(TOML))
    contents = tomllib.loads(path.read_text(encoding="utf-8"))
    for _ in range(data.draw(st.integers(1, 3))):
        where = list(places(contents))
        how = data.draw(
            st.sampled_from(["replace", "replace", "replace", "drop", "nest", "rename"])
        )
        if where:
            changed(contents, data.draw(st.sampled_from(where)), how, data.draw(VALUES))
    made = tmp_path / "made.toml"
    made.write_text(toml_file(contents), encoding="utf-8")
    for kind in ("model", "scenario", "sweep"):
        refusal(kind, made)


@pytest.mark.parametrize("kind", READERS)
@few
@given(data=st.binary(max_size=200))
def test_any_bytes(kind: str, data: bytes, tmp_path: Path) -> None:
    path = tmp_path / "made"
    path.write_bytes(data)
    error = refusal(kind, path)
    assert error is not None or kind == "csv"


# ---- every key ------------------------------------------------------------------------------


SECTIONS: dict[str, Keys] = {
    "model run": RUN,
    **VEHICLE_SECTIONS,
    **OF_SCENARIO,
    **{kind: declared(controller) for kind, controller in cl.CONTROLLERS.items()},
    "sweep": OF_SWEEP,
    **{make.__name__: declared(make) for make in (values_of, points, sample, draw)},
}
EVERY = [
    pytest.param(key, parameter, id=f"{name}.{key}")
    for name, keys in SECTIONS.items()
    for key, parameter in keys.items()
]


@pytest.mark.parametrize("name", ["roller_rig.toml", "four_axles.toml", "wet_patch_sweep.toml"])
def test_a_toml_file_in_another_encoding_says_so(tmp_path: Path, name: str) -> None:
    path, text = tmp_path / name, f"\n# 5 \u2030\n{(MODELS / name).read_text()}"
    wide = "the file is in UTF-16, or no text: save it as UTF-8"
    narrow = "line 2: '\u2030' is not in UTF-8: save the file as UTF-8"
    for encoding, message in (("utf-16", wide), ("utf-16-le", wide), ("cp1252", narrow)):
        path.write_bytes(text.encode(encoding))
        with pytest.raises(cl.ModelError, match=rf"{name}: {re.escape(message)}$"):
            READERS[kind_of(MODELS / name)](path)


@pytest.mark.parametrize(("key", "parameter"), EVERY)
def test_every_key_is_held_to_what_is_declared_of_it(key: str, parameter: Parameter) -> None:
    def error_of(table: dict[str, object]) -> str:
        with pytest.raises(cl.ModelError) as caught:
            read_section("it", {key: parameter}, table)
        return str(caught.value)

    misspelt = f"it.{key}x is not a known key; did you mean {key!r}? known: {key}"
    assert error_of({f"{key}x": 1}) == misspelt  # and not that the right one is missing
    if parameter.needed:
        assert error_of({}) == f"it.{key} is missing"
    if parameter.quantity is None:
        assert re.match(
            rf"it\.{key} = 3 must be (a string|a list|true or false)", error_of({key: 3})
        )
        if parameter.choices and True not in parameter.choices:
            known = ", ".join(parameter.choices)
            assert error_of({key: ""}) == f"it.{key} = '' must be one of: {known}"
            assert error_of({key: "no such"}) == f"it.{key} = 'no such' must be one of: {known}"
        return
    limits = parameter.quantity
    ends = [limits.above, limits.below]
    ends += [math.nextafter(limits.at_least, -math.inf), math.nextafter(limits.at_most, math.inf)]
    for bad in (math.nan, *ends):
        hint = f"; {limits.hint}" if limits.hint else ""
        refused = f"it.{key} = {bad!r} is out of range: must be {limits}{hint}"
        assert error_of({key: [bad] if parameter.many else bad}) == refused
    for wrong in (True, "1 furlong"):
        refused = f"it.{key} = {wrong!r} must be a number in {limits.unit}"
        assert error_of({key: [wrong] if parameter.many else wrong}).startswith(refused)
    if limits.whole:
        broken = [2.5] if parameter.many else 2.5
        assert error_of({key: broken}) == f"it.{key} = 2.5 must be a whole number"
    low, high = limits.usual or (0.0, 0.0)
    for unusual in (1e-3 * low, 1e3 * high):
        if limits.allow(unusual) and not limits.is_usual(unusual):
            doubt = re.escape(f"my.toml: it.{key} = {unusual:g}")
            usual = re.escape(f" is implausible: {low:g} to {high:g}")
            with pytest.warns(cl.InputWarning, match=f"^{doubt}.*{usual}"), loading("my.toml"):
                read_section(
                    "it", {key: parameter}, {key: [unusual] if parameter.many else unusual}
                )
    of_list = error_of({key: 1.0 if parameter.many else [1.0]})
    assert of_list.startswith(f"it.{key} = {1.0 if parameter.many else [1.0]} must be a ")


# ---- sizes ---------------------------------------------------------------------------------


SWEEP = tomllib.loads((MODELS / "friction_and_load_sweep.toml").read_text(encoding="utf-8"))


def sweep_with(**axis: object) -> str:
    """The shipped sweep with these keys in each axis."""
    return toml_file(SWEEP | {"axes": {name: v | axis for name, v in SWEEP["axes"].items()}})


MANY = {
    "counts": (sweep_with(count=10**9), "count = 1000000000 is out of range: must be"),
    "points": (sweep_with(count=10**6), "the grid has 1000000000000 points: at most 10000000"),
    "deep lists": (f"x = {'[' * 100_000}", "nested too deeply"),
    "deep tables": (f"x = {'{a=' * 100_000}", "nested too deeply"),
    "long names": (f"{'x' * 100_000} = 1", "..."),
    "long lists": (toml_file(SWEEP | {"outcomes": {"x": [0.5] * 20_000}}), "outcomes = {'x'"),
    "names of two lines": (r'"a\nb" = 1', r"a\nb is not a known key"),
    "texts of two lines": (
        toml_file(SWEEP | {"axes": "a\r\x1b\nb"}),
        r"'a\r\x1b\nb' must be a section",
    ),
    "huge numbers": (f"axes = 0x{'f' * 100_000}", ""),
}


@pytest.mark.parametrize("name", MANY)
def test_large_and_odd_contents(name: str, tmp_path: Path) -> None:
    text, expected = MANY[name]
    path = tmp_path / "made.toml"
    path.write_text(text, encoding="utf-8")
    for kind in ("model", "scenario"):
        assert refusal(kind, path) is not None
    assert expected in str(refusal("sweep", path))


def test_long_profile_is_read(tmp_path: Path) -> None:
    contents = tomllib.loads((MODELS / "dry_wet_dry.toml").read_text(encoding="utf-8"))
    places = [float(i) for i in range(20_000)]
    contents["track"] = {"distance": places, "friction": [1.0] * len(places)}
    contents["wheelset"] = "locomotive.toml"
    path = tmp_path / "long.toml"
    path.write_text(toml_file(contents), encoding="utf-8")
    assert refusal("scenario", path) is None


# ---- tables and datasets --------------------------------------------------------------------


def test_broken_datasets(tmp_path: Path) -> None:
    path = tmp_path / "x.nc"
    write_dataset(xarray.Dataset({"slip_work": ("run", [0.0, 1.0], {"units": "J"})}), path)
    data = path.read_bytes()
    for place in range(len(data)):
        path.write_bytes(data[:place] + b"\xff" + data[place + 1 :])
        with suppress(ValueError), warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of xarray, about odd attributes
            read_dataset(path)
