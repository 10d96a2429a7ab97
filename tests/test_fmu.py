"""The FMU as a tool sees it, through FMPy."""

from __future__ import annotations

import shutil
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import fmpy
import fmpy.validation
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE

import contactlib as cl
from contactlib import kernel

BOOLEANS = ("falling_branch", "speed_regularized", "k_hat_limited", "force_limited")


@pytest.fixture(scope="module")
def fmu(rig: cl.Model, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return cl.export_fmu(rig, tmp_path_factory.mktemp("fmu") / "CreepForceElement.fmu")


@pytest.fixture(scope="module")
def unzipped(fmu: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    # A folder that a URI must encode.
    folder = tmp_path_factory.mktemp("unzipped") / "a folder, 100% \u00e4"
    return Path(fmpy.extract(str(fmu), unzipdir=str(folder)))


class Slave:
    """An instance with its log and its variables by name."""

    def __init__(self, folder: Path, guid: str | None = None, log: list[str] | None = None) -> None:
        description = fmpy.read_model_description(str(folder))
        self.references = {v.name: v.valueReference for v in description.modelVariables}
        self.log = [] if log is None else log
        self._callbacks = fmi2CallbackFunctions()
        self._callbacks.logger = fmi2CallbackLoggerTYPE(
            lambda env, name, status, category, text: self.log.append(text.decode())
        )
        self.fmu = FMU2Slave(
            guid=description.guid if guid is None else guid,
            unzipDirectory=str(folder),
            modelIdentifier="CreepForceElement",
            instanceName="test",
        )
        self.fmu.instantiate(callbacks=self._callbacks, loggingOn=True)

    def start(self, time: float = 0.0) -> Slave:
        self.fmu.setupExperiment(startTime=time)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()
        return self

    def get(self, *names: str) -> list[float]:
        return list(self.fmu.getReal([self.references[n] for n in names]))

    def set(self, **values: float) -> None:
        self.fmu.setReal([self.references[n] for n in values], list(values.values()))


@pytest.fixture
def slave(unzipped: Path) -> Iterator[Slave]:
    made = Slave(unzipped)
    yield made
    made.fmu.freeInstance()


def test_description_is_valid(fmu: Path, unzipped: Path) -> None:
    assert fmpy.validation.validate_fmu(str(fmu)) == []
    root = ElementTree.parse(unzipped / "modelDescription.xml").getroot()
    units = {unit.get("name") for unit in root.iter("Unit")}
    for variable in root.iter("ScalarVariable"):
        real = variable.find("Real")
        if real is None:
            assert variable.find("Boolean") is not None
            continue
        assert real.get("unit") in units
        if variable.get("causality") in ("input", "parameter"):
            low, start, high = (float(real.get(k, "nan")) for k in ("min", "start", "max"))
            assert low <= start <= high
        else:
            assert real.get("start") is None
    assert root.get("guid") == kernel.token()


@pytest.mark.parametrize("kind", kernel.MODEL_KINDS)
@pytest.mark.parametrize("version", [2, 3])
def test_initial_unknowns_have_plain_kinds(
    rig: cl.Model, tmp_path: Path, kind: str, version: int
) -> None:
    # Others are for the running model; FMI Library, and with it libcosim, refuses the FMU.
    fmu = cl.export_fmu(rig, tmp_path / "it.fmu", kind=kind, fmi_version=version)
    with zipfile.ZipFile(fmu) as archive:
        root = ElementTree.fromstring(archive.read("modelDescription.xml"))
    unknowns = [*root.findall(".//InitialUnknowns/Unknown"), *root.iter("InitialUnknown")]
    kinds = {kind for u in unknowns for kind in u.get("dependenciesKind", "").split()}
    assert kinds == {"dependent"}


def test_export_depends_on_nothing_but_the_model(fmu: Path, rig: cl.Model, tmp_path: Path) -> None:
    again = cl.export_fmu(rig, tmp_path / "again.fmu")
    assert again.read_bytes() == fmu.read_bytes()


def test_outputs_at_initialisation_are_the_kernel_s(slave: Slave, rig: cl.Model) -> None:
    slave.fmu.setupExperiment(startTime=0.0)
    slave.fmu.enterInitializationMode()
    slave.set(omega=20.2)
    record = rig.wheelset.element.evaluate(omega=20.2, speed=10.0)
    names = [n for n in slave.references if n in (record.dtype.names or ())]
    reals = [n for n in names if n not in BOOLEANS]
    assert slave.get(*reals) == [float(record[n]) for n in reals]
    assert len(reals) == 9


def test_booleans(slave: Slave) -> None:
    slave.start()
    references = [slave.references[n] for n in BOOLEANS]
    assert slave.fmu.getBoolean(references) == [False] * 4
    slave.set(omega=20.5)
    assert slave.fmu.getBoolean(references) == [True, False, False, False]
    slave.set(speed=0.0, normal_load=1.0)
    assert slave.fmu.getBoolean(references)[1:3] == [True, True]


@pytest.mark.parametrize("control", ["creep", "torque"])
def test_same_trajectory_as_the_kernel(fmu: Path, rig: cl.Model, control: str) -> None:
    # Under torque control the run-away would magnify the slightest difference.
    if control == "creep":
        controller: Any = rig.creep_control
    else:
        controller = cl.TorqueControl(cl.Profile((0.0, 6.0), (2.6e4, 2.9e4)))
    settings: dict[str, Any] = {
        "duration": 12.0,
        "step": 1e-3,
        "initial_speed": 10.0,
        "initial_creepage": 0.01,
    }
    with cl.FmuSource(fmu) as source:
        with_fmu = cl.cosimulate(rig.wheelset, source, controller, **settings)
    without = cl.cosimulate(
        rig.wheelset, cl.KernelSource(rig.wheelset.element), controller, **settings
    )
    for name in ("omega", "creep_force", "drive_torque"):
        np.testing.assert_allclose(with_fmu[name], without[name], rtol=1e-9)
    assert (with_fmu["creepage"].max() > 0.15) == (control == "torque")


def test_exchange_converges_to_the_stiff_solver_with_first_order(rig: cl.Model) -> None:
    body, control = rig.wheelset, rig.creep_control
    exact = cl.simulate(body, control, duration=8.0, initial_speed=10.0)
    steps = np.array([2e-3, 1e-3, 5e-4])
    errors = []
    for step in steps:
        run = cl.cosimulate(
            body,
            cl.KernelSource(body.element),
            control,
            duration=8.0,
            step=step,
            initial_speed=10.0,
            initial_creepage=0.008,
        )
        errors.append(np.abs(np.interp(exact.time, run.time, run["omega"]) - exact["omega"]).max())
    order = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert order == pytest.approx(1.0, abs=0.1)
    assert errors[1] < 1e-4


def test_exchange_is_stable_up_to_twice_the_inverse_slip_pole(rig: cl.Model) -> None:
    body = rig.wheelset
    point = body.balanced(creepage=0.002, speed=10.0)
    gradient = point.creep_force_slope / point.speed
    pole = gradient * body.radius**2 / body.inertia + body.damping / body.inertia
    for factor, grows in ((0.97, False), (1.03, True)):
        step = factor * 2.0 / pole
        run = cl.cosimulate(
            body,
            cl.KernelSource(body.element),
            cl.TorqueControl(cl.Profile.of(point.drive_torque)),
            duration=200 * step,
            step=step,
            initial_speed=10.0,
            initial_creepage=0.002 * (1.0 + 1e-6),
        )
        away = np.abs(run["omega"] - point.omega)
        assert (away[-1] > away[0]) == grows


def test_fmpy_runs_it_alone(fmu: Path, rig: cl.Model) -> None:
    result = fmpy.simulate_fmu(
        str(fmu),
        stop_time=1.0,
        start_values={"omega": 20.2, "normal_load": 1e5},
        output=["creep_force", "falling_branch"],
    )
    expected = float(rig.wheelset.element.force(omega=20.2, speed=10.0, normal_load=1e5))
    assert result["creep_force"][-1] == expected
    assert not result["falling_branch"][-1]


@pytest.mark.parametrize(
    ("name", "value", "limit"),
    [
        ("normal_load", -1.0, "from 0 to"),
        ("normal_load", np.nan, "from 0 to"),
        ("omega", np.inf, "from -1e"),
        ("friction_scale", 0.0, "from 1e-06"),
        ("slope_reduction", 1.5, "to 1"),
        ("radius", 0.6, "after initialization"),
        ("creep_force", 1.0, "is an output"),
    ],
)
def test_bad_values_are_refused_and_forgotten(
    slave: Slave, name: str, value: float, limit: str
) -> None:
    slave.start()
    before = slave.get("creep_force")
    with pytest.raises(FMICallException):
        slave.set(**{name: value})
    assert name in slave.log[-1]
    assert limit in slave.log[-1]
    slave.fmu.doStep(currentCommunicationPoint=0.0, communicationStepSize=1e-3)
    assert slave.get("creep_force") == before


def test_friction_is_tunable_while_it_runs(slave: Slave) -> None:
    slave.start()
    slave.set(omega=24.0)
    sliding = slave.get("creep_force")[0]
    slave.set(static_friction=0.9, kinetic_friction=0.42)
    assert slave.get("creep_force")[0] == pytest.approx(2.0 * sliding, rel=1e-3)
    slave.set(static_friction=0.3)
    with pytest.raises(FMICallException):
        slave.get("creep_force")
    assert "not below the kinetic one" in slave.log[-1]
    slave.set(static_friction=0.9)
    assert slave.get("creep_force")[0] == pytest.approx(2.0 * sliding, rel=1e-3)


@pytest.mark.parametrize(
    ("point", "step", "message"),
    [
        (0.5, 1e-3, "communication point"),
        (0.0, 0.0, "step size"),
        (0.0, -1e-3, "step size"),
        (0.0, np.inf, "step size"),
        (np.nan, 1e-3, "step size"),
        (-1e-3, 1e-3, "communication point"),
    ],
)
def test_bad_steps_are_refused(slave: Slave, point: float, step: float, message: str) -> None:
    slave.start()
    with pytest.raises(FMICallException):
        slave.fmu.doStep(currentCommunicationPoint=point, communicationStepSize=step)
    assert message in slave.log[-1]
    slave.fmu.doStep(currentCommunicationPoint=0.0, communicationStepSize=1e-3)


def test_time_may_differ_in_the_last_bits(slave: Slave) -> None:
    slave.start(time=100.0)
    time = 100.0
    for i in range(1, 2001):
        slave.fmu.doStep(currentCommunicationPoint=time, communicationStepSize=0.1)
        time = 100.0 + 0.1 * i


def test_state_is_saved_and_restored(slave: Slave) -> None:
    slave.start()
    slave.set(omega=20.3)
    before = slave.get("creep_force")
    state = slave.fmu.getFMUState()
    slave.set(omega=25.0, kinetic_friction=0.3)
    slave.fmu.doStep(currentCommunicationPoint=0.0, communicationStepSize=1e-3)
    assert slave.get("creep_force") != before
    slave.fmu.setFMUState(state)
    slave.fmu.freeFMUState(state)
    assert slave.get("creep_force") == before
    slave.fmu.doStep(currentCommunicationPoint=0.0, communicationStepSize=1e-3)


def test_reset_gives_the_start_values_back(slave: Slave) -> None:
    slave.start()
    before = slave.get("omega", "creep_force")
    slave.set(omega=25.0)
    slave.fmu.terminate()
    slave.fmu.reset()
    assert slave.start().get("omega", "creep_force") == before


def test_instances_do_not_see_each_other(unzipped: Path) -> None:
    one, other = Slave(unzipped).start(), Slave(unzipped).start()
    before = other.get("creep_force")
    one.set(omega=22.0)
    assert other.get("creep_force") == before
    one.fmu.freeInstance()
    assert other.get("creep_force") == before
    other.fmu.freeInstance()


@pytest.mark.parametrize("file", ["creep_table.bin", "start_values.bin"])
@pytest.mark.parametrize(
    ("damage", "message"), [("missing", "cannot open"), ("cut", "length"), ("flipped", "checksum")]
)
def test_broken_resources_are_a_clear_message(
    unzipped: Path, tmp_path: Path, file: str, damage: str, message: str
) -> None:
    folder = tmp_path / "broken"
    shutil.copytree(unzipped, folder)
    target = folder / "resources" / file
    data = bytearray(target.read_bytes())
    if damage == "missing":
        target.unlink()
    else:
        data[-1] ^= 1
        target.write_bytes(data[:-1] if damage == "cut" else data)
    log: list[str] = []
    with pytest.raises(Exception, match="instantiate"):
        Slave(folder, log=log)
    assert log[-1].startswith(f"resource {file}: ")
    assert message in log[-1]


def test_wrong_guid_is_refused(unzipped: Path) -> None:
    log: list[str] = []
    with pytest.raises(Exception, match="instantiate"):
        Slave(unzipped, guid="{other}", log=log)
    assert kernel.token() in log[-1]


def test_source_tells_what_the_fmu_logged(fmu: Path) -> None:
    with (
        pytest.raises(RuntimeError, match=r"normal_load = -5 is out of range"),
        cl.FmuSource(fmu) as source,
    ):
        source.exchange(0.0, 1e-3, 20.0, 10.0, -5.0, 1.0)


def test_export_refuses_what_it_cannot_do(rig: cl.Model, tmp_path: Path) -> None:
    target = tmp_path / "x.fmu"
    with pytest.raises(ValueError, match="fmi_version = 1"):
        cl.export_fmu(rig, target, fmi_version=1)
    with pytest.raises(ValueError, match="kind = 'car'"):
        cl.export_fmu(rig, target, kind="car")
    with pytest.raises(ValueError, match="'pdp11-unix', must be of x86_64-linux"):
        cl.export_fmu(rig, target, platforms=["pdp11-unix"])
    assert not target.exists()


def test_export_names_the_command_that_builds_a_library(
    rig: cl.Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(kernel, "library_path", lambda name: tmp_path / name)
    with pytest.raises(ValueError, match=r"python fmu/build_hook\.py x86_64-windows"):
        cl.export_fmu(rig, tmp_path / "x.fmu", platforms=["x86_64-windows"])
