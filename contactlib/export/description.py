"""What an FMU is to a tool, before it is put into the words of FMI 2 or FMI 3.

The kernel's list of variables gives names, units, limits and value references; the model gives
start values; here are roles, dependencies and nominal values.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property

from contactlib import kernel
from contactlib.export.units import Type, type_of
from contactlib.scenario import Model

MODEL_NAMES = {
    "force_element": "CreepForceElement",
    "wheelset": "Wheelset",
    "wheelset_body": "WheelsetBody",
}
UNLIMITED = 1e300  # the kernel's way to say that a number has no limit

# Causality and variability by the kernel's role.
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


@dataclass(frozen=True, kw_only=True)
class Variable:
    """A variable as a tool sees it.

    Attributes
    ----------
    name, description, role : str
        As in the kernel's list.
    reference : int
        Value reference.
    causality, variability : str
        In the words of FMI.
    boolean : bool
        Whether it is a truth value.
    type : Type or None
        Physical type; None for truth values.
    minimum, maximum : float or None
        Limits, None if there is none.
    start : float, bool or None
        None if it is calculated.
    nominal : float or None
        Typical size, if one can be told.
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

    @property
    def unit(self) -> str:
        """SI unit; "Boolean" for a truth value."""
        return "Boolean" if self.type is None else self.type.unit

    @property
    def initial(self) -> str | None:
        """How its value at the start comes about, in the words of FMI."""
        if self.causality in ("input", "independent"):
            return None
        return "calculated" if self.start is None else "exact"


@dataclass(frozen=True, kw_only=True)
class Unknown:
    """An output, derivative or indicator, and what it depends on, by variable and kind."""

    variable: Variable
    dependencies: dict[str, str]


@dataclass(frozen=True)
class Description:
    """One kind of FMU of one model.

    Parameters
    ----------
    model : Model
        Gives table and start values.
    kind : str
        One of `contactlib.kernel.MODEL_KINDS`.
    relaxation_length : float, optional
        Of the contact [m]; 0 if its force follows the creepage at once.
    implicit, parallel_exchange : bool, optional
        Start values of the force element's parameters of the same names.
    starts : mapping of str to float, optional
        Start values by name, in place of the model's; names that are not of this kind are ignored.
    """

    model: Model
    kind: str
    relaxation_length: float = 0.0
    implicit: bool = False
    parallel_exchange: bool = False
    starts: Mapping[str, float] = field(default_factory=dict)

    @property
    def model_name(self) -> str:
        """Name of the model, and of its binary."""
        return MODEL_NAMES[self.kind]

    @cached_property
    def token(self) -> str:
        """What ties the description to the binary, its kind of model and its resources.

        Tools take FMUs of the same token for the same, so it differs with everything that a model
        can change.
        """
        digest = hashlib.sha256()
        if self.has_contact:
            digest.update(self.model.wheelset.element.table.data)
        digest.update(repr((self.text, self.start_values)).encode())
        return f"{kernel.token()}-{self.kind}-{digest.hexdigest()[:16]}"

    @property
    def has_contact(self) -> bool:
        """Whether there is a table in it."""
        return self.kind != "wheelset_body"

    @property
    def relaxed(self) -> bool:
        """Whether the contact has a state."""
        return self.has_contact and self.relaxation_length > 0.0

    @property
    def text(self) -> str:
        """One line that says what it is."""
        table = self.model.wheelset.element.table
        what = {
            "force_element": f"Creep force of a wheel ({table.law})",
            "wheelset": f"Wheelset with creep force ({table.law})",
            "wheelset_body": "Wheelset without its creep force, which comes from outside",
        }
        return f"{what[self.kind]}: {self.model.name}"

    @cached_property
    def start_values(self) -> dict[str, float]:
        """Start value of every variable that is not calculated, by name, in SI units."""
        wheelset, speed = self.model.wheelset, self.model.initial_speed
        element = wheelset.element
        known = {
            **element.parameters,
            **wheelset.parameters,
            "relaxation_length": self.relaxation_length,
            "relaxed_creepage": 0.0,
            "effective_inverse_mass": wheelset.effective_inverse_mass,
            "implicit": float(self.implicit),
            "parallel_exchange": float(self.parallel_exchange),
            "omega": speed / element.radius,
            "speed": speed,
            "normal_load": element.contact.normal_load,
            "friction_scale": 1.0,
            "drive_torque": 0.0,
            "resistance_force": 0.0,
            "creep_force": 0.0,
            **self.starts,
        }
        given = [v.name for v in kernel.model_variables(self.kind) if v.role in kernel.GIVEN]
        return {name: known[name] for name in given}

    @cached_property
    def variables(self) -> tuple[Variable, ...]:
        """All variables of the FMU, by rising value reference."""
        entries = enumerate(kernel.model_variables(self.kind))
        return tuple(self._variable(i, v) for i, v in entries if self.relaxed or not v.only_relaxed)

    def _variable(self, reference: int, entry: kernel.Variable) -> Variable:
        causality, variability = ROLES[entry.role]
        start: float | bool | None = self.start_values.get(entry.name)
        if entry.boolean:
            start = None if start is None else bool(start)
            variability = "discrete" if causality == "output" else variability
        low, high = entry.limits.at_least, entry.limits.at_most
        return Variable(
            name=entry.name,
            reference=reference,
            description=entry.description,
            role=entry.role,
            causality=causality,
            variability=variability,
            boolean=entry.boolean,
            type=None if entry.boolean else type_of(entry.name, entry.unit),
            minimum=None if entry.boolean or low <= -UNLIMITED else low,
            maximum=None if entry.boolean or high >= UNLIMITED else high,
            start=start,
            nominal=self._nominals.get(entry.name),
        )

    @cached_property
    def _nominals(self) -> dict[str, float]:
        element = self.model.wheelset.element
        friction, load = element.friction, element.contact.normal_load
        force, zeta0 = friction.kinetic * load, element.saturation_creepage
        speed = max(self.model.initial_speed, 1.0)
        omega = max(self.model.initial_speed / element.radius, 1.0)
        return {
            "omega": omega,  # as fmu/component.c gives them for the states
            "speed": speed,
            "relaxed_creepage": 1e-2,
            "normal_load": load,
            "creep_force": force,
            "wheel_torque": element.radius * force,
            "drive_torque": element.radius * force,
            "creepage": zeta0,
            "traction_coefficient": friction.kinetic,
            "force_gradient": force / (zeta0 * speed),
        }

    def of_role(self, *roles: str) -> list[Variable]:
        """Variables of some roles."""
        return [v for v in self.variables if v.role in roles]

    @cached_property
    def by_name(self) -> dict[str, Variable]:
        """Variables by name."""
        return {v.name: v for v in self.variables}

    # ---- dependencies ----------------------------------------------------------------------

    def unknown(self, name: str, *, initial: bool = False) -> Unknown:
        """An unknown with all it depends on; parameters count if `initial`."""
        present = self.by_name
        names = [n for n in self._dependencies(name) if n in present]
        if not initial:
            names = [n for n in names if present[n].causality != "parameter"]
        kinds = dict(self._kinds.get(name, {}))
        if initial:  # when parameters are still set, nothing that they scale is fixed
            kinds = {n: kind for n, kind in kinds.items() if kind == "constant"}
        return Unknown(
            variable=present[name], dependencies={n: kinds.get(n, "dependent") for n in names}
        )

    @cached_property
    def _kinds(self) -> dict[str, dict[str, str]]:
        """Kinds of dependency other than "dependent"."""
        states = [v.name for v in self.of_role("state")]
        return {
            **{name: {name: "constant"} for name in states},
            # Over the inertia or the mass, which are fixed; less the damping, which is not.
            "der(omega)": {"drive_torque": "fixed", "creep_force": "fixed", "omega": "tunable"}
            if self.kind == "wheelset_body"
            else {"drive_torque": "fixed"},
            "der(speed)": {"resistance_force": "fixed", "creep_force": "fixed"},
        }

    def _dependencies(self, name: str) -> list[str]:
        """What a variable depends on, in the order of the list of variables."""
        found = self._depends[name]
        return [v.name for v in self.variables if v.name in found]

    @cached_property
    def _depends(self) -> dict[str, set[str]]:
        one_axis = self.has_contact and self.model.wheelset.element.table.one_axis
        velocity = {"omega", "speed", "radius"}
        reference = {"speed", "minimum_speed"}
        # Friction falls with the slip velocity, and with it all that scales with friction.
        factor = {*velocity, "slip_rate_residual", "slip_rate_decay", "friction_scale"}
        load = {"normal_load", "nominal_load", "load_exponent"}
        kinetic = {*factor, "kinetic_friction"}
        zeta0 = {*kinetic, *load, "peak_pressure", "contact_modulus", "slope_reduction"}
        drop = {*kinetic, "static_friction", "weakening_length"}
        k_hat = {*drop, *load, "semi_width", "peak_pressure", "contact_modulus"}
        acting = {"relaxed_creepage"} if self.relaxed else {*velocity, *reference}
        x = {*acting, *zeta0}
        free_ratio = x if one_axis else {*x, *k_hat}
        ratio = {*free_ratio, "static_friction"}  # which the force never exceeds
        force = {*ratio, *kinetic, "normal_load"}
        gradient = {*force, *reference}
        indicators = {
            "falling": {*ratio, *reference},
            "speed": set() if self.relaxed else reference,
            "k_hat": set() if one_axis else k_hat,
            "force": ratio,
        }
        flags = ("falling_branch", "speed_regularized", "k_hat_limited", "force_limited")
        rates: dict[str, set[str]] = {"relaxed_creepage": {*velocity, *zeta0, *acting}}
        rates["relaxed_creepage"] |= {"relaxation_length"}
        pull = force if self.has_contact else {"creep_force"}
        body = {*pull, "radius", "inertia", "damping", "omega", "drive_torque"}
        moved = {*pull, *reference, "inverse_mass", "resistance_force", "grade_acceleration"}
        moved |= {f"{part}_resistance" for part in ("constant", "linear", "quadratic")}
        rates |= {"omega": body, "speed": moved}
        hint = {*gradient, "effective_inverse_mass", "implicit", "parallel_exchange"}
        return {
            **{state: {state} for state in rates},
            **{f"der({state})": depends for state, depends in rates.items()},
            **{f"{name}_indicator": depends for name, depends in indicators.items()},
            **dict(zip(flags, indicators.values(), strict=True)),
            "creep_force": force,
            "wheel_torque": {*force, "radius"},
            "creepage": {*velocity, *reference},
            "normalized_creepage": x,
            "traction_coefficient": {*ratio, *kinetic},
            "force_gradient": gradient,
            "k_hat": k_hat,
            "saturation_creepage": zeta0,
            "process_zone_ratio": k_hat,
            "step_size_hint": {*hint, "relaxation_length"},
        }

    def unknowns(self, variables: Iterable[Variable], *, initial: bool = False) -> list[Unknown]:
        """Unknowns of some variables."""
        return [self.unknown(v.name, initial=initial) for v in variables]
