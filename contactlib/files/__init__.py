"""Model and scenario files: TOML is read into validated, frozen parameters."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from contactlib.files.mistakes import ModelError as ModelError
    from contactlib.files.model import Model as Model
    from contactlib.files.model import load_model as load_model
    from contactlib.files.rail_conditions import RailCondition as RailCondition
    from contactlib.files.rail_conditions import condition_names as condition_names
    from contactlib.files.rail_conditions import load_condition as load_condition
    from contactlib.files.reading import model_path as model_path
    from contactlib.files.scenario import Scenario as Scenario
    from contactlib.files.scenario import load_scenario as load_scenario
else:
    from contactlib.base.lazy import lazy_names

    __getattr__, __dir__, __all__ = lazy_names(__name__)
