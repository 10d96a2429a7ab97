"""Tables of a law: building, reading, and the certificate of their error."""

from contactlib.table.creep_force_table import CreepForceTable
from contactlib.table.law_tables import carter_griffith_table, cohesive_table

__all__ = [
    "CreepForceTable",
    "carter_griffith_table",
    "cohesive_table",
]
