"""Model and scenario files: TOML in, validated and frozen parameters out.

A model file is a wheelset with the two runs of the demonstration. A scenario file names such a
vehicle and says how it is driven, where, and by which controllers.
"""

from contactlib.scenario.model import Model, load_model
from contactlib.scenario.reading import ModelError, is_scenario, model_path
from contactlib.scenario.scenario import Scenario, load_scenario

__all__ = [
    "Model",
    "ModelError",
    "Scenario",
    "is_scenario",
    "load_model",
    "load_scenario",
    "model_path",
]
