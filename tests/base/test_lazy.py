"""A library of an extra that is not installed: the error names the extra."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from command_line import call

import contactlib as cl
from contactlib.base.lazy import EXTRAS, optional_library


@pytest.mark.parametrize("library", EXTRAS)
def test_the_error_names_the_extra(library: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(ImportError, match=rf"^{library} is not.*rail\[{EXTRAS[library]}\]'"):
        optional_library(library)


def test_what_a_library_lacks_itself_is_another_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "fmpy.nothing", None)
    with pytest.raises(ModuleNotFoundError, match=r"fmpy\.nothing"):
        optional_library("fmpy.nothing")


@pytest.mark.parametrize(
    ("library", "arguments"),
    [
        ("fmpy", ["demo", "-o", "demo"]),
        ("xarray", ["sweep", "wet_patch_sweep.toml", "-o", "sweep"]),
        ("distributed", ["sweep", "wet_patch_sweep.toml", "--cluster", "tcp://nowhere:1"]),
        ("xarray", ["table", "roller_rig.toml", "-o", "table.csv"]),
    ],
)
def test_a_command_reports_it_before_it_works(
    library: str, arguments: list[str], tmp_path: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(str(tmp_path))
    monkeypatch.setitem(sys.modules, library, None)
    result = call(*arguments)
    assert result.exit_code == 2
    assert f"contactlib: {library} is not installed" in result.stderr


def test_a_wheelset_needs_no_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    for library in EXTRAS:
        monkeypatch.setitem(sys.modules, library, None)
    wheelset = cl.load_model("roller_rig.toml").wheelset
    ramp = cl.TorqueControl(cl.Profile((0.0, 10.0), (26e3, 28e3)))
    run = cl.simulate(wheelset, ramp, initial_speed=10.0)
    assert np.isfinite(run["creepage"]).all()
