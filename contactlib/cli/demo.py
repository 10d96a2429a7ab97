"""The demonstration: from the law to a running FMU, with the shipped models."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from contactlib import figures
from contactlib.base.lazy import optional_library
from contactlib.base.writing import write_whole
from contactlib.cli.console import ConsoleReporter
from contactlib.export import export_fmu
from contactlib.export.explorer import write_explorer
from contactlib.files.model import load_model
from contactlib.files.scenario import Scenario, load_scenario
from contactlib.laws.carter_griffith import CarterGriffith
from contactlib.laws.hertz import EllipticContact
from contactlib.laws.scales import process_zone_ratio
from contactlib.runs.result import Result
from contactlib.runs.simulation import simulate
from contactlib.stability import creep_control_gain, find_fold
from contactlib.table.creep_force_table import CreepForceTable
from contactlib.table.law_tables import build_carter_griffith_table, carter_griffith_table

RIG, LOCOMOTIVE = "roller_rig", "locomotive"
SCENARIOS = {RIG: "torque_or_creep_rig.toml", LOCOMOTIVE: "torque_or_creep.toml"}
STEP = 1e-3  # communication step of the FMU [s]


@dataclass(frozen=True)
class Number:
    """One number of the report, with its key in summary.json and its label."""

    key: str
    label: str
    value: float
    unit: str

    def __str__(self) -> str:
        return f"{self.label:<60} {self.value:.6g} {self.unit if self.unit != '1' else ''}".rstrip()


def run_demo(output: str | os.PathLike[str], reporter: ConsoleReporter) -> Path:
    """Run everything and write it to the folder `output`; return the path of summary.json.

    Raises
    ------
    ImportError
        If FMPy is not installed.
    OSError
        If the folder cannot be created or written.
    """
    fmpy = optional_library("fmpy")
    folder = Path(output)
    folder.mkdir(parents=True, exist_ok=True)
    summary: dict[str, Any] = {}

    def report(section: str, heading: str, numbers: Iterable[Number]) -> None:
        reporter.heading(heading)
        summary[section] = {"title": heading, "numbers": {}}
        for number in numbers:
            reporter.line(f"  {number}")
            entry = {"label": number.label, "value": number.value, "unit": number.unit}
            summary[section]["numbers"][number.key] = entry

    with reporter.step("Tabulating the Carter-Griffith law") as progress:
        table = build_carter_griffith_table("elliptic", progress)
        table.save(folder / "creep_table.bin")
    report("table", "Table of the Carter-Griffith law of an ellipse", _table_numbers(table))

    tables = {RIG: carter_griffith_table("line"), LOCOMOTIVE: table}
    models = {n: load_model(f"models/{n}.toml", table=its) for n, its in tables.items()}
    scenarios = {n: load_scenario(SCENARIOS[n], table=its) for n, its in tables.items()}
    held: dict[str, Result] = {}
    for name, scenario in scenarios.items():
        title = models[name].name
        with reporter.step(f"{title}: ramping the torque") as progress:
            away = _run(folder / f"{name}_torque_control.csv", scenario, "torque", progress)
        with reporter.step(f"{title}: controlling the creepage") as progress:
            held[name] = _run(folder / f"{name}_creep_control.csv", scenario, "creep", progress)
        report(name, title, _run_numbers(scenario, away, held[name]))
        with reporter.step(f"{title}: drawing"):
            _draw(folder, name, title, scenario, away, held[name])

    model, scenario = models[LOCOMOTIVE], scenarios[LOCOMOTIVE]
    fmu = export_fmu(model, folder / "CreepForceElement.fmu")
    run, wheel = held[LOCOMOTIVE], replace(scenario.drivetrain.wheelset.element, wheels=1)
    with reporter.step(f"{model.name}: the force from {fmu.name}, run by FMPy"):
        given: dict[str, Any] = {
            "time": run.time, "omega": run["omega"], "speed": run["speed"],
            "normal_load": wheel.axle_load, "friction_scale": 1.0,
            "lateral_velocity": 0.0, "spin_velocity": 0.0,
        }  # fmt: skip
        kinds = [(name, np.float64) for name in given]
        moved = np.rec.fromarrays(np.broadcast_arrays(*given.values()), dtype=kinds)
        found = fmpy.simulate_fmu(
            str(fmu), stop_time=float(run.time[-1]), output_interval=STEP, input=moved,
            output=["omega", "speed", "creep_force"],
        )  # fmt: skip
        fmpy.write_csv(str(folder / f"{LOCOMOTIVE}_creep_control_fmu.csv"), found)
    force = wheel.force(omega=found["omega"], speed=found["speed"])
    apart = float(np.max(np.abs(found["creep_force"] - force)) / np.max(force))
    numbers = [
        Number("step", "communication step", STEP, "s"),
        Number("against_kernel", "relative difference, FMU and kernel in Python", apart, "1"),
    ]
    report("fmu", "The FMU of a wheel along the run of the locomotive", numbers)

    page = write_explorer(folder / "explorer.html")
    size = Number("size", "size", 1e-3 * page.stat().st_size, "kB")
    report("explorer", f"The explorer, a page that runs the kernel live: {page.name}", [size])

    return write_whole(folder / "summary.json", json.dumps(summary, indent=2).encode() + b"\n")


def _run(csv: Path, scenario: Scenario, name: str, progress: Callable[[float], object]) -> Result:
    """Run the wheelset under a continuous controller, to the end of the controller's reference."""
    control: Any = scenario.any_controller(name)
    result = simulate(
        scenario.drivetrain.wheelset,
        control,
        initial_speed=scenario.initial_speed,
        progress=progress,
    )
    result.to_csv(csv)
    return result


def _table_numbers(table: CreepForceTable) -> Iterator[Number]:
    law = CarterGriffith(k_hat=0.3, contact="elliptic")
    yield Number(
        "points",
        "points at which the table was compared with the law",
        table.certificate_points,
        "1",
    )
    yield Number("max_error", "certified error of the traction ratio", table.max_error, "1")
    yield Number("max_slope_error", "certified error of the slope", table.max_slope_error, "1")
    yield Number(
        "peak_creepage", "peak at k_hat 0.3: creepage/zeta0", law.peak.normalized_creepage, "1"
    )
    yield Number("peak_ratio", "peak at k_hat 0.3: Q/(f_d P)", law.peak.traction_ratio, "1")


def _run_numbers(scenario: Scenario, torque_run: Result, creep_run: Result) -> Iterator[Number]:
    wheelset = scenario.drivetrain.wheelset
    element = wheelset.element
    passed = torque_run.first("peak_passed")
    away = torque_run.first("slip_away")
    if passed is None or away is None:
        raise RuntimeError(f"{scenario.name}: the torque ramp did not pass the fold")
    fold = find_fold(wheelset, speed=passed.speed)
    at_peak = wheelset.balanced(creepage=passed.creepage, speed=passed.speed)
    held = wheelset.radius * at_peak.creep_force + wheelset.damping * at_peak.omega
    yield Number("peak_force", "peak creep force", at_peak.creep_force, "N")
    yield Number("peak_creepage", "creepage at the peak", passed.creepage, "1")
    if isinstance(element.contact, EllipticContact):  # the same steel, layer and friction
        strips = replace(element, contact=replace(element.contact, theory="strips"))
        creepage = np.linspace(0.0, 2.0 * passed.creepage, 401)
        force, without = (
            e.at_creepage(creepage, speed=passed.speed)["creep_force"] for e in (element, strips)
        )
        yield Number(
            "half_space_gain",
            "largest gain in Q/(f_d P), half-space instead of strips",
            float(np.max(force - without) / (element.friction.kinetic * element.axle_load)),
            "1",
        )
    yield Number(
        "steady_torque", "torque of peak force and damping, r Q_peak + b omega", held, "N.m"
    )
    if wheelset.mass is not None:
        yield Number(
            "turning_torque",
            "torque that accelerates the wheelset with the train",
            fold.drive_torque - held,
            "N.m",
        )
    yield Number(
        "critical_torque_predicted", "critical torque, predicted (fold)", fold.drive_torque, "N.m"
    )
    yield Number(
        "critical_torque_simulated",
        "critical torque, simulated (slow ramp)",
        passed.drive_torque,
        "N.m",
    )
    yield Number(
        "critical_torque_difference",
        "relative difference of the two",
        passed.drive_torque / fold.drive_torque - 1.0,
        "1",
    )
    yield Number(
        "slip_away_time",
        "time from the peak to a creepage of 10 zeta0",
        away.time - passed.time,
        "s",
    )
    yield Number(
        "largest_creepage",
        "largest creepage after slip-away",
        float(torque_run["creepage"].max()),
        "1",
    )
    yield Number(
        "hysteresis", "relative torque drop needed to return, predicted", fold.hysteresis, "1"
    )

    target = float(creep_run["reference"][-1])
    tail = creep_run.time > 0.75 * creep_run.time[-1]
    point = wheelset.balanced(creepage=target, speed=float(creep_run["speed"][-1]))
    yield Number(
        "held_creepage",
        "creepage held on the falling branch by creep control",
        float(creep_run["creepage"][-1]),
        "1",
    )
    yield Number(
        "held_deviation",
        "largest deviation in the last quarter of the run",
        float(np.abs(creep_run["creepage"] - target)[tail].max()),
        "1",
    )
    yield Number(
        "open_loop_pole",
        "pole at this creepage under constant torque",
        float(point.eigenvalues[0].real),
        "1/s",
    )
    yield Number(
        "smallest_gain", "smallest gain that holds it", creep_control_gain(wheelset, point), "N.m"
    )
    control: Any = scenario.any_controller("creep")
    yield Number("gain", "gain used", control.proportional_gain, "N.m")
    yield Number(
        "process_zone_ratio",
        "process zone ratio (the law needs less than 0.5)",
        process_zone_ratio(element.contact, element.friction),
        "1",
    )


def _draw(
    folder: Path,
    name: str,
    title: str,
    scenario: Scenario,
    torque_run: Result,
    creep_run: Result,
) -> None:
    passed = torque_run.first("peak_passed")
    speed = scenario.initial_speed if passed is None else passed.speed
    wheelset, runs = scenario.drivetrain.wheelset, (torque_run, creep_run)
    drawn = {
        "creep_curve": figures.creep_curve(wheelset, speed=speed),
        "time_histories": figures.time_histories(*runs, title=title, wheelset=wheelset),
        "fold_diagram": figures.fold_diagram(wheelset, *runs, speed=speed, title=title),
    }
    for kind, figure in drawn.items():
        figures.save_pictures(figure, folder, f"{name}_{kind}")
