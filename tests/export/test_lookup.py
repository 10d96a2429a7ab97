"""The creep force as a table: few points, the stated error between them, and the way back."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray
from command_line import done
from falling_friction import falling
from scipy.interpolate import RegularGridInterpolator
from scipy.io import loadmat

import contactlib as cl
from contactlib.element import ProcessZoneWarning
from contactlib.export.lookup import FORMATS, write_lookup_table

FINE = np.concatenate([np.linspace(0.0, 0.1, 100_001), np.linspace(0.1, 1.0, 90_001)])


@pytest.mark.parametrize("error", [1e-2, 1e-3, 1e-5])
def test_interpolation_keeps_the_error(rig: cl.Model, error: float) -> None:
    table = cl.lookup_table(rig, error=error)
    law = rig.wheelset.element.at_creepage(FINE, speed=10.0)["creep_force"]
    between = np.interp(FINE, table.creepage, table.creep_force)
    worst = np.abs(between - law).max() / law.max()
    assert 0.5 * error < worst <= error * (1.0 + 1e-6)
    assert table.attrs["largest_error_found"] == pytest.approx(worst, rel=0.02)


def test_the_limit_to_static_friction_keeps_the_error(rig: cl.Model) -> None:
    friction = cl.friction_with_k_hat(
        rig.wheelset.element.contact, k_hat=0.3, static=0.23, kinetic=0.21
    )
    with pytest.warns(ProcessZoneWarning):
        element = cl.ForceElement(
            rig.wheelset.element.contact, friction, table=rig.wheelset.element.table, radius=0.5
        )
    table = cl.lookup_table(element)
    law = element.at_creepage(FINE, speed=10.0)["creep_force"]
    between = np.interp(FINE, table.creepage, table.creep_force)
    assert np.abs(between - law).max() <= 1e-3 * (1.0 + 1e-6) * law.max()
    assert table.sizes["creepage"] < 60


def test_chosen_axes_keep_the_error(rig: cl.Model) -> None:
    ends = {"axle_load": (50e3, 300e3), "friction_scale": (0.3, 1.0)}
    load, scale = (slice(*e) for e in ends.values())
    table = cl.lookup_table(rig, axle_load=load, friction_scale=scale, error=5e-3)
    assert table.creep_force.dims == ("axle_load", "friction_scale", "creepage")
    axes = [table[name].values for name in table.creep_force.dims]
    assert [(axis[0], axis[-1]) for axis in axes] == [*ends.values(), (0.0, 1.0)]
    force = RegularGridInterpolator(axes, table.creep_force.values)
    random = np.random.default_rng(3)
    zeta = np.linspace(0.0, 0.2, 2001)
    for load, scale in zip(
        random.uniform(*ends["axle_load"], 50),
        random.uniform(*ends["friction_scale"], 50),
        strict=True,
    ):
        law = rig.wheelset.element.at_creepage(
            zeta, speed=10.0, axle_load=load, friction_scale=scale
        )["creep_force"]
        got = force(np.stack(np.broadcast_arrays(load, scale, zeta), axis=-1))
        assert np.abs(got - law).max() <= 5e-3 * law.max()


def test_given_axes_are_kept_and_the_error_between_them_is_reported(rig: cl.Model) -> None:
    element = falling(rig.wheelset.element)
    table = cl.lookup_table(element, speed=[5.0, 10.0, 20.0], axle_load=100e3)
    assert table.creep_force.dims == ("speed", "creepage")
    assert table.speed.values.tolist() == [5.0, 10.0, 20.0]
    assert float(table.axle_load) == 100e3
    assert "between the given points of the other axes it is up to 0." in table.attrs["error_is"]
    for speed in (5.0, 10.0, 20.0):
        law = element.at_creepage(FINE, speed=speed, axle_load=100e3)["creep_force"]
        got = np.interp(FINE, table.creepage, table.creep_force.sel(speed=speed))
        assert np.abs(got - law).max() <= 1e-3 * law.max() * (1.0 + 1e-6)


def test_a_table_is_a_measured_curve(rig: cl.Model, tmp_path: Path) -> None:
    write_lookup_table(cl.lookup_table(rig, error=1e-4), tmp_path / "curve.csv")
    (tmp_path / "back.toml").write_text(
        '[contact]\nradius = 0.5\nsemi_width = "5 mm"\nwheel_load = "110.325 kN"\n'
        'youngs_modulus = "210 GPa"\npoisson_ratio = 0.3\n'
        '[law]\nkind = "measured"\nfile = "curve.csv"\n[wheelset]\nradius = 0.5\nwheels = 2\n'
    )
    back = cl.load_model(tmp_path / "back.toml").wheelset.element
    law, got = (
        e.at_creepage(FINE, speed=10.0)["creep_force"] for e in (rig.wheelset.element, back)
    )
    assert np.abs(got - law).max() < 2.5e-3 * law.max()  # the smoothing's error


def test_a_table_for_several_loads_is_no_measured_curve(rig: cl.Model, tmp_path: Path) -> None:
    table = cl.lookup_table(rig, axle_load=[50e3, 100e3], error=0.05)
    path = write_lookup_table(table, tmp_path / "curve.csv")
    with pytest.raises(ValueError, match=r"curve\.csv: line \d+: axle_load varies"):
        cl.TractionData.from_csv(path)


def test_all_formats_hold_the_same_and_state_the_error(rig: cl.Model, tmp_path: Path) -> None:
    table = cl.lookup_table(rig, axle_load=[50e3, 100e3], error=0.05)
    paths = {kind: write_lookup_table(table, tmp_path / f"curve{kind}") for kind in FORMATS}
    with xarray.open_dataset(paths[".nc"], engine="scipy") as read:
        xarray.testing.assert_identical(read.load(), table)
    matrices = loadmat(paths[".mat"])
    for name in ("axle_load", "creepage", "creep_force", "traction_coefficient"):
        assert (matrices[name].squeeze() == table[name].values).all()
    assert matrices["error"].item() == 0.05
    lines = paths[".csv"].read_text().splitlines()
    assert "# error: 0.05" in lines
    head = next(i for i, line in enumerate(lines) if not line.startswith("#"))
    columns = np.loadtxt(lines[head + 1 :], delimiter=",").T
    assert lines[head] == "axle_load,creepage,traction_coefficient,creep_force"
    assert (columns[3] == table.creep_force.values.ravel()).all()
    for kind, path in paths.items():  # no date, no other chance
        again = write_lookup_table(table, tmp_path / f"again{kind}")
        assert again.read_bytes() == path.read_bytes()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"error": 0.5}, r"error = 0\.5 is out of range: must be finite and >= 1e-07 and <= 0\.1"),
        (
            {"axle_load": [2e3, 1e3]},
            r"axle_load = .* or strictly increasing numbers",
        ),
        ({"speed": slice(1.0, 2.0, 3.0)}, r"speed = slice.* must be slice\(lowest, highest\)"),
        ({"speed": 0.01}, r"speed = 0\.01 is out of range: .*>= 0\.1"),
        ({"axle_load": range(1, 100_002)}, r"the table would have .* must be <= 10000000"),
    ],
)
def test_bad_options_are_refused(rig: cl.Model, options: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        cl.lookup_table(rig, **options)


def test_the_command_writes_it(tmp_path: Path) -> None:
    path = tmp_path / "curve.csv"
    options = ["--load", "100 kN:200kN", "--friction-scale", "0.5,1", "--error", "0.02"]
    shown = done("table", "roller_rig.toml", "-o", path, *options)
    assert "largest error of interpolation found 0.0" in shown.stdout
    assert "axle_load,friction_scale,creepage" in path.read_text()
