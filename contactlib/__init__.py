"""Creep force element for vehicle dynamics: the Carter-Griffith law from table to FMU.

import contactlib as cl

law = cl.CarterGriffith(k_hat=0.3)              # the law itself
table = cl.CreepForceTable.from_law(cl.CarterGriffith, contact="line")
model = cl.load_model("models/roller_rig.toml") # a wheelset
cl.export_fmu(model, "CreepForceElement.fmu")   # for any vehicle tool
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:  # the public names and their modules; each is imported at its first use
    __version__: str

    # The rooms, which contain these names and all others.
    from contactlib import element as element
    from contactlib import export as export
    from contactlib import figures as figures
    from contactlib import files as files
    from contactlib import laws as laws
    from contactlib import logs as logs
    from contactlib import runs as runs
    from contactlib import stability as stability
    from contactlib import table as table
    from contactlib import traction as traction
    from contactlib import vehicle as vehicle

    # isort: split
    # Vehicle engineers: the element, its parameters from files, its FMU.
    from contactlib.base.quantities import InputWarning as InputWarning
    from contactlib.element import CreepForces as CreepForces
    from contactlib.element import ForceElement as ForceElement
    from contactlib.element import roll as roll
    from contactlib.export import export_fmu as export_fmu
    from contactlib.export import export_kernel as export_kernel
    from contactlib.export import export_ssp as export_ssp
    from contactlib.export import lookup_table as lookup_table
    from contactlib.files import Model as Model
    from contactlib.files import ModelError as ModelError
    from contactlib.files import load_model as load_model

    # isort: split
    # Measured data, contact, friction and laws.
    from contactlib.laws import CarterGriffith as CarterGriffith
    from contactlib.laws import CohesiveZone as CohesiveZone
    from contactlib.laws import EllipticContact as EllipticContact
    from contactlib.laws import Friction as Friction
    from contactlib.laws import LineContact as LineContact
    from contactlib.laws import Material as Material
    from contactlib.laws import MeasuredCurve as MeasuredCurve
    from contactlib.laws import Polach as Polach
    from contactlib.laws import TractionData as TractionData
    from contactlib.laws import friction_with_k_hat as friction_with_k_hat
    from contactlib.laws import relaxation_lengths as relaxation_lengths
    from contactlib.laws.fit import fit as fit
    from contactlib.table import CreepForceTable as CreepForceTable
    from contactlib.table import carter_griffith_table as carter_griffith_table

    # isort: split
    # Stability of a wheelset.
    from contactlib.runs import simulate as simulate
    from contactlib.stability import controllability as controllability
    from contactlib.stability import creep_control_gain as creep_control_gain
    from contactlib.stability import find_fold as find_fold
    from contactlib.stability import steady_states as steady_states
    from contactlib.stability import worst_pole as worst_pole
    from contactlib.stability.clearing import clearing as clearing
    from contactlib.stability.s_curve import s_curve as s_curve
    from contactlib.vehicle import CreepControl as CreepControl
    from contactlib.vehicle import Profile as Profile
    from contactlib.vehicle import TorqueControl as TorqueControl
    from contactlib.vehicle import Wheelset as Wheelset

    # isort: split
    # Traction control: scenarios, controllers, many runs.
    from contactlib.files import Scenario as Scenario
    from contactlib.files import load_scenario as load_scenario
    from contactlib.runs import Plant as Plant
    from contactlib.runs import Result as Result
    from contactlib.runs import ensemble as ensemble
    from contactlib.runs import load_sweep as load_sweep
    from contactlib.runs import metrics as metrics
    from contactlib.runs import run_many as run_many
    from contactlib.runs import run_scenario as run_scenario
    from contactlib.runs import tune as tune
    from contactlib.traction import CONTROLLERS as CONTROLLERS
    from contactlib.traction import SampledController as SampledController
    from contactlib.traction import TractionController as TractionController
    from contactlib.vehicle import Track as Track

else:
    from importlib.metadata import version

    from contactlib.base.lazy import lazy_names

    _lazy, __dir__, __all__ = lazy_names(__name__)

    def __getattr__(name):
        return version("contactlib-rail") if name == "__version__" else _lazy(name)
