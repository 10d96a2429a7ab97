"""Objects that several test modules share; building them is not what is tested."""

from __future__ import annotations

import pytest

import contactlib as cl


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
def cohesive_table() -> cl.CreepForceTable:
    return cl.cohesive_table("line", 0.45 / 0.21)
