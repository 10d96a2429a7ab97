"""The kernel's own mathematics, beside mpmath's."""

from __future__ import annotations

import ctypes
import subprocess
from collections.abc import Callable
from pathlib import Path

import mpmath
import numpy as np
import pytest
from native_programs import NATIVE, SANITIZED, standalone

from contactlib import kernel
from contactlib.base.quantities import FloatArray

ULP = 2.0**-52
RANDOM = np.random.default_rng(11)
"""Arguments are the same in every run."""

# Of C's library: what IEEE 754 defines to the last bit.
EXACT = {"ceil", "copysign", "fabs", "floor", "fmax", "fmin", "fmod", "rint", "sqrt", "trunc"}


def powers_of_ten(low: float, high: float, count: int = 3000) -> FloatArray:
    return 10.0 ** RANDOM.uniform(low, high, count)


def both_signs(values: FloatArray) -> FloatArray:
    return np.concatenate([values, -values])


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    source = NATIVE / "simd_math_functions.c"
    return standalone(source, tmp_path_factory.mktemp("simd_math"), *SANITIZED)


def values(program: Path, name: str, a: FloatArray, b: FloatArray) -> list[float]:
    lines = (f"{name} {x.hex()} {y.hex()}\n" for x, y in zip(a.tolist(), b.tolist(), strict=True))
    ran = subprocess.run(
        [str(program)], input="".join(lines), capture_output=True, text=True, check=True
    )
    return [float.fromhex(line) for line in ran.stdout.split()]


Exact = Callable[[mpmath.mpf, mpmath.mpf], mpmath.mpf]


def exact_power(ratio: mpmath.mpf, exponent: mpmath.mpf) -> mpmath.mpf:
    return mpmath.power(ratio, exponent)


@pytest.mark.tools
@pytest.mark.parametrize(
    ("name", "exact", "a", "b", "ulps"),
    [
        ("decaying_exponential", lambda v, _: mpmath.exp(-v), RANDOM.uniform(0, 700, 3000), 0, 1),
        ("exponential", lambda v, _: mpmath.exp(v), RANDOM.uniform(-700, 700, 3000), 0, 1),
        ("exponential", lambda v, _: mpmath.exp(v), both_signs(powers_of_ten(-20, 0)), 0, 1),
        ("logarithm", lambda v, _: mpmath.log(v), powers_of_ten(-307, 308), 0, 1),
        ("logarithm", lambda v, _: mpmath.log(v), RANDOM.uniform(0.5, 2.0, 3000), 0, 1),
        # It keeps its digits near 1, where it is small.
        ("logarithm", lambda v, _: mpmath.log(v), 1 + both_signs(powers_of_ten(-15, -1)), 0, 1),
        ("cube_root", lambda v, _: mpmath.cbrt(v), powers_of_ten(-307, 308), 0, 1),
        ("cube_root", lambda v, _: mpmath.cbrt(v), powers_of_ten(-1, 1), 0, 1),
    ],
)
def test_value_is_exact_to_its_last_digits(
    program: Path,
    name: str,
    exact: Exact,
    a: FloatArray,
    b: FloatArray | float,
    ulps: float,
) -> None:
    a, second = a[::5], (np.zeros_like(a) + b)[::5]
    with mpmath.workdps(40):
        expected = [exact(mpmath.mpf(x), mpmath.mpf(y)) for x, y in zip(a, second, strict=True)]
        computed = values(program, name, a, second)
        errors = [abs(v / e - 1) for v, e in zip(computed, expected, strict=True)]
    assert max(errors) <= ulps * ULP


@pytest.mark.tools
@pytest.mark.parametrize("decades", [0.01, 1.0, 10.0, 100.0])
def test_power_loses_what_its_logarithm_has_of_digits_before_the_point(
    program: Path, decades: float
) -> None:
    ratio, exponent = both_signs(powers_of_ten(-8.0, 0.0)) * decades, RANDOM.uniform(0, 1, 6000)
    ratio, exponent = 10.0 ** ratio[::5], exponent[::5]
    powers = values(program, "power_of", ratio, exponent)
    with mpmath.workdps(40):
        for x, y, v in zip(ratio, exponent, powers, strict=True):
            size = 1 + abs(y * mpmath.log(mpmath.mpf(x)))
            assert abs(v / exact_power(mpmath.mpf(x), mpmath.mpf(y)) - 1) <= ULP * size


@pytest.mark.tools
def test_one_stays_one(program: Path) -> None:
    exponents = RANDOM.uniform(0.0, 1.0, 100)
    assert set(values(program, "power_of", np.ones(100), exponents)) == {1.0}
    assert values(program, "cube_root", np.ones(1), np.ones(1)) == [1.0]
    assert values(program, "logarithm", np.ones(1), np.ones(1)) == [0.0]
    assert values(program, "exponential", np.zeros(1), np.ones(1)) == [1.0]


@pytest.mark.tools
def test_beyond_the_range_values_stay_in_order(program: Path) -> None:
    ends = np.array([-np.inf, -701.0, -700.0, 700.0, 701.0, np.inf])
    computed = values(program, "exponential", ends, ends)
    assert computed[:2] == [0.0, 0.0]
    assert computed[4:] == [np.inf, np.inf]
    assert 0.0 < computed[2] < 1e-303 < 1e303 < computed[3] < np.inf
    smallest = np.array([0.0, 5e-324, 2.3e-308, 1e-300, np.inf])
    computed = values(program, "logarithm", smallest, smallest)
    assert computed == sorted(computed)
    assert -710.0 < computed[0] < -708.0
    assert computed[-1] == np.inf
    nothing = np.array([np.nan])
    for name in ("exponential", "decaying_exponential", "logarithm", "cube_root"):
        assert np.isnan(values(program, name, nothing, nothing))


def undefined_symbols(library: bytes) -> set[str]:
    """Functions that a 64-bit ELF library takes from others."""
    sections = np.frombuffer(library, "<u8", offset=40, count=1)[0]
    count = int(np.frombuffer(library, "<u2", offset=60, count=1)[0])
    layout = [(f, "<u4") for f in ("name", "kind")] + [("flags", "<u8"), ("address", "<u8")]
    layout += [("offset", "<u8"), ("size", "<u8"), ("link", "<u4"), ("rest", "V20")]
    headers = np.frombuffer(library, np.dtype(layout), offset=int(sections), count=count)
    (dynamic,) = headers[headers["kind"] == 11]
    strings = library[int(headers[dynamic["link"]]["offset"]) :]
    symbol = [("name", "<u4"), ("info", "u1"), ("other", "u1"), ("section", "<u2"), ("rest", "V16")]
    table = library[int(dynamic["offset"]) : int(dynamic["offset"] + dynamic["size"])]
    symbols = np.frombuffer(table, np.dtype(symbol))
    places = symbols[symbols["section"] == 0]["name"].tolist()
    return {strings[at : strings.index(b"\0", at)].decode() for at in places} - {""}


def test_library_takes_no_mathematics_but_exact_ones_from_the_system() -> None:
    name = kernel.platform_name()
    if not name.endswith("linux"):
        pytest.skip("reads libraries of Linux")
    undefined = undefined_symbols(kernel.library_path(name).read_bytes())
    assert {"memcpy", "malloc"} <= undefined
    # What libm alone has; it finds what the C library has by itself too.
    system, libm = ctypes.CDLL("libc.so.6"), ctypes.CDLL("libm.so.6")
    functions = {name for name in undefined if hasattr(libm, name) and not hasattr(system, name)}
    assert functions <= EXACT
