"""The FMU checker: a good FMU has no problem, and each fault is called by its name."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import pytest
from click.testing import CliRunner

import contactlib as cl
from contactlib.checker import binaries, check_fmu, loading
from contactlib.checker.xml import parse
from contactlib.cli import main

Files = dict[str, bytes]

# Sources instead of libraries: then nothing is loaded, and a case takes no time.
FMI2 = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="wheel" guid="{1}" numberOfEventIndicators="0">
<ModelExchange modelIdentifier="wheel" canGetAndSetFMUstate="true" canSerializeFMUstate="true">
<SourceFiles><File name="wheel.c"/></SourceFiles></ModelExchange>
<CoSimulation modelIdentifier="wheel"><SourceFiles><File name="wheel.c"/></SourceFiles></CoSimulation>
<UnitDefinitions><Unit name="N"><BaseUnit kg="1" m="1" s="-2"/><DisplayUnit name="kN" factor="1e-3"/></Unit>
<Unit name="m"/></UnitDefinitions>
<TypeDefinitions><SimpleType name="Load"><Real unit="N" displayUnit="kN" min="0" max="10"/></SimpleType>
<SimpleType name="Rail"><Enumeration><Item name="dry" value="1"/><Item name="wet" value="2"/></Enumeration></SimpleType>
</TypeDefinitions>
<LogCategories><Category name="logStatusError"/><Category name="logEvents"/></LogCategories>
<DefaultExperiment startTime="0" stopTime="10" tolerance="1e-6" stepSize="1e-3"/>
<ModelVariables>
<ScalarVariable name="load" valueReference="0" causality="input"><Real declaredType="Load" start="5"/></ScalarVariable>
<ScalarVariable name="rail" valueReference="0" causality="parameter" variability="fixed"><Enumeration declaredType="Rail" start="2"/></ScalarVariable>
<ScalarVariable name="gain" valueReference="1" causality="parameter" variability="tunable"><Real min="-1" max="1" nominal="0.5" start="0.25"/></ScalarVariable>
<ScalarVariable name="x" valueReference="2" initial="exact"><Real unit="m" start="0" reinit="true"/></ScalarVariable>
<ScalarVariable name="der(x)" valueReference="3"><Real derivative="4"/></ScalarVariable>
<ScalarVariable name="force" valueReference="4" causality="output"><Real unit="N"/></ScalarVariable>
<ScalarVariable name="force_too" valueReference="4"><Real unit="N"/></ScalarVariable>
<ScalarVariable name="sliding" valueReference="5" causality="output" variability="discrete"><Boolean/></ScalarVariable>
<ScalarVariable name="mass" valueReference="6" causality="calculatedParameter" variability="fixed"><Real/></ScalarVariable>
<ScalarVariable name="g" valueReference="7" variability="constant"><Real start="9.81"/></ScalarVariable>
<ScalarVariable name="time" valueReference="8" causality="independent"><Real/></ScalarVariable>
</ModelVariables>
<ModelStructure>
<Outputs><Unknown index="6" dependencies="1 4" dependenciesKind="dependent constant"/><Unknown index="8"/></Outputs>
<Derivatives><Unknown index="5" dependencies="4 11"/></Derivatives>
<InitialUnknowns><Unknown index="5" dependencies="3"/><Unknown index="6"/><Unknown index="8"/><Unknown index="9"/></InitialUnknowns>
</ModelStructure>
</fmiModelDescription>
"""  # noqa: E501

FMI3 = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="wheel" instantiationToken="{1}">
<ModelExchange modelIdentifier="wheel"/>
<CoSimulation modelIdentifier="wheel" providesIntermediateUpdate="true" canReturnEarlyAfterIntermediateUpdate="true" fixedInternalStepSize="1e-3"/>
<UnitDefinitions><Unit name="N"><DisplayUnit name="1/N" factor="1" inverse="true"/></Unit></UnitDefinitions>
<ModelVariables>
<Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>
<UInt64 name="size" valueReference="1" causality="structuralParameter" start="2" max="18446744073709551615"/>
<Float64 name="load" valueReference="2" causality="input" unit="N" start="1 2"><Dimension valueReference="1"/><Alias name="weight" displayUnit="1/N"/></Float64>
<Float64 name="x" valueReference="3" initial="exact" start="0"/>
<Float64 name="der(x)" valueReference="4" derivative="3"/>
<Float32 name="force" valueReference="5" causality="output"/>
<Int8 name="count" valueReference="6" causality="output"/>
<String name="label" valueReference="7" causality="parameter"><Start value="left"/></String>
<Clock name="tick" valueReference="8" causality="input" intervalVariability="triggered"/>
<Float64 name="sampled" valueReference="9" variability="discrete" clocks="8" previous="10"/>
<Float64 name="before" valueReference="10" variability="discrete" clocks="8"/>
<Float64 name="indicator" valueReference="11"/>
</ModelVariables>
<ModelStructure>
<Output valueReference="5" dependencies="2 3"/><Output valueReference="6"/>
<ContinuousStateDerivative valueReference="4"/>
<ClockedState valueReference="9"/>
<InitialUnknown valueReference="4"/><InitialUnknown valueReference="5"/><InitialUnknown valueReference="6"/>
<EventIndicator valueReference="11"/>
</ModelStructure>
</fmiModelDescription>
"""  # noqa: E501

BUILD = """<fmiBuildDescription fmiVersion="3.0"><BuildConfiguration modelIdentifier="wheel">
<SourceFileSet><SourceFile name="wheel.c"/><IncludeDirectory name="include"/></SourceFileSet>
</BuildConfiguration></fmiBuildDescription>"""

TERMINALS = """<fmiTerminalsAndIcons fmiVersion="3.0">
<GraphicalRepresentation><Icon x1="-1" y1="-1" x2="1" y2="1"/></GraphicalRepresentation>
<Terminals><Terminal name="contact" matchingRule="plug">
<TerminalMemberVariable variableName="load" memberName="load" variableKind="signal"/>
<TerminalMemberVariable variableName="force" memberName="force" variableKind="signal"/>
<TerminalGraphicalRepresentation x1="0" y1="0" x2="1" y2="1" iconBaseName="pin"/>
</Terminal></Terminals></fmiTerminalsAndIcons>"""

PNG = b"\x89PNG\r\n\x1a\n"
TERMINALS_FILE = "terminalsAndIcons/terminalsAndIcons.xml"
BUILD_FILE = "sources/buildDescription.xml"


def fmi2_files(description: str = FMI2) -> Files:
    return {"modelDescription.xml": description.encode(), "sources/wheel.c": b""}


def fmi3_files(description: str = FMI3, build: str = BUILD, terminals: str = TERMINALS) -> Files:
    return {
        "modelDescription.xml": description.encode(),
        BUILD_FILE: build.encode(),
        "sources/wheel.c": b"",
        "sources/include/wheel.h": b"",
        TERMINALS_FILE: terminals.encode(),
        "terminalsAndIcons/icon.png": PNG,
        "terminalsAndIcons/pin.png": PNG,
        "documentation/index.html": b"",
    }


@pytest.fixture
def problems(tmp_path: Path) -> Callable[[Files], list[str]]:
    """Zips files and checks them."""

    def check(files: Files) -> list[str]:
        path = tmp_path / "made.fmu"
        with zipfile.ZipFile(path, "w") as archive:
            for name, data in files.items():
                archive.writestr(name, data)
        return check_fmu(path, load=True)

    return check


@pytest.fixture(scope="module")
def exported(rig: cl.Model, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return cl.export_fmu(rig, tmp_path_factory.mktemp("check") / "CreepForceElement.fmu")


@pytest.fixture
def exported_files(exported: Path) -> Files:
    with zipfile.ZipFile(exported) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def replaced(text: str, old: str, new: str) -> str:
    assert text.count(old) == 1, f"{old} must stand in the text once"
    return text.replace(old, new)


def test_good_fmus_have_no_problem(problems: Callable[[Files], list[str]]) -> None:
    assert problems(fmi2_files()) == []
    assert problems(fmi3_files()) == []


def test_exported_fmu_has_no_problem(exported: Path) -> None:
    assert check_fmu(exported, load=True) == []


FMI2_FAULTS = {
    "empty guid": ('guid="{1}"', 'guid=""', "guid is empty"),
    "version": ('fmiVersion="2.0"', 'fmiVersion="1.0"', "fmiVersion is 1.0, must be 2.0 or 3.0"),
    "capability": (
        'canGetAndSetFMUstate="true" canS',
        "canS",
        "ModelExchange: canSerializeFMUstate is true, so canGetAndSetFMUstate must be true",
    ),
    "identifier": (
        '<CoSimulation modelIdentifier="wheel"',
        '<CoSimulation modelIdentifier="my wheel"',
        'CoSimulation: modelIdentifier "my wheel" must be an identifier of C',
    ),
    "unit twice": ('<Unit name="m"/>', '<Unit name="m"/><Unit name="m"/>', 'unit "m" is defined'),
    "unit unknown": (
        '<Real unit="m"',
        '<Real unit="mm"',
        'variable "x" (line 17): unit "mm" is not in UnitDefinitions',
    ),
    "factor": (
        'factor="1e-3"',
        'factor="0"',
        'unit "N": DisplayUnit kN: factor 0 must be finite and not 0',
    ),
    "offset": (
        'factor="1e-3"',
        'factor="1e-3" offset="INF"',
        'unit "N": DisplayUnit kN: offset INF must be finite',
    ),
    "display unit twice": (
        '<DisplayUnit name="kN" factor="1e-3"/>',
        '<DisplayUnit name="kN" factor="1e-3"/><DisplayUnit name="kN"/>',
        'unit "N": display unit "kN" is defined 2 times, must be unique',
    ),
    "type twice": (
        'SimpleType name="Rail"',
        'SimpleType name="Load"',
        'type "Load" is defined 2 times, must be unique',
    ),
    "display unit": (
        'displayUnit="kN"',
        'displayUnit="lbf"',
        'type "Load": displayUnit "lbf" is not defined for unit "N"',
    ),
    "display unit alone": (
        '<Real min="-1"',
        '<Real displayUnit="kN" min="-1"',
        'variable "gain" (line 16): displayUnit "kN" needs a unit',
    ),
    "type named as variable": (
        'SimpleType name="Load"',
        'SimpleType name="mass"',
        'type "mass": there is a variable of the same name',
    ),
    "items": (
        'name="wet" value="2"',
        'name="wet" value="1"',
        'type "Rail": Item value "1" is defined 2 times, must be unique',
    ),
    "log category": (
        'Category name="logEvents"',
        'Category name="logStatusError"',
        'log category "logStatusError" is defined 2 times',
    ),
    "stop time": (
        'stopTime="10"',
        'stopTime="0"',
        "DefaultExperiment: stopTime 0 must be above startTime 0",
    ),
    "step": (
        'stepSize="1e-3"',
        'stepSize="0"',
        "DefaultExperiment: stepSize 0 must be positive",
    ),
    "infinite time": (
        'startTime="0"',
        'startTime="-INF"',
        "DefaultExperiment: startTime -INF must be finite",
    ),
    "name twice": ('name="mass"', 'name="gain"', 'variable "gain" is defined 2 times'),
    "two independent": (
        'name="g" valueReference="7" variability="constant"><Real start="9.81"/>',
        'name="g" valueReference="7" causality="independent"><Real/>',
        "2 variables have causality independent, must be at most one",
    ),
    "start above max": (
        'start="0.25"',
        'start="2"',
        'variable "gain" (line 16): start 2 must not be above max 1',
    ),
    "start below the type's min": (
        'declaredType="Load" start="5"',
        'declaredType="Load" start="-5"',
        'variable "load" (line 14): start -5 must not be below min 0',
    ),
    "start is not a number": ('start="0.25"', 'start="NaN"', "start NaN must be a number"),
    "min above max": (
        'min="-1" max="1"',
        'min="1" max="-1"',
        'variable "gain" (line 16): min 1 must not be above max -1',
    ),
    "nominal": ('nominal="0.5"', 'nominal="0"', "nominal 0 must be positive and finite"),
    "enumeration": (
        'declaredType="Rail" start="2"',
        'declaredType="Rail" start="3"',
        'variable "rail" (line 15): start 3 is no Item of type "Rail"',
    ),
    "declared type unknown": (
        'declaredType="Load"',
        'declaredType="Weight"',
        'variable "load" (line 14): declaredType "Weight" is not in TypeDefinitions',
    ),
    "declared type of another type": (
        'declaredType="Load"',
        'declaredType="Rail"',
        'declaredType "Rail" is for Enumeration, must be for Real',
    ),
    "start missing": (
        'declaredType="Load" start="5"',
        'declaredType="Load"',
        'variable "load" (line 14): start is missing, must be given for causality input',
    ),
    "start for calculated": (
        'variability="fixed"><Real/>',
        'variability="fixed"><Real start="0"/>',
        'variable "mass" (line 22): start is not for initial calculated',
    ),
    "start for time": (
        'causality="independent"><Real/>',
        'causality="independent"><Real start="0"/>',
        'variable "time" (line 24): start is not for causality independent',
    ),
    "variability": (
        'variability="tunable"',
        'variability="discrete"',
        "variability discrete must be fixed or tunable for causality parameter",
    ),
    "continuous boolean": (
        'variability="discrete"><Boolean/>',
        "><Boolean/>",
        'variable "sliding" (line 21): variability continuous is not for type Boolean',
    ),
    "initial": (
        'variability="tunable"',
        'variability="tunable" initial="approx"',
        "initial approx must be exact for causality parameter and variability tunable",
    ),
    "initial of an input": (
        'name="load" valueReference="0" causality="input"',
        'name="load" valueReference="0" causality="input" initial="exact"',
        'variable "load" (line 14): initial exact is not for causality input',
    ),
    "derivative of nothing": (
        'derivative="4"',
        'derivative="40"',
        'variable "der(x)" (line 18): derivative 40: there is no such variable',
    ),
    "derivative of a parameter": (
        'derivative="4"',
        'derivative="3"',
        'derivative 3: it and "gain" must be continuous and floating point',
    ),
    "reinit": (
        'causality="output"><Real unit="N"/>',
        'causality="output"><Real unit="N" reinit="true"/>',
        'variable "force" (line 19): reinit is for continuous states only',
    ),
    "alias of another unit": (
        'name="force_too" valueReference="4"><Real unit="N"/>',
        'name="force_too" valueReference="4"><Real unit="m"/>',
        'value reference 4 of variables "force", "force_too": aliases must have the same unit',
    ),
    "alias of a constant": (
        'name="mass" valueReference="6"',
        'name="mass" valueReference="7"',
        'variables "mass", "g": aliases of a constant must be constants',
    ),
    "alias of two starts": (
        'name="x" valueReference="2" initial="exact"><Real unit="m"',
        'name="x" valueReference="1" initial="exact"><Real',
        'value reference 1 of variables "gain", "x": at most one alias may have a start value',
    ),
    "output not listed": (
        '<Unknown index="8"/></Outputs>',
        "</Outputs>",
        'ModelStructure/Outputs lacks "sliding"',
    ),
    "parameter among the outputs": (
        '<Unknown index="8"/></Outputs>',
        '<Unknown index="8"/><Unknown index="3"/></Outputs>',
        'ModelStructure/Outputs lists "gain", which has causality parameter',
    ),
    "output twice": (
        '<Unknown index="8"/></Outputs>',
        '<Unknown index="8"/><Unknown index="8"/></Outputs>',
        'ModelStructure/Outputs lists "sliding" 2 times',
    ),
    "index of nothing": (
        '<Unknown index="8"/></Outputs>',
        '<Unknown index="8"/><Unknown index="80"/></Outputs>',
        "ModelStructure/Outputs (line 27): there is no variable of index 80",
    ),
    "derivative not listed": (
        '<Derivatives><Unknown index="5" dependencies="4 11"/></Derivatives>',
        "",
        'ModelStructure/Derivatives lacks "der(x)"',
    ),
    "state among the derivatives": (
        '<Unknown index="5" dependencies="4 11"/></Derivatives>',
        '<Unknown index="5"/><Unknown index="4"/></Derivatives>',
        'ModelStructure/Derivatives lists "x", which has no attribute derivative',
    ),
    "initial unknown not listed": (
        '<Unknown index="9"/></InitialUnknowns>',
        "</InitialUnknowns>",
        'ModelStructure/InitialUnknowns lacks "mass"',
    ),
    "known among the initial unknowns": (
        '<Unknown index="9"/></InitialUnknowns>',
        '<Unknown index="9"/><Unknown index="10"/></InitialUnknowns>',
        'ModelStructure/InitialUnknowns lists "g", which has causality local and initial exact',
    ),
    "initial unknowns out of order": (
        '<Unknown index="8"/><Unknown index="9"/>',
        '<Unknown index="9"/><Unknown index="8"/>',
        "ModelStructure/InitialUnknowns must be in the order of the index",
    ),
    "dependency on nothing": (
        'dependencies="4 11"',
        'dependencies="4 12"',
        'dependencies of "der(x)": there is no variable of index 12',
    ),
    "dependency on an unknown": (
        'dependencies="4 11"',
        'dependencies="4 6"',
        'dependencies of "der(x)": "force" is no known',
    ),
    "initial dependency on an unknown": (
        '<Unknown index="5" dependencies="3"/>',
        '<Unknown index="5" dependencies="9"/>',
        'dependencies of "der(x)": "mass" is no known',
    ),
    "dependency twice": (
        'dependencies="4 11"',
        'dependencies="4 4"',
        'dependencies of "der(x)": a variable is listed twice',
    ),
    "too few kinds": (
        'dependenciesKind="dependent constant"',
        'dependenciesKind="dependent"',
        'dependencies of "force": 1 dependenciesKind for 2 dependencies',
    ),
    "kinds alone": (
        '<Unknown index="8"/></Outputs>',
        '<Unknown index="8" dependenciesKind="dependent"/></Outputs>',
        'dependencies of "sliding": dependenciesKind is given without dependencies',
    ),
    "kind for a boolean": (
        '<Unknown index="8"/></Outputs>',
        '<Unknown index="8" dependencies="1" dependenciesKind="fixed"/></Outputs>',
        'dependencies of "sliding": dependenciesKind fixed must be dependent',
    ),
    "kind while initializing": (
        'index="5" dependencies="3"',
        'index="5" dependencies="3" dependenciesKind="tunable"',
        'dependencies of "der(x)": dependenciesKind tunable must be dependent or constant',
    ),
    "schema": (
        'valueReference="6"',
        'valueReference="six"',
        "modelDescription.xml: line 22: Element 'ScalarVariable', attribute 'valueReference'",
    ),
    "not well formed": ("</ModelVariables>", "", "modelDescription.xml is not well-formed XML"),
}


@pytest.mark.parametrize("fault", FMI2_FAULTS)
def test_fmi2_description(fault: str, problems: Callable[[Files], list[str]]) -> None:
    old, new, said = FMI2_FAULTS[fault]
    found = problems(fmi2_files(replaced(FMI2, old, new)))
    assert any(said in problem for problem in found), found
    assert all(problem.startswith("modelDescription.xml") for problem in found)
    assert len(found) <= 5, found


FMI3_FAULTS = {
    "independent variable of another type": (
        '<Float64 name="time"',
        '<Int32 name="time"',
        'variable "time" (line 7): causality independent is not for type Int32',
    ),
    "derivative of itself": (
        'derivative="3"',
        'derivative="4"',
        'variable "der(x)" (line 11): derivative 4 is the variable itself',
    ),
    "state is an input": (
        'derivative="3"',
        'derivative="2"',
        'ModelStructure/ContinuousStateDerivative: state "load" has causality input, must be local',
    ),
    "second derivative not listed": (
        '"indicator" valueReference="11"/>',
        '"indicator" valueReference="11"/><Float64 name="v" valueReference="12" derivative="3"/>',
        'ModelStructure/ContinuousStateDerivative lacks "v"',
    ),
    "empty token": ('instantiationToken="{1}"', 'instantiationToken=""', "instantiationToken is"),
    "capability": (
        'providesIntermediateUpdate="true" ',
        "",
        "CoSimulation: canReturnEarlyAfterIntermediateUpdate is true, so "
        "providesIntermediateUpdate must be true",
    ),
    "internal step": (
        'fixedInternalStepSize="1e-3"',
        'fixedInternalStepSize="0"',
        "CoSimulation: fixedInternalStepSize 0 must be positive",
    ),
    "inverse display unit": (
        'inverse="true"',
        'inverse="true" offset="1"',
        'unit "N": DisplayUnit 1/N: offset 1 must be 0 as inverse is true',
    ),
    "no independent variable": (
        ' causality="independent"',
        "",
        "0 variables have causality independent, must be exactly one",
    ),
    "value reference twice": (
        '"indicator" valueReference="11"',
        '"indicator" valueReference="3"',
        'value reference 3 of variables "x", "indicator" must be unique',
    ),
    "alias named as variable": (
        'Alias name="weight"',
        'Alias name="force"',
        'variable "force" is defined 2 times, must be unique',
    ),
    "display unit of an alias": (
        'displayUnit="1/N"',
        'displayUnit="kg"',
        'alias "weight": displayUnit "kg" is not defined for unit "N"',
    ),
    "number of start values": (
        'start="1 2"',
        'start="1 2 3"',
        'variable "load" (line 9): start has 3 values, must have 2 or 1',
    ),
    "values for a scalar": ('exact" start="0"', 'exact" start="0 0"', "must have 1"),
    "vanishing dimension": (
        'Dimension valueReference="1"',
        'Dimension start="0"',
        'variable "load" (line 9): Dimension 0 must be at least 1',
    ),
    "dimension of a float": (
        'Dimension valueReference="1"',
        'Dimension valueReference="3"',
        "Dimension: valueReference 3 is no UInt64 variable with a start",
    ),
    "dimension of a variable": (
        'causality="structuralParameter" start="2"',
        'causality="parameter" start="2"',
        'Dimension: "size" must be constant or a structuralParameter',
    ),
    "start of a string": (
        '<Start value="left"/>',
        "",
        'variable "label" (line 14): start is missing, must be given for causality parameter',
    ),
    "large start": (
        'start="2" max="18446744073709551615"',
        'start="18446744073709551615" max="18446744073709551614"',
        "start 18446744073709551615 must not be above max 18446744073709551614",
    ),
    "clock": (
        'valueReference="10" variability="discrete" clocks="8"',
        'valueReference="10" variability="discrete" clocks="3"',
        'variable "before" (line 17): clocks: value reference 3 is no Clock',
    ),
    "causality of a clock": (
        'causality="input" intervalVariability',
        'causality="parameter" intervalVariability',
        'variable "tick" (line 15): causality parameter is not for type Clock',
    ),
    "previous value": (
        'previous="10"',
        'previous="9"',
        "previous 9: there is no other variable of type Float64 there",
    ),
    "previous value without clocks": (
        'clocks="8" previous="10"',
        'previous="10"',
        "previous 10 is for variables with clocks only",
    ),
    "derivative of nothing": (
        'derivative="3"',
        'derivative="33"',
        'variable "der(x)" (line 11): derivative 33: there is no such variable',
    ),
    "derivative twice": (
        '<ContinuousStateDerivative valueReference="4"/>',
        '<ContinuousStateDerivative valueReference="4"/>'
        '<ContinuousStateDerivative valueReference="4"/>',
        'ModelStructure/ContinuousStateDerivative lists "der(x)" 2 times',
    ),
    "derivative not listed": (
        '<ContinuousStateDerivative valueReference="4"/>',
        "",
        'ModelStructure/ContinuousStateDerivative lacks "der(x)"',
    ),
    "output not listed": (
        '<Output valueReference="6"/>',
        "",
        'ModelStructure/Output lacks "count"',
    ),
    "output of nothing": (
        '<Output valueReference="6"/>',
        '<Output valueReference="6"/><Output valueReference="66"/>',
        "ModelStructure/Output (line 21): there is no variable of value reference 66",
    ),
    "event indicator": (
        '<EventIndicator valueReference="11"/>',
        '<EventIndicator valueReference="6"/>',
        'ModelStructure/EventIndicator lists "count", which is no continuous float',
    ),
    "clocked state": (
        '<ClockedState valueReference="9"/>',
        '<ClockedState valueReference="10"/>',
        'ModelStructure/ClockedState lists "before", which has no attribute previous',
    ),
}


@pytest.mark.parametrize("fault", FMI3_FAULTS)
def test_fmi3_description(fault: str, problems: Callable[[Files], list[str]]) -> None:
    old, new, said = FMI3_FAULTS[fault]
    found = problems(fmi3_files(replaced(FMI3, old, new)))
    assert any(said in problem for problem in found), found
    assert all(problem.startswith("modelDescription.xml: ") for problem in found)
    assert len(found) <= 5, found


def test_there_is_an_interface(problems: Callable[[Files], list[str]]) -> None:
    interfaces = FMI3[FMI3.index("<ModelExchange") : FMI3.index("<UnitDefinitions>")]
    found = problems(fmi3_files(replaced(FMI3, interfaces, "")))
    assert found[0] == (
        "modelDescription.xml: there is no interface: neither ModelExchange nor CoSimulation"
    )


def test_a_state_has_one_derivative(problems: Callable[[Files], list[str]]) -> None:
    more = replaced(
        FMI3,
        "</ModelVariables>",
        '<Float64 name="v" valueReference="12" derivative="3"/></ModelVariables>',
    )
    for entry in ("ContinuousStateDerivative", "InitialUnknown"):
        first = f'<{entry} valueReference="4"/>'
        more = replaced(more, first, f'{first}<{entry} valueReference="12"/>')
    assert problems(fmi3_files(more)) == [
        'modelDescription.xml: ModelStructure/ContinuousStateDerivative lists 2 derivatives of "x"'
    ]


def test_clocked_variables_may_be_initial_unknowns(problems: Callable[[Files], list[str]]) -> None:
    last = '<InitialUnknown valueReference="6"/>'
    more = replaced(FMI3, last, f'{last}<InitialUnknown valueReference="9"/>')
    assert not [p for p in problems(fmi3_files(more)) if "FMPy" not in p]


def test_fmpy_is_asked_where_no_rule_is_broken(problems: Callable[[Files], list[str]]) -> None:
    structured = replaced(FMI2, 'guid="{1}"', 'guid="{1}" variableNamingConvention="structured"')
    assert problems(fmi2_files(structured)) == []
    (found,) = problems(fmi2_files(replaced(structured, 'name="g"', 'name="2g"')))
    assert found.startswith('modelDescription.xml: FMPy: "2g" (line 23) is not a legal variable')


FILE_FAULTS = {
    "sources/wheel.c": "sources/buildDescription.xml: line 2: sources/wheel.c is missing",
    "sources/include/wheel.h": f"{BUILD_FILE}: line 2: folder sources/include is missing",
    "documentation/index.html": "documentation/index.html is missing",
    "terminalsAndIcons/icon.png": f"{TERMINALS_FILE}: Icon: terminalsAndIcons/icon.png is missing",
    "terminalsAndIcons/pin.png": f'{TERMINALS_FILE}: terminal "contact": terminalsAndIcons/pin.png',
    "modelDescription.xml": "modelDescription.xml is missing",
    BUILD_FILE: "binaries/ is missing, and there are no sources either",
}


@pytest.mark.parametrize("missing", FILE_FAULTS)
def test_missing_file(missing: str, problems: Callable[[Files], list[str]]) -> None:
    files = {**fmi3_files(), "documentation/other.html": b""}
    del files[missing]
    (found,) = problems(files)
    assert found.startswith(FILE_FAULTS[missing])


def test_fmi2_source_files(problems: Callable[[Files], list[str]]) -> None:
    files = fmi2_files()
    del files["sources/wheel.c"]
    assert problems(files) == [
        f"sources/wheel.c is missing, though {interface}/SourceFiles names it"
        for interface in ("ModelExchange", "CoSimulation")
    ]


def test_fmi2_source_file_twice(problems: Callable[[Files], list[str]]) -> None:
    once = '<File name="wheel.c"/></SourceFiles></CoSimulation>'
    twice = replaced(FMI2, once, f'<File name="wheel.c"/>{once}')
    assert problems(fmi2_files(twice)) == [
        'modelDescription.xml: CoSimulation: source file "wheel.c" is defined 2 times, '
        "must be unique"
    ]


TERMINAL_FAULTS = {
    "version": ('fmiVersion="3.0"', 'fmiVersion="3.1"', "fmiVersion 3.1 must be 3.0"),
    "variable": (
        'variableName="load"',
        'variableName="weigth"',
        'terminal "contact": variable "weigth" is not in modelDescription.xml',
    ),
    "member missing": (
        ' memberName="load"',
        "",
        'terminal "contact": matchingRule plug needs a memberName of each member',
    ),
    "member twice": (
        'memberName="load"',
        'memberName="force"',
        'terminal "contact": member "force" is defined 2 times, must be unique',
    ),
    "terminal twice": (
        "</Terminals>",
        '<Terminal name="contact" matchingRule="bus"/></Terminals>',
        'terminal "contact" is defined 2 times',
    ),
    "schema": ('variableName="load"', 'variable="load"', "line 4: Element 'TerminalMemberVar"),
    "not well formed": ("</Terminals>", "", "is not well-formed XML"),
}


@pytest.mark.parametrize("fault", TERMINAL_FAULTS)
def test_terminals(fault: str, problems: Callable[[Files], list[str]]) -> None:
    old, new, said = TERMINAL_FAULTS[fault]
    found = problems(fmi3_files(terminals=replaced(TERMINALS, old, new)))
    assert any(said in problem for problem in found), found
    assert all(problem.startswith(TERMINALS_FILE) for problem in found)


def test_an_alias_may_be_a_member(problems: Callable[[Files], list[str]]) -> None:
    terminals = replaced(TERMINALS, 'variableName="load"', 'variableName="weight"')
    assert problems(fmi3_files(terminals=terminals)) == []


def test_build_description(problems: Callable[[Files], list[str]]) -> None:
    build = replaced(BUILD, 'modelIdentifier="wheel"', 'modelIdentifier="wheels"')
    assert problems(fmi3_files(build=build)) == [
        f"{BUILD_FILE}: line 1: modelIdentifier wheels is of no interface in modelDescription.xml"
    ]


def test_icon_must_be_an_image(problems: Callable[[Files], list[str]]) -> None:
    files = {**fmi3_files(), "terminalsAndIcons/icon.png": b"GIF"}
    assert problems(files) == [
        f"{TERMINALS_FILE}: Icon: terminalsAndIcons/icon.png is no PNG image"
    ]


# ---- the zip --------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["/etc/x", "a/../../x", "C:/x", "a\\b"])
def test_paths_stay_in_the_folder(name: str, problems: Callable[[Files], list[str]]) -> None:
    found = problems({**fmi2_files(), name: b""})
    assert f"{name}: the path must be relative, without '..', '\\' and ':'" in found


@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_names_are_unique(tmp_path: Path, problems: Callable[[Files], list[str]]) -> None:
    files = {**fmi2_files(), "resources/a": b"", "resources/A": b""}
    assert problems(files) == ["resources/A: differs from resources/a in nothing but case"]
    assert problems({**files, "resources/A": b"", "resources/a/b": b""})[0] == (
        "resources/a: is a file and a folder"
    )
    with zipfile.ZipFile(tmp_path / "made.fmu", "a") as archive:
        archive.writestr("sources/wheel.c", b"again")
    assert "sources/wheel.c: is in the zip 2 times" in check_fmu(tmp_path / "made.fmu")


def test_damaged_member(exported: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(exported) as archive:
        entry = archive.getinfo("resources/creep_table.bin")
    data = bytearray(exported.read_bytes())
    data[entry.header_offset + 30 + len(entry.filename) + 20] ^= 1
    broken = tmp_path / "broken.fmu"
    broken.write_bytes(data)
    assert check_fmu(broken)[0].startswith("resources/creep_table.bin: damaged: ")


def test_compression_method(tmp_path: Path) -> None:
    path = tmp_path / "made.fmu"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_BZIP2) as archive:
        for name, data in fmi2_files().items():
            archive.writestr(name, data)
    assert check_fmu(path) == [
        f"{name}: compression method 12 must be 0 (stored) or 8 (deflate)" for name in fmi2_files()
    ]


# ---- the exported FMU, broken ---------------------------------------------------------------


def library_of(files: Files) -> str:
    return next(name for name in files if name.startswith("binaries/"))


def test_library_of_another_name(
    exported_files: Files, problems: Callable[[Files], list[str]]
) -> None:
    path = library_of(exported_files)
    other = path.replace("CreepForceElement", "Creep")
    files = {other if name == path else name: data for name, data in exported_files.items()}
    assert problems(files) == [f"{path} is missing"]


def test_only_what_can_be_loaded_is(exported_files: Files) -> None:
    root = parse(exported_files["modelDescription.xml"])
    version = int(root.get("fmiVersion")[0])
    path = library_of(exported_files)
    assert set(loading.loadable(exported_files, root, version).values()) == {path}
    for data in (b"", b"MZ" + bytes(100)):
        assert loading.loadable({**exported_files, path: data}, root, version) == {}
    for interface in root.findall("*[@modelIdentifier]"):
        interface.set("needsExecutionTool", "true")
    assert loading.loadable(exported_files, root, version) == {}


def test_what_a_library_says_is_passed_on(
    exported_files: Files, problems: Callable[[Files], list[str]]
) -> None:
    table = exported_files["resources/creep_table.bin"]
    found = problems({**exported_files, "resources/creep_table.bin": table[:-1]})
    assert found
    for problem in found:
        assert problem.startswith(f"{library_of(exported_files)} could not be instantiated")
        assert "creep_table.bin" in problem


def test_a_library_that_hangs_is_stopped(
    exported_files: Files, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    program = tmp_path / "sleep.py"
    program.write_text("import time; time.sleep(60)")
    monkeypatch.setattr(loading, "PROGRAM", program)
    root = parse(exported_files["modelDescription.xml"])
    version = int(root.get("fmiVersion")[0])
    found = list(loading.loading_problems(exported_files, root, version, time_limit=0.2))
    assert found
    assert all("took more than 0.2 s to instantiate" in problem for problem in found)


def test_a_crash_is_named(
    exported_files: Files, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    program = tmp_path / "crash.py"
    program.write_text("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)")
    monkeypatch.setattr(loading, "PROGRAM", program)
    root = parse(exported_files["modelDescription.xml"])
    version = int(root.get("fmiVersion")[0])
    found = list(loading.loading_problems(exported_files, root, version))
    assert found
    assert all("crashed (SIGSEGV) when instantiated for" in problem for problem in found)


def test_all_functions_of_the_headers_are_needed() -> None:
    folder = Path(fmpy.__file__).parent / "c-code"
    for version, interfaces in ((2, ("ModelExchange", "CoSimulation")), (3, ("CoSimulation",))):
        header = (folder / f"fmi{version}Functions.h").read_text()
        declared = set(re.findall(rf"#define (fmi{version}\w+)\s+fmi{version}FullName", header))
        needed = set().union(*(binaries.needed_functions(i, version) for i in interfaces))
        assert needed == declared
    only_exchange = binaries.needed_functions("ModelExchange", 2)
    assert "fmi2SetTime" in only_exchange
    assert "fmi2DoStep" not in only_exchange


def test_start_above_the_limit_of_the_exported(
    exported_files: Files, problems: Callable[[Files], list[str]]
) -> None:
    root = ElementTree.fromstring(exported_files["modelDescription.xml"])
    limited = [element for element in root.iter() if {"min", "start"} <= element.attrib.keys()]
    limited[0].set("min", "1e9")
    found = problems({**exported_files, "modelDescription.xml": ElementTree.tostring(root)})
    assert any("must not be below min 1e9" in problem for problem in found)


# ---- the command ----------------------------------------------------------------------------


def test_command_says_what_was_checked(exported: Path) -> None:
    result = CliRunner().invoke(main, ["check", "--load", str(exported)])
    assert result.exit_code == 0, result.output
    assert result.stdout.startswith(f"{exported}: no problem found (FMI ")
    assert "loaded on this machine" in result.stdout
    assert result.stdout.count("\n") == 1


def test_command_prints_problems_and_fails(tmp_path: Path) -> None:
    path = tmp_path / "bad.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("readme.txt", b"")
    result = CliRunner().invoke(main, ["check", str(path)])
    assert result.exit_code == 1
    assert result.stdout == "modelDescription.xml is missing\n"


def test_command_cannot_read(tmp_path: Path) -> None:
    path = tmp_path / "text.fmu"
    path.write_text("no zip")
    for name, said in ((path, "is not a zip file"), (tmp_path / "none.fmu", "none.fmu")):
        result = CliRunner().invoke(main, ["check", str(name)])
        assert result.exit_code == 2
        assert said in result.stderr
        assert result.stderr.count("\n") == 1
