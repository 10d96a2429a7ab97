"""Every example draws or writes the file that its docstring promises, and prints its numbers."""

from __future__ import annotations

import ast
import re
import runpy
from pathlib import Path

import matplotlib.pyplot as plt
import pytest
from outside_tools import module

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
PRINTED = {
    "creep_curve": "k_hat 0.30: maximum 1.1350 at 1.1316 times",
    "delay": "a delay of 10 ms leaves a gain from 7.00 m/s on",
    "far_tail": "of the stops are longer than 470 m",
    "fmu": "creep_force  FMU 43484.8, simulate 43484.8",
    "fold": "fold predicted at 27314 N.m, passed at 27325 N.m",
    "lateral_spin": "spin 0.2 1/m: 9633 N along, -4976 N across",
    "learning": "cut and re-apply: 0.944",
    "measured_curve": "fit residual 0.0246",
    "nmpc": "Predictive     98.",
    "own_controller": "HoldSlip   86.1 %",
    "own_loop": "with the cut: 0 slip away",
    "sweep": "creep_pi       89.3 %, 95.8 %, 97.2 %",
    "wet_patch": "creep_pi       uses  97.6 % while friction limits",
}

NEEDS = {"far_tail": "openturns", "nmpc": "casadi"}


def test_every_example_is_here() -> None:
    assert sorted(path.stem for path in EXAMPLES.glob("*.py")) == sorted(PRINTED)


@pytest.mark.slow
@pytest.mark.parametrize("name", PRINTED)
def test_an_example_keeps_its_promise(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    if name in NEEDS:
        module(NEEDS[name])
    monkeypatch.chdir(tmp_path)
    path = EXAMPLES / f"{name}.py"
    runpy.run_path(str(path), run_name="__main__")
    plt.close("all")
    assert PRINTED[name] in capsys.readouterr().out
    text = path.read_text(encoding="ascii")
    assert len(text.splitlines()) <= (100 if name == "nmpc" else 40)
    promised = ast.get_docstring(ast.parse(text)) or ""
    for file in re.findall(r"(?:Draws|Writes) (\w+\.\w+)", promised):
        assert (tmp_path / file).stat().st_size > 1000
