"""Files that are too large, or small and long to read: refused before they take time or memory."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import contactlib as cl
from contactlib.base.writing import MAX_BYTES
from contactlib.files.reading import LONG_KEY

MODEL = Path(cl.files.model_path("roller_rig.toml")).read_text(encoding="utf-8")
HISTORY = ", ".join(["1.0"] * 2_000_000)
LARGE = {
    "keys": "".join(f"k{i} = 1\n" for i in range(1_000_000)) + MODEL,
    "points": f"{MODEL}\n[x]\ntime = [{HISTORY}]\n",
    "comment": MODEL + "#" + "x" * 10_000_000,
}
# tomllib would take hours for these; a child that takes a minute has failed.
DOTTED = {
    "key": "a" + ".a" * 100_000 + " = 1\n",
    "table": "[a" + " . 'b c'" * 100_000 + "]\n",
    "quoted": '"\\""' + '."="' * 100_000 + " = 1\n",
}
DEEP = "".join(f"[k{i}.b.c.d.e.f.g.h.i]\n" for i in range(70_000))
READ = r"""
import re, sys
import contactlib as cl
try:
    cl.load_model(sys.argv[1])
except cl.ModelError as error:
    print(error)
# The resource usage of a process includes that of the one it was forked from.
print(1024 * int(re.search(r"VmHWM:\s*(\d+) kB", open("/proc/self/status").read())[1]))
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="memory in units of Linux")
@pytest.mark.parametrize("name", [*LARGE, *DOTTED, "deep"])
def test_an_untrusted_file_takes_neither_time_nor_memory(tmp_path: Path, name: str) -> None:
    path = tmp_path / "m.toml"
    path.write_text(LARGE.get(name) or DOTTED.get(name, DEEP) + MODEL, encoding="utf-8")
    command = [sys.executable, "-c", READ, str(path)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    output, memory = done.stdout.splitlines()
    assert output == f"{path}: " + (
        "the file is too large: it must have <= 2 MB"
        if name in LARGE
        else "its lists or tables are nested too deeply"
        if name in DOTTED
        else "more than 10000 of its keys have three parts or more"
    )
    assert int(memory) < 1e9


# Each took the square of its length: minutes and more.
SQUARES = {
    "quotes": MODEL + "# " + '\\"' * 200_000,
    "comma": MODEL + "x = " + "=1" * 200_000,
    "unit": MODEL.replace("\nradius =", f'\nradius = "1 a{" " * 1_500_000}b"\nz =', 1),
    "digits": MODEL.replace("\nradius =", f'\nradius = "{"1" * 400_000}_"\nz =', 1),
}


@pytest.mark.parametrize("name", SQUARES)
def test_a_file_up_to_the_limit_takes_time_in_proportion(tmp_path: Path, name: str) -> None:
    path = tmp_path / "m.toml"
    path.write_text(SQUARES[name], encoding="utf-8")
    command = [sys.executable, "-c", READ, str(path)]
    subprocess.run(command, capture_output=True, timeout=60, check=True)


def test_a_column_s_name_takes_time_in_proportion(tmp_path: Path) -> None:
    path = tmp_path / "c.csv"
    path.write_text(",".join(["[" * 130_000] * 14) + "\n1,1\n")
    read = "import sys, contactlib as cl; cl.TractionData.from_csv(sys.argv[1])"
    command = [sys.executable, "-c", read, str(path)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert "no column 'creepage'" in done.stderr


def test_numbers_of_a_curve_have_ascii_digits(tmp_path: Path) -> None:
    path = tmp_path / "c.csv"
    for text in ("1_0", "\u0661"):
        path.write_text(f"creepage,traction_coefficient\n0.01,{text}\n", encoding="utf-8")
        with pytest.raises(ValueError, match="is not a number"):
            cl.TractionData.from_csv(path)


def test_nine_parts_are_a_key_and_ten_are_not() -> None:
    assert not LONG_KEY.search(".".join(["a"] * 9) + " = 0.1")
    assert LONG_KEY.search(".".join(["a"] * 10) + " = 0.1")


@pytest.mark.slow
def test_a_curve_is_read_up_to_the_limit(tmp_path: Path) -> None:
    path, row = tmp_path / "c.csv", "0.01,0.3\n"
    head = "creepage,traction_coefficient\n"
    count = (MAX_BYTES - len(head)) // len(row)
    path.write_text(head + row * count)
    assert cl.TractionData.from_csv(path).creepage.size == count
    path.write_text(head + row * (count + 1))
    with pytest.raises(ValueError, match=r"c\.csv: the file is too large: it must have <= 2 MB"):
        cl.TractionData.from_csv(path)
