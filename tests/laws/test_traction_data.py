"""Measured points from arrays and files; a mistake in a file is one line with its place."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import contactlib as cl
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
        "# made up\n\nspeed, traction_coefficient ,creepage\n# m/s\n10,0.2,0.01\n5,-0.1,-1"
    )
    data = TractionData.from_csv(path)
    assert data.speed is not None
    assert (data.speed.tolist(), data.creepage.tolist()) == ([10.0, 5.0], [0.01, -1.0])
    assert data.traction_coefficient.tolist() == [0.2, -0.1]
    with pytest.raises(ValueError, match="the file has a speed"):
        TractionData.from_csv(path, speed=10.0)


NAMES = "slip_percent;mu;v\n"
AS_IT_IS: dict[str, tuple[str, dict[str, Any]]] = {
    "percent": ("slip_percent,mu,v\n1.5,0.25,36\n3,0.2,36\n", {}),
    "semicolons and decimal commas": (f"{NAMES}1,5;0,25;36\n3;0,2;36,0\n", {}),
    "tabs": ("slip_percent\tmu\tv\n1,5\t0,25\t36\n3\t0,2\t36\n", {}),
    "blanks": ("  slip_percent   mu v\n 1.5   0.25 36\n 3.0  0.20  36\n", {}),
    "quoted": ('"slip_percent","mu","v"\n"1,5","0,25","36"\n"3","0,2","36"\n', {}),
    "comments and empty lines": (
        f"# rig 3\nsep=;\n\n{NAMES}# day 2\n1,5;0,25;36\n;;\n3;0,2;36\n",
        {},
    ),
    "byte order mark": (f"\ufeff{NAMES}1,5;0,25;36\n3;0,2;36\n", {}),
    "other columns": ("t,slip_percent,mu,v,who\n0,1.5,0.25,36,me\n1,3,0.2,36,\n", {}),
    "a unit behind the name": (
        "slip [%],mu (-),v [km/h]\n1.5,0.25,36\n3,0.2,36\n",
        {"columns": ("slip", "mu", "v"), "creepage_unit": None},
    ),
    "a sign behind the name": (
        "slip %;mu;v [km/h]\n1,5;0,25;36\n3;0,2;36\n",
        {"columns": ("slip %", "mu", "v"), "creepage_unit": None},
    ),
    "a row of units": (
        f"{NAMES}[%];[-];[km/h]\n1,5;0,25;36\n3;0,2;36\n",
        {"creepage_unit": None},
    ),
    "a row of units with an empty one": (
        "slip_percent;mu;v;note\n%;;km/h;\n1,5;0,25;36;\n3;0,2;36;\n",
        {"creepage_unit": None},
    ),
    "a row of units with a one": (
        f"{NAMES}%;1;km/h\n1,5;0,25;36\n3;0,2;36\n",
        {"creepage_unit": None},
    ),
    "a force in a row of units": (
        f"{NAMES}%;kN;\n1,5;55;36\n3;44;36\n",
        {"creepage_unit": None, "load": 220e3},
    ),
    "a force with its unit behind the name": (
        "slip_percent;Q [kN];v\n1,5;55;36\n3;44;36\n",
        {"columns": (1, 2, 3), "load": 220e3},
    ),
    "a force in newtons": (
        "creepage,creep_force,speed\n1.5,5e4,36\n3,4e4,36\n",
        {"columns": None, "load": 2e5},
    ),
    "per mille": (
        "slip [\u2030];mu;v\n15;0,25;36\n30;0,2;36\n",
        {"columns": ("slip", "mu", "v"), "creepage_unit": None},
    ),
    "a force in pounds": (
        "slip_percent;Q [lbf];v\n1,5;11240,4471;36\n3;8992,3577;36\n",
        {"columns": (1, 2, 3), "load": 200e3},
    ),
    "no names": ("1.5 0.25 36\n3 0.2 36\n", {"columns": (1, 2, 3)}),
    "trailing separators": (f"{NAMES}1,5;0,25;36;;\n3;0,2;36;;\n", {}),
}


@pytest.mark.parametrize("name", AS_IT_IS)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_a_file_is_read_as_it_is(name: str, encoding: str, tmp_path: Path) -> None:
    text, options = AS_IT_IS[name]
    path = tmp_path / "rig.csv"
    path.write_text(text, encoding=encoding)
    given: dict[str, Any] = {"columns": ("slip_percent", "mu", "v"), "creepage_unit": "%"}
    data = TractionData.from_csv(path, **given | options)
    assert data.creepage.tolist() == pytest.approx([0.015, 0.03], rel=1e-15)
    assert data.traction_coefficient.tolist() == pytest.approx(
        [0.25, 0.2], rel=1e-15 if "lbf" not in text else 1e-8
    )
    assert data.speed is not None
    speed = 10.0 if "km/h" in text else 36.0
    assert data.speed.tolist() == pytest.approx([speed, speed], rel=1e-15)


# Mistakes in files that are read as they are, and in others with columns and unit of their own.
MISTAKES = [
    ("", "line 1: the file is empty"),
    ("# only\ncreepage,force\n1,2\n", "line 2: no column 'traction_coef.*: creepage, force"),
    ("creepage,traction_coefficient\n", "line 1: no data"),
    ("creepage,traction_coefficient\n1,2\n#\n1,2,3\n", "line 4: 3 values for 2 columns"),
    ("creepage,traction_coefficient\n1,two\n", "line 2: traction_coefficient = 'two' is not"),
    ("creepage,traction_coefficient\n1,2\nnan,2\n", "line 3: creepage = nan is out of range"),
    ("creepage,traction_coefficient,speed\n1,2,0\n", "line 2: speed = 0.0 .* > 0"),
    (
        "creepage,traction_coefficient\n0,0.1\n1,0.3\n2,-0.3\n",
        "line 4: traction_coefficient = -0.3 and creepage = 2.0 have opposite signs: both",
    ),
    ("creepage,traction_coefficient\n1,\xb5\n", "line 2: traction_coefficient = "),
]
IN_COLUMNS = [
    (
        "slip_per_cent;mu\n1;2\n",
        r"line 1: no column 'slip_percent'; did you mean 'slip_per_cent'",
    ),
    ("slip_percent,mu\n1,5,0,25\n", "line 2: 4 values for 2 columns; are there decimal commas"),
    ("slip_percent;mu\n1;0.2\n1,5;0.2\n", "line 3: slip_percent = '1,5', but line 2 has anoth"),
    ("slip_percent;mu;mu\n1;0.2;3\n", "line 1: 2 columns 'mu': select one by its number"),
    ("1,0.2\n2,0.1\n", r"line 1: the first row contains numbers.* columns = \[1, 2\]"),
    (
        "slip_percent [km],mu\n1,0.2\n",
        "line 1: slip_percent .km. is in 'km', but creepage_unit",
    ),
    (
        "slip_percent,mu [kN]\n1,0.2\n",
        "line 1: mu .kN. is in 'kN', .* not a unit in 1: divide by the load, with load = ",
    ),
    ("slip_percent;mu\n%;kN\n1;0.2\n", "line 1: mu is in 'kN', .* divide by the load, with lo"),
    (
        "slip_percent,mu [km/h]\n1,0.2\n",
        "line 1: mu .* a unit in 1: divide a slip velocity by .* speed; known are 1, %, permille$",
    ),
    (
        "Rig 7, 1 May\nBy: NN\n\nslip_percent;mu\n1;0.2\n",
        "line 1: line 4 names the columns, so lines 1 to 2 are a preamble: begin each line .* #",
    ),
    ("slip_percent,mu\n1,\n2,0.1\n3,x\n4,\n", "line 2: mu = '' .* number; the same in lines 4, 5$"),
    ('slip_percent,mu\n1,"0.2\n', "line 2: unexpected end of data"),
    ("slip_percent,mu\n1,\n", "line 2: mu = '' is not a number"),
]


@pytest.mark.parametrize(("text", "message"), [*MISTAKES, *IN_COLUMNS])
def test_a_mistake_is_one_line_with_its_place(tmp_path: Path, text: str, message: str) -> None:
    path, options = tmp_path / "rig.csv", dict[str, Any]()
    if (text, message) in IN_COLUMNS:
        options = {"columns": ("slip_percent", "mu"), "creepage_unit": "%"}
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises(ValueError, match=message) as info:
        TractionData.from_csv(path, **options)
    assert str(info.value).startswith(f"{path}: line ")
    assert "\n" not in str(info.value)


def test_a_load_that_does_not_fit_the_force_is_warned_of(tmp_path: Path) -> None:
    path = tmp_path / "rig.csv"
    given: dict[str, Any] = {"columns": (1, 2), "creepage_unit": "%"}
    path.write_text("slip_percent,mu\n1,440\n2,400\n")
    with pytest.warns(cl.InputWarning, match="= 2, .* load = 220 N carry as many wheels"):
        TractionData.from_csv(path, load=220.0, **given)
    path.write_text("slip_percent,mu\n1,55\n2,50\n")
    with pytest.warns(cl.InputWarning, match=r"is 0\.00025 of load = 220000 N.* lack the force"):
        TractionData.from_csv(path, load=220e3, **given)


def test_options_are_checked(tmp_path: Path) -> None:
    columns: Any
    path = tmp_path / "rig.csv"
    path.write_text("a,b\n1,0.2\n")
    for columns in ("ab", ("a",), ("a", "a"), (0, 1), ("a", 1.0), ("a", True)):
        with pytest.raises(ValueError, match=r"columns = .* must be two or three different names"):
            TractionData.from_csv(path, columns=columns)
    with pytest.raises(ValueError, match="column 3 does not exist: there are 2"):
        TractionData.from_csv(path, columns=(1, 3))
    with pytest.raises(ValueError, match="creepage_unit = 'percent' must be '1' or '%'"):
        TractionData.from_csv(path, columns=("a", "b"), creepage_unit="percent")


def test_a_name_with_per_cent_needs_the_unit(tmp_path: Path) -> None:
    path = tmp_path / "rig.csv"
    path.write_text("slip_percent,mu\n0.5,0.2\n1,0.3\n")
    with pytest.raises(ValueError, match=r"is slip_percent in per cent.* creepage_unit = '%'"):
        TractionData.from_csv(path, columns=("slip_percent", "mu"))
    data = TractionData.from_csv(path, columns=("slip_percent", "mu"), creepage_unit="1")
    assert data.creepage.tolist() == [0.5, 1.0]


def test_creepage_that_seems_to_be_in_per_cent_warns(tmp_path: Path) -> None:
    path = tmp_path / "rig.csv"
    path.write_text("creepage,traction_coefficient\n1.5,0.25\n8,0.2\n")
    with pytest.warns(cl.InputWarning, match="line 3: creepage = 8, .* creepage_unit"):
        data = TractionData.from_csv(path)
    assert data.creepage[1] == 8.0
    assert TractionData.from_csv(path, creepage_unit="%").creepage[1] == 0.08


def test_creepage_in_per_cent_without_unit_warns_below_two(tmp_path: Path) -> None:
    path = tmp_path / "rig.csv"
    slip = (0.1, 0.2, 0.4, 0.7, 1.1, 1.9)
    rows = "".join(f"{s},{0.3 * min(1.0, s / 0.5)}\n" for s in slip)
    cases: list[tuple[str, dict[str, Any]]]
    cases = [("slip", {}), ("slip [1]", {}), ("slip", {"creepage_unit": "%"})]
    for name, given in cases:
        path.write_text(f"{name},mu\n{rows}")
        with warnings.catch_warnings(record=True) as warned:
            warnings.simplefilter("always")
            TractionData.from_csv(path, columns=("slip", "mu"), **given)
        texts = [str(warning.message) for warning in warned]
        doubted = name == "slip" and not given
        assert len(texts) == doubted
        assert not doubted or "takes a creepage of 0.4, and above 0.05 is unusual; " in texts[0]


def test_a_coefficient_beyond_any_contact_is_an_error(tmp_path: Path) -> None:
    path = tmp_path / "rig.csv"
    path.write_text("creepage,mu\n0.01,18\n0.02,22\n")
    for load, hint in ((None, r"as in 'mu \[%\]'"), (1.0, "carry as many wheels")):
        with pytest.raises(ValueError, match=rf"line 3: .* = 22 is out of range: .* 5; .*{hint}"):
            TractionData.from_csv(path, columns=("creepage", "mu"), load=load)
    with pytest.raises(ValueError, match=r"traction_coefficient = 18\.0 is out of range"):
        TractionData([0.01, 0.02], [18.0, 22.0])


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


def test_small_tractions_about_zero_may_have_either_sign() -> None:
    data = TractionData([0.0001, 0.01, 0.02], [-0.002, 0.3, 0.29])
    assert data.traction_coefficient[0] == -0.002
    with pytest.raises(
        ValueError, match=r"point 1: .* -0\.05 and the creepage 0\.0001 have opposite signs"
    ):
        TractionData([0.0001, 0.01, 0.02], [-0.05, 0.3, 0.29])


def test_a_coefficient_that_seems_to_be_in_per_cent_is_placed_and_helped(tmp_path: Path) -> None:
    path = tmp_path / "rig.csv"
    path.write_text("creepage,mu\n0.01,0.25\n0.02,3.35\n")
    with pytest.warns(cl.InputWarning, match=r"line 3: .* = 3\.35,.* as in 'mu \[%\]'") as caught:
        TractionData.from_csv(path, columns=("creepage", "mu"))
    assert caught[0].filename == __file__  # not a line of the package
    path.write_text("creepage,mu [%]\n0.01,25\n0.02,33.5\n")
    data = TractionData.from_csv(path, columns=("creepage", "mu"))
    assert data.traction_coefficient.tolist() == [0.25, 0.335]
