"""The FMUs with reference results: FMPy runs each again, in both versions and interfaces.

CONTACTLIB_REFERENCE_FMUS names a folder that `reference_fmus.py` wrote, as that of a release;
without it, this machine's FMUs are written.
"""

from __future__ import annotations

import os
from pathlib import Path

import fmpy
import fmpy.util
import numpy as np
import pytest
from reference_fmus import INTERFACES, NAMES, TOLERANCE, write

from contactlib import kernel

HELD = 100  # parts of a row: FMPy holds the inputs of model exchange for an interval of output
pytestmark = pytest.mark.tools  # in CI those of a release


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if given := os.environ.get("CONTACTLIB_REFERENCE_FMUS"):
        return Path(given)
    made = tmp_path_factory.mktemp("reference")
    write(made, [kernel.platform_name()])
    return made


def test_files_are_those_that_the_readme_names(folder: Path) -> None:
    ends = (".fmi2.fmu", ".fmi3.fmu", "_in.csv", *(f"_{interface}.csv" for interface in INTERFACES))
    expected = {"README.md", *(f"{name}{end}" for name in NAMES.values() for end in ends)}
    assert {path.name for path in folder.iterdir()} == expected
    text = (folder / "README.md").read_text(encoding="ascii")
    assert all(f"`NAME{end}`" in text for end in ends)


@pytest.mark.parametrize("interface", INTERFACES)
@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("name", NAMES.values())
def test_another_tool_gets_the_reference(
    folder: Path, name: str, version: int, interface: str
) -> None:
    fmu = str(folder / f"{name}.fmi{version}.fmu")
    step = float(fmpy.read_model_description(fmu).defaultExperiment.stepSize)
    reference = fmpy.util.read_csv(folder / f"{name}_{interface}.csv")
    simulated = fmpy.simulate_fmu(
        fmu,
        fmi_type={"cs": "CoSimulation", "me": "ModelExchange"}[interface],
        stop_time=reference["time"][-1],
        output_interval=step / (1 if interface == "cs" else HELD),
        relative_tolerance=1e-11,
        input=fmpy.util.read_csv(folder / f"{name}_in.csv"),
        output=list(reference.dtype.names[1:]),
    )
    # At an event there are two rows.
    last = np.append(np.diff(simulated["time"]) > 1e-9, True)
    at = np.abs(simulated["time"][last][:, None] - reference["time"]).argmin(axis=0)
    assert np.abs(simulated["time"][last][at] - reference["time"]).max() < 1e-9
    for output in reference.dtype.names[1:]:
        expected = reference[output]
        size = np.abs(expected).max()
        assert np.abs(simulated[output][last][at] - expected).max() <= TOLERANCE * size, output
        assert np.ptp(expected) > 10.0 * TOLERANCE * size, output  # it shows something
