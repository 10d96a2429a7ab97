"""One force element and one wheelset."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contactlib.base.quantities import FloatArray, Limits
from contactlib.kernel.library import ffi, library, pointer, struct_dtype
from contactlib.kernel.models import model_variables
from contactlib.kernel.tables import NativeContact, NativeTable


def process_zone_limit() -> float:
    """Largest process zone ratio for which the limit of a vanishing weakening zone is good [1]."""
    return float(library().process_zone_limit())


# An FMU accepts all values that a tool's solver may try, such as the load of a wheel that lifts
# off. In Python a load below zero, or zero friction, is a mistake.
MINIMA = {"normal_load": 0.0, "friction_scale": 1e-6}
# The load of all wheels of an element or wheelset: its name in Python, and in the kernel and FMUs.
LOAD_IN_KERNEL = {"axle_load": "normal_load"}


def _limits(kind: str, *roles: str, minima: Mapping[str, float] = MINIMA) -> dict[str, Limits]:
    limits = {
        v.name: replace(v.limits, at_least=minima.get(v.name, v.limits.at_least))
        for v in model_variables(kind)
        if v.role in roles
    }
    if kind != "creep_forces":  # whose load is that of one contact in Python, too
        limits["axle_load"] = limits.pop(LOAD_IN_KERNEL["axle_load"])
    return limits


@cache
def force_input_limits() -> Mapping[str, Limits]:
    """Limits of the force element's inputs in Python, by name."""
    return _limits("force_element", "input")


@cache
def creep_forces_limits() -> Mapping[str, Limits]:
    """Limits of the inputs of `CreepForces`, which a vehicle tool's solver may call, by name."""
    return _limits("creep_forces", "input", minima={"normal_load": 0.0})


@cache
def wheelset_limits() -> Mapping[str, Limits]:
    """Limits of the wheelset's inputs and states in Python, by name."""
    return _limits("wheelset", "input", "state")


def _evaluated(kind: str, function: Any, given: Sequence[Any], inputs: Any) -> NDArray[np.void]:
    """Output records of a kind of contact for input records of any shape."""
    inputs = np.asarray(inputs, struct_dtype(f"{kind}_input"), order="C")
    outputs = np.empty(inputs.shape, struct_dtype(f"{kind}_output"))
    records = pointer(inputs, f"{kind}_input"), pointer(outputs, f"{kind}_output")
    function(*given, inputs.size, *records)
    return outputs


def contact_scales(
    parameters: Mapping[str, float],
    normal_load: float,
    friction_scale: float = 1.0,
    table: NativeTable | None = None,
) -> Any:
    """Struct `contact_scales` at a load above zero; those of the memory need the table."""
    lib, scales = library(), ffi.new("contact_scales *")
    given = ffi.new("force_element_parameters *", dict(parameters))
    struct = ffi.NULL if table is None else table.struct
    lib.force_element_scales(struct, given, normal_load, friction_scale, scales)
    return scales


def thermal_softening(
    x: FloatArray, heat_number: FloatArray, k_hat: FloatArray, *, elliptic: bool
) -> FloatArray:
    """Factor on friction by thermal softening; arguments broadcast, named as in `heat.h`."""
    given = [np.array(a, order="C") for a in np.broadcast_arrays(x, heat_number, k_hat)]
    found = np.empty(given[0].shape)
    arrays = [pointer(a, "double") for a in (*given, found)]
    library().thermal_softening_many(elliptic, found.size, *arrays)
    return found


STEADY = ("steady_force", "sticking", "steady_outer")  # outputs: those states in steady rolling


def memory_states() -> tuple[str, ...]:
    """States of a contact with memory along rolling."""
    return struct_dtype("rolling_memory").names or ()


class NativeForceElement:
    """Parameters and table of a force element. Checks nothing.

    Attributes
    ----------
    force : callable
        Creep force of omega, speed, load and friction scale, all numbers; nan if one is out of its
        limits. Nothing is faster.
    nominal_load : float
        Of all its wheels together [N].
    """

    def __init__(self, table: NativeTable | NativeContact, parameters: Mapping[str, float]) -> None:
        lib = library()
        self._table = table  # keeps what the structs below point to
        self._parameters = ffi.new("force_element_parameters *", dict(parameters))
        names = ("omega", "speed", "axle_load", "friction_scale")
        limits = [force_input_limits()[name] for name in names]
        ends = [[limit.at_least for limit in limits], [limit.at_most for limit in limits]]
        self.structs = table.struct, self._parameters
        self.force = partial(
            lib.force_element_force, *self.structs, ffi.new("force_ranges *", ends)
        )
        self.nominal_load = parameters["nominal_load"]

    def evaluate(self, inputs: NDArray[np.void]) -> NDArray[np.void]:
        """Output records for input records of any shape."""
        function = library().force_element_evaluate_many
        return _evaluated("force_element", function, self.structs, inputs)

    def forces(self, *inputs: FloatArray) -> FloatArray:
        """Creep forces at omega, speed, load and friction scale, which broadcast.

        There are neither lateral slip nor spin, and the element has no memory.
        """
        force = np.empty(np.broadcast_shapes(*(one.shape for one in inputs)))
        rows = [
            np.ascontiguousarray(one if one.size == 1 else np.broadcast_to(one, force.shape))
            for one in inputs
        ]
        strides = [int(row.size > 1) for row in rows]
        given = ffi.new("double *[4]", [pointer(row, "double") for row in rows])
        library().force_element_forces(
            *self.structs, force.size, given, strides, pointer(force, "double")
        )
        return force

    def evaluate_one(self, *inputs: float) -> Any:
        """Output struct at one point: the fast way for an integrator.

        The inputs are omega, speed, load, friction scale and, with memory, the held force, the
        unslipped part and the force of the outer zone.
        """
        given = ffi.new("force_element_input *", [*inputs[:4], inputs[4:]])
        result = ffi.new("force_element_output *")
        library().force_element_evaluate(self._table.struct, self._parameters, given, result)
        return result

    def steady_memory(self, *rolling: float) -> dict[str, float]:
        """States of the memory, by name, of a contact that rolls steadily.

        `rolling` are omega, speed, load and friction scale.
        """
        contact = self.evaluate_one(*rolling)
        return {s: getattr(contact, of) for s, of in zip(memory_states(), STEADY, strict=True)}

    def steepest_gradient(self, speed: float) -> float:
        """Largest gradient of the force by slip velocity at the nominal load [N.s/m]."""
        at = speed / self._parameters.radius, speed, self.nominal_load, 1.0
        given, rolling = ffi.new("force_element_input *", at), self.evaluate_one(*at)
        return float(library().force_element_steepest(*self.structs, given, rolling))

    def roll(
        self,
        creepage: FloatArray,
        distance: FloatArray,
        speed: float,
        tolerance: float,
        normal_load: float | None = None,
        friction_scale: float = 1.0,
    ) -> FloatArray:
        """Creep force of a contact with memory at increasing distances rolled [N].

        Raises
        ------
        ArithmeticError
            If the tolerance is not met.
        """
        force = np.empty(creepage.shape)
        error = library().force_element_roll(
            *self.structs,
            speed,
            self.nominal_load if normal_load is None else normal_load,
            friction_scale,
            creepage.size,
            pointer(creepage, "double"),
            pointer(distance, "double"),
            tolerance,
            pointer(force, "double"),
        )
        if error != ffi.NULL:
            raise ArithmeticError(ffi.string(error).decode())
        return force


class NativeWheelset:
    """Parameters of a wheelset's equations of motion. Checks nothing."""

    def __init__(self, parameters: Mapping[str, float]) -> None:
        library()
        self.struct = ffi.new("wheelset_parameters *", dict(parameters))

    def motion(
        self, omega: float, speed: float, torque: float, resistance: float, contact: Any
    ) -> Any:
        """Rates struct of one state; `contact` is an output struct of the force element."""
        rates = ffi.new("wheelset_rates *")
        library().wheelset_motion(self.struct, omega, speed, torque, resistance, contact, rates)
        return rates


class NativeCurve:
    """Curve of steady creep under given conditions; see fmu/kernel/creep_curve.h. Checks nothing.

    Parameters
    ----------
    contact : NativeForceElement
        The contact of all wheels together.
    body : NativeWheelset, optional
        Default: the curve is that of the creep force.
    **conditions : float
        Members of the struct `creep_conditions`; a pair where the two wheels may differ.
    """

    def __init__(
        self, contact: NativeForceElement, body: NativeWheelset | None, **conditions: Any
    ) -> None:
        library()
        self._given = (
            *contact.structs,
            ffi.NULL if body is None else body.struct,
            ffi.new("creep_conditions *", conditions),
        )
        self._kept = contact, body

    def points(self, creepage: FloatArray) -> NDArray[np.void]:
        """Records `creep_point` at creepages of any shape."""
        creepage = np.asarray(creepage, dtype=np.float64, order="C")
        points = np.empty(creepage.shape, struct_dtype("creep_point"))
        room = pointer(points, "creep_point")
        library().creep_curve_points(*self._given, creepage.size, pointer(creepage, "double"), room)
        return points

    def turns(self, side: float) -> NDArray[np.void]:
        """Records of the turning points of one side, and of the end of the search."""
        return self._found(library().creep_curve_turns, side)

    def steady(self, torque: float, side: float) -> NDArray[np.void]:
        """Records of the points of one side that balance a torque."""
        return self._found(library().creep_curve_steady, torque, side)

    def grip(self, torque: float) -> tuple[float, float]:
        """Creepage on the rising branch that balances a torque, nan beyond the limit; the limit."""
        limit = ffi.new("double *")
        return library().creep_curve_grip(*self._given, torque, limit), limit[0]

    def peak(self) -> tuple[float, float]:
        """Creepage and force of the maximum creep force in traction."""
        table, contact, _, at = self._given
        creepage = ffi.new("double *")
        force = library().creep_curve_peak(table, contact, at, creepage)
        return creepage[0], force

    def fold(self) -> NDArray[np.void]:
        """Records of the fold and of the return to grip; none if the torque never falls."""
        points = np.empty(2, struct_dtype("creep_point"))
        return points[: library().creep_curve_fold(*self._given, pointer(points, "creep_point"))]

    def worst(self) -> Any:
        """Struct of the point with the maximum pole."""
        point = ffi.new("creep_point *")
        library().creep_curve_worst(*self._given, point)
        return point

    def _found(self, search: Any, *given: float) -> NDArray[np.void]:
        room = 64
        while True:
            points = np.empty(room, struct_dtype("creep_point"))
            count = search(*self._given, *given, room, pointer(points, "creep_point"))
            if count < room:
                return points[:count]
            room *= 4


def half_space_scales(a_over_b: float, poisson_ratio: float) -> Any:
    """Struct of Kalker's coefficients and the scales of an ellipse; the kernel checks nothing."""
    lib = library()
    scales = ffi.new("half_space_scales *")
    lib.half_space_scales_of(a_over_b, poisson_ratio, scales)
    return scales


def relaxation_lengths(a_over_b: float, poisson_ratio: float) -> tuple[float, float, float]:
    """Longitudinal, lateral and spin length over a; the kernel checks nothing."""
    lib = library()
    lengths = ffi.new("relaxation_lengths *")
    lib.relaxation_lengths_of(a_over_b, poisson_ratio, lengths)
    return lengths.longitudinal, lengths.lateral, lengths.spin


def contact_memory(
    elliptic: bool,
    a_over_b: float,
    poisson_ratio: float,
    layer_ratio: float = 0.0,
    softer: float = 0.0,
) -> Any:
    """Struct of relaxation lengths over a and stiffness at standstill, see `half_space.h`."""
    lib = library()
    memory = ffi.new("contact_memory *")
    lib.contact_memory_of(elliptic, a_over_b, poisson_ratio, layer_ratio, softer, memory)
    return memory


def hertz_integral(along: float, across: float) -> float:
    """Carlson's R_D(0, across**2, along**2) of an ellipse's semi-axes [1/m^3]."""
    return float(library().hertz_integral(along, across))


def hertz_semi_axes(radius_x: float, radius_y: float, compliance: float) -> tuple[float, float]:
    """Semi-axes of the ellipse of two relative radii [m]; the kernel checks nothing."""
    lib = library()
    found = ffi.new("double[2]")
    lib.hertz_semi_axes(radius_x, radius_y, compliance, found)
    return found[0], found[1]


class NativeCreepForces:
    """A pair of bodies, prepared for any ellipse. Checks nothing."""

    def __init__(
        self, table: NativeTable, coefficients: NDArray[np.float64], parameters: Mapping[str, float]
    ) -> None:
        lib = library()
        self._kept = table, coefficients, ffi.new("creep_forces_parameters *", dict(parameters))
        self.struct = ffi.new("creep_forces *")
        lib.creep_forces_prepare(
            self.struct, table.struct, pointer(coefficients, "double"), self._kept[2]
        )

    def evaluate(self, inputs: NDArray[np.void]) -> NDArray[np.void]:
        """Output records for input records of any shape."""
        return _evaluated("creep_forces", library().creep_forces_evaluate, [self.struct], inputs)
