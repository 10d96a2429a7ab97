"""Objects that several test modules share; building them is not what is tested."""

from __future__ import annotations

import os
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # each worker has one core

import pytest
from explorer_page import ExplorerPage, explorer_page
from outside_tools import missing

import contactlib as cl
from contactlib.table import building as table_module
from contactlib.table import cohesive_layers, corner_sampling, law_tables
from contactlib.table.creep_force_table import CreepForceTable

if TYPE_CHECKING:
    from native_programs import Build


def pytest_addoption(parser: pytest.Parser) -> None:
    text = "of each test with many cases run the first: another version of a library fails them all"
    parser.addoption("--one-case", action="store_true", help=text)


@pytest.hookimpl(trylast=True)  # of those that the markers leave
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if config.getoption("one_case"):
        first = {item.nodeid.partition("[")[0]: item for item in reversed(items)}
        config.hook.pytest_deselected(items=[item for item in items if item not in first.values()])
        items[:] = reversed(first.values())


def pytest_xdist_auto_num_workers(config: pytest.Config) -> int | None:
    """One process for a single test module; as many as there are cores for more."""
    if len(config.args) == 1 and Path(config.args[0].partition("::")[0]).is_file():
        config.option.dist = "no"
        return 0
    return None  # xdist's own choice


@pytest.fixture(scope="session")
def table() -> cl.CreepForceTable:
    return cl.CreepForceTable.from_law(cl.CarterGriffith, contact="line")


@pytest.fixture(scope="session")
def rig(table: cl.CreepForceTable) -> cl.Model:
    return cl.load_model("models/roller_rig.toml", table=table)


@pytest.fixture(scope="session")
def locomotive() -> cl.Model:
    return cl.load_model("models/locomotive.toml")


@pytest.fixture(scope="module")
def page() -> Iterator[ExplorerPage]:
    """The explorer in a browser."""
    with explorer_page() as opened:
        yield opened


@pytest.fixture(scope="session")
def sanitized(tmp_path_factory: pytest.TempPathFactory) -> Build:
    """The C sources under the sanitizers, compiled once for all programs and fuzz targets."""
    import fuzz
    from native_programs import SANITIZED, Build

    folder = tmp_path_factory.mktemp("sanitized")
    if not fuzz.can_fuzz(folder):
        missing("there is no clang with libFuzzer and the sanitizers' runtimes")
    return Build(folder, SANITIZED)


@pytest.fixture(scope="session")
def cohesive_table(tmp_path_factory: pytest.TempPathFactory) -> CreepForceTable:
    """On a coarse grid, as the fine one takes seconds; xdist's workers share its file.

    It has no layers.
    """
    return coarse_cohesive_table(tmp_path_factory, layers=False)


@pytest.fixture(scope="session")
def layered_cohesive_table(tmp_path_factory: pytest.TempPathFactory) -> CreepForceTable:
    """The same with coarse layers."""
    return coarse_cohesive_table(tmp_path_factory, layers=True)


def coarse_cohesive_table(made: pytest.TempPathFactory, layers: bool) -> CreepForceTable:
    folder = made.getbasetemp()
    folder = folder.parent if "PYTEST_XDIST_WORKER" in os.environ else folder
    file = folder / f"cohesive{'_layers' * layers}.bin"
    if not file.exists():
        build_coarse_cohesive_table(layers).save(file)
    return CreepForceTable.load(file)


def build_coarse_cohesive_table(layers: bool) -> CreepForceTable:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(table_module, "CORNER_GRIDS", {4: ((128, 24),)})
        patch.setattr(table_module, "CERTIFIED_K_HATS", 8)
        for panels, number in (("K_PANELS", 2), ("BELOW", 3), ("BEYOND", 2)):
            patch.setattr(corner_sampling, panels, number)
        coarse = partial(CreepForceTable.from_law, target=1e-4, slope_target=3e-3)
        patch.setattr(CreepForceTable, "from_law", coarse)
        patch.setattr(cohesive_layers, "CELLS", (48, 8, 14))
        patch.setattr(cohesive_layers, "SPACING", (0.2, 0.5))
        patch.setattr(table_module, "CERTIFIED_LAYERS", (3, 7))
        # Others, of this process and of this user, get the fine one.
        patch.setattr(law_tables, "_cohesive", {})
        patch.setattr(law_tables, "_kept", lambda name, build: build())
        return law_tables.cohesive_table("line", 0.45 / 0.21, layers=layers)
