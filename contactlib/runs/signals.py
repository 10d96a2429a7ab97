"""Signals of runs, with units and descriptions; a block of rows computes each on first use."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from functools import cache, cached_property
from typing import Any, NamedTuple, Protocol

import numpy as np

from contactlib import kernel
from contactlib.base.quantities import FloatArray
from contactlib.base.text import known_names
from contactlib.element.force_element import ForceElement
from contactlib.vehicle.available_force import AvailableForce

OF_FORCES = ("N", "N.s/m")  # units of what each of two equal wheels has half of
WORKS = ("drive_work", "creep_work", "resistance_work", "loss_work")
SIDES = ("left", "right")


class Source(Protocol):
    """Source of rows: the drivetrains, their radii [m] and their largest forces."""

    fleet: kernel.NativeFleet
    radius: FloatArray
    axles: int  # of each vehicle
    sand_rate: FloatArray  # of each axle in the block's rows [kg/s]
    measured_speed: FloatArray  # vehicle speed that the controllers get, of the block's rows [m/s]

    @property
    def available(self) -> AvailableForce | None:
        """Largest creep forces that friction allows; None if no signal needs them."""

    @property
    def pressure_per_torque(self) -> FloatArray:
        """Pressure in each brake's cylinder over its torque [Pa/(N.m)]."""

    @property
    def padded(self) -> bool:
        """Whether the friction of a brake's pads changes."""

    def speed_limit(self, distance: FloatArray) -> FloatArray:
        """Speed limits of the tracks at distances of shape (rows, n) [m/s]."""


class Signal(NamedTuple):
    """Unit and description of a signal; `sides`: with those of the left and the right wheel."""

    unit: str
    description: str
    sides: bool = False


SIGNALS = {  # of sampled runs, in this order; `Block` computes those that the kernel does not
    "demand": Signal("N.m", "torque that the driver demands"),
    "commanded_torque": Signal("N.m", "torque that the drive is commanded"),
    "drive_torque": Signal("N.m", "drive torque on the axle"),
    "axle_torque": Signal("N.m", "torque that twists the axle"),
    "omega": Signal("rad/s", "angular velocity", sides=True),
    "speed": Signal("m/s", "vehicle speed"),
    "acceleration": Signal("m/s2", "vehicle acceleration"),
    "slip_velocity": Signal("m/s", "rim speed less vehicle speed"),
    "creepage": Signal("1", "longitudinal creepage", sides=True),
    "creep_force": Signal("N", "creep force", sides=True),
    "available_force": Signal("N", "largest creep force that friction allows"),
    "friction_scale_left": Signal("1", "factor on friction, left wheel"),
    "friction_scale_right": Signal("1", "factor on friction, right wheel"),
    "slope_scale": Signal("1", "factor on the initial slope of the creep force"),
    "grade": Signal("1", "rise of the track over distance, beside the vehicle's own"),
    "axle_load": Signal("N", "load of both wheels together"),
    "falling_branch": Signal("1", "1 where the creep force falls with creepage, else 0"),
    "distance": Signal("m", "distance travelled"),
    "drive_work": Signal("J", "work of the drive"),
    "creep_work": Signal("J", "work that friction turns into heat"),
    "resistance_work": Signal("J", "work of the resistance, or of a rig that holds the speed"),
    "loss_work": Signal("J", "work of the damping"),
    "stored_energy": Signal("J", "kinetic energy, and that of twisted axle and shaft"),
    "energy_defect": Signal("J", "error of the energy balance"),
    "brake_torque": Signal(
        "N.m", "torque of the brake against turning wheels, at its pads' friction"
    ),
    "measured_speed": Signal("m/s", "vehicle speed that the controllers get"),
}
SHARED = ("speed", "acceleration", "speed_limit")  # by the axles of a vehicle
OF_SHAFTS = {  # of drivetrains whose motor has a shaft
    "motor_omega": Signal("rad/s", "angular velocity of the rotor over the gear ratio"),
    "shaft_torque": Signal("N.m", "torque that twists the shaft of the motor, at the axle"),
}
OF_BRAKES = {  # of drivetrains whose brake has a pressure
    "cylinder_pressure": Signal("Pa", "pressure in the brake cylinder"),
}
OF_PADS = {  # of drivetrains whose brake has a table of its pads' friction
    "pad_friction": Signal("1", "friction of the brake's pads over the nominal one, both wheels"),
}
OF_SAND = {  # of drivetrains with sanding
    "sand": Signal("1", "part of its whole effect that sand on the rails has"),
    "sand_rate": Signal("kg/s", "sand that is laid"),
}
OF_TRACKS = {"speed_limit": Signal("m/s", "speed from which the driver demands no traction")}
CONTINUOUS = {  # of a run under a continuous controller, before those of sampled runs
    "omega": SIGNALS["omega"]._replace(sides=False),
    "speed": SIGNALS["speed"],
    "drive_torque": SIGNALS["drive_torque"],
    "creep_force": SIGNALS["creep_force"]._replace(sides=False),
    "creepage": SIGNALS["creepage"]._replace(sides=False),
    "normalized_creepage": Signal("1", "creepage over saturation creepage"),
    "traction_coefficient": Signal("1", "creep force over axle load"),
    "slip_velocity": SIGNALS["slip_velocity"],
    "axle_load": SIGNALS["axle_load"],
    "friction_scale": Signal("1", "factor on friction"),
    "resistance_force": Signal("N", "resistance force beside the vehicle's own"),
    "falling_branch": SIGNALS["falling_branch"],
    "reference": Signal("", "reference of the controller"),
}
ABSENT = ("wheel_torque", "lateral_force", "spin_moment")  # runs have neither lateral slip nor spin
OF_MEMORY = {  # of a contact with memory
    "sticking": Signal("1", "part of the contact that sticks in steady rolling", sides=True),
    "unslipped": Signal("1", "part that has not slipped since it entered", sides=True),
}


def units(*tables: Mapping[str, Signal]) -> dict[str, str]:
    """Units of the signals of tables by name, also of those of the two wheels."""
    signals = {name: signal for table in tables for name, signal in table.items()}
    return {
        each: signal.unit
        for name, signal in signals.items()
        for each in (name, *(f"{name}_{side}" for side in SIDES if signal.sides))
    }


UNITS = units(SIGNALS)


@cache
def of_contacts() -> Mapping[str, Signal]:
    """Signals of the contacts, which a run computes on request.

    They are the kernel's outputs of a contact. Those of both wheels are the sum of a force, the
    mean of another number, and of a flag 1 if it is 1 for one of them.
    """
    return {
        **{v.name: Signal(_unit(v), v.description, sides=True) for v in _outputs_of_contacts()},
        **OF_MEMORY,
    }


@cache
def _outputs_of_contacts() -> list[kernel.Variable]:
    known = {*SIGNALS, *ABSENT}
    fields = {*(kernel.struct_dtype("force_element_output").names or ())} - known
    return [v for v in kernel.model_variables("force_element") if v.name in fields]


def _unit(variable: kernel.Variable) -> str:
    return "1" if variable.boolean else variable.unit


def checked_signals(names: Iterable[str], elements: Collection[ForceElement]) -> dict[str, str]:
    """Units of signals of the contacts, which all of these elements must have, by name.

    Raises
    ------
    ValueError
        If a name is unknown, or is that of a signal that these contacts do not have.
    """
    if isinstance(names, str):
        raise ValueError(f"signals = {names!r} must be a list, such as [{names!r}]")
    known = units(of_contacts())
    thermal = {v.name for v in _outputs_of_contacts() if v.part == "if_thermal"}
    for name in names:
        if name not in known:
            raise ValueError(f"signals: {name!r} is not one; {known_names(str(name), known)}")
        both = name if name in of_contacts() else name.rpartition("_")[0]
        for element in elements:
            if both in thermal and not element.friction.softens_with_heat:
                raise ValueError(
                    f"signals: {name!r} needs friction that falls with temperature: [friction] "
                    "softening_temperature"
                )
            if both in OF_MEMORY and not element.memory:
                raise ValueError(f"signals: {name!r} needs [contact] memory = true")
    return {name: known[name] for name in names}


def long_name(name: str) -> str:
    """Describe a signal; of any other name its words."""
    known = {
        **SIGNALS,
        **OF_SHAFTS,
        **OF_BRAKES,
        **OF_PADS,
        **OF_SAND,
        **OF_TRACKS,
        **CONTINUOUS,
        **of_contacts(),
    }
    both, _, side = name.rpartition("_")
    if name not in known and side in SIDES and both in known:
        return f"{known[both].description}, {side} wheel"
    return known[name].description if name in known else name.replace("_", " ")


class Block:
    """Signals of some rows of n runs by name: arrays of shape (rows, n).

    The arrays share the fleet's memory and are valid until its next block.

    Parameters
    ----------
    time : ndarray
        Times of the rows [s].
    demand : ndarray
        Demanded torque [N.m], shape (rows, n).
    inputs, states : ndarray
        Records of the kernel, shape (rows, n).
    source : Source
        Source of the rows.
    stored : list of ndarray
        Stored energy at the start of the run [J]; the run's first block appends it.
    """

    def __init__(
        self,
        time: FloatArray,
        demand: FloatArray,
        inputs: Any,
        states: Any,
        source: Source,
        stored: list[FloatArray],
    ) -> None:
        self.time = time
        self._demand, self._inputs, self._states = demand, inputs, states
        self._source, self._stored = source, stored
        self._found: dict[str, FloatArray] = {"demand": demand}

    def __getitem__(self, name: str) -> FloatArray:
        """Return one signal."""
        if name not in self._found:
            self._found[name] = self._make(name)
        return self._found[name]

    @cached_property
    def _outputs(self) -> Any:
        return self._source.fleet.evaluate(self._inputs, self._states)

    @cached_property
    def _contacts(self) -> Any:
        shape = (*self._states.shape, 2)
        contacts = np.empty(shape, kernel.struct_dtype("force_element_output"))
        self._source.fleet.evaluate(self._inputs, self._states, contacts)
        return contacts

    def _make(self, name: str) -> FloatArray:
        if name in COMPUTED:
            return COMPUTED[name](self)
        if name == "slope_scale" or name.startswith("friction_scale_"):
            return np.asarray(self._inputs[name.replace("_scale", "")])
        if name in ("commanded_torque", "grade", "sand"):
            return np.asarray(self._inputs[name])
        if name in (kernel.drivetrain_dtype("output").names or ()):
            return np.asarray(self._outputs[name])  # the torque is that of motor and brake
        if name in self._states.dtype.names:
            return np.asarray(self._states[name])
        return self._of_contact(name)

    def _of_contact(self, name: str) -> FloatArray:
        """Signal of the contacts of one wheel, or of both."""
        both, _, side = name.rpartition("_")
        if not {name, both} & {*of_contacts()}:
            raise KeyError(f"signal {name!r}: Block has no method _{name}, and no record has it")
        if side in SIDES:
            values = np.asarray(self._contacts[both][..., SIDES.index(side)])
            return 0.5 * values if of_contacts()[both].unit in OF_FORCES else values
        if name in OF_MEMORY:
            left, right = (self[f"{name}_{side}"] for side in SIDES)
        else:
            left, right = np.moveaxis(self._contacts[name], -1, 0)
        is_flag = name in {v.name for v in _outputs_of_contacts() if v.boolean}
        return np.maximum(left, right) if is_flag else np.asarray(0.5 * (left + right))

    def _omega(self) -> FloatArray:
        return 0.5 * (self["omega_left"] + self["omega_right"])

    def _slip_velocity(self) -> FloatArray:
        return self._source.radius * self["omega"] - self["speed"]

    def _acceleration(self) -> FloatArray:
        own = np.asarray(self._outputs["speed_rate"])
        axles = self._source.axles
        if axles == 1:
            return own
        shared = own.reshape(len(own), -1, axles).mean(axis=-1)  # each has the same mass
        return np.asarray(np.repeat(shared, axles, axis=1))

    def _measured_speed(self) -> FloatArray:
        return self._source.measured_speed[: self.time.size]

    def _sand_rate(self) -> FloatArray:
        return self._source.sand_rate[: self.time.size]

    def _speed_limit(self) -> FloatArray:
        return self._source.speed_limit(self["distance"])

    def _cylinder_pressure(self) -> FloatArray:
        return np.asarray(self._source.pressure_per_torque * self._states["brake_torque"])

    def _brake_torque(self) -> FloatArray:
        friction = self["pad_friction"] if self._source.padded else 1.0
        return np.asarray(friction * self._states["brake_torque"])

    def _creepage(self) -> FloatArray:
        return 0.5 * (self["creepage_left"] + self["creepage_right"])

    def _creep_force(self) -> FloatArray:
        return self["creep_force_left"] + self["creep_force_right"]

    def _falling_branch(self) -> FloatArray:
        sides = self._outputs["falling_left"], self._outputs["falling_right"]
        return np.asarray(np.maximum(*sides))

    def _available_force(self) -> FloatArray:
        names = "speed", "friction_scale_left", "friction_scale_right", "slope_scale", "axle_load"
        available: Any = self._source.available
        return np.asarray(available(*(self[name] for name in names)))

    def _axle_load(self) -> FloatArray:
        return np.asarray(self._inputs["load_left"] + self._inputs["load_right"])

    def _energy_defect(self) -> FloatArray:
        if not self._stored:
            self._stored.append(self["stored_energy"][0].copy())
        return energy_defect(self, self._stored[0])


class Values(Protocol):
    """Signals by name."""

    def __getitem__(self, name: str, /) -> FloatArray:
        """Return one signal."""


def energy_defect(signals: Values, stored_at_start: FloatArray) -> FloatArray:
    """Error of the energy balance: drive work - change of stored energy - other works [J]."""
    drive, *others = (signals[name] for name in WORKS)
    return np.asarray(drive - (signals["stored_energy"] - stored_at_start) - sum(others))


COMPUTED: Mapping[str, Callable[[Block], FloatArray]] = {
    name.removeprefix("_"): method
    for name, method in vars(Block).items()
    if name.removeprefix("_") in {*SIGNALS, *OF_BRAKES, *OF_SAND, *OF_TRACKS}
}
