"""What the outcomes of a sweep mean, where a number alone does not say it."""

from __future__ import annotations

from typing import NamedTuple


class Meaning(NamedTuple):
    """Of one outcome.

    Attributes
    ----------
    wanted : int
        1 if much of it is good, -1 if little is; 0 if neither can be said, as of the distance
        travelled, of which one wants much in traction and little in braking.
    infinite, missing : str
        What it means that it is infinite, or has no value.
    zero : str
        What it means that it is zero, where zero is of another kind than small; else empty.
    """

    wanted: int = 0
    infinite: str = "infinite"
    missing: str = "no value"
    zero: str = ""


CLEARING = Meaning(infinite="survives any length", zero="not held even before the patch")
FOLD = Meaning(missing="no maximum, or braking")
MEANINGS = {
    "adhesion_utilisation": Meaning(1),
    "slip_work": Meaning(-1),
    "slip_share": Meaning(-1),
    "largest_creepage": Meaning(-1),
    "largest_slip_speed": Meaning(-1),
    "recovery_time": Meaning(-1, "does not recover", "nothing to recover from"),
    "jerk": Meaning(-1),
    "torsional_peak": Meaning(-1, missing="rigid axle"),
    "clearing_time": CLEARING,
    "clearing_distance": CLEARING,
    "critical_torque": FOLD,
    "patch_critical_torque": FOLD,
    "critical_creepage": FOLD,
    "hysteresis": FOLD,
    "torque_margin": Meaning(infinite="no demand", missing=FOLD.missing),
    "delay_limit": Meaning(infinite="any delay"),
    "required_gain": Meaning(zero="needs none"),
}
YES_OR_NO = {"stable": ("held", "not held")}  # outcomes that are 1 or 0, and what these mean
# Zero where the largest demand is the critical torque: a border on the maps of all outcomes.
MARGIN, BORDER = "torque_margin", "demand = critical torque"
ZEROS = {"worst_pole": "zero: below it nothing runs away", MARGIN: BORDER}


def meaning(outcome: object) -> Meaning:
    """Of an outcome by name."""
    return MEANINGS.get(str(outcome), Meaning())
