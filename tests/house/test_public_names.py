"""The package imports its public names when they are used, and not before."""

from __future__ import annotations

import importlib
import importlib.metadata
import pickle
import pydoc
import subprocess
import sys
from operator import attrgetter
from types import ModuleType

import pytest

import contactlib as cl

NAMES = dir(cl)
ROOMS = [name for name in NAMES if isinstance(getattr(cl, name), ModuleType)]
# What is loaded beyond Python's own library and this package.
OTHERS = """
import sys

before = set(sys.modules)
{code}
loaded = {{name.split(".")[0] for name in set(sys.modules) - before}}
print(*sorted(loaded - sys.stdlib_module_names - {{"contactlib"}}))
"""


def run(code: str) -> str:
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return done.stdout.strip()


def others(code: str) -> set[str]:
    return set(run(OTHERS.format(code=code)).split())


def test_import_loads_no_library() -> None:
    assert others("import contactlib") == set()


def test_command_loads_no_scientific_library() -> None:
    loaded = others("import contactlib.cli.commands")
    assert "click" in loaded
    assert not loaded & {"numpy", "scipy", "control", "matplotlib", "xarray", "cffi", "lxml"}


def test_wheelset_loads_neither_control_nor_figures_nor_tables_of_data() -> None:
    loaded = others("import contactlib; contactlib.Wheelset, contactlib.run_scenario")
    assert "scipy" in loaded
    assert not loaded & {"control", "matplotlib", "xarray", "pandas", "lxml", "fmpy"}


def test_few_names_are_on_top() -> None:
    assert len(NAMES) <= 62


@pytest.mark.parametrize(
    "name", [*NAMES, *(f"{r}.{n}" for r in ROOMS for n in getattr(cl, r).__all__)]
)
def test_every_name_is_there(name: str) -> None:
    value = attrgetter(name)(cl)
    if isinstance(value, ModuleType):
        assert value is importlib.import_module(value.__name__)
    elif callable(value):
        assert value.__module__.startswith("contactlib.")
        assert value.__name__ == name.split(".")[-1]
        assert pickle.loads(pickle.dumps(value)) is value  # noqa: S301


def test_version_is_that_of_the_installed_package() -> None:
    assert cl.__version__ == importlib.metadata.version("contactlib-rail")
    command = [sys.executable, "-m", "contactlib", "--version"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == f"contactlib, version {cl.__version__}"


def test_names_are_listed() -> None:
    assert {"Wheelset", "fit", "stability"} <= set(NAMES)
    code = "from contactlib import *; import contactlib as cl; print(dir(cl) == cl.__all__, *dir())"
    same, *there = run(code).split()
    assert same == "True"
    assert set(NAMES) <= set(there)
    described = pydoc.plain(pydoc.render_doc(cl))
    for name in NAMES:
        assert name in described


def test_other_attributes_are_as_of_any_module() -> None:
    import contactlib.base.writing

    assert contactlib.base.writing.write_whole.__module__ == "contactlib.base.writing"
    with pytest.raises(AttributeError, match=r"^module 'contactlib' has no attribute 'weelset'$"):
        _ = cl.weelset  # type: ignore[attr-defined]
    with pytest.raises(ImportError, match="cannot import name 'weelset' from 'contactlib'"):
        from contactlib import weelset  # type: ignore[attr-defined]  # noqa: F401
