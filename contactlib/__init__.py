"""Creep force element for vehicle dynamics: the Carter-Griffith law from table to FMU.

import contactlib as cl

law = cl.CarterGriffith(k_hat=0.3)              # the law itself
table = cl.CreepForceTable.from_law(cl.CarterGriffith, contact="line")
model = cl.load_model("models/roller_rig.toml") # a wheelset and its runs
cl.export_fmu(model, "CreepForceElement.fmu")   # for any vehicle tool
"""

from contactlib import control_systems, stability, torsion, traction
from contactlib.comparison import comparison_table, write_comparison
from contactlib.controllers import CreepControl, TorqueControl
from contactlib.cosimulation import FmuSource, KernelSource, cosimulate
from contactlib.data import TractionData
from contactlib.drivetrain import Axle, Drivetrain
from contactlib.element import (
    ForceElement,
    ProcessZoneWarning,
    friction_with_k_hat,
    k_hat,
    process_zone_ratio,
    saturation_creepage,
)
from contactlib.export import export_fmu, export_ssp
from contactlib.fit import FitResult, fit
from contactlib.friction import EXPONENTIAL, Friction, Weakening
from contactlib.hertz import EllipticContact, LineContact, Material
from contactlib.law_tables import carter_griffith_table, cohesive_table
from contactlib.laws import CarterGriffith, CohesiveZone, ConvergenceError, MeasuredCurve, Polach
from contactlib.metrics import Metrics, metrics
from contactlib.peak_force import available_force
from contactlib.profile import Profile
from contactlib.scenario import (
    Model,
    ModelError,
    Scenario,
    load_model,
    load_scenario,
    model_path,
)
from contactlib.simulation import Event, Result, simulate
from contactlib.stability import (
    Fold,
    basin,
    clearing,
    controllability,
    creep_control_gain,
    fast_pole,
    find_fold,
    quasi_steady_torque,
    s_curve,
    separatrix,
    slip_away_time,
    slope_threshold,
    steady_states,
    worst_pole,
)
from contactlib.table import CreepForceTable
from contactlib.track import Track
from contactlib.traction import (
    CONTROLLERS,
    CreepPI,
    Measurement,
    OpenLoop,
    Sensors,
    SlopeSeeking,
    ThresholdControl,
    TractionController,
)
from contactlib.traction_run import run_scenario
from contactlib.wheelset import OperatingPoint, Resistance, Wheelset

__all__ = [
    "CONTROLLERS",
    "EXPONENTIAL",
    "Axle",
    "CarterGriffith",
    "CohesiveZone",
    "ConvergenceError",
    "CreepControl",
    "CreepForceTable",
    "CreepPI",
    "Drivetrain",
    "EllipticContact",
    "Event",
    "FitResult",
    "FmuSource",
    "Fold",
    "ForceElement",
    "Friction",
    "KernelSource",
    "LineContact",
    "Material",
    "MeasuredCurve",
    "Measurement",
    "Metrics",
    "Model",
    "ModelError",
    "OpenLoop",
    "OperatingPoint",
    "Polach",
    "ProcessZoneWarning",
    "Profile",
    "Resistance",
    "Result",
    "Scenario",
    "Sensors",
    "SlopeSeeking",
    "ThresholdControl",
    "TorqueControl",
    "Track",
    "TractionController",
    "TractionData",
    "Weakening",
    "Wheelset",
    "available_force",
    "basin",
    "carter_griffith_table",
    "clearing",
    "cohesive_table",
    "comparison_table",
    "control_systems",
    "controllability",
    "cosimulate",
    "creep_control_gain",
    "export_fmu",
    "export_ssp",
    "fast_pole",
    "find_fold",
    "fit",
    "friction_with_k_hat",
    "k_hat",
    "load_model",
    "load_scenario",
    "metrics",
    "model_path",
    "process_zone_ratio",
    "quasi_steady_torque",
    "run_scenario",
    "s_curve",
    "saturation_creepage",
    "separatrix",
    "simulate",
    "slip_away_time",
    "slope_threshold",
    "stability",
    "steady_states",
    "torsion",
    "traction",
    "worst_pole",
    "write_comparison",
]
