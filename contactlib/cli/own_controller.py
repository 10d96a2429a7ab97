"""A controller from a Python file that the user names on the command line."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import ModuleType

from contactlib.base.text import USERS_ERRORS, explained, known_names
from contactlib.files.scenario import Scenario, check_names
from contactlib.traction.interface import Controller, checked_controller


def load_controller(place: str) -> tuple[str, Controller]:
    """Run a Python file and return the name and the controller that `place` names in it.

    Parameters
    ----------
    place : str
        ``FILE.py:NAME``, the name of an object, or of a class that needs no arguments.

    Raises
    ------
    ValueError
        If `place` names no controller.
    OSError
        If the file cannot be read.
    RuntimeError
        If the file or the class raises an error.
    """
    file, _, name = place.rpartition(":")
    if not (file.endswith(".py") and name.isidentifier()):
        like = f"{Path(file).with_suffix('.py')}:{name}" if file else "my_file.py:MyController"
        raise ValueError(f"--controller {place} must be FILE.py:NAME, such as {like}")
    module = _run(Path(file))
    known, stem = vars(module), module.__name__
    if name not in known:
        names = [key for key, value in known.items() if getattr(value, "__module__", "") == stem]
        raise ValueError(
            f"--controller {place}: the file has no {name}; {known_names(name, names)}"
        )
    controller = known[name]
    if isinstance(controller, type):
        try:
            controller = controller()
        except USERS_ERRORS as error:
            line = explained(f"--controller {place}", error)
            raise RuntimeError(f"{line}; or name an object that the file makes of it") from error
    return name, checked_controller(f"--controller {place}", controller)


def with_controllers(
    path: str, scenario: Scenario, controllers: Mapping[str, Controller]
) -> Scenario:
    """Add controllers of the user's own to the scenario of a file.

    Raises
    ------
    ValueError
        If the scenario already has a controller of this name.
    """
    if taken := set(controllers) & set(scenario.controllers):
        raise ValueError(f"{path} has a controller {min(taken)} itself: take another name")
    every = {**scenario.controllers, **controllers}
    check_names(every)
    return replace(scenario, controllers=every)


OTHERWISE = "contactlib_own_controller"  # module's name, if another module has that of the file
_run_here: set[str] = set()


def _run(file: Path) -> ModuleType:
    """Run a file as a module; as for a script, it may import what lies beside it.

    Other processes import it by the name of the file.
    """
    file.stat()  # an OSError that names it
    name = file.stem if file.stem not in {*sys.modules} - _run_here else OTHERWISE
    _run_here.add(name)
    spec = importlib.util.spec_from_file_location(name, file)
    module = sys.modules[name] = importlib.util.module_from_spec(spec)  # type: ignore[arg-type]
    sys.path.insert(0, str(file.resolve().parent))
    try:
        spec.loader.exec_module(module)  # type: ignore[union-attr]
    except USERS_ERRORS as error:
        raise explained(f"--controller {file}", error) from error
    return module
