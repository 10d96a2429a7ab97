"""Load an unpacked FMU's library, make an instance and free it again; a program of its own.

Arguments: folder, FMI version, interface, model identifier, token. The checker runs it apart, as a
library that is not sound can take its process with it.
"""

from __future__ import annotations

import sys
from typing import Any

from fmpy import fmi2, fmi3

CLASSES: dict[tuple[int, str], Any] = {
    (2, "ModelExchange"): fmi2.FMU2Model,
    (2, "CoSimulation"): fmi2.FMU2Slave,
    (3, "ModelExchange"): fmi3.FMU3Model,
    (3, "CoSimulation"): fmi3.FMU3Slave,
    (3, "ScheduledExecution"): fmi3.FMU3ScheduledExecution,
}


def main(folder: str, version: str, interface: str, identifier: str, token: str) -> None:
    """Instantiate and free; what goes wrong is an exception."""
    fmu = CLASSES[int(version), interface](
        unzipDirectory=folder, modelIdentifier=identifier, guid=token, instanceName="check"
    )
    said = fmu.getVersion()
    said = said.decode() if isinstance(said, bytes) else said
    if not said.startswith(f"{version}."):
        raise RuntimeError(f"fmi{version}GetVersion says {said!r}, must be {version}.0")
    fmu.instantiate()
    fmu.freeInstance()


if __name__ == "__main__":
    try:
        main(*sys.argv[1:])
    except Exception as error:  # FMPy raises bare exceptions
        sys.exit(str(error) or type(error).__name__)
