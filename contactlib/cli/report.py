"""Reports in a folder: metrics, time series and figures of runs; settings that a search found."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from contactlib import figures
from contactlib.base.quantities import ReadOnly
from contactlib.base.text import fixed_width
from contactlib.base.units import in_si
from contactlib.base.writing import write_whole
from contactlib.figures import drivetrain_setting, run_name
from contactlib.files.scenario import Scenario
from contactlib.runs.outcomes import (
    MAX_SPEED_ERROR,
    OUTCOMES,
    Metrics,
    comparison_table,
    metrics,
    write_comparison,
)
from contactlib.runs.scenario_runs import run_scenario
from contactlib.runs.tuning import OBJECTIVE, Tuning, check_distinct, searched, sensor_errors, tune
from contactlib.stability import (
    controllability,
    reduced_frequency,
    reduced_plant,
    worst_pole,
)
from contactlib.stability.poles import STEADY_ROLLING
from contactlib.traction import OpenLoop, ThresholdControl, WheelSlideProtection
from contactlib.vehicle.continuous_control import ContinuousController

if TYPE_CHECKING:
    import xarray as xr

    from contactlib.runs.result import Result
    from contactlib.vehicle.drivetrain import Drivetrain

WITHOUT_GAIN = OpenLoop, ThresholdControl, WheelSlideProtection


class Reporter(Protocol):
    """Display of the progress and results of a report."""

    def step(self, title: str) -> AbstractContextManager[Callable[[float], object]]:
        """A step that takes time; yields a function to call with the fraction done."""

    def line(self, text: str) -> None:
        """Show a line."""


def write_report(
    scenario: Scenario,
    names: Sequence[str],
    folder: str | os.PathLike[str],
    reporter: Reporter,
    formats: Sequence[str] = ("png", "svg"),
    over: str = "time",
    signals: Sequence[str] = (),
    diagram: Mapping[str, Any] | None = None,
    animated: bool = False,
    settings: Mapping[str, Any] = ReadOnly({}),
) -> dict[str, Any]:
    """Run a scenario, show the metrics, and write metrics, time series and figures to a folder.

    Parameters
    ----------
    scenario : Scenario
        Gives runs, name and caption.
    names : sequence of str
        Controllers to run it under.
    folder : path
        Created after the runs if missing. It gets metrics.txt, .csv and .json, a CSV file and a
        figure for each run, and for more than one run a figure that compares them. A vehicle's run
        NAME gets as well the metrics by axle, NAME.axles.txt, .csv and .json, and a figure of its
        axles on the creep curve, NAME.creep_curve.
    reporter : Reporter
        Shows progress, events and metrics.
    formats : sequence of str, optional
        Formats of the figures, each one of matplotlib's.
    over : str, optional
        Axis of the figures: "time" or "distance".
    signals : sequence of str, optional
        More signals of the contact, as for `run_scenario`, which the CSV files get.
    diagram : mapping, optional
        Arguments of `figures.run_diagram`, such as limits, for the figure NAME.diagram of each run.
        Default: no such figure.
    animated : bool, optional
        Whether an animation of all runs, comparison.gif, is written as well.
    settings : mapping, optional
        Other arguments of `run_scenario`, such as those that repeat a run of a sweep.

    Returns
    -------
    dict
        `Metrics` by name.

    Raises
    ------
    OSError
        If the folder cannot be created or written.
    """
    output, drivetrain = Path(folder), scenario.drivetrain
    for line in outlook(scenario):
        reporter.line(line)
    results: dict[str, Result] = {}
    all_metrics: dict[str, Metrics] = {}
    by_axle: dict[str, dict[str, Metrics]] = {}

    def run(title: str, case: Scenario, name: str, signals: Sequence[str] = ()) -> Result:
        try:
            with reporter.step(f"{scenario.name}: {title}") as progress:
                return run_scenario(case, name, signals=signals, progress=progress, **settings)
        except RuntimeError as error:
            where = f"in the run of {title}; nothing is written to {output}"
            raise RuntimeError(f"{error}, {where}") from error

    for name in names:
        results[name] = run(name.replace("_", " "), scenario, name, signals)
        for event in results[name].events:
            reporter.line(
                f"{event.name:<12} at {event.time:.6g} s: creepage {event.creepage:.6g}, "
                f"speed {event.speed:.6g} m/s, drive torque {event.drive_torque:.6g} N.m"
            )
        all_metrics[name], uniform = metrics(results[name], drivetrain), None
        if math.isfinite(all_metrics[name].stopping_distance):
            uniform = run("the same on uniform friction", scenario.on_uniform_friction, name)
            all_metrics[name] = metrics(results[name], drivetrain, uniform=uniform)
        if scenario.axles > 1:
            by_axle[name] = _by_axle(results[name], uniform, drivetrain)
    reporter.line(comparison_table(all_metrics, within=f"{scenario.duration:g} s"))
    for name in names:
        error = all_metrics[name].speed_error
        for line in warning_of_speed(scenario, name, results[name], error):
            reporter.line(line)
    for name, axles in by_axle.items():
        reporter.line(f"\nAxles under {name}:")
        reporter.line(comparison_table({f"axle {i}": one for i, one in axles.items()}))
    output.mkdir(parents=True, exist_ok=True)
    for name, result in results.items():
        result.to_csv(output / f"{name}.csv")
    write_comparison(output, all_metrics)
    for name, axles in by_axle.items():
        write_comparison(output, axles, stem=f"{name}.axles", of="axle")
    with reporter.step(f"{scenario.name}: drawing"):
        gif = output / "comparison.gif" if animated else None
        of_runs = scenario, results, all_metrics, by_axle
        for name, figure in _drawn(*of_runs, over, diagram, gif).items():
            figures.save_pictures(figure, output, name, formats)
        if len(names) == 1:
            for suffix in formats:
                (output / f"comparison.{suffix}").unlink(missing_ok=True)  # from earlier runs
    return all_metrics


def warning_of_speed(scenario: Scenario, name: str, result: Result, error: float) -> list[str]:
    """Line on a run whose controllers get a speed that errs too much [m/s]; none for others."""
    highest = float(np.abs(result["speed"]).max())
    opens = isinstance(scenario.any_controller(name), OpenLoop)
    if opens or highest == 0.0 or error <= MAX_SPEED_ERROR * highest:
        return []
    return [
        f"{name}: the speed that its controllers get is off by up to {error:.3g} m/s, "
        f"{error / highest:.0%} of the highest one, above {MAX_SPEED_ERROR:.0%}: its outcomes hold "
        "for that estimate only"
    ]


def _by_axle(result: Result, uniform: Result | None, drivetrain: Drivetrain) -> dict[str, Metrics]:
    """Metrics of the axles by number; their energy closes only in sum."""
    pairs = zip(result.by_axle, uniform.by_axle if uniform else [None] * result.axles, strict=True)
    every = (metrics(axle, drivetrain, uniform=other) for axle, other in pairs)
    return {str(i): one._replace(energy_defect=math.nan) for i, one in enumerate(every, start=1)}


def _drawn(
    scenario: Scenario,
    results: Mapping[str, Any],
    all_metrics: Mapping[str, Any],
    by_axle: Mapping[str, Mapping[str, Metrics]],
    over: str,
    diagram: Mapping[str, Any] | None,
    gif: Path | None,
) -> dict[str, Any]:
    """Figures of the runs by name of their files; the animation is written."""
    texts = vehicle_text(scenario) + drivetrain_setting(scenario.drivetrain), track_text(scenario)
    wheelset = scenario.drivetrain.wheelset
    caption = " ".join(text for text in (*texts, sensors_text(scenario)) if text)
    unit, kinetic = scenario.speed_unit, wheelset.element.friction.kinetic
    one = kinetic if scenario.track.unit == "coefficient" else 1.0
    look: dict[str, Any] = {
        "caption": caption,
        "minimum_speed": wheelset.element.minimum_speed,
        "units": figures.Units(
            unit, 1.0 / in_si(f"1 {unit}", "m/s"), one, scenario.track.unit == "adhesion"
        ),
    }
    drawn = {}
    for name, result in results.items():
        title = f"{scenario.name}: {figures.run_name(name)}"
        shown = list(by_axle.get(name, {name: all_metrics[name]}).values())
        drawn[name] = figures.scenario_run(result, shown, title=title, over=over, **look)
        if diagram is not None:
            of_run = result, all_metrics[name], scenario, name
            page = figures.run_diagram(*of_run, caption=caption, over=over, **diagram)
            drawn[f"{name}.diagram"] = page
        if name in by_axle:
            curve = figures.vehicle_creep_curve(result, wheelset, title=title, caption=caption)
            drawn[f"{name}.creep_curve"] = curve
    if gif is not None:
        figures.animate_runs(results, wheelset, gif, title=scenario.name, units=look["units"])
    if len(results) > 1:
        look["title"] = scenario.name
        drawn["comparison"] = figures.comparison(results, all_metrics, over=over, **look)
    return drawn


def vehicle_text(scenario: Scenario) -> str:
    """Beginning of a sentence about the axles; empty for a wheelset."""
    if scenario.axles == 1:
        return ""
    *places, last = (f"{place:g}" for place in scenario.position)
    return f"Each of {scenario.axles} axles at {', '.join(places)} and {last} m: "


def track_text(scenario: Scenario) -> str:
    """Sentence about what a figure of a run does not draw: cleaning and wheel load."""
    track, load, parts = scenario.track, scenario.dynamic_load, []
    if track.cleaning > 0.0:
        parts.append(f"cleaning {track.cleaning:.3g} m/J up to the factor {track.recovered:.3g}")
    if load is not None:
        random = f"random up to {max(load.frequency, default=0.0):.3g} Hz, seed {load.seed:g}"
        history = f"of the static one, times {min(load.factor, default=1.0):.3g}"
        history += f" to {max(load.factor, default=1.0):.3g}"
        parts.append(f"wheel load {random if load.frequency else history}")
    text = "; ".join(parts)
    return f"{text[:1].upper()}{text[1:]}." if text else ""


def sensors_text(scenario: Scenario) -> str:
    """Sentences about the sensors; empty if no controller has any."""
    if not sample_times(scenario):
        return ""
    sensors = scenario.sensors
    errors = {
        f"bias of the vehicle speed {100 * sensors.vehicle_speed_bias:.3g} %": (
            sensors.vehicle_speed_bias
        ),
        f"its drift {sensors.vehicle_speed_drift:.3g} m/s2": sensors.vehicle_speed_drift,
        f"error of the wheel diameter {100 * sensors.wheel_diameter_error:.3g} %": (
            sensors.wheel_diameter_error
        ),
        f"encoder with {sensors.encoder_pulses:g} pulses": sensors.encoder_pulses,
    }
    causes = ", ".join(text for text, value in errors.items() if value)
    return (
        f"Sensors: delay {1e3 * sensors.delay:.3g} ms, noise {sensors.wheel_speed_noise:.2g} "
        f"and {sensors.vehicle_speed_noise:.2g} m/s on wheel and vehicle speed."
        + (f" {causes[0].upper()}{causes[1:]}." if causes else "")
    )


def sample_times(scenario: Scenario) -> list[float]:
    """Sample times of the scenario's controllers, sorted; continuous ones have none."""
    every = map(scenario.any_controller, scenario.controllers)
    return sorted(
        {control.sample_time for control in every if not isinstance(control, ContinuousController)}
    )


def outlook(scenario: Scenario) -> list[str]:
    """Report for each sample time, at minimum and maximum friction, if a gain is stabilising.

    A line names the steepest point of the falling branch, its pole, and the gains that hold it with
    the delays of the loop: at the design speed and, if the run starts more slowly, at its first
    speed, but not below the minimum speed. Where only a friction brake acts, under controllers
    without a gain, it names the pole alone. The last line reports rolling that is not steady.
    """
    drivetrain, wheelset = scenario.drivetrain, scenario.drivetrain.wheelset
    start = max(abs(scenario.initial_speed), wheelset.element.minimum_speed)
    speeds = [scenario.design_speed, *([start] if start < scenario.design_speed else [])]
    remembers, times = wheelset.element.memory, sample_times(scenario)
    controls = map(scenario.any_controller, scenario.controllers)
    brakes = drivetrain.brake is not None and max(scenario.demand.value) <= 0.0
    if brakes and all(isinstance(control, WITHOUT_GAIN) for control in controls):
        times = [0.0]  # without a verdict
    lines, rates = [], {}
    for speed in speeds:
        rates[speed] = [0.0, *([] if remembers else drivetrain.vibrations)]
        for sample_time in times:
            rails = scenario.rails_at(speed)
            for friction, slope in sorted({rails.lowest, rails.highest}):
                line, pole = _verdict(scenario, speed, sample_time, friction, slope)
                lines.append(line)
                rates[speed].append(pole)
    slowest = speeds[-1]  # where the contact is passed through in the longest time
    fastest = reduced_frequency(wheelset, max(rates[slowest]), speed=slowest)
    if fastest > STEADY_ROLLING and not remembers:  # memory is in poles and ranges of gains
        lines.append(
            f"rolling at {slowest:g} m/s is not steady, and analysis is inaccurate: the largest "
            f"rate, {max(rates[slowest]):.3g} 1/s, has the reduced frequency {fastest:.2g}, above "
            f"{STEADY_ROLLING:g}; add memory = true to [contact]"
        )
    return lines


def _verdict(
    scenario: Scenario, speed: float, sample_time: float, friction: float, slope: float
) -> tuple[str, float]:
    """Line on the steepest point of the falling branch under a speed and factors; its pole."""
    drivetrain = scenario.drivetrain
    wheelset = drivetrain.wheelset.with_slope(slope)
    worst = worst_pole(wheelset, speed=speed, friction_scale=friction)
    where = f"at {speed:g} m/s, friction factor {friction:g}"
    where += "" if slope == 1.0 else f", slope factor {slope:g}"
    if worst.pole <= 0.0:
        return f"{where}: no branch on which the wheel slips away under constant torque", 0.0
    where = f"falling branch {where}, creepage {100.0 * worst.creepage:.3g} %"
    frequency = reduced_frequency(wheelset, worst.pole, speed=speed)
    rolling = f"reduced frequency p a/V {frequency:.2g}"
    if sample_time == 0.0:
        locks = f"at constant torque of the brake the wheel locks, pole {worst.pole:.4g} 1/s"
        return f"{where}: {locks}; {rolling}", worst.pole
    plant = reduced_plant(wheelset, worst.creepage, speed=speed, friction_scale=friction)
    verdict = controllability(
        worst.pole,
        zeros=plant.zeros,
        poles=plant.poles,
        delay=scenario.sensors.delay,
        lag=drivetrain.motor.lag if max(scenario.demand.value) > 0.0 else drivetrain.brake_lag,
        sample_time=sample_time,
    )
    stay = "; control has to stay on the rising branch" if verdict.window.empty else ""
    return f"{where}: {verdict.text}{stay}; {rolling}", worst.pole


def write_tuning(
    scenarios: Sequence[Scenario],
    names: Sequence[str],
    folder: Path,
    reporter: Reporter,
    formats: Sequence[str],
    trials: int,
    seeds: int,
) -> None:
    """Search settings of controllers, run them with sensor errors, and write the results.

    Parameters
    ----------
    scenarios : sequence of Scenario
        Scenarios that the settings have to suit; the first names the controllers.
    names : sequence of str
        Controllers; empty for all that declare settings to search.
    folder : Path
        Gets settings.toml, which is written anew whenever a controller is tuned, and after the
        last one errors.csv, errors.txt and the figure errors. It is created before the first
        search.
    reporter, formats
        As for `write_report`.
    trials, seeds : int
        As for `contactlib.tune`.

    Raises
    ------
    ValueError
        As `contactlib.tune` does, and if two scenarios have one name.
    OSError
        If the folder cannot be created or written.
    """
    first = scenarios[0]
    check_distinct(scenarios)
    declared = [n for n in first.controllers if getattr(first.controller(n), "search_ranges", None)]
    chosen = list(dict.fromkeys(names or declared or first.controllers))
    for name in chosen:
        searched(scenarios, name)  # refuses all of them before the first search
    tuned: dict[str, Tuning] = {}
    settings = folder / "settings.toml"
    with ExitStack() as stack:
        stack.callback(_remove_empty, folder)
        folder.mkdir(parents=True, exist_ok=True)
        try:
            for name in chosen:
                with reporter.step(f"Tuning {name}") as progress:
                    tuned[name] = tune(
                        scenarios, name, trials=trials, seeds=seeds, progress=progress
                    )
                sections = [
                    tuning.section(key, first.controllers[key]) for key, tuning in tuned.items()
                ]
                write_whole(settings, "\n".join(sections).encode())
            _report_tuning(scenarios, tuned, folder, reporter, formats)
        except KeyboardInterrupt:
            if tuned:
                reporter.line(f"Stopped. The settings of {', '.join(tuned)} are in {settings}")
            raise


def _remove_empty(folder: Path) -> None:
    with suppress(OSError):  # not empty
        folder.rmdir()


def _report_tuning(
    scenarios: Sequence[Scenario],
    tuned: Mapping[str, Tuning],
    folder: Path,
    reporter: Reporter,
    formats: Sequence[str],
) -> None:
    """Show and write the utilisation of tuned controllers, also with sensor errors."""
    objective = [name.replace("_", " ") for name in OBJECTIVE]
    rows = [
        ["", "", *(cell for name in objective for cell in (name, ""))],
        ["controller", "scenario", *["designed", "tuned"] * len(objective)],
    ]
    for name, tuning in tuned.items():
        for scenario, *both in zip(scenarios, tuning.designed, tuning.tuned, strict=True):
            pairs = zip(*(values.mean(axis=-1) for values in both), strict=True)
            rows.append(
                [name, scenario.name, *(f"{value:.3f}" for pair in pairs for value in pair)]
            )
    trials = next(iter(tuned.values())).trials
    reporter.line(f"The search tried {trials} settings of each controller, for the largest mean of")
    for name in OBJECTIVE:
        reporter.line(f"- {name.replace('_', ' ')}: {OUTCOMES[name].description}")
    reporter.line("over all scenarios, sensors and noises. With noise that it has not seen:")
    reporter.line(fixed_width(rows))
    with reporter.step("Running with sensors that err") as progress:
        controls = {name: tuning.controllers for name, tuning in tuned.items()}
        errors = sensor_errors(scenarios, controls, progress=progress)
    frame = errors.to_dataframe().reset_index()
    write_whole(folder / "errors.csv", frame.to_csv(index=False, lineterminator="\n").encode())
    table = errors_table(errors)
    reporter.line(table)
    write_whole(folder / "errors.txt", f"{table}\n".encode())
    with reporter.step("Drawing"):
        figures.save_pictures(figures.sensor_errors(errors), folder, "errors", formats)


def errors_table(errors: xr.DataArray) -> str:
    """Format limited utilisation with sensor errors: mean and, in brackets, minimum over noise.

    Parameters
    ----------
    errors : xarray.DataArray
        From `contactlib.runs.sensor_errors`.
    """
    lines = []
    for scenario in errors.scenario.values:
        rows = [["sensors", *map(run_name, errors.controller.values)]]
        for error in errors.error.values:
            noises = errors.sel(scenario=scenario, error=error)
            cells = zip(noises.mean("noise").values, noises.min("noise").values, strict=True)
            rows.append([error, *(f"{mean:.3f} ({smallest:.3f})" for mean, smallest in cells)])
        title = f"{scenario}: limited utilisation, mean over noise (minimum)"
        lines += [title, fixed_width(rows), ""]
    return "\n".join(lines[:-1])
