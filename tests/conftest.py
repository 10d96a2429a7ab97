"""Objects that several test modules share; building them is not what is tested."""

from __future__ import annotations

import os
from functools import partial

import pytest

import contactlib as cl
from contactlib import law_tables
from contactlib import table as table_module
from contactlib.table import CreepForceTable


@pytest.fixture(scope="session")
def table() -> cl.CreepForceTable:
    return cl.CreepForceTable.from_law(cl.CarterGriffith, contact="line")


@pytest.fixture(scope="session")
def rig(table: cl.CreepForceTable) -> cl.Model:
    return cl.load_model("models/roller_rig.toml", table=table)


@pytest.fixture(scope="session")
def locomotive(table: cl.CreepForceTable) -> cl.Model:
    return cl.load_model("models/locomotive.toml", table=table)


@pytest.fixture(scope="session")
def cohesive_table(tmp_path_factory: pytest.TempPathFactory) -> CreepForceTable:
    """On a coarse grid, as the fine one takes a minute; xdist's workers share its file."""
    folder = tmp_path_factory.getbasetemp()
    file = (folder.parent if "PYTEST_XDIST_WORKER" in os.environ else folder) / "cohesive.bin"
    if not file.exists():
        coarse_cohesive_table().save(file)
    return CreepForceTable.load(file)


def coarse_cohesive_table() -> CreepForceTable:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(table_module, "CORNER_GRIDS", {4: ((128, 24),)})
        patch.setattr(table_module, "CERTIFIED_K_HATS", 8)
        patch.setattr(table_module, "SLOPE_TARGET", 3e-3)
        patch.setattr(CreepForceTable, "from_law", partial(CreepForceTable.from_law, target=1e-4))
        patch.setattr(law_tables, "_cohesive", {})  # others of this process get the fine one
        return law_tables.cohesive_table("line", 0.45 / 0.21)
