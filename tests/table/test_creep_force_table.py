"""The table: its certificate, its smoothness, and what a damaged file does."""

from __future__ import annotations

import pickle
import struct
import zlib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike

import contactlib as cl
from contactlib import CarterGriffith, CreepForceTable
from contactlib.base.quantities import FloatArray
from contactlib.kernel.library import ffi, library
from contactlib.kernel.tables import NativeTable, shipped_path
from contactlib.laws import ConvergenceError
from contactlib.table.building import GRIDS


def test_certificate_holds_at_other_points(table: CreepForceTable) -> None:
    random = np.random.default_rng(20260101)
    for k_hat in np.concatenate([[0.0, 2.0], 10.0 ** random.uniform(-9.0, np.log10(2.0), 40)]):
        law = CarterGriffith(k_hat=float(k_hat))
        x = np.concatenate([10.0 ** random.uniform(-12.0, 6.0, 500), random.uniform(0.0, 4.0, 500)])
        error = np.abs(table.traction_ratio(x, k_hat) - law.traction_ratio(x)).max()
        slope_error = np.abs(table.slope(x, k_hat) - law.slope(x)).max()
        # A certificate is a largest value found, so others may exceed it a little.
        assert error <= max(2.0 * table.max_error, 4e-15)
        assert slope_error <= max(2.0 * table.max_slope_error, 4e-15)
    assert table.max_error <= 1e-6
    assert table.max_slope_error <= 1e-4
    assert table.certificate_points > 30_000


@pytest.mark.parametrize("k_hat", [1e-3, 0.02, 0.3, 1.0, 2.0])
def test_exactly_one_extremum(table: CreepForceTable, k_hat: float) -> None:
    x = np.union1d(np.geomspace(1e-9, 1e6, 20_000), np.linspace(0.9, 3.0, 20_000))
    sign = np.sign(table.slope(x, k_hat))
    assert (np.diff(sign[sign != 0.0]) != 0.0).sum() == 1
    ratio = table.traction_ratio(x, k_hat)
    assert ratio.max() == pytest.approx(CarterGriffith(k_hat=k_hat).peak.traction_ratio, abs=1e-7)


def test_zero_k_hat_never_falls(table: CreepForceTable) -> None:
    x = np.union1d(np.geomspace(1e-9, 1e6, 5000), [1.0])
    assert (table.slope(x, 0.0) >= 0.0).all()
    assert (table.slope(x[x >= 1.0], 0.0) == 0.0).all()


@pytest.mark.parametrize("shape", ["line", "elliptic"])
def test_initial_slope_is_that_of_the_smallest_creepage(shape: str) -> None:
    table = NativeTable(shipped_path(shape).read_bytes())
    value = ffi.new("creep_value *")
    for k_hat in (0.0, 1e-8, 0.01, 0.3, table.struct.k_max):
        for layer_ratio in (0.0, 1e-11, 1e-3, 0.5, 10.0, 1e5):
            library().creep_table_evaluate(table.struct, 1e-290, k_hat, layer_ratio, value)
            slope = library().creep_table_initial_slope(table.struct, k_hat, layer_ratio)
            assert slope == pytest.approx(value.slope, rel=1e-15)


def test_odd_and_broadcasting(table: CreepForceTable) -> None:
    x, k_hat = np.linspace(-3.0, 3.0, 7), np.array([[0.0], [0.3], [2.0]])
    ratio = table.traction_ratio(x, k_hat)
    assert ratio.shape == (3, 7)
    np.testing.assert_array_equal(ratio[:, ::-1], -ratio)
    np.testing.assert_array_equal(table.slope(x, k_hat)[:, ::-1], table.slope(x, k_hat))
    assert table.traction_ratio(0.5, 0.3).shape == ()
    assert table.traction_ratio(0.5, [0.3]).shape == (1,)
    assert table.traction_ratio(np.float32(0.5), 1).dtype == np.float64
    np.testing.assert_array_equal(table.traction_ratio(x[::2], 0.3), ratio[1, ::2])


def test_one_point_has_the_bits_of_an_array(table: CreepForceTable) -> None:
    random = np.random.default_rng(7)
    x = [0.0, -0.0, 5e-324, -1.7976931348623157e308, *random.uniform(-3.0, 3.0, 200).tolist()]
    k_hat = [0.0, 2.0, 0.3, 0.3, *random.uniform(0.0, 2.0, 200).tolist()]
    for method in (table.traction_ratio, table.slope):
        one_by_one = [method(*point) for point in zip(x, k_hat, strict=True)]
        assert all(type(v) is np.ndarray and v.shape == () for v in one_by_one)
        assert np.array(one_by_one).tobytes() == method(x, k_hat).tobytes()
        assert method(np.float64(x[9]), k_hat[9]).tobytes() == one_by_one[9].tobytes()


def test_one_point_in_many_threads(table: CreepForceTable) -> None:
    x = np.linspace(0.0, 3.0, 4000)
    with ThreadPoolExecutor(8) as pool:
        ratios = list(pool.map(lambda v: table.traction_ratio(v, 0.3), x.tolist()))
    np.testing.assert_array_equal(ratios, table.traction_ratio(x, 0.3))


@pytest.mark.parametrize("k_hat", [-0.1, 2.1, [0.1, 2.5]])
def test_k_hat_beyond_the_table_is_refused(table: CreepForceTable, k_hat: ArrayLike) -> None:
    with pytest.raises(ValueError, match=r"k_hat = .*>= 0 and <= 2$"):
        table.traction_ratio(1.0, k_hat)


class Stickier:
    """A law that is not the line contact's: its ratio, raised by a tenth of the stick share s."""

    def __init__(self, *, k_hat: float) -> None:
        self._line = CarterGriffith(k_hat=k_hat)

    def traction_ratio(self, normalized_creepage: ArrayLike) -> FloatArray:
        s = 0.5 * (1.0 - self._line.stick_boundary(normalized_creepage))
        return np.asarray(self._line.traction_ratio(normalized_creepage) * (1.0 + 0.1 * s))

    def slope(self, normalized_creepage: ArrayLike) -> FloatArray:
        x = np.asarray(normalized_creepage)
        m = 0.5 * (1.0 + self._line.stick_boundary(x))
        s, stretch = 1.0 - m, (x - m) + 4.0 * m * (1.0 - m)
        fall = np.divide(4.0 * m * s, stretch, out=np.zeros_like(x), where=stretch > 0.0)
        rise = self._line.slope(x) * (1.0 + 0.1 * s)
        return np.asarray(rise - 0.1 * self._line.traction_ratio(x) * fall)


@pytest.fixture(scope="module")
def spline_table() -> CreepForceTable:
    return CreepForceTable.from_law(Stickier, target=1e-5)


def test_another_law_is_refined_until_it_meets_the_target(spline_table: CreepForceTable) -> None:
    assert spline_table.cells in GRIDS[1:]
    assert 1e-12 < spline_table.max_error <= 1e-5
    law = Stickier(k_hat=0.4)
    x = np.linspace(0.0, 5.0, 777)
    assert np.abs(spline_table.traction_ratio(x, 0.4) - law.traction_ratio(x)).max() <= 1e-5


def test_spline_converges_with_fourth_order() -> None:
    from contactlib.table import building as module

    errors, none = [], module.Certificate(0.0, 0.0, 0)
    x = np.linspace(0.05, 4.0, 501)
    cells = [16, 32, 64, 128]
    for n in cells:
        sampler = module.Sampler(Stickier, {}, lambda part: None)
        coefficients = module._fit(sampler, None, n, n, 0.0, 1.0)
        made = CreepForceTable(module.pack(sampler, (n, n), none, coefficients))
        law = Stickier(k_hat=0.9)
        errors.append(np.abs(made.traction_ratio(x, 0.9) - law.traction_ratio(x)).max())
    order = -np.polyfit(np.log(cells), np.log(errors), 1)[0]
    assert order > 3.5


@pytest.mark.parametrize(
    ("name", "step", "error"),
    [("table", 1e-4, 1e-9), ("spline_table", 1e-6, 1e-8), ("cohesive_table", 1e-6, 2e-7)],
)
def test_slope_is_the_derivative(
    name: str, step: float, error: float, request: pytest.FixtureRequest
) -> None:
    of, random = request.getfixturevalue(name), np.random.default_rng(2)
    x, k_hat = random.uniform(0.1, 4.0, 400), random.uniform(0.1, 1.9, 400)
    q = [of.traction_ratio(x + i * step, k_hat) for i in (-2, -1, 1, 2)]
    five_point = (q[0] - 8.0 * q[1] + 8.0 * q[2] - q[3]) / (12.0 * step)
    np.testing.assert_allclose(of.slope(x, k_hat), five_point, atol=error)


def test_a_target_out_of_reach_reports_what_was_reached(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("contactlib.table.building.GRIDS", GRIDS[:2])
    with pytest.raises(
        ValueError, match=r"target = 1e-14, .* are not reached for Stickier.* error"
    ):
        CreepForceTable.from_law(Stickier, target=1e-14)


def test_file_round_trip(spline_table: CreepForceTable, tmp_path: Path) -> None:
    path = spline_table.save(tmp_path / "a table.bin")
    again = CreepForceTable.load(path)
    assert again.data == spline_table.data
    assert again.max_error == spline_table.max_error
    assert again.law == "Stickier"
    assert [p.name for p in tmp_path.iterdir()] == ["a table.bin"]
    x = np.linspace(-3.0, 3.0, 99)
    np.testing.assert_array_equal(again.traction_ratio(x, 0.5), spline_table.traction_ratio(x, 0.5))


def resealed(data: bytes) -> bytes:
    """The same bytes with a checksum that fits, as a forger would write them."""
    return data[:12] + struct.pack("<I", zlib.crc32(data[16:])) + data[16:]


def patched(data: bytes, offset: int, layout: str, value: float) -> bytes:
    changed = bytearray(data)
    struct.pack_into(layout, changed, offset, value)
    return bytes(changed)


def test_every_damaged_file_is_a_clear_error(spline_table: CreepForceTable, tmp_path: Path) -> None:
    data = spline_table.data
    cases = [
        (b"", "shorter than its header"),
        (data[:20], "shorter than its header"),
        (b"NOTATABL" + data[8:], "wrong magic"),
        (patched(data, 8, "<I", 1), "older format version: 1, this contactlib reads 3"),
        (data[:-8], "length differs"),
        (data + b"\0", "length differs"),
        (patched(data, 200, "<B", data[200] ^ 1), "damaged"),
        (resealed(patched(data, 24, "<I", 5000)), "cells is out of range"),
        (resealed(patched(data, 24, "<I", 17)), "does not fit its number of cells"),
        (resealed(patched(data, 24, "<I", 0)), "cells is out of range"),
        (resealed(patched(data, 32, "<d", -1.0)), "k_max"),
        (resealed(patched(data, 64, "<d", -1.0)), "static_to_kinetic"),
        (resealed(patched(data, 72, "<I", 2)), "shape"),
        (resealed(patched(data, 216, "<d", np.nan)), "not finite"),
    ]
    for number, (broken, message) in enumerate(cases):
        path = tmp_path / f"{number}.bin"
        path.write_bytes(broken)
        with pytest.raises(ValueError, match=rf"{number}\.bin: .*{message}"):
            CreepForceTable.load(path)


def test_every_single_flipped_bit_of_the_head_is_found(table: CreepForceTable) -> None:
    for position in range(8 * len(table.data)):
        broken = bytearray(table.data)
        broken[position // 8] ^= 1 << position % 8
        with pytest.raises(ValueError, match="the file"):
            CreepForceTable(bytes(broken))


def test_a_table_comes_back_from_a_pickle(table: cl.CreepForceTable) -> None:
    assert pickle.loads(pickle.dumps(table)).data == table.data  # noqa: S301 - of our own making


def test_an_error_of_the_law_ends_the_building_of_its_table() -> None:
    class Broken(cl.CarterGriffith):
        def traction_ratio(self, normalized_creepage: Any) -> Any:
            raise ConvergenceError("no solution")

        evaluate = None  # type: ignore[assignment]

    with pytest.raises(ConvergenceError, match="no solution"):
        cl.CreepForceTable.from_law(Broken)
