"""Sand that the axles lay: where it lies, when, and what it does there."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import contactlib as cl
from contactlib.traction import Command, OpenLoop
from contactlib.vehicle import Sanding

SLIPPERY = cl.Track(friction_left=cl.Profile.of(0.4))


class Sands(cl.SampledController):
    """Lays sand of one axle between two samples."""

    sample_time = 0.01

    def __init__(self, axle: int, first: int, last: int) -> None:
        self.axle, self.first, self.last, self.sample = axle, first, last, -1

    def torque(self, measurement: cl.traction.Measurement[float]) -> Command[float]:
        self.sample += 1
        on = measurement.axle == self.axle and self.first <= self.sample < self.last
        return Command(measurement.demand, on)


def sanded(speed: float = 10.0, track: cl.Track = SLIPPERY, **given: Any) -> cl.Scenario:
    case = cl.load_scenario("four_axles.toml")
    sanding = Sanding(friction=2.0, slope=0.8, rate=0.02, **given)
    return replace(
        case,
        drivetrain=replace(case.drivetrain, sanding=sanding),
        track=track,
        initial_speed=speed,
        design_speed=10.0,
        duration=1.5,
        controllers={"open_loop": OpenLoop()},
    )


@pytest.mark.parametrize("speed", [10.0, -10.0])
def test_axles_behind_meet_the_sand_where_it_was_laid(speed: float) -> None:
    """After the delay; those that passed before do not, whatever the direction of travel."""
    case = sanded(speed, by="controller", delay=0.1)
    run = cl.run_scenario(case, Sands(2, 20, 60))
    begin, end = (np.interp(0.1 + at, run.time, run["distance"][:, 1]) for at in (0.2, 0.6))
    low, high = sorted((begin, end))
    sand = run["sand"]
    on = sand > 0.0
    for axle in range(4):
        place = run["distance"][:, axle]
        inside = (place > low + 0.2) & (place < high - 0.2)
        outside = (place < low - 0.2) | (place > high + 0.2)
        before = run.time < 0.3 if axle == 1 else run.time < 0.0
        behind = (axle > 1) == (speed > 0.0) or axle == 1
        assert not (on[:, axle] & (outside | before)).any()
        assert (sand[inside & ~before, axle] == 1.0).all() if behind else not on[:, axle].any()
    np.testing.assert_allclose(run["friction_scale_left"], 0.4 * (1.0 + sand), rtol=1e-12)
    np.testing.assert_allclose(run["slope_scale"], 1.0 - 0.2 * sand, rtol=1e-12)
    used = cl.run_many([case], Sands(2, 20, 60), ["sand_used"])["sand_used"]
    assert used == pytest.approx(0.4 * 0.02)


def test_sand_everywhere_is_the_track_with_its_factors() -> None:
    """From all axles and within the speeds it is laid at, it is sand by place."""
    track = cl.Track(friction_left=cl.Profile.of(0.8), slope=cl.Profile.of(0.8))
    laid = cl.run_scenario(sanded(), "open_loop")
    given = replace(sanded(track=track), drivetrain=replace(sanded().drivetrain, sanding=None))
    placed = cl.run_scenario(given, "open_loop")
    np.testing.assert_allclose(laid["creep_force"], placed["creep_force"], rtol=1e-6, atol=2.0)
    assert np.abs(laid.total("energy_defect")).max() < 1e-8 * laid.total("drive_work")[-1]
    for case in (sanded(below=9.0), sanded(above=12.0)):
        assert not cl.run_scenario(case, "open_loop")["sand"].any()


def test_plants_and_mistakes() -> None:
    plant = cl.Plant(sanded(by="controller", axles=(1.0,)))
    plant.step(0.0, sand=0.5)
    assert plant["sand"].tolist() == [0.5, 0.0, 0.0, 0.0]
    assert plant["sand_rate"].tolist() == [0.01, 0.0, 0.0, 0.0]
    with pytest.raises(ValueError, match=r"sand = 2.0 .* must be .* <= 1"):
        plant.step(0.0, sand=2.0)
    plain = cl.load_scenario("four_axles.toml")
    for case in (plain, sanded(by="speed")):
        with pytest.raises(ValueError, match=r"no sanding.by = 'controller': add \[sanding\]"):
            cl.run_scenario(case, Sands(1, 0, 5))
    with pytest.raises(ValueError, match=r"sanding.axles = \(5.0,\) must be numbers from 1 to 4"):
        sanded(axles=(5.0,))
    with pytest.raises(ValueError, match=r"above = 3.0 must be < below = 2.0"):
        Sanding(friction=2.0, above=3.0, below=2.0)
    rl = pytest.importorskip("contactlib.rl")
    with pytest.raises(ValueError, match="an action is a torque alone; set by = 'speed'"):
        rl.TractionEnv(sanded(by="controller"))
