"""Creep force element for vehicle dynamics: the Carter-Griffith law from table to FMU.

import contactlib as cl

law = cl.CarterGriffith(k_hat=0.3)              # the law itself
table = cl.CreepForceTable.from_law(cl.CarterGriffith, contact="line")
model = cl.load_model("models/roller_rig.toml") # a wheelset and its runs
cl.export_fmu(model, "CreepForceElement.fmu")   # for any vehicle tool
"""

from contactlib.comparison import comparison_table, write_comparison
from contactlib.control_systems import (
    closed_loop,
    creep_control_system,
    creep_loop,
    margins,
    nyquist,
    open_loop,
    operating_point,
    phase_plane_system,
    response,
    root_locus,
    sampled_loop,
)
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
    Basin,
    Clearing,
    Controllability,
    Fold,
    ReducedPlant,
    SCurve,
    SteadyStates,
    Window,
    WorstPole,
    approximate_pole,
    basin,
    clearing,
    clearing_distance,
    clearing_time,
    controllability,
    creep_control_gain,
    delay_limit,
    fast_pole,
    find_fold,
    pi_stable,
    poles,
    proportional_window,
    quasi_steady_torque,
    reduced_plant,
    s_curve,
    sampled_delay,
    separatrix,
    slip_away_estimate,
    slip_away_formula,
    slip_away_time,
    slope_threshold,
    steady_states,
    worst_pole,
)
from contactlib.table import CreepForceTable
from contactlib.torsion import (
    antiphase_eigenvalues,
    bistable_range,
    effective_slope,
    torsional_jacobian,
    torsional_state,
    torsional_threshold,
)
from contactlib.track import Track
from contactlib.wheelset import OperatingPoint, Resistance, Wheelset

__all__ = [
    "EXPONENTIAL",
    "Axle",
    "Basin",
    "CarterGriffith",
    "Clearing",
    "CohesiveZone",
    "Controllability",
    "ConvergenceError",
    "CreepControl",
    "CreepForceTable",
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
    "Metrics",
    "Model",
    "ModelError",
    "OperatingPoint",
    "Polach",
    "ProcessZoneWarning",
    "Profile",
    "ReducedPlant",
    "Resistance",
    "Result",
    "SCurve",
    "Scenario",
    "SteadyStates",
    "TorqueControl",
    "Track",
    "TractionData",
    "Weakening",
    "Wheelset",
    "Window",
    "WorstPole",
    "antiphase_eigenvalues",
    "approximate_pole",
    "available_force",
    "basin",
    "bistable_range",
    "carter_griffith_table",
    "clearing",
    "clearing_distance",
    "clearing_time",
    "closed_loop",
    "cohesive_table",
    "comparison_table",
    "controllability",
    "cosimulate",
    "creep_control_gain",
    "creep_control_system",
    "creep_loop",
    "delay_limit",
    "effective_slope",
    "export_fmu",
    "export_ssp",
    "fast_pole",
    "find_fold",
    "fit",
    "friction_with_k_hat",
    "k_hat",
    "load_model",
    "load_scenario",
    "margins",
    "metrics",
    "model_path",
    "nyquist",
    "open_loop",
    "operating_point",
    "phase_plane_system",
    "pi_stable",
    "poles",
    "process_zone_ratio",
    "proportional_window",
    "quasi_steady_torque",
    "reduced_plant",
    "response",
    "root_locus",
    "s_curve",
    "sampled_delay",
    "sampled_loop",
    "saturation_creepage",
    "separatrix",
    "simulate",
    "slip_away_estimate",
    "slip_away_formula",
    "slip_away_time",
    "slope_threshold",
    "steady_states",
    "torsional_jacobian",
    "torsional_state",
    "torsional_threshold",
    "worst_pole",
    "write_comparison",
]
