"""A load or compliance that is set now gives the memory of a contact that was declared with it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from exported_fmu import exported
from fmu_instance import Instance
from native_models import with_memory

import contactlib as cl
from contactlib import kernel

LAYER = 1e-13  # of the ellipse, with a ratio of 0.86 [m/Pa]; the table of the line has no layers
STATES = {"held_force": 0.11, "unslipped": 0.8, "outer_force": 0.02}  # forces over the load
CASES = [
    *(("rig", load, 0.0) for load in (0.1, 0.5, 1.4)),
    *(("locomotive", load, layer) for load in (0.1, 0.5, 2.0) for layer in (0.1, 1.0, 10.0)),
]


def layered(model: cl.Model, load: float = 1.0, layer: float = 1.0) -> cl.Model:
    """The model with memory and a layer, declared with factors on load and compliance."""
    element = model.wheelset.element
    contact: cl.EllipticContact | cl.LineContact
    if isinstance(element.contact, cl.EllipticContact):
        contact = replace(element.contact, normal_load=load * element.contact.normal_load)
    else:
        per_length = load * element.contact.normal_load_per_length
        contact = replace(element.contact, normal_load_per_length=per_length)
    length = 0.1 * element.friction.weakening_length  # short under any of the loads
    friction = replace(element.friction, weakening_length=length)
    element = replace(element, contact=contact, friction=friction, layer_compliance=layer * LAYER)
    return with_memory(replace(model, wheelset=replace(model.wheelset, element=element)))


@pytest.mark.parametrize(("name", "load", "layer"), CASES)
@pytest.mark.parametrize("speed", [0.0, 10.0])
def test_force_element(
    request: pytest.FixtureRequest, name: str, speed: float, load: float, layer: float
) -> None:
    model = request.getfixturevalue(name)
    nominal = layered(model, 1.0, float(layer > 0.0)).wheelset.element
    expected = layered(model, load, layer).wheelset.element
    given = np.zeros(1, kernel.struct_dtype("force_element_input"))
    weight = expected.normal_load
    for key, value in STATES.items():
        given[key] = value if key == "unslipped" else value * weight
    given["speed"], given["omega"] = speed, (speed + 0.01) / expected.radius
    given["normal_load"], given["friction_scale"] = weight, 0.9
    parameters = {**nominal.rolling_parameters, "layer_compliance": layer * LAYER}
    present = kernel.NativeForceElement(nominal.native_contact, parameters).evaluate(given)
    expected_value = expected.rolling_native.evaluate(given)
    for key in present.dtype.names or ():
        if key == "load_margin":
            continue  # it is relative to the nominal load
        a, b = present[key], expected_value[key]
        np.testing.assert_allclose(a, b, rtol=1e-11, atol=1e-12 * np.abs(b).max(), err_msg=key)


@pytest.mark.parametrize(("load", "layer"), [(0.5, 10.0), (2.0, 0.1)])
@pytest.mark.parametrize("exchange", [False, True])
@pytest.mark.parametrize("kind", ["force_element", "wheelset"])
def test_fmu(
    locomotive: cl.Model, tmp_path: Path, kind: str, exchange: bool, load: float, layer: float
) -> None:
    name, rows = f"{kind}-memory", []
    models = layered(locomotive), layered(locomotive, load, layer)
    weight = models[1].wheelset.element.contact.normal_load
    for model in models:
        folder = exported(model, tmp_path, name)
        with Instance(folder, exchange=exchange) as tool:
            variables = tool.description.modelVariables
            outputs = [v.name for v in variables if v.causality == "output"]
            rates = [v.name for v in variables if v.derivative]
            tool.start(normal_load=weight, layer_compliance=layer * LAYER, omega=20.02, speed=10.0)
            if exchange:
                tool.fmu.newDiscreteStates()
                tool.fmu.enterContinuousTimeMode()
                states = {key: value * weight for key, value in STATES.items()}
                tool.set(**{**states, "unslipped": 0.8})
            row = []
            for k in range(1 if exchange else 20):
                if not exchange:
                    tool.step(1e-3 * k, 1e-3)
                row.append(tool.get(*outputs, *rates))
            rows.append(np.array(row))
    size = np.abs(rows[1]).max(axis=0)
    error = np.abs(rows[0] - rows[1]).max(axis=0) / np.where(size > 0.0, size, 1.0)
    assert error[: len(outputs)].max() < 1e-12, dict(zip(outputs, error, strict=False))
    assert error.max() < 1e-10  # a stiff contact's rates magnify the rounding of its states
