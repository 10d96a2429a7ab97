"""Model and scenario files: TOML in, validated and frozen parameters out.

A model file is a wheelset with the two runs of the demonstration. A scenario file names such a
vehicle and says how it is driven, where, and by which controllers.
"""

from contactlib.scenario.controllers import ControllerDesign
from contactlib.scenario.model import VEHICLE_SECTIONS, Model, build_wheelset, load_model
from contactlib.scenario.reading import ModelError, is_scenario, model_path
from contactlib.scenario.scenario import (
    Scenario,
    ScenarioContents,
    build_scenario,
    load_scenario,
    read_contents,
)

__all__ = [
    "VEHICLE_SECTIONS",
    "ControllerDesign",
    "Model",
    "ModelError",
    "Scenario",
    "ScenarioContents",
    "build_scenario",
    "build_wheelset",
    "is_scenario",
    "load_model",
    "load_scenario",
    "model_path",
    "read_contents",
]
