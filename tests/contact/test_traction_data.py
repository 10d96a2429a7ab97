"""Measured points from arrays and files; a mistake in a file is one line that says where."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from contactlib import TractionData
from contactlib.base.writing import package_folder

EUROSPRINTER = package_folder("models") / "eurosprinter_engel1998.csv"


def test_the_shipped_measurement() -> None:
    data = TractionData.from_csv(EUROSPRINTER, speed=10.0)
    assert data.speed is not None
    assert data.creepage.shape == data.traction_coefficient.shape == data.speed.shape == (151,)
    assert (data.creepage[0], data.traction_coefficient[-1]) == (0.003699, 0.2115)
    assert "Engel, Beck & Alders" in EUROSPRINTER.read_text(encoding="ascii")


def test_columns_come_in_any_order_and_with_comments(tmp_path: Path) -> None:
    path = tmp_path / "curve.csv"
    path.write_text(
        "# made up\n\nspeed, traction_coefficient ,creepage\n# m/s\n10,0.2,0.01\n5,0.1,-1"
    )
    data = TractionData.from_csv(path)
    assert data.speed is not None
    assert (data.speed.tolist(), data.creepage.tolist()) == ([10.0, 5.0], [0.01, -1.0])
    assert data.traction_coefficient.tolist() == [0.2, 0.1]
    with pytest.raises(ValueError, match="line 3: the file has a speed"):
        TractionData.from_csv(path, speed=10.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "line 1: the columns are ''"),
        ("# only\ncreepage,force\n1,2\n", "line 2: the columns are 'creepage,force'"),
        ("creepage,traction_coefficient\n", "line 1: no data"),
        ("creepage,traction_coefficient\n1,2\n#\n1,2,3\n", "line 4: 3 values for 2 columns"),
        ("creepage,traction_coefficient\n1,two\n", "line 2: traction_coefficient = 'two' is not"),
        ("creepage,traction_coefficient\n1,2\nnan,2\n", "line 3: creepage = nan is out of range"),
        ("creepage,traction_coefficient,speed\n1,2,0\n", "line 2: speed = 0.0 .* > 0"),
        ("creepage,traction_coefficient\n1,\xb5\n", "line 2: traction_coefficient = "),
    ],
)
def test_a_bad_file_is_one_line_with_its_place(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "curve.csv"
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises(ValueError, match=message) as info:
        TractionData.from_csv(path)
    assert str(info.value).startswith(f"{path}: ")
    assert "\n" not in str(info.value)


def test_bad_arrays_are_refused() -> None:
    with pytest.raises(ValueError, match="one length"):
        TractionData([0.1, 0.2], [0.3])
    with pytest.raises(ValueError, match="at least 1"):
        TractionData([], [])
    with pytest.raises(ValueError, match=r"traction_coefficient = nan"):
        TractionData([0.1], [np.nan])
    with pytest.raises(ValueError, match=r"speed = 0\.0"):
        TractionData([0.1], [0.3], speed=0)


def test_points_do_not_change() -> None:
    source = np.array([0.1, 0.2])
    data = TractionData(source, source)
    source[0] = 5.0
    assert data.creepage[0] == 0.1
    with pytest.raises(ValueError, match="read-only"):
        data.creepage[0] = 5.0
