"""An instance of an FMU with its variables by name, alike for FMI 2 and FMI 3; and which FMUs."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple, Self

import fmpy
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Model, FMU2Slave, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
from fmpy.fmi3 import FMU3Model, FMU3Slave

# Every kind of FMU that can be exported: arguments of `export_fmu` by name. A name that ends in
# "memory" is for models with memory: see `fitting` in exported_fmu.py.
EXPORTS: dict[str, dict[str, Any]] = {
    "force_element": {"kind": "force_element"},
    "force_element-memory": {"kind": "force_element"},
    "force_element-implicit": {"kind": "force_element", "implicit": True},
    "wheelset": {"kind": "wheelset"},
    "wheelset-memory": {"kind": "wheelset"},
    "wheelset_body": {"kind": "wheelset_body"},
    "creep_forces": {"kind": "creep_forces"},
    "vehicle": {"kind": "vehicle"},
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
    """An FMU that was unpacked, its variables by name, its log. A context manager, which ends it.

    `log` takes pairs of a category and a text; `description` is that of an instance before.
    """

    def __init__(
        self,
        folder: Path,
        *,
        exchange: bool = False,
        token: str | None = None,
        log: list[tuple[str, str]] | None = None,
        logging: bool = True,
        description: Any = None,
    ) -> None:
        self.description = description or fmpy.read_model_description(str(folder), validate=False)
        self.version = int(self.description.fmiVersion[0])
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}
        self.booleans = {v.name for v in self.description.modelVariables if v.type == "Boolean"}
        self.log: list[tuple[str, str]] = [] if log is None else log
        classes = {2: (FMU2Slave, FMU2Model), 3: (FMU3Slave, FMU3Model)}
        self.fmu: Any = classes[self.version][exchange](
            guid=self.description.guid if token is None else token,
            unzipDirectory=str(folder),
            modelIdentifier=self.description.modelName,
            instanceName="test",
        )
        if self.version == 2:
            self._set, self._get = self.fmu.setReal, self.fmu.getReal
            self.callbacks = fmi2CallbackFunctions()
            self.callbacks.logger = fmi2CallbackLoggerTYPE(
                lambda environment, name, status, *given: self._note(*given)
            )
            self.fmu.instantiate(callbacks=self.callbacks, loggingOn=logging)
        else:
            self._set, self._get = self.fmu.setFloat64, self.fmu.getFloat64
            self.fmu.instantiate(
                loggingOn=logging,
                logMessage=lambda environment, status, *given: self._note(*given),
            )

    def _note(self, category: bytes, text: bytes) -> None:
        self.log.append((category.decode(), text.decode()))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *unused: object) -> None:
        self.fmu.freeInstance()

    @property
    def message(self) -> str:
        """Text of the last message."""
        return self.log[-1][1]

    @contextmanager
    def refused(self, *words: str, status: int | None = None) -> Iterator[None]:
        """The call inside fails, with this status and these words in the last message."""
        with pytest.raises(FMICallException) as raised:
            yield
        assert status in (None, raised.value.status)
        for word in words:
            assert word in self.message

    def initialize(self, time: float = 0.0, **options: float) -> Self:
        """Enter initialization; options are the tolerance and the stop time, as FMPy calls them."""
        if self.version == 2:
            self.fmu.setupExperiment(startTime=time, **options)
            self.fmu.enterInitializationMode()
        else:
            self.fmu.enterInitializationMode(startTime=time, **options)
        return self

    def start(self, time: float = 0.0, **values: float) -> Self:
        """Initialize with these values."""
        self.initialize(time)
        self.set(**values)
        self.fmu.exitInitializationMode()
        return self

    def set(self, **values: float) -> None:
        """Set real variables."""
        if values:
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

    def derivative(
        self, unknowns: list[str], knowns: list[str], seed: list[float], *, adjoint: bool = False
    ) -> list[float]:
        """Directional derivative, or adjoint one."""
        of = [self.references[name] for name in unknowns]
        to = [self.references[name] for name in knowns]
        if adjoint:
            return list(self.fmu.getAdjointDerivative(of, to, seed, len(knowns)))
        return list(self.fmu.getDirectionalDerivative(of, to, seed))

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


class Wheels:
    """An instance with several wheels, its variables by name and wheel, alike for both versions."""

    def __init__(self, tool: Instance, count: int) -> None:
        self.tool, self.version, self.count = tool, tool.version, count
        self.inputs = self._of("input")
        self.outputs = self._of("output")

    def _of(self, causality: str) -> list[str]:
        variables = self.tool.description.modelVariables
        names = (v.name.split("[")[0] for v in variables if v.causality == causality)
        return list(dict.fromkeys(names))

    def scalars(self, name: str) -> list[str]:
        """Names of the variables that hold a variable of each wheel."""
        if self.version == 3 or self.count == 1:
            return [name]
        stem, end = (name[:-1], ")") if name.endswith(")") else (name, "")
        return [f"{stem}[{i + 1}]{end}" for i in range(self.count)]

    def references(self, *names: str) -> list[int]:
        return [self.tool.references[scalar] for name in names for scalar in self.scalars(name)]

    def set(self, **values: list[float]) -> None:
        for name, each in values.items():
            set_values = self.tool.fmu.setFloat64 if self.version == 3 else self.tool.fmu.setReal
            set_values(self.references(name), each)

    def get(self, name: str) -> list[float]:
        """Value of each wheel."""
        of, fmu = self.references(name), self.tool.fmu
        if self.version == 2:
            boolean = self.scalars(name)[0] in self.tool.booleans
            return list(map(float, (fmu.getBoolean if boolean else fmu.getReal)(of)))
        boolean = name in self.tool.booleans
        return list(map(float, (fmu.getBoolean if boolean else fmu.getFloat64)(of, self.count)))
