"""Friction of brake pads in scenario files: lists, and a CSV file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import contactlib as cl

CSV = "# bench\nspeed [km/h];pressure [bar];friction\n108;1;1,1\n0;3;1,2\n0;1;1,4\n108;3;0,9\n"
FILE = 'pads = "pads.csv"'
LISTS = """pad_friction = [1.1, 1.2, 1.4, 0.9]
pad_speed = ["108 km/h", 0.0, 0.0, 30.0]
pad_pressure = [1e5, "3 bar", 1e5, 3e5]"""


def load(folder: Path, pads: str, csv: str = CSV) -> cl.Scenario:
    (folder / "pads.csv").write_text(csv)
    text = Path("models/wheel_slide_protection.toml").read_text()
    new = f"[brake]\npressure = 3e5\ntorque = 1e4\n{pads}\n"
    (folder / "scenario.toml").write_text(text.replace("[brake]\n", new))
    return cl.load_scenario(folder / "scenario.toml")


def test_a_file_of_pads_is_its_lists(tmp_path: Path) -> None:
    expected = [0.0, 30.0], [1e4 / 3.0, 1e4], [[1.4, 1.2], [1.1, 0.9]]
    for pads in (FILE, LISTS):
        brake = load(tmp_path, pads).drivetrain.brake
        for one, other in zip((brake and brake.pads) or (), expected, strict=True):
            np.testing.assert_allclose(one, np.array(other), rtol=1e-12)


@pytest.mark.parametrize(
    ("pads", "csv", "message"),
    [
        ('pads = "../pads.csv"', CSV, r"pads must lie beside the scenario or below"),
        (f"{FILE}\n{LISTS}", CSV, r"replaces pad_speed and pad_pressure and pad_friction: give"),
        (FILE, "", r"brake.pads pads.csv: line 1: it must name the columns speed, pressure, fric"),
        (FILE, "speed,mu\n1,1\n", r"line 1: no column is 'mu'; known: speed"),
        (FILE, "friction,friction\n1,1\n", r"line 1: two columns 'friction'"),
        (FILE, "speed [bar],friction\n1,1\n", r"line 1: speed .*bar"),
        (FILE, "bench 3\nspeed,friction\n1,1\n", r"line 1: line 2 names the columns"),
        (FILE, "speed,friction\n1,-1\n", r"brake.pad_friction = -1.0 is out of range: .* > 0"),
        (FILE, "speed,friction\n1,1\n1,1\n", r"has 2 entries: must have 1, one for each pair"),
    ],
)
def test_mistakes_are_named(tmp_path: Path, pads: str, csv: str, message: str) -> None:
    with pytest.raises(cl.ModelError, match=message):
        load(tmp_path, pads, csv)


def test_friction_coefficients_are_doubted(tmp_path: Path) -> None:
    with pytest.warns(cl.InputWarning, match=r"at most 0.35, and 1 is the nominal .*pad_scale"):
        load(tmp_path, "pad_friction = [0.35]")
    load(tmp_path, "pad_friction = [0.35]\npad_scale = 2.9")
