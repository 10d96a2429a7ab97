"""The figures of a run: what the ramp of a fold diagram says of itself."""

from __future__ import annotations

import re

import numpy as np
import pytest

import contactlib as cl
from contactlib import figures


def told(model: cl.Model, slower: float = 1.0) -> str:
    """What the fold diagram says where the ramp comes back, with a fall that is so much slower."""
    ramp = model.torque_control.reference
    top = int(np.argmax(ramp.value)) + 1  # end of the highest torque
    fall = [ramp.at[top] + slower * (at - ramp.at[top]) for at in ramp.at[top:]]
    control = cl.TorqueControl(cl.Profile((*ramp.at[:top], *fall), ramp.value))
    run = cl.simulate(model.wheelset, control, initial_speed=model.initial_speed)
    held = cl.simulate(model.wheelset, model.creep_control, initial_speed=model.initial_speed)
    figure = figures.fold_diagram(model.wheelset, run, held, speed=10.0, title="")
    texts = [text.get_text().replace("\n", " ") for text in figure.axes[0].texts]
    return next((text for text in texts if "lags" in text), "").replace("\N{NO-BREAK SPACE}", " ")


@pytest.mark.parametrize(("name", "torque"), [("rig", 23.75), ("locomotive", 17.37)])
def test_a_fast_ramp_says_why_it_returns_late(
    name: str, torque: float, request: pytest.FixtureRequest
) -> None:
    """Below the return by J domega/dt, with which the slowing wheel drives the contact too."""
    model: cl.Model = request.getfixturevalue(name)
    said = told(model)
    found = re.match(r"grip at ([\d.]+) kN m: the spinning wheel lags behind the ramp", said)
    assert found is not None
    assert float(found[1]) == pytest.approx(torque, abs=0.06)


def test_a_slow_ramp_returns_at_the_return(rig: cl.Model) -> None:
    assert told(rig, slower=10.0) == ""
