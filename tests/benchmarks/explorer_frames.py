"""Cost of the explorer page's frames: ``python tests/benchmarks/explorer_frames.py``.

Headless Chromium without a graphics processor draws the page at 1440 x 900 pixels in real time.
The cost of a frame is what its script takes: the simulation, the analysis and the charts. Of the
16.7 ms between two frames half is to be left over; if a median takes more, the answer is 1.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from contactlib.explorer import PAGE

sys.path.insert(0, str(Path(__file__).parent.parent))  # for what the tests share

from explorer_page import explorer_page
from explorer_visitor import Visitor

FRAMES = 300
WARM = 30  # frames that are not counted: the script is being compiled
MOST = 0.5 * 1e3 / 60.0  # that a median may cost [ms]

MEASURE = """async (warm, frames) => {
  const { app } = await contactlib.ready;
  const next = () => new Promise(requestAnimationFrame);
  for (let i = 0; i < warm; i++) await next();
  app.frameCosts.length = 0;
  const began = await next();
  let now = began;
  for (let i = 0; i < frames; i++) now = await next();
  return { costs: app.frameCosts.slice(0, frames), rate: (1e3 * frames) / (now - began) };
}"""


class Frames(NamedTuple):
    """Costs of frames [ms], and how many there were in a second."""

    costs: list[float]
    rate: float


def ramp(visitor: Visitor) -> None:
    visitor.enter(rate=0.1, torque=27.0)


def run_away(visitor: Visitor) -> None:
    visitor.enter(rate=100.0, torque=28.0)


def late_control(visitor: Visitor) -> None:
    visitor.check("Creep control")
    visitor.enter(reference=2.0, delay=5.0)


def ellipse(visitor: Visitor) -> None:
    visitor.check("Ellipse")


def locomotive(visitor: Visitor) -> None:
    visitor.choose("locomotive")


CASES: dict[str, Callable[[Visitor], None]] = {
    "at rest, as the page opens": lambda _: None,
    "slow ramp": ramp,
    "run-away": run_away,
    "creep control, 5 ms late": late_control,
    "elliptic contact": ellipse,
    "locomotive, whose speed changes": locomotive,
}


def measure(visitor: Visitor, case: str, frames: int = FRAMES) -> Frames:
    """Frames of the shipped roller rig, after what a visitor does first."""
    visitor.choose("roller_rig")
    CASES[case](visitor)
    found = Frames(**visitor.call(MEASURE, WARM, frames))
    if len(found.costs) < frames:
        raise RuntimeError(f"{case}: the run stopped after {len(found.costs)} of {frames} frames")
    return found


def main() -> int:
    """Measure all cases and print a table."""
    print(f"{FRAMES} frames each of {PAGE.name}, {PAGE.stat().st_size / 1e6:.2f} MB [ms]")
    print(f"{'':34s}{'median':>8s}{'95 %':>8s}{'worst':>8s}{'frames/s':>10s}")
    medians = []
    with explorer_page(width=1440, height=900) as opened:
        visitor = Visitor(opened)
        for case in CASES:
            costs, rate = measure(visitor, case)
            medians.append(float(np.median(costs)))
            late = float(np.percentile(costs, 95.0))
            print(
                f"{case:34s}{medians[-1]:8.2f}{late:8.2f}{max(costs):8.2f}{rate:10.1f}", flush=True
            )
    return int(max(medians) > MOST)


if __name__ == "__main__":
    sys.exit(main())
