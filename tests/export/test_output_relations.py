"""Every output of every FMU is consistent with force, slip and load, in every mode.

`RELATIONS` states for each variable that an FMU calculates what it is by the other variables, so
also where an implicit step replaces the force by a mean. An output without a relation fails.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from brake_pads import GIVE, held_by
from exported_fmu import exported, fitting
from falling_friction import falling
from fmu_instance import EXPORTS, Instance, Wheels

import contactlib as cl
from contactlib import kernel
from contactlib.export.description import Description

CALCULATED = ("output", "state", "derivative", "indicator")
MEMORY = ("held_force", "unslipped", "outer_force", "held_lateral", "outer_lateral")
OUTER_STRENGTH = 0.1567  # share of the zone that slips first, see memory.h
STEP, SHORT_STEP = 2e-3, 1e-5  # [s]

# Traction, braking, sliding, no load, no friction, little friction, which limits k_hat and the
# force, lateral slip with and without spin, below the minimum speed, backwards.
PLACES: list[dict[str, float]] = [
    {"slip": 0.03},
    {"slip": 0.15, "normal_load": 9e4},
    {"slip": -1.5},
    {"slip": 0.2, "normal_load": 0.0},
    {"slip": 0.05, "friction_scale": 0.0},
    {"slip": 0.004, "friction_scale": 0.02},
    {"slip": 0.06, "lateral_velocity": 0.05, "spin_velocity": 2.0},
    {"slip": -0.1, "lateral_velocity": -0.4, "normal_load": 6e4},
    {"slip": 0.002, "speed": 0.05, "spin_velocity": -0.01},
    {"slip": -0.3, "speed": -10.0},
]
BODIES_PLACES: list[dict[str, float]] = [
    {"creepage_x": -0.001},
    {"creepage_x": 0.05, "creepage_y": 0.02, "speed": 20.0},
    {"creepage_y": -0.003, "spin": 0.3, "normal_load": 6e4},
    {"creepage_x": -0.002, "friction_scale": 0.3, "speed": -8.0},
    {"normal_load": 0.0, "semi_axis_x": 0.0, "semi_axis_y": 0.0, "creepage_x": 0.1},
]


def regularized(speed: float, minimum: float) -> float:
    z = speed / minimum
    return abs(speed) if abs(z) >= 1.0 else minimum * (3.0 + z * z * (6.0 - z * z)) / 8.0


class Point:
    """Values of one wheel's variables, and what follows from them."""

    def __init__(self, description: Description, values: dict[str, float]) -> None:
        self.description = description
        self.values = {**description.start_values, **values}
        self.step_slip: float | None = None  # at the end of an implicit step [m/s]
        self.before: Point | None = None  # at the start of a short step

    def __getattr__(self, name: str) -> float:
        return self.values[name]

    @cached_property
    def remembers(self) -> bool:
        return self.description.remembers

    @cached_property
    def stepped(self) -> bool:
        """Whether the creep force is the mean of a step."""
        return self.step_slip is not None

    @cached_property
    def grips(self) -> bool:
        return self.normal_load > 0.0 and self.friction_scale > 0.0

    @cached_property
    def slip(self) -> float:
        """Slip velocity to which the outputs belong [m/s]."""
        now = self.values["radius"] * self.values["omega"] - self.values["speed"]
        return now if self.step_slip is None else self.step_slip

    @cached_property
    def slowest(self) -> float:
        """Speed below which that of the creepage is regularised [m/s]."""
        return 1e-6 if self.remembers else self.minimum_speed

    @cached_property
    def contact(self) -> Point:
        """The same with semi-width and pressure under the load."""
        growth = (self.normal_load / self.nominal_load) ** self.load_exponent
        at_load = {name: growth * self.values[name] for name in ("semi_width", "peak_pressure")}
        return Point(self.description, {**self.values, **at_load})

    @cached_property
    def cold_zeta0(self) -> float:
        """Saturation creepage, Eq. (15), if neither heat nor slip speed lowers friction."""
        stiffness = self.contact_modulus * self.slope_reduction
        return (
            2.0
            * self.kinetic_friction
            * self.friction_scale
            * self.contact.peak_pressure
            / stiffness
        )

    @cached_property
    def weakening(self) -> float:
        at = self.contact
        return at.contact_modulus * at.weakening_length / (at.semi_width * at.peak_pressure)

    @cached_property
    def cold_k_hat(self) -> float:
        """Eq. (17), likewise."""
        drop = self.static_friction - self.kinetic_friction
        root = math.sqrt(self.weakening * drop / math.pi / self.friction_scale)
        return root / self.kinetic_friction

    @cached_property
    def slip_speed(self) -> float:
        """Magnitude of all slip [m/s]."""
        turning = 0.0
        if self.description.spins:
            contact: Any = self.description.element.contact
            aspect = contact.semi_axis_x / contact.semi_axis_y
            spread = math.sqrt((1.0 + aspect**-2) / 5.0)
            turning = spread * self.contact.semi_width * self.spin_velocity
        return math.hypot(self.slip, self.lateral_velocity, turning)

    @cached_property
    def warm(self) -> float:
        """Factor on friction by temperature."""
        if self.softening_temperature == 0.0:
            return 1.0
        mean = 1.3184531038587535 if self.elliptic else 1.5720233570985864  # laws/heat.py
        rail, wheel = (
            regularized(v, self.minimum_speed) for v in (self.speed, self.slip + self.speed)
        )
        at = self.contact
        pressure = mean * at.peak_pressure * math.sqrt(at.semi_width / math.pi)
        carried = self.thermal_effusivity * (math.sqrt(rail) + math.sqrt(wheel))
        heating = self.kinetic_friction * self.friction_scale * pressure / carried
        rolling = rail * self.cold_zeta0
        numbers = self.slip_speed / rolling, rolling * heating / self.softening_temperature
        given = (np.array(number) for number in (*numbers, self.cold_k_hat))
        return float(kernel.thermal_softening(*given, elliptic=bool(self.elliptic)))

    @cached_property
    def fall(self) -> float:
        """Factor on friction by slip speed and temperature."""
        left = self.slip_rate_residual
        decay = math.exp(-self.slip_rate_decay * self.slip_speed)
        return ((1.0 - left) * decay + left) * self.warm

    @cached_property
    def k_hat_of_law(self) -> float:
        return self.cold_k_hat / math.sqrt(self.fall)

    @cached_property
    def largest(self) -> float:
        """Static friction times load [N]."""
        return self.static_friction * self.friction_scale * max(0.0, self.normal_load)

    def steady(self, name: str, slip: float | None = None) -> float:
        """Force of steady rolling here, or at another slip velocity."""
        element = self.description.element
        inputs = np.zeros((), kernel.struct_dtype("force_element_input"))
        for key in inputs.dtype.names or ():
            inputs[key] = self.values.get(key, 0.0)
        inputs["omega"] = ((self.slip if slip is None else slip) + self.speed) / self.radius
        if name == "creep_force" and self.remembers:
            native = kernel.NativeForceElement(element.native_contact, element.rolling_parameters)
            return float(native.evaluate(inputs)["steady_force"])
        given = {**element.parameters, "minimum_speed": self.slowest}
        native = kernel.NativeForceElement(element.native_contact, given)
        return float(native.evaluate(inputs)[name])

    @cached_property
    def zones(self) -> list[tuple[float, tuple[float, float]]]:
        """What static friction allows outer zone and core to hold, and what they hold [N]."""
        outer = self.outer_force, self.outer_lateral
        core = self.held_force - outer[0], self.held_lateral - outer[1]
        most = OUTER_STRENGTH * self.largest
        return [(most, outer), (self.largest - most, core)]

    def acting(self, name: str) -> float:
        """Component of the held force, with each zone as far as static friction holds it [N]."""
        force = 0.0
        for most, zone in self.zones:
            size = math.hypot(*zone)
            force += zone[name == "lateral"] * (most / size if size > most else 1.0)
        return force

    @cached_property
    def memory_scales(self) -> Any:
        """What the kernel derives of the memory here."""
        element = self.description.element
        scale, table = self.friction_scale * self.fall, element.table.native
        return kernel.contact_scales(
            element.rolling_parameters, self.normal_load, scale, table=table
        )

    @cached_property
    def gradient(self) -> float:
        """Of the steady force by slip velocity [N.s/m]."""
        move = 1e-5 * regularized(self.speed, self.slowest) * self.cold_zeta0
        ahead, behind = (self.steady("creep_force", self.slip + d) for d in (move, -move))
        return (ahead - behind) / (2.0 * move)

    @cached_property
    def resistance(self) -> float:
        direction = self.speed / regularized(self.speed, self.minimum_speed)
        return (
            self.constant_resistance * direction
            + self.linear_resistance * self.speed
            + self.quadratic_resistance * self.speed * abs(self.speed)
            + self.resistance_force
        )


# A relation gives the value that follows from other variables, or with it a relative tolerance and
# the smallest number that this is relative to; or whether the variable's value fits.
Relation = Callable[[Point], "float | bool | tuple[float, float, float]"]


def if_grips(value: Callable[[Point], float]) -> Relation:
    return lambda p: value(p) if p.grips else 0.0


def creep_force(p: Point) -> float | bool:
    if p.remembers and not p.stepped:
        return p.acting("force") if p.grips else 0.0
    if not p.stepped and p.creep_force * p.slip < 0.0:
        return False
    return abs(p.creep_force) <= p.largest * (1.0 + 1e-12)  # in a step see creepage


def lateral_force(p: Point) -> float | bool:
    if p.remembers and p.grips:
        return p.acting("lateral")
    return dissipates(p)


def dissipates(p: Point) -> bool:
    """Whether steady forces brake the slip, within friction, and only slip gives any."""
    if not p.grips:
        return p.lateral_force == p.spin_moment == 0.0
    along = p.steady("creep_force")
    across = p.steady("lateral_force") if p.remembers else p.lateral_force
    power = along * p.slip - across * p.lateral_velocity - p.spin_moment * p.spin_velocity
    slips = p.lateral_velocity != 0.0 or p.spin_velocity != 0.0
    return power >= 0.0 and math.hypot(along, across) <= p.largest and bool(across) == slips


def force_gradient(p: Point) -> tuple[float, float, float]:
    scale = p.largest / (p.cold_zeta0 * regularized(p.speed, p.slowest)) if p.grips else 1.0
    return (p.gradient if p.grips else 0.0), 1e-6, scale


def step_size_hint(p: Point) -> tuple[float, float, float]:
    hint = 1000.0
    if p.grips and p.gradient and not p.implicit:
        share = 0.5 if p.parallel_exchange else 1.0
        hint = share / (abs(p.gradient) * p.effective_inverse_mass)
    if p.grips and p.remembers and not p.implicit and not p.parallel_exchange:
        at = p.contact
        memory = p.memory_scales
        compliance = 2.0 * at.peak_pressure * memory.relaxation_length
        compliance /= p.contact_modulus * p.slope_reduction * memory.initial_slope
        stiffness = max(memory.standing_stiffness, 1.0) * p.normal_load / compliance
        hint = max(hint, 1.0 / math.sqrt(stiffness * p.effective_inverse_mass))
    return min(hint, 1000.0), 1e-4, 0.0


def force_limited(p: Point) -> bool:
    """Whether the steady force, or with memory that of a zone, is above static friction."""
    force = math.hypot(p.steady("creep_force"), p.steady("lateral_force"))
    limited = p.grips and force > (1.0 - 1e-12) * p.largest * p.fall
    if p.remembers and p.grips:
        limited |= any(math.hypot(*zone) > 1.01 * most for most, zone in p.zones)
    return bool(p.force_limited) == limited


def moves(name: str) -> Relation:
    """The variable follows its rate over a short step."""

    def end(p: Point) -> tuple[float, float, float]:
        if p.before is None:
            return p.values[name], 0.0, 0.0
        rates = [point.values[f"der({name})"] for point in (p.before, p)]
        rise = 0.5 * SHORT_STEP * sum(rates)
        force = name in MEMORY and name != "unslipped"
        size = p.static_friction * p.nominal_load if force else 0.1
        scale = SHORT_STEP * max(map(abs, rates)) + 1e-8 * size
        return p.before.values[name] + rise, 5e-2 * scale / abs(p.values[name] or 1.0), 1.0

    return end


def positive_where(flag: str, indicator: str) -> Relation:
    return lambda p: (p.values[indicator] > 0.0) == bool(p.values[flag])


def rate_of(name: str) -> Relation:
    """The relation of the state uses its rate."""
    return lambda p: math.isfinite(p.values[f"der({name})"])


CONTACT: dict[str, Relation] = {
    "creep_force": creep_force,
    "wheel_torque": lambda p: -p.radius * p.creep_force,
    "lateral_force": lateral_force,
    "spin_moment": dissipates,
    "creepage": lambda p: p.slip / regularized(p.speed, p.slowest),
    "normalized_creepage": if_grips(lambda p: p.creepage / p.saturation_creepage),
    "traction_coefficient": if_grips(lambda p: p.creep_force / p.normal_load),
    "force_gradient": force_gradient,
    "k_hat": if_grips(lambda p: min(p.k_hat_of_law, p.description.element.table.k_max)),
    "saturation_creepage": if_grips(lambda p: p.cold_zeta0 * p.fall),
    "process_zone_ratio": if_grips(
        lambda p: (
            2.0
            * p.weakening
            / (p.static_friction - p.kinetic_friction)
            / (p.friction_scale * p.fall)
        )
    ),
    "contact_temperature": if_grips(lambda p: p.softening_temperature * (1.0 - p.warm)),
    "falling_branch": lambda p: bool(p.falling_branch) == (p.force_gradient < 0.0),
    "speed_regularized": lambda p: (
        bool(p.speed_regularized) == (not p.remembers and abs(p.speed) < p.minimum_speed)
    ),
    "k_hat_limited": lambda p: (
        bool(p.k_hat_limited) == (p.grips and p.k_hat_of_law > p.description.element.table.k_max)
    ),
    "force_limited": force_limited,
    "length_limited": lambda p: (
        bool(p.length_limited)
        == (
            p.remembers
            and p.grips
            and not p.elliptic
            and 2.0 * p.transverse_half_length < 4.0 * (1.0 - 1e-9) * p.contact.semi_width
        )
    ),
    "unloaded": lambda p: bool(p.unloaded) == (p.normal_load <= 0.0),
    "step_size_hint": step_size_hint,
    **{name: moves(name) for name in MEMORY},
    **{f"der({name})": rate_of(name) for name in MEMORY},
    "falling_indicator": positive_where("falling_branch", "falling_indicator"),
    "speed_indicator": positive_where("speed_regularized", "speed_indicator"),
    "k_hat_indicator": positive_where("k_hat_limited", "k_hat_indicator"),
    "force_indicator": positive_where("force_limited", "force_indicator"),
    "length_indicator": positive_where("length_limited", "length_indicator"),
    "load_indicator": positive_where("unloaded", "load_indicator"),
}
BODY: dict[str, Relation] = {
    "omega": moves("omega"),
    "speed": moves("speed"),
    "pads": moves("pads"),
    "der(omega)": lambda p: (
        (
            p.drive_torque
            - p.brake_torque * held_by(p.pads, p.radius * p.omega)[0]
            - p.radius * p.creep_force
            - p.damping * p.omega
        )
        / p.inertia
    ),
    "der(pads)": lambda p: (held_by(p.pads, p.radius * p.omega)[1], 1e-9, abs(p.omega) / GIVE),
    "der(speed)": lambda p: (p.creep_force - p.resistance) * p.inverse_mass - p.grade_acceleration,
}


def pair_dissipates(p: Point) -> bool:
    power = p.creepage_x * p.force_x + p.creepage_y * p.force_y + p.spin * p.spin_moment
    size = math.hypot(p.force_x, p.force_y)
    return size <= p.largest * (1.0 + 1e-12) and (power < 0.0 if p.grips else power == size == 0.0)


def utilisation(p: Point) -> float | bool:
    if not p.grips:
        return 0.0
    size = math.hypot(p.force_x, p.force_y) / p.largest
    if p.softening_temperature > 0.0:  # which lowers static friction too
        return size <= p.utilisation <= 1.0
    turning = math.sqrt(0.2 * (p.semi_axis_x**2 + p.semi_axis_y**2)) * p.spin
    slip = abs(p.speed) * math.hypot(p.creepage_x, p.creepage_y, turning)
    left = p.slip_rate_residual if p.slip_rate_decay else 1.0
    return size / (left + (1.0 - left) * math.exp(-p.slip_rate_decay * slip))


RELATIONS: dict[str, dict[str, Relation]] = {
    "force_element": CONTACT,
    "wheelset": {**CONTACT, **BODY},
    "wheelset_body": BODY,
    "creep_forces": {
        **dict.fromkeys(("force_x", "force_y", "spin_moment"), pair_dissipates),
        "utilisation": utilisation,
    },
}


def check(point: Point, where: object) -> None:
    """Each calculated variable of a point meets its relation."""
    relations = RELATIONS[point.description.kind]
    for v in point.description.variables:
        if v.role not in CALCULATED:
            continue
        assert v.name in relations, f"{v.name} is calculated: state its relation to the others"
        computed, expected = point.values[v.name], relations[v.name](point)
        what = f"{v.name} = {computed!r}, {where}"
        if isinstance(expected, bool):
            assert expected, what
        else:
            value, within, scale = (
                (expected, 1e-9, 0.0) if isinstance(expected, float) else expected
            )
            assert abs(computed - value) <= within * max(abs(value), scale), f"{what}: {value!r}"


def read(wheels: Wheels, description: Description) -> list[Point]:
    """Values of all wheels."""
    names = [v.name for v in description.variables if v.role in (*CALCULATED, "input")]
    columns = {name: wheels.get(name) for name in names}
    return [
        Point(description, {name: column[i] for name, column in columns.items()})
        for i in range(wheels.count)
    ]


class Momentum:
    """The slip of an implicit step by its mean force, see `fmu/fmi/force_element_model.c`."""

    def __init__(self, start: Point) -> None:
        self.force = start.creep_force
        self.mass = 1.0 / start.effective_inverse_mass
        self.parallel = bool(start.parallel_exchange)
        self.applied, self.slip, self.step = self.force, start.slip, math.inf

    def end(self, point: Point, step: float) -> float:
        """Slip velocity at the end of a step."""
        slip = begin = point.radius * point.omega - point.speed
        rate = (slip - self.slip) / self.step + self.applied / self.mass
        if self.parallel:  # the last force still acts
            begin += step * (rate - self.force / self.mass)
        self.applied = self.force if self.parallel else point.creep_force
        self.force, self.slip, self.step = point.creep_force, slip, step
        return begin + step * (rate - point.creep_force / self.mass)


MODES: dict[str, dict[str, Any]] = {
    **{name: {} for name in EXPORTS if name != "vehicle"},  # test_vehicle_fmu.py has its relations
    "force_element parallel": {"parallel_exchange": True},
    "force_element-implicit parallel": {"parallel_exchange": True},
    "force_element-memory implicit": {"implicit": True},
}
BODY_VALUES = {
    "drive_torque": 2e4,
    "brake_torque": 3e3,
    "pads": 0.5,
    "resistance_force": 1e3,
    "creep_force": 4e4,
}


def start(wheels: Wheels, description: Description, places: list[dict[str, float]]) -> None:
    """Initialize each wheel at its place."""
    default = {**description.start_values, **BODY_VALUES}
    columns: dict[str, list[float]] = {}
    for place in places:
        given = {**BODY_VALUES, **place}
        if "slip" in place:
            speed = place.get("speed", default["speed"])
            given |= {"speed": speed, "omega": (place["slip"] + speed) / default["radius"]}
        for name in {key for other in places for key in other} | {"omega", "speed", *BODY_VALUES}:
            if name in description.start_values:
                columns.setdefault(name, []).append(given.get(name, default[name]))
    wheels.tool.initialize()
    wheels.set(**columns)
    wheels.tool.fmu.exitInitializationMode()


def points_of_run(wheels: Wheels, description: Description) -> Iterator[list[Point]]:
    """The wheels after each step; the last step is short."""
    points, time = read(wheels, description), 0.0
    yield points
    momenta: list[Momentum] = []
    for k, step in enumerate((STEP, STEP, STEP, SHORT_STEP)):
        if "omega" in wheels.inputs:  # as a body would move in a short step
            away = [0.05 * math.sin(k + i) if step == STEP else 0.0 for i in range(wheels.count)]
            slips = [p.slip + more for p, more in zip(points, away, strict=True)]
            omega = [(p.speed + w) / p.radius for p, w in zip(points, slips, strict=True)]
            wheels.set(omega=omega)
        if not (description.implicit and momenta):
            points = read(wheels, description)
        if description.implicit and not momenta:
            momenta = [Momentum(point) for point in points]
        before = points
        wheels.tool.step(time, step)
        time += step
        points = read(wheels, description)
        for i, momentum in enumerate(momenta):
            points[i].step_slip = momentum.end(points[i], step)
        if step == SHORT_STEP:
            for point, earlier in zip(points, before, strict=True):
                point.before = earlier
        yield points


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("mode", MODES)
def test_outputs_are_consistent(
    locomotive: cl.Model, tmp_path: Path, mode: str, version: int
) -> None:
    name, kind = mode.split()[0], EXPORTS[mode.split()[0]]["kind"]
    element = falling(locomotive.wheelset.element)  # with slip speed
    if version == 2:  # with heat, and a layer
        table = cl.carter_griffith_table("elliptic")
        element = falling(locomotive.wheelset.element, residual=0.0)
        element = replace(element, layer_compliance=3e-13, table=table)
    model = replace(locomotive, wheelset=replace(locomotive.wheelset, element=element))
    places = {"creep_forces": BODIES_PLACES, "wheelset_body": PLACES[:1]}.get(kind, PLACES)
    groups = [places] if version == 3 else [[place] for place in places]
    count, options = len(groups[0]), MODES[mode]
    wheels_option = {"wheels": count} if count > 1 else {}
    folder = exported(model, tmp_path, name, version, **options, **wheels_option)
    description = Description(fitting(model, name), **{**EXPORTS[name], **options})
    swing = 0.0
    for exchange in (False, True):
        with Instance(folder, exchange=exchange) as tool:
            wheels = Wheels(tool, count)
            for group in groups:
                start(wheels, description, group)
                rows = points_of_run(wheels, description)
                for number, points in enumerate([read(wheels, description)] if exchange else rows):
                    for point, place in zip(points, group, strict=True):
                        check(point, (number, place))
                        if point.stepped and point.grips:
                            swing = max(
                                swing, abs(point.creep_force / point.steady("creep_force") - 1)
                            )
                tool.fmu.reset()
    assert not description.implicit or swing > 0.05  # the mean is not the force at the end
