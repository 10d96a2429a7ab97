"""Export a model for other tools, as an FMU or as an SSP package of coupled FMUs."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from contactlib.base.writing import write_whole
from contactlib.export.explorer import write_explorer
from contactlib.export.kernel_source import export_kernel
from contactlib.export.lookup import lookup_table
from contactlib.export.package import describe, fmu
from contactlib.export.ssp import export_ssp

if TYPE_CHECKING:
    from contactlib.files.model import Model
    from contactlib.files.scenario import Scenario

__all__ = [
    "export_fmu",
    "export_kernel",
    "export_ssp",
    "lookup_table",
    "write_explorer",
]


def export_fmu(
    model: Model | Scenario,
    path: str | os.PathLike[str],
    *,
    fmi_version: int = 2,
    kind: str | None = None,
    platforms: Sequence[str] | None = None,
    implicit: bool = False,
    parallel_exchange: bool = False,
    booleans: bool = True,
    brake_pressure: bool = False,
    wheels: int = 1,
    per_wheel: Sequence[str] = (),
    author: str | None = None,
    version: str | None = None,
) -> Path:
    """Write `model` as an FMU for model exchange and co-simulation.

    Parameters
    ----------
    model : Model or Scenario
        Gives parameters, table and start values; a scenario those of its vehicle, with its rails.
    path : path
        File to write.
    fmi_version : {2, 3}, optional
        Version of the FMI standard. Default: 2.
    kind : {"force_element", "wheelset", "wheelset_body", "creep_forces", "vehicle"}, optional
        Creep force for given velocities (default of a model); wheelset with its creep force, for a
        given drive torque; wheelset for a given creep force; `CreepForces`, for given ellipse, load
        and creepages; or the vehicle of a scenario (its default), for given torques of its axles:
        without controllers, sensors, driver, dead time of the brake, and limits of the drive.
    platforms : sequence of str, optional
        FMI 3 platform tuples, such as ``"x86_64-linux"``, or ``["all"]``. A library that the
        installation lacks is compiled, which takes some seconds, and cached. Default: this
        machine's.
    implicit, parallel_exchange : bool, optional
        Start values of the force element's parameters of these names: whether the element solves
        its own slip over a step, and whether both sides of the coupling step in parallel. Default:
        False.
    booleans : bool, optional
        Whether flags are Booleans. If not, they are real numbers, 0 or 1, for tools that read every
        output as a real number, as CasADi, CoFmuPy and PathSim do. Default: True.
    brake_pressure : bool, optional
        Whether a vehicle has the inputs ``brake_pressure``, which act at once as
        `contactlib.vehicle.Brake` converts them, in place of the commanded ``brake_torque``, which
        its times to fill and vent delay. Default: False.
    wheels : int, optional
        Number of wheels, or of wheelsets of kind "wheelset", that one call steps side by side, at
        most 32. Their inputs, outputs and states are arrays in FMI 3, as ``omega`` with 8 elements,
        and variables ``omega[1]`` to ``omega[8]`` in FMI 2. Default: 1.
    per_wheel : sequence of str, optional
        Names of parameters that each wheel has for itself, such as ``["static_friction"]``.
        Default: the wheels have all parameters in common. The axles of a vehicle always have
        positions and radii of their own.
    author, version : str, optional
        Of the exported model, for its description. Default: not stated.

    Returns
    -------
    Path
        The written file.

    Raises
    ------
    ValueError
        If an argument is invalid or does not apply to the kind, or a platform's library is missing
        and there is no compiler; the message names the command that installs it.
    RuntimeError
        If the reference run of the FMU fails; a file at `path` stays as it is.
    """
    description = describe(
        model,
        kind,
        implicit,
        parallel_exchange,
        booleans=booleans,
        brake_pressure=brake_pressure,
        wheels=wheels,
        per_wheel=per_wheel,
        author=author,
        version=version,
    )
    return write_whole(path, fmu(description, fmi_version, platforms))
