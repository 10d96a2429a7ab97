"""The creep force laws and what they need: contact, friction, heat, measured curves, fits."""

from contactlib.laws.carter_griffith import CarterGriffith
from contactlib.laws.cohesive import CohesiveZone
from contactlib.laws.cohesive_zone import ConvergenceError
from contactlib.laws.fit import FitResult, fit
from contactlib.laws.friction import EXPONENTIAL, Friction, Weakening
from contactlib.laws.heat import ContactHeat, Softening, ThermalMaterial
from contactlib.laws.hertz import EllipticContact, LineContact, Material
from contactlib.laws.kalker import KalkerCoefficients, kalker_coefficients
from contactlib.laws.measured import MeasuredCurve
from contactlib.laws.polach import Polach
from contactlib.laws.relaxation import RelaxationLengths, relaxation_lengths
from contactlib.laws.scales import (
    friction_with_k_hat,
    k_hat,
    process_zone_ratio,
    saturation_creepage,
)
from contactlib.laws.thermal_contact import ThermalContact
from contactlib.laws.traction_data import TractionData

__all__ = [
    "EXPONENTIAL",
    "CarterGriffith",
    "CohesiveZone",
    "ContactHeat",
    "ConvergenceError",
    "EllipticContact",
    "FitResult",
    "Friction",
    "KalkerCoefficients",
    "LineContact",
    "Material",
    "MeasuredCurve",
    "Polach",
    "RelaxationLengths",
    "Softening",
    "ThermalContact",
    "ThermalMaterial",
    "TractionData",
    "Weakening",
    "fit",
    "friction_with_k_hat",
    "k_hat",
    "kalker_coefficients",
    "process_zone_ratio",
    "relaxation_lengths",
    "saturation_creepage",
]
