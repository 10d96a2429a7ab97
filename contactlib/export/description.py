"""Description of an FMU's variables and dependencies, independent of the version of FMI.

The kernel's list of variables gives names, units, limits and value references, and the model gives
start values. This module adds causalities, nominal values and dependencies: FMI's default (all
inputs), except where it would create a false algebraic loop.
"""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

from contactlib import kernel
from contactlib.element.creep_forces import CreepForces
from contactlib.element.force_element import ForceElement, RangeWarning
from contactlib.element.lateral_spin import spinning_aspect
from contactlib.export.units import Type, type_of
from contactlib.files.model import Missing, Model

MODEL_NAMES = {
    "force_element": "CreepForceElement",
    "wheelset": "Wheelset",
    "wheelset_body": "WheelsetBody",
    "creep_forces": "CreepForces",
    "vehicle": "Vehicle",
}
MEMORY = ("memory", "body_modulus", "poisson_ratio", "transverse_half_length")
# Without inertia: two wheels on a light wheelset, inertia/radius^2 = 500 kg [1/kg].
ASSUMED_INVERSE_MASS = 4e-3
MAX_VARIABLES = 128  # of a wheel, as in fmu/fmi/component.h
UNLIMITED = 1e300  # the kernel's limit for numbers without one

# Causality and variability for each role in the kernel's list.
ROLES = {
    "independent": ("independent", "continuous"),
    "fixed_parameter": ("parameter", "fixed"),
    "tunable_parameter": ("parameter", "tunable"),
    "input": ("input", "continuous"),
    "output": ("output", "continuous"),
    "state": ("output", "continuous"),
    "derivative": ("local", "continuous"),
    "indicator": ("local", "continuous"),
}

# Inputs of the outputs that need no force; and inputs, and a state, that no output of a contact
# depends on, because they act on the body.
KINEMATIC = {
    "creepage": ("omega", "speed"),
    "speed_regularized": ("speed",),
    "length_limited": ("normal_load",),
    "unloaded": ("normal_load",),
}
BODY_INPUTS = {
    *("drive_torque", "brake_torque", "brake_pressure", "resistance_force", "pads"),
    *("motor_torque", "acting_motor_torque", "acting_brake_torque"),
    *("grade", "front_coupler_force", "rear_coupler_force"),
}
SUMS = ("acceleration", "der(speed", "der(axle_load")  # to which all axles of a vehicle contribute
# A contact with memory holds its force, up to friction, so no algebraic loop leads through it.
HELD = ("creep_force", "wheel_torque", "traction_coefficient", "lateral_force")


def held_forces() -> list[str]:
    """States of a contact with memory that are forces."""
    states = (v for v in kernel.model_variables("force_element") if v.role == "state")
    return [v.name for v in states if v.unit == "N"]


@dataclass(frozen=True, kw_only=True)
class Variable:
    """A variable in the modelDescription.xml.

    Attributes
    ----------
    name, description, role : str
        As in the kernel's list.
    reference : int
        Value reference.
    causality, variability : str
        As named by FMI.
    boolean : bool
        Whether the variable is Boolean.
    type : Type or None
        Physical type; None for a Boolean.
    minimum, maximum : float or None
        Limits; None without any.
    start : float, bool or None
        Start value of each element, or of the first one; None if it is calculated.
    starts : tuple of float
        Start values of the elements, if they differ.
    nominal : float or None
        Typical size, if known.
    size : int
        Number of elements of an array; 0 for a scalar.
    wheel : int or None
        Index of the wheel of a scalar that other wheels have too.
    """

    name: str
    reference: int
    description: str
    role: str
    causality: str
    variability: str
    boolean: bool
    type: Type | None
    minimum: float | None
    maximum: float | None
    start: float | bool | None
    nominal: float | None
    starts: tuple[float, ...] = ()
    size: int = 0
    wheel: int | None = None

    @property
    def unit(self) -> str:
        """SI unit; "Boolean" for a Boolean."""
        return "Boolean" if self.type is None else self.type.unit

    @property
    def initial(self) -> str | None:
        """FMI's attribute ``initial``: how the start value is determined."""
        if self.causality in ("input", "independent"):
            return None
        if self.stem == "axle_load":  # it settles
            return "approx"
        return "calculated" if self.start is None else "exact"

    @property
    def stem(self) -> str:
        """Name without the number of a wheel."""
        return self.name.split("[")[0]

    def elements(self) -> list[Variable]:
        """Scalar variables of the elements of an array, named as in ``omega[1]``."""
        if not self.size:
            return [self]
        stem, end = (self.name[:-1], ")") if self.role == "derivative" else (self.name, "")
        return [
            replace(
                self,
                name=f"{stem}[{i + 1}]{end}",
                reference=self.reference + i * MAX_VARIABLES,
                start=self.starts[i] if self.starts else self.start,
                size=0,
                wheel=i,
            )
            for i in range(self.size)
        ]


@dataclass(frozen=True, kw_only=True)
class Unknown:
    """An output, derivative or indicator, and the names of the variables it depends on."""

    variable: Variable
    dependencies: list[str]


@dataclass(frozen=True)
class Description:
    """One kind of FMU of one model.

    Parameters
    ----------
    model : Model
        Gives table and start values.
    kind : str
        One of `contactlib.kernel.MODEL_KINDS`.
    implicit, parallel_exchange : bool, optional
        Start values of the force element's parameters of the same names.
    booleans : bool, optional
        Whether truth values are Booleans; else real numbers, 0 or 1.
    whole_wheelset : bool, optional
        Whether the force element is all wheels of the wheelset. Default: one wheel.
    wheels : int, optional
        Number of wheels, or of wheelsets, that are side by side.
    per_wheel : sequence of str, optional
        Parameters that each wheel has for itself. Default: they have all in common.
    arrays : bool, optional
        Whether variables of each wheel are arrays; else there is a variable for each element.
    starts : mapping of str to float, optional
        Start values by name, in place of the model's; names that are not of this kind are ignored.
        One axle's has its number, as in ``position[2]``.
    rails : bytes, optional
        File of a vehicle's rails.
    run : sequence of float, optional
        Duration of a vehicle's run, and sample times of its controllers, which are outside [s].
    author, version : str or None, optional
        Of the exported model. Default: not stated.
    """

    model: Model
    kind: str
    implicit: bool = False
    parallel_exchange: bool = False
    booleans: bool = True
    whole_wheelset: bool = False
    wheels: int = 1
    per_wheel: Sequence[str] = ()
    arrays: bool = True
    starts: Mapping[str, float] = field(default_factory=dict)
    rails: bytes = b""
    run: Sequence[float] = ()
    author: str | None = None
    version: str | None = None

    @property
    def model_name(self) -> str:
        """Name of the model, and of its binary."""
        return MODEL_NAMES[self.kind]

    @cached_property
    def token(self) -> str:
        """Token that ties the description to the binary, the kind of model and its resources.

        Tools treat FMUs with equal tokens as equal, so the token depends on everything that a
        model can change.
        """
        digest = hashlib.sha256()
        for data in self.resources.values():
            digest.update(data)
        given = (self.text, self.start_values, self.booleans, self.author, self.version)
        digest.update(repr((*given, self.wheels, *self.per_wheel, *self.run)).encode())
        return f"{kernel.token()}-{self.kind}-{digest.hexdigest()[:16]}"

    @cached_property
    def element(self) -> ForceElement:
        """Contact of one wheel; of all wheels of the wheelset together if they move as one.

        Its table has layers only if the contact has one.
        """
        element = self.model.wheelset.element
        together = self.kind.startswith(("wheelset", "vehicle")) or self.whole_wheelset
        wheels = element.wheels if together else 1.0
        table = element.table if element.layer_compliance > 0.0 else element.table.without_layers()
        with warnings.catch_warnings():  # given when the model was made
            warnings.simplefilter("ignore", RangeWarning)
            return replace(element, wheels=wheels, table=table)

    @property
    def carriers(self) -> str:
        """The wheels that share the load and give the force, in words."""
        wheels = self.element.wheels
        group = "one wheel" if wheels == 1.0 else f"{wheels:g} wheels together"
        return group if self.wheels == 1 else f"each of {self.wheels}: {group}"

    @property
    def has_contact(self) -> bool:
        """Whether the FMU contains one contact with its table."""
        return self.kind in ("force_element", "wheelset", "vehicle")

    @cached_property
    def bodies(self) -> CreepForces | None:
        """The pair of bodies of an FMU for any ellipse."""
        return CreepForces.of(self.element) if self.kind == "creep_forces" else None

    @cached_property
    def resources(self) -> dict[str, bytes]:
        """Files of the FMU's resources that the kernel reads beside start values."""
        table = {"creep_table.bin": self.element.table.data}
        if self.bodies is not None:
            return {**table, "creep_forces.bin": self.bodies.data}
        if not self.has_contact:
            return {}
        rails = {"rails.bin": self.rails} if self.rails else {}
        return {**table, "lateral_spin_contact.bin": self.element.lateral_spin_data, **rails}

    @cached_property
    def native_contact(self) -> kernel.NativeContact:
        """The kernel's view of these files."""
        if self.bodies is not None:
            table = self.element.table.native
            return kernel.NativeContact(table, self.bodies.data, any_ellipse=True)
        contact = self.element.native_contact
        return kernel.NativeRails(contact, self.rails) if self.rails else contact

    @property
    def remembers(self) -> bool:
        """Whether the contact has states."""
        return self.has_contact and self.element.memory

    @property
    def spins(self) -> bool:
        """Whether the contact has spin as an input."""
        return self.has_contact and spinning_aspect(self.element.contact) is not None

    @property
    def text(self) -> str:
        """The FMU's contents in one line."""
        table = self.element.table
        what = {
            "force_element": f"Creep force of {self.carriers} ({table.law})",
            "wheelset": f"Wheelset with creep force ({table.law})",
            "wheelset_body": "Wheelset without its creep force, which is an input",
            "creep_forces": f"Creep forces and spin moment of any ellipse ({table.law})",
            "vehicle": f"Vehicle of {self.wheels} axle{'s' * (self.wheels > 1)} ({table.law})",
        }
        several = f"{self.wheels} times: " if self.wheels > 1 and not self.rails else ""
        return f"{several}{what[self.kind]}: {self.model.name}"

    @property
    def effective_inverse_mass(self) -> float:
        """Slip acceleration per force of the element: all wheels of the wheelset push alike."""
        wheelset, wheels = self.model.wheelset, self.model.wheelset.element.wheels
        if isinstance(wheelset, Missing):
            return ASSUMED_INVERSE_MASS
        return wheels / self.element.wheels * wheelset.effective_inverse_mass

    @cached_property
    def start_values(self) -> dict[str, float]:
        """Start value of every variable that is not calculated, by name, in SI units."""
        wheelset, speed = self.model.wheelset, self.model.initial_speed
        element = self.element
        known = {
            **dict.fromkeys(MEMORY, 0.0),
            **element.rolling_parameters,
            **(wheelset.parameters if self.kind.startswith(("wheelset", "vehicle")) else {}),
            **(self.bodies.parameters if self.bodies is not None else {}),
            "semi_axis_x": element.contact.semi_width,
            "semi_axis_y": getattr(element.contact, "semi_axis_y", 0.0),
            "creepage_x": 0.0,
            "creepage_y": 0.0,
            "spin": 0.0,
            **dict.fromkeys(held_forces(), 0.0),
            "unslipped": 1.0,
            "effective_inverse_mass": self.effective_inverse_mass,
            "implicit": float(self.implicit),
            "parallel_exchange": float(self.parallel_exchange),
            "max_substeps": 0.0,
            "omega": speed / element.radius,
            "speed": speed,
            "normal_load": element.axle_load,
            "friction_scale": 1.0,
            "lateral_velocity": 0.0,
            "spin_velocity": 0.0,
            "drive_torque": 0.0,
            "brake_torque": 0.0,
            "pads": 1.0,
            "resistance_force": 0.0,
            "creep_force": 0.0,
            **self.starts,
        }
        given = [v.name for v in kernel.model_variables(self.kind) if v.role in kernel.GIVEN]
        of_axles = [name for name in self.starts if name.partition("[")[0] in given]
        return {name: known[name] for name in dict.fromkeys((*given, *of_axles))}

    def starts_of(self, name: str) -> list[float]:
        """Start value of a variable for each wheel."""
        values, numbers = self.start_values, range(1, self.wheels + 1)
        return [values.get(f"{name}[{i}]", values[name]) for i in numbers]

    @cached_property
    def variables(self) -> tuple[Variable, ...]:
        """All variables of the FMU, in the order of their value references."""
        entries, friction = enumerate(kernel.model_variables(self.kind)), self.element.friction
        thermal, decays = friction.softens_with_heat, friction.slip_rate_decay > 0.0
        braked = self.starts.get("brake_fill_time", 0.0) > 0.0
        by_pressure = self.starts.get("torque_per_pressure", 0.0) > 0.0
        parts = {
            "always": True,
            "once": True,
            "if_lagging": self.starts.get("motor_lag", 0.0) > 0.0,
            "if_braked": braked,
            "if_brake_torque": braked and not by_pressure,
            "if_brake_pressure": braked and by_pressure,
            "if_remembering": self.remembers,
            "if_spinning": self.spins,
            "if_layered": self.kind != "wheelset_body" and self.element.layer_compliance > 0.0,
            "if_falling": self.bodies is not None and decays,
            "if_thermal": self.kind != "wheelset_body" and thermal,
            "if_slip_counts": self.bodies is not None and (thermal or decays),
        }
        chosen = [self._variable(i, v) for i, v in entries if parts[v.part]]
        return tuple(chosen if self.arrays else (e for v in chosen for e in v.elements()))

    def is_common(self, entry: kernel.Variable) -> bool:
        """Whether all wheels have a variable in common."""
        parameter = entry.role.endswith("parameter") and entry.name not in self.per_wheel
        return self.wheels == 1 or entry.part == "once" or parameter

    def _variable(self, reference: int, entry: kernel.Variable) -> Variable:
        causality, variability = ROLES[entry.role]
        start: float | bool | None = self.start_values.get(entry.name)
        boolean = entry.boolean and self.booleans
        if boolean:
            start = None if start is None else bool(start)
            variability = "discrete" if causality == "output" else variability
        low, high = entry.limits.at_least, entry.limits.at_most
        differ = f"{entry.name}[2]" in self.start_values
        return Variable(
            name=entry.name,
            reference=reference,
            description=self._described(entry),
            role=entry.role,
            causality=causality,
            variability=variability,
            boolean=boolean,
            type=None if boolean else type_of(entry.name, "1" if entry.boolean else entry.unit),
            minimum=None if boolean or low <= -UNLIMITED else low,
            maximum=None if boolean or high >= UNLIMITED else high,
            start=start,
            nominal=self._nominals.get(entry.name),
            starts=tuple(self.starts_of(entry.name)) if differ else (),
            size=0 if self.is_common(entry) else self.wheels,
        )

    def _described(self, entry: kernel.Variable) -> str:
        """The kernel's description; that of load and force names the wheels that share them."""
        if entry.name in ("normal_load", "creep_force", "nominal_load"):
            return f"{entry.description}; of {self.carriers}"
        return entry.description

    @cached_property
    def _nominals(self) -> dict[str, float]:
        element = self.element
        friction, load = element.friction, element.axle_load
        force, zeta0 = friction.kinetic * load, element.saturation_creepage
        speed = max(self.model.initial_speed, 1.0)
        omega = max(self.model.initial_speed / element.radius, 1.0)
        sides = [f"{name}_{side}" for name in held_forces()[:2] for side in ("left", "right")]
        torques = ("motor_torque", "acting_motor_torque", "acting_brake_torque")
        return {
            "omega": omega,  # the states' as in fmu/fmi/component.c
            "speed": speed,
            **dict.fromkeys(held_forces(), force),
            "unslipped": 1.0,
            "normal_load": load,
            "creep_force": force,
            "lateral_force": force,
            "spin_moment": force * element.contact.semi_width,
            "lateral_velocity": zeta0 * speed,
            "spin_velocity": zeta0 * speed / element.contact.semi_width,
            "force_x": force,
            "force_y": force,
            "utilisation": 1.0,
            "creepage_x": zeta0,
            "creepage_y": zeta0,
            "spin": zeta0 / element.contact.semi_width,
            "semi_axis_x": element.contact.semi_width,
            "semi_axis_y": element.contact.semi_width,
            "wheel_torque": element.radius * force,
            "drive_torque": element.radius * force,
            "brake_torque": element.radius * force,
            "brake_pressure": 1e5,
            "pads": 1.0,
            **dict.fromkeys(sides, force),
            **dict.fromkeys(("unslipped_left", "unslipped_right"), 1.0),
            **dict.fromkeys(torques, element.radius * force),
            "available_force": force,
            "axle_load": self.start_values.get("axle_load", load),
            "friction": 1.0,
            "distance": 1.0,
            "creepage": zeta0,
            "normalized_creepage": 1.0,
            "saturation_creepage": zeta0,
            "traction_coefficient": friction.kinetic,
            "force_gradient": force / (zeta0 * speed),
            "k_hat": element.k_hat or 1.0,
            "process_zone_ratio": 1.0,
            "contact_temperature": 100.0,
            "step_size_hint": 1e-3,
        }

    def of_role(self, *roles: str) -> list[Variable]:
        """Variables with one of these roles."""
        return [v for v in self.variables if v.role in roles]

    @cached_property
    def by_name(self) -> dict[str, Variable]:
        """Variables by name."""
        return {v.name: v for v in self.variables}

    def unknowns(self, variables: Iterable[Variable], *, initial: bool = False) -> list[Unknown]:
        """Unknowns for these variables; `initial` is whether parameters can still change."""
        parameters = ("fixed_parameter", "tunable_parameter") if initial else ()
        known = self.of_role(*parameters, "input", "state")
        known = [v for v in known if not (initial and v.initial == "approx")]
        return [Unknown(variable=v, dependencies=self._dependencies(v, known)) for v in variables]

    def _dependencies(self, variable: Variable, known: list[Variable]) -> list[str]:
        """Parameters, and the inputs and states from which a variable may be computed."""
        everywhere = variable.stem.startswith(SUMS)
        known = [v for v in known if everywhere or v.wheel in (None, variable.wheel)]
        needed = {v.stem for v in known}
        if variable.role == "state" and variable in known:
            needed = {variable.stem}
        elif variable.role == "output":
            on = (*held_forces(), "normal_load", "friction_scale")
            fewer = KINEMATIC | (dict.fromkeys(HELD, on) if self.remembers else {})
            if self.rails:
                acting = "acting_motor_torque"
                motor = acting if acting in needed else "motor_torque"
                torques = ("omega", "pads", "acting_brake_torque", "brake_pressure", motor)
                fewer = {"acceleration": tuple(needed), "drive_torque": torques}
            needed = set(fewer.get(variable.stem, needed - BODY_INPUTS))
        return [v.name for v in known if v.stem in needed or v.causality == "parameter"]
