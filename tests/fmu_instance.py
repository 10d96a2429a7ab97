"""An instance of an FMU with its variables by name, alike for FMI 2 and FMI 3; and which FMUs."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple, Self

import fmpy
import fmpy.simulation

# Every kind of FMU that can be exported: arguments of `export_fmu` by name.
EXPORTS: dict[str, dict[str, Any]] = {
    "force_element": {"kind": "force_element"},
    "force_element-relaxed": {"kind": "force_element", "relaxation_length": 8e-3},
    "force_element-implicit": {"kind": "force_element", "implicit": True},
    "wheelset": {"kind": "wheelset"},
    "wheelset-relaxed": {"kind": "wheelset", "relaxation_length": 8e-3},
    "wheelset_body": {"kind": "wheelset_body"},
}


class Subject(NamedTuple):
    """A kind of FMU in one version of the standard."""

    name: str
    version: int

    @property
    def arguments(self) -> dict[str, Any]:
        """What `export_fmu` takes beside model and path."""
        return {**EXPORTS[self.name], "fmi_version": self.version}

    def __str__(self) -> str:
        """Name of the test that is run with it."""
        return f"{self.name}-fmi{self.version}"


class Instance:
    """An FMU that was unpacked, in co-simulation. A context manager, which ends it."""

    def __init__(self, folder: Path) -> None:
        self.description = fmpy.read_model_description(str(folder))
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}
        self.booleans = {v.name for v in self.description.modelVariables if v.type == "Boolean"}
        self.version = int(self.description.fmiVersion[0])
        self.fmu: Any = fmpy.simulation.instantiate_fmu(
            str(folder), self.description, "CoSimulation"
        )
        if self.version == 2:
            self._set, self._get = self.fmu.setReal, self.fmu.getReal
        else:
            self._set, self._get = self.fmu.setFloat64, self.fmu.getFloat64

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *unused: object) -> None:
        self.fmu.freeInstance()

    def start(self, time: float = 0.0, **values: float) -> Self:
        """Initialize with these values."""
        if self.version == 2:
            self.fmu.setupExperiment(startTime=time)
            self.fmu.enterInitializationMode()
        else:
            self.fmu.enterInitializationMode(startTime=time)
        self.set(**values)
        self.fmu.exitInitializationMode()
        return self

    def set(self, **values: float) -> None:
        """Set real variables."""
        self._set([self.references[name] for name in values], list(values.values()))

    def get(self, *names: str) -> list[float]:
        """Values of real and Boolean variables."""
        return [
            float((self.fmu.getBoolean if name in self.booleans else self._get)([reference])[0])
            for name, reference in ((name, self.references[name]) for name in names)
        ]

    def step(self, time: float, step: float) -> None:
        """One communication step."""
        self.fmu.doStep(currentCommunicationPoint=time, communicationStepSize=step)

    def saved(self) -> bytes:
        """Its state as bytes."""
        state = self.fmu.getFMUState()
        data = self.fmu.serializeFMUState(state)
        self.fmu.freeFMUState(state)
        return bytes(data)

    def restore(self, data: bytes) -> None:
        """Take a state over."""
        state = self.fmu.deserializeFMUState(data)
        self.fmu.setFMUState(state)
        self.fmu.freeFMUState(state)
