"""Creep force element for vehicle dynamics: the Carter-Griffith law from table to FMU.

import contactlib as cl

law = cl.CarterGriffith(k_hat=0.3)              # the law itself
table = cl.CreepForceTable.from_law(cl.CarterGriffith, contact="line")
model = cl.load_model("models/roller_rig.toml") # a wheelset
cl.export_fmu(model, "CreepForceElement.fmu")   # for any vehicle tool
"""

import ast
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # the public names and their modules; each is imported at its first use
    __version__: str

    from contactlib import stability as stability
    from contactlib import traction as traction
    from contactlib.base.quantities import InputWarning as InputWarning
    from contactlib.element.creep_forces import CreepForces as CreepForces
    from contactlib.element.force_element import AspectWarning as AspectWarning
    from contactlib.element.force_element import ForceElement as ForceElement
    from contactlib.element.force_element import ProcessZoneWarning as ProcessZoneWarning
    from contactlib.export import export_fmu as export_fmu
    from contactlib.export import export_ssp as export_ssp
    from contactlib.export.explorer import write_explorer as write_explorer
    from contactlib.export.kernel_source import export_kernel as export_kernel
    from contactlib.export.lookup import lookup_table as lookup_table
    from contactlib.files.mistakes import ModelError as ModelError
    from contactlib.files.model import Model as Model
    from contactlib.files.model import load_model as load_model
    from contactlib.files.reading import model_path as model_path
    from contactlib.files.scenario import Scenario as Scenario
    from contactlib.files.scenario import load_scenario as load_scenario
    from contactlib.laws.carter_griffith import CarterGriffith as CarterGriffith
    from contactlib.laws.cohesive import CohesiveZone as CohesiveZone
    from contactlib.laws.cohesive_zone import ConvergenceError as ConvergenceError
    from contactlib.laws.fit import FitResult as FitResult
    from contactlib.laws.fit import fit as fit
    from contactlib.laws.friction import EXPONENTIAL as EXPONENTIAL
    from contactlib.laws.friction import Friction as Friction
    from contactlib.laws.friction import Weakening as Weakening
    from contactlib.laws.heat import ContactHeat as ContactHeat
    from contactlib.laws.heat import Softening as Softening
    from contactlib.laws.heat import ThermalMaterial as ThermalMaterial
    from contactlib.laws.hertz import EllipticContact as EllipticContact
    from contactlib.laws.hertz import LineContact as LineContact
    from contactlib.laws.hertz import Material as Material
    from contactlib.laws.kalker import KalkerCoefficients as KalkerCoefficients
    from contactlib.laws.kalker import kalker_coefficients as kalker_coefficients
    from contactlib.laws.measured import MeasuredCurve as MeasuredCurve
    from contactlib.laws.polach import Polach as Polach
    from contactlib.laws.scales import friction_with_k_hat as friction_with_k_hat
    from contactlib.laws.scales import k_hat as k_hat
    from contactlib.laws.scales import process_zone_ratio as process_zone_ratio
    from contactlib.laws.scales import saturation_creepage as saturation_creepage
    from contactlib.laws.thermal_contact import ThermalContact as ThermalContact
    from contactlib.laws.traction_data import TractionData as TractionData
    from contactlib.runs.cosimulation import FmuSource as FmuSource
    from contactlib.runs.cosimulation import KernelSource as KernelSource
    from contactlib.runs.cosimulation import cosimulate as cosimulate
    from contactlib.runs.outcomes import OUTCOMES as OUTCOMES
    from contactlib.runs.outcomes import Metrics as Metrics
    from contactlib.runs.outcomes import comparison_table as comparison_table
    from contactlib.runs.outcomes import metrics as metrics
    from contactlib.runs.outcomes import write_comparison as write_comparison
    from contactlib.runs.plant import Plant as Plant
    from contactlib.runs.result import Event as Event
    from contactlib.runs.result import Result as Result
    from contactlib.runs.scenario_runs import run_many as run_many
    from contactlib.runs.scenario_runs import run_scenario as run_scenario
    from contactlib.runs.simulation import simulate as simulate
    from contactlib.runs.sweep import ANALYSES as ANALYSES
    from contactlib.runs.sweep import Sweep as Sweep
    from contactlib.runs.sweep import load_sweep as load_sweep
    from contactlib.runs.sweep.ensemble import ensemble as ensemble
    from contactlib.runs.tuning import Tuning as Tuning
    from contactlib.runs.tuning import sensor_errors as sensor_errors
    from contactlib.runs.tuning import tune as tune
    from contactlib.stability import control_systems as control_systems
    from contactlib.stability import controllability as controllability
    from contactlib.stability import creep_control_gain as creep_control_gain
    from contactlib.stability import fast_pole as fast_pole
    from contactlib.stability import find_fold as find_fold
    from contactlib.stability import quasi_steady_torque as quasi_steady_torque
    from contactlib.stability import separatrix as separatrix
    from contactlib.stability import slip_away_time as slip_away_time
    from contactlib.stability import slope_threshold as slope_threshold
    from contactlib.stability import steady_states as steady_states
    from contactlib.stability import torsion as torsion
    from contactlib.stability import worst_pole as worst_pole
    from contactlib.stability.basin import basin as basin
    from contactlib.stability.clearing import clearing as clearing
    from contactlib.stability.s_curve import s_curve as s_curve
    from contactlib.table.creep_force_table import CreepForceTable as CreepForceTable
    from contactlib.table.law_tables import carter_griffith_table as carter_griffith_table
    from contactlib.table.law_tables import cohesive_table as cohesive_table
    from contactlib.traction import CONTROLLERS as CONTROLLERS
    from contactlib.traction import CreepPI as CreepPI
    from contactlib.traction import Measurement as Measurement
    from contactlib.traction import OpenLoop as OpenLoop
    from contactlib.traction import SampledController as SampledController
    from contactlib.traction import Sensors as Sensors
    from contactlib.traction import SlopeSeeking as SlopeSeeking
    from contactlib.traction import ThresholdControl as ThresholdControl
    from contactlib.traction import TractionController as TractionController
    from contactlib.vehicle.available_force import available_force as available_force
    from contactlib.vehicle.conditions import Conditions as Conditions
    from contactlib.vehicle.conditions import OperatingPoint as OperatingPoint
    from contactlib.vehicle.conditions import Resistance as Resistance
    from contactlib.vehicle.continuous_control import CreepControl as CreepControl
    from contactlib.vehicle.continuous_control import TorqueControl as TorqueControl
    from contactlib.vehicle.creep_curve import CreepCurve as CreepCurve
    from contactlib.vehicle.creep_curve import Fold as Fold
    from contactlib.vehicle.drivetrain import Axle as Axle
    from contactlib.vehicle.drivetrain import Drivetrain as Drivetrain
    from contactlib.vehicle.drivetrain import Motor as Motor
    from contactlib.vehicle.track import Profile as Profile
    from contactlib.vehicle.track import Track as Track
    from contactlib.vehicle.wheel_load import WheelLoad as WheelLoad
    from contactlib.vehicle.wheelset import Wheelset as Wheelset

# Scientific libraries take a second to load, so a public name is imported when it is first used.
# Its home is read from the block above, which type checkers and editors read as well.
_HOMES = {
    alias.name: node.module
    for block in ast.parse(Path(__file__).read_text(encoding="ascii")).body
    if isinstance(block, ast.If)
    for node in block.body
    if isinstance(node, ast.ImportFrom) and node.module
    for alias in node.names
}

__all__ = sorted(_HOMES)


if not TYPE_CHECKING:  # to whom every name but those above is a mistake

    def __getattr__(name: str) -> Any:
        if name == "__version__":
            return import_module("importlib.metadata").version("contactlib-rail")
        if name not in _HOMES:
            message = f"module {__name__!r} has no attribute {name!r}"
            raise AttributeError(message, name=name)
        home = _HOMES[name]
        if home == __name__ or not hasattr(
            import_module(home), name
        ):  # a module, such as `stability`
            value = import_module(f"{home}.{name}")
        else:
            value = getattr(import_module(home), name)
        globals()[name] = value
        return value


def __dir__() -> list[str]:
    return __all__
