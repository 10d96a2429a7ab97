"""Fingerprints of code and numbers: what changes them and what does not."""

from __future__ import annotations

import subprocess
import sys
import threading
from typing import Any

import pytest

import contactlib as cl
from contactlib.runs.sweep.fingerprint import fingerprint

SOURCE = """
import dataclasses, functools, math
import numpy as np
import contactlib as cl

GAIN, NAMES = 2.0, {"a", "b", "c"}

def limited(torque, demand):
    return min(torque, demand)

@functools.cache
def scaled(torque):
    return 1.0 * torque

class Base(cl.SampledController):
    sample_time = 0.01
    def reset(self, measurement, torque):
        self.last = 1.0

def gain_of(scale):
    return lambda torque: scale * torque

gained = gain_of(1.0)

@dataclasses.dataclass
class Mine(Base):
    gain: float = 1.0
    table: object = dataclasses.field(default_factory=lambda: np.array([0.0, 1.0]))
    def torque(self, measurement):
        if "a" in NAMES and "d" not in {"d", "e", "f"}:
            return limited(scaled(gained(self._part(measurement))), measurement.demand)
        return [math.sin(x) for x in (GAIN,)][0]
    @staticmethod
    def _part(measurement):
        return 0.5 * measurement.demand
    @property
    def half(self):
        return 0.5
    @functools.cached_property
    def third(self):
        return 0.33

made = Mine()
made.itself = made
"""


def made(source: str = SOURCE) -> Any:
    known: dict[str, Any] = {"__name__": "__main__"}
    exec(source, known)  # noqa: S102 - of our own making
    return known["made"]


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("GAIN, NAMES = 2.0", "GAIN, NAMES = 2.5"),
        ('{"a", "b", "c"}', '{"a", "b"}'),
        ('{"d", "e", "f"}', '{"d", "e"}'),
        ("min(torque, demand)", "max(torque, demand)"),
        ("return 1.0 * torque", "return 1.1 * torque"),
        ("gain_of(1.0)", "gain_of(1.1)"),
        ("sample_time = 0.01", "sample_time = 0.02"),
        ("self.last = 1.0", "self.last = 2.0"),
        ("gain: float = 1.0", "gain: float = 2.0"),
        ("[0.0, 1.0]", "[0.0, 1.5]"),
        ("0.5 * measurement", "0.6 * measurement"),
        ("return 0.5\n", "return 0.6\n"),
        ("return 0.33", "return 0.34"),
        ("math.sin(x)", "math.cos(x)"),
        ("made = Mine()", "made = Mine(gain=3.0)"),
        ("itself = made", "itself = None"),
    ],
)
def test_any_change_of_code_or_numbers_is_noticed(old: str, new: str) -> None:
    assert SOURCE.count(old) == 1
    assert fingerprint(made(SOURCE.replace(old, new))) != fingerprint(made())


@pytest.mark.slow
def test_comments_places_and_what_is_not_used_do_not_count(monkeypatch: pytest.MonkeyPatch) -> None:
    known = fingerprint(made())
    moved = SOURCE.replace("GAIN, N", "# what it gains\n\nUNUSED = 3\nGAIN, N")
    assert fingerprint(made(moved)) == known
    code = (
        "import sys; from contactlib.runs.sweep.fingerprint import fingerprint\n"
        f"{SOURCE}\nprint(fingerprint(made))"
    )
    monkeypatch.setenv("PYTHONHASHSEED", "1")  # another order of sets
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == known


def test_a_wheelset_in_a_controller_counts_by_its_numbers() -> None:
    names = ("roller_rig.toml", "roller_rig.toml", "locomotive.toml")
    one, same, other = (cl.load_model(name).wheelset for name in names)
    known = fingerprint(one)
    cl.find_fold(one, speed=10.0)  # what it derives does not count
    assert fingerprint(one) == fingerprint(same) == known != fingerprint(other)


def test_what_cannot_be_read_is_never_the_same() -> None:
    lock = threading.Lock()
    assert fingerprint(lock) != fingerprint(lock)
