"""The only package that touches the native library.

It passes numpy arrays and C structs to the library and contains no contact mechanics. cffi reads
the declarations from the C headers, so each declaration exists once.
"""

from contactlib.kernel.bodies import LOAD_IN_KERNEL as LOAD_IN_KERNEL
from contactlib.kernel.bodies import NativeCreepForces as NativeCreepForces
from contactlib.kernel.bodies import NativeCurve as NativeCurve
from contactlib.kernel.bodies import NativeForceElement as NativeForceElement
from contactlib.kernel.bodies import NativeWheelset as NativeWheelset
from contactlib.kernel.bodies import contact_memory as contact_memory
from contactlib.kernel.bodies import contact_scales as contact_scales
from contactlib.kernel.bodies import creep_forces_limits as creep_forces_limits
from contactlib.kernel.bodies import force_input_limits as force_input_limits
from contactlib.kernel.bodies import half_space_scales as half_space_scales
from contactlib.kernel.bodies import hertz_integral as hertz_integral
from contactlib.kernel.bodies import hertz_semi_axes as hertz_semi_axes
from contactlib.kernel.bodies import memory_states as memory_states
from contactlib.kernel.bodies import process_zone_limit as process_zone_limit
from contactlib.kernel.bodies import relaxation_lengths as relaxation_lengths
from contactlib.kernel.bodies import thermal_softening as thermal_softening
from contactlib.kernel.bodies import wheelset_limits as wheelset_limits
from contactlib.kernel.drivetrains import NativeFleet as NativeFleet
from contactlib.kernel.drivetrains import NativeMember as NativeMember
from contactlib.kernel.drivetrains import NativePads as NativePads
from contactlib.kernel.drivetrains import NativePeaks as NativePeaks
from contactlib.kernel.drivetrains import NativeTrack as NativeTrack
from contactlib.kernel.drivetrains import drivetrain_dtype as drivetrain_dtype
from contactlib.kernel.lateral_spin import lateral_spin_forces as lateral_spin_forces
from contactlib.kernel.lateral_spin import lateral_spin_sizes as lateral_spin_sizes
from contactlib.kernel.library import ffi as ffi
from contactlib.kernel.library import library as library
from contactlib.kernel.library import library_path as library_path
from contactlib.kernel.library import platform_name as platform_name
from contactlib.kernel.library import struct_dtype as struct_dtype
from contactlib.kernel.library import token as token
from contactlib.kernel.models import GIVEN as GIVEN
from contactlib.kernel.models import MODEL_KINDS as MODEL_KINDS
from contactlib.kernel.models import NativeModel as NativeModel
from contactlib.kernel.models import Variable as Variable
from contactlib.kernel.models import model_variables as model_variables
from contactlib.kernel.runs import NativeLaw as NativeLaw
from contactlib.kernel.runs import NativeRun as NativeRun
from contactlib.kernel.runs import run_wheelset as run_wheelset
from contactlib.kernel.tables import TABLE_MAGIC as TABLE_MAGIC
from contactlib.kernel.tables import TABLE_VERSION as TABLE_VERSION
from contactlib.kernel.tables import NativeContact as NativeContact
from contactlib.kernel.tables import NativeTable as NativeTable
from contactlib.kernel.tables import framed as framed
from contactlib.kernel.tables import shipped_path as shipped_path
from contactlib.kernel.tables import table_coordinate as table_coordinate
from contactlib.kernel.tables import table_nodes as table_nodes
from contactlib.kernel.vehicles import NODE_DISTANCE as NODE_DISTANCE
from contactlib.kernel.vehicles import NativeRails as NativeRails
from contactlib.kernel.vehicles import NativeVehicle as NativeVehicle
from contactlib.kernel.vehicles import NativeVehicles as NativeVehicles
from contactlib.kernel.vehicles import rail_nodes as rail_nodes
from contactlib.kernel.vehicles import rails_file as rails_file
from contactlib.kernel.vehicles import vehicle_loads as vehicle_loads
