"""The folders of the FMI cross-check: their layout, and the references run again by FMPy.

CONTACTLIB_CROSS_CHECK names a folder that `cross_check.py` wrote, as that of a release; without it,
this machine's FMUs are written.
"""

from __future__ import annotations

import os
from pathlib import Path

import fmpy
import fmpy.util
import numpy as np
import pytest
from cross_check import HOW, PLATFORMS, TOOL, write
from fmpy.cross_check.validate_vendor_repo import validate_repo

import contactlib as cl
from contactlib import kernel
from contactlib.export.description import MODEL_NAMES
from contactlib.export.platforms import FMI2_FOLDERS

HERE = [name for name in PLATFORMS if kernel.platform_name() == FMI2_FOLDERS[name][0]]
HELD = 100  # parts of a row: FMPy holds the inputs of model exchange for an interval of output
pytestmark = [
    pytest.mark.tools,  # in CI those of a release
    pytest.mark.skipif(not HERE, reason="the rules do not know this platform"),
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if given := os.environ.get("CONTACTLIB_CROSS_CHECK"):
        return Path(given)
    made = tmp_path_factory.mktemp("cross-check")
    write(made, {name: [kernel.platform_name()] for name in HERE})
    return made


def test_layout_is_that_of_the_rules(folder: Path) -> None:
    platforms = PLATFORMS if "CONTACTLIB_CROSS_CHECK" in os.environ else HERE
    count, results, problems = validate_repo(str(folder))
    assert (problems, results, count) == ([], 0, 2 * len(platforms) * len(MODEL_NAMES))
    named = {
        f"fmus/2.0/{fmi_type}/{platform}/{TOOL}/{cl.__version__}/{name}/{file}"
        for fmi_type in HOW
        for platform in platforms
        for name in MODEL_NAMES.values()
        for file in (
            "README.md",
            *(f"{name}{end}" for end in (".fmu", "_in.csv", "_ref.csv", "_ref.opt")),
        )
    }
    assert {p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file()} == named
    for path in folder.rglob("*.csv"):
        assert path.stat().st_size < 1e6  # as the rules say


@pytest.mark.parametrize("fmi_type", HOW)
@pytest.mark.parametrize("name", MODEL_NAMES.values())
def test_another_tool_gets_the_reference(folder: Path, name: str, fmi_type: str) -> None:
    place = folder / "fmus" / "2.0" / fmi_type / HERE[0] / TOOL / cl.__version__ / name
    options = fmpy.util.read_ref_opt_file(place / f"{name}_ref.opt")
    reference = fmpy.util.read_csv(place / f"{name}_ref.csv")
    assert reference["time"][[0, -1]].tolist() == [options["StartTime"], options["StopTime"]]
    found = fmpy.simulate_fmu(
        str(place / f"{name}.fmu"),
        fmi_type={"cs": "CoSimulation", "me": "ModelExchange"}[fmi_type],
        stop_time=options["StopTime"],
        output_interval=options["OutputIntervalLength"] / (1 if fmi_type == "cs" else HELD),
        relative_tolerance=1e-11,
        input=fmpy.util.read_csv(place / f"{name}_in.csv"),
        output=list(reference.dtype.names[1:]),
    )
    # At an event there are two rows.
    last = np.append(np.diff(found["time"]) > 1e-9, True)
    at = np.abs(found["time"][last][:, None] - reference["time"]).argmin(axis=0)
    assert np.abs(found["time"][last][at] - reference["time"]).max() < 1e-9
    for output in reference.dtype.names[1:]:
        expected = reference[output]
        size = np.abs(expected).max()
        assert np.abs(found[output][last][at] - expected).max() <= options["RelTol"] * size, output
        assert np.ptp(expected) > 10.0 * options["RelTol"] * size, output  # it shows something
