"""Vehicles in the kernel: the loads of their axles, and the slip work on their rails."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from contactlib.base.quantities import FloatArray
from contactlib.kernel.library import checked_dtype, ffi, library, pointer, struct_dtype
from contactlib.kernel.tables import NativeContact, framed

NODE_DISTANCE = 0.1  # of the nodes of rails that slip cleans [m]
KEPT_BEHIND = 100.0  # length of rail behind a vehicle whose slip work is kept, at least [m]


class NativeVehicle(NamedTuple):
    """Body of a vehicle, None if its loads are given; how slip cleans its rails [m/J, 1]."""

    body: Mapping[str, Any] | None
    cleaning: float
    recovered: float


def vehicle_record(body: Mapping[str, Any]) -> NDArray[np.void]:
    """Parameters of a vehicle as an array of one record."""
    record = np.zeros(1, struct_dtype("vehicle_parameters"))
    for name, value in body.items():
        if name == "position":
            record["position"][0, : len(value)] = value
        elif name in (record.dtype.names or ()):
            record[name] = value
    record["axles"] = len(body["position"])
    return record


def vehicle_loads(
    body: Mapping[str, Any],
    radius: float,
    creep_force: FloatArray,
    acceleration: FloatArray,
    omega_rate: FloatArray,
) -> FloatArray:
    """Loads of axles by statics [N], shape (..., axles), as `vehicle_loads` of the kernel."""
    axles = creep_force.shape[-1]
    forces = np.zeros(acceleration.size, struct_dtype("vehicle_forces"))
    forces["creep_force"][:, :axles] = creep_force.reshape(-1, axles)
    forces["omega_rate"][:, :axles] = omega_rate.reshape(-1, axles)
    forces["acceleration"] = acceleration.ravel()
    forces["radius"] = radius
    room = forces.dtype["creep_force"].shape[0]
    load = np.empty((forces.size, room))
    library().vehicle_loads(
        pointer(vehicle_record(body), "vehicle_parameters"),
        forces.size,
        pointer(forces, "vehicle_forces"),
        ffi.cast(f"double (*)[{room}]", ffi.from_buffer(load)),
    )
    return load[:, :axles].reshape(creep_force.shape)


class NativeRails(NativeContact):
    """A contact on rails, from a file as fmu/kernel/rails.c reads it.

    Raises
    ------
    ValueError
        If the bytes do not describe rails.
    """

    def __init__(self, contact: NativeContact, data: bytes) -> None:
        lib, words = library(), np.frombuffer(data, np.uint64).copy()
        self._contact, self._data = contact, data
        self.struct = ffi.new("creep_table *", contact.struct[0])
        rails = self.struct.rails = ffi.new("vehicle_rails *")
        error = lib.vehicle_rails_open(rails, pointer(words, "uint64_t"), len(data))
        if error != ffi.NULL:
            raise ValueError(ffi.string(error).decode())
        work = ffi.new("double[]", lib.vehicle_rails_numbers(rails) + 1)
        lib.vehicle_rails_begin(rails, work)
        self._kept = words, rails, work

    def own(self) -> NativeContact:
        """The contact on rails that no other instance of a model cleans."""
        return NativeRails(self._contact, self._data)


def rails_file(
    track: Sequence[tuple[Sequence[float], Sequence[float]]],
    *,
    cleaning: float,
    recovered: float,
    length: float,
) -> bytes:
    """Bytes of rails, for a vehicle of a length from its first to its last axle [m]."""
    left, right, *others = track
    nodes = rail_nodes(length) if cleaning > 0.0 and length > 0.0 else 0
    numbers = [cleaning, recovered, NODE_DISTANCE, float(nodes)]
    for at, value in (left, ((), ()) if left == right else right, *others):
        numbers += [float(len(at)), *at, *value]
    return framed(b"CREEPRAI", 1, np.array(numbers, "<f8").tobytes())


def rail_nodes(length: float, node_distance: float = NODE_DISTANCE) -> int:
    """Number of nodes for the slip work on the rails under and behind a vehicle of a length [m]."""
    return 1 << int(np.ceil(np.log2((length + KEPT_BEHIND) / node_distance + 4.0)))


class NativeVehicles:
    """Vehicles of equally many axles, with what they have of the past; copies are independent.

    Parameters
    ----------
    vehicles : sequence of NativeVehicle
        The vehicles.
    axles : int
        Number of axles of each.
    node_distance : float, optional
        Distance of the nodes of the rails' slip work [m].

    Attributes
    ----------
    axles : ndarray
        Records ``axle_state``, shape (vehicles, axles).
    """

    def __init__(
        self,
        vehicles: Sequence[NativeVehicle],
        axles: int,
        node_distance: float = NODE_DISTANCE,
    ) -> None:
        bodies = [vehicle_record(v.body) for v in vehicles if v.body is not None]
        self._given = list(vehicles)
        self._bodies = np.concatenate(bodies) if bodies else None
        self.axles = np.zeros((len(vehicles), axles), struct_dtype("axle_state"))
        self._distance, self._nodes = node_distance, 0
        if axles > 1 and any(vehicle.cleaning > 0.0 for vehicle in vehicles):
            length = max(float(body["position"].max()) for body in bodies)
            self._nodes = rail_nodes(length, node_distance)
        self._ranges = np.zeros(len(vehicles), struct_dtype("rail_range"))
        self._work = np.zeros((len(vehicles), self._nodes, 2))

    def begin(self, load: FloatArray) -> None:
        """Forget the past, under the loads of all axles [N]."""
        self.axles[...] = np.zeros((), self.axles.dtype)
        self.axles["load"] = self.axles["target"] = load.reshape(self.axles.shape)
        self._ranges[...] = (0.0, -1.0, 0.0)

    @property
    def struct(self) -> Any:
        """Array of C structs that share this memory; it must not outlive the vehicles."""
        names = ("body", "axle", "range", "work")
        records = np.zeros(len(self._given), _vehicle_dtype())
        for name in ("cleaning", "recovered"):
            records[name] = [getattr(vehicle, name) for vehicle in self._given]
        records["node_distance"], records["nodes"] = self._distance, self._nodes
        arrays = (self._bodies, self.axles, self._ranges, self._work)
        for name, array in zip(names, arrays, strict=True):
            if array is not None and (self._nodes or name in ("body", "axle")):
                size = array[:1].nbytes
                records[name] = array.ctypes.data + size * np.arange(len(array))
        return pointer(records, "vehicle")

    def settle(self, fleet: Any, inputs: NDArray[np.void], states: NDArray[np.void]) -> None:
        """Let loads and slip work be those of the present forces of a `NativeFleet`."""
        library().vehicles_settle(
            fleet.members,
            fleet.size,
            fleet.axles,
            self.struct,
            pointer(np.ascontiguousarray(inputs), "drivetrain_input"),
            pointer(np.ascontiguousarray(states), "drivetrain_state"),
            pointer(fleet.evaluate(inputs, states), "drivetrain_output"),
        )


def _vehicle_dtype() -> np.dtype[np.void]:
    """Dtype of the struct vehicle, with pointers as numbers."""
    numbers = [(name, np.float64) for name in ("cleaning", "recovered", "node_distance")]
    arrays = [(name, np.uintp) for name in ("axle", "range", "work", "nodes")]
    return checked_dtype([("body", np.uintp), *numbers, *arrays], "vehicle")
