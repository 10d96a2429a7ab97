"""Many drivetrains, stepped together along their tracks."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from itertools import chain
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from contactlib.base.quantities import FloatArray
from contactlib.kernel.library import (
    checked_dtype,
    ffi,
    library,
    pointer,
    struct_dtype,
)
from contactlib.kernel.tables import NativeTable
from contactlib.kernel.vehicles import NativeVehicles

NativeProfile = tuple[Sequence[float], Sequence[float]]  # places and values
PROFILES = 5  # of a track


class NativePeaks(NamedTuple):
    """Struct `peak_map`; the value has the branches first, then an axis for each entry."""

    first: tuple[float, ...]
    step: tuple[float, ...]
    value: FloatArray


class NativeTrack(NamedTuple):
    """Profiles of a track as struct `track`, and what its friction is if it is no factor."""

    profiles: tuple[NativeProfile, ...]
    peaks: NativePeaks | None = None


@cache
def drivetrain_dtype(part: str) -> np.dtype[np.void]:
    """Structured dtype of a drivetrain's ``input``, ``state`` or ``output``."""
    return struct_dtype(f"drivetrain_{part}")


class NativePads(NamedTuple):
    """Struct `pad_table`; the friction has the shape (speeds, torques)."""

    speed: FloatArray
    torque: FloatArray
    friction: FloatArray


class NativeMember(NamedTuple):
    """Parts of one drivetrain; without a track the input has its factors."""

    table: NativeTable
    contact: Mapping[str, float]
    drivetrain: Mapping[str, float]
    body: Mapping[str, float]
    track: NativeTrack | None = None
    pads: NativePads | None = None


class NativeFleet:
    """Drivetrains that are stepped together, each with its own parameters. Checks nothing.

    Members that share an object share its copy. A member's results are the same to the last bit
    whatever the other members are, or other vehicles.

    Parameters
    ----------
    members : sequence of NativeMember
        The drivetrains.
    axles : int, optional
        Number of neighbouring members that share their speed, as those of one vehicle: see
        fmu/kernel/drivetrain.h.

    Attributes
    ----------
    members : array of C structs
        The drivetrains.
    """

    def __init__(self, members: Sequence[NativeMember], axles: int = 1) -> None:
        self.size, self.axles = len(members), axles
        self._gripped: dict[bytes, tuple[float, float]] = {}  # of the last call of `grip`
        places = np.zeros(self.size, _place_dtype())
        contacts, of_contact = _unique([member.contact for member in members])
        bodies, of_body = _unique([(member.drivetrain, member.body) for member in members])
        tracks, of_track = _unique([member.track for member in members])
        contact = _records(contacts, struct_dtype("force_element_parameters"))
        flat = [{**drivetrain, **body} for drivetrain, body in bodies]
        drivetrain = _records(flat, struct_dtype("drivetrain_parameters"))
        maps, of_map = _unique([track and track.peaks for track in tracks])
        maps_kept = [None if one is None else _peak_struct(one) for one in maps]
        rails, profiles = _track_records(tracks, _addresses_of(maps_kept)[of_map])
        places["table"] = _addresses_of([member.table.struct for member in members])
        places["contact"] = _addresses(contact)[of_contact]
        places["drivetrain"] = _addresses(drivetrain)[of_body]
        without = np.array([track is None for track in tracks])
        places["rails"] = np.where(without, 0, _addresses(rails))[of_track]
        pads, of_pads = _unique([member.pads for member in members])
        pads_kept = [None if one is None else _pad_struct(one) for one in pads]
        places["pads"] = _addresses_of(pads_kept)[of_pads]
        tables = [m.table for m in members], maps, maps_kept, pads, pads_kept
        self._kept = tables, contact, drivetrain, rails, profiles, places
        self.members = pointer(places, "drivetrain_member")
        library().drivetrains_prepare(self.members, self.size)

    def stepping(
        self,
        inputs: NDArray[np.void],
        states: NDArray[np.void],
        substeps: FloatArray,
        failed: NDArray[np.bool_],
        vehicles: NativeVehicles | None = None,
    ) -> Callable[[int, float, float, float], None]:
        """Prepare to advance states and substeps in place.

        Parameters
        ----------
        inputs : ndarray
            Contiguous records, shape (rows, n).
        states, substeps : ndarray
            A record and a number for each member.
        failed : ndarray of bool
            It is set for members whose integrator gives up; these are not stepped any more.
        vehicles : NativeVehicles, optional
            Those of the members, whose loads and rails follow. Default: they are the inputs'.

        Returns
        -------
        callable
            Advances under a row of the inputs; its arguments are the number of the row, the time
            and the step [s], and the tolerance. The row's loads, friction, slope and grade are set
            to those at the start.
        """
        row = pointer(inputs, "drivetrain_input")
        changed = pointer(substeps, "double"), pointer(failed, "unsigned char")
        state = pointer(states, "drivetrain_state")
        step_on, size = library().drivetrains_advance, self.size
        of_all = self.members, size, self.axles, ffi.NULL if vehicles is None else vehicles.struct

        def advance(place: int, time: float, step: float, tolerance: float) -> None:
            step_on(*of_all, row + place * size, state, time, step, tolerance, *changed)

        return advance

    def advance(
        self,
        inputs: NDArray[np.void],
        states: NDArray[np.void],
        time: float,
        step: float,
        tolerance: float,
        substeps: FloatArray,
    ) -> None:
        """Advance states and substeps in place by one step, as `stepping`.

        Raises
        ------
        RuntimeError
            If the integrator gives up.
        """
        failed = np.zeros(self.size, dtype=np.bool_)
        self.stepping(inputs, states, substeps, failed)(0, time, step, tolerance)
        if failed.any():
            raise RuntimeError(
                f"drivetrain {np.flatnonzero(failed)[0]}: the tolerance is not met within the "
                "largest number of substeps"
            )

    def evaluating(
        self, inputs: NDArray[np.void], states: NDArray[np.void], outputs: NDArray[np.void]
    ) -> Callable[[int], None]:
        """Function that sets the outputs of the states under a row of the inputs."""
        row, state = pointer(inputs, "drivetrain_input"), pointer(states, "drivetrain_state")
        output, evaluate = pointer(outputs, "drivetrain_output"), library().drivetrains_evaluate
        members, size = self.members, self.size

        def set_outputs(place: int) -> None:
            evaluate(members, size, 1, row + place * size, state, output, ffi.NULL)

        return set_outputs

    def evaluate(
        self,
        inputs: NDArray[np.void],
        states: NDArray[np.void],
        contacts: NDArray[np.void] | None = None,
    ) -> NDArray[np.void]:
        """Output records of input and state records, both of shape (..., n).

        `contacts`, of shape (..., n, 2), takes the outputs of the left and the right wheel's
        contact, whose forces are those of both wheels under twice the load.
        """
        inputs, states = np.ascontiguousarray(inputs), np.ascontiguousarray(states)
        outputs = np.empty(states.shape, dtype=drivetrain_dtype("output"))
        library().drivetrains_evaluate(
            self.members,
            self.size,
            states.size // self.size,
            pointer(inputs, "drivetrain_input"),
            pointer(states, "drivetrain_state"),
            pointer(outputs, "drivetrain_output"),
            ffi.NULL if contacts is None else pointer(contacts, "force_element_output"),
        )
        return outputs

    def settle(self, inputs: NDArray[np.void], states: NDArray[np.void]) -> None:
        """Let the contacts have rolled steadily at their creepages; changes the states."""
        library().drivetrains_settle(
            self.members,
            self.size,
            pointer(np.ascontiguousarray(inputs), "drivetrain_input"),
            pointer(states, "drivetrain_state"),
        )

    def grip(
        self, inputs: NDArray[np.void], speed: FloatArray, torque: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Creepages on the rising branch that hold torques, nan beyond the limit; the limits."""
        inputs = np.ascontiguousarray(inputs)
        given = [np.ascontiguousarray(a, np.float64) for a in (speed, torque)]
        rows = [a.view(np.uint64).reshape(self.size, -1) for a in (self._kept[-1], inputs, *given)]
        keys = map(bytes, np.hstack(rows))
        creepage, limit = np.empty(self.size), np.full(self.size, np.nan)
        known, self._gripped = self._gripped, {}  # as runs begin alike, and loads settle
        for i, key in enumerate(keys):
            if key not in known:
                library().drivetrains_grip(
                    self.members + i,
                    1,
                    pointer(inputs[i : i + 1], "drivetrain_input"),
                    *(pointer(a[i : i + 1], "double") for a in (*given, creepage, limit)),
                )
                known[key] = creepage[i], limit[i]
            creepage[i], limit[i] = self._gripped[key] = known[key]
        return creepage, limit

    def peak(
        self, inputs: NDArray[np.void], speed: FloatArray, which: NDArray[np.intp]
    ) -> FloatArray:
        """Largest creep forces [N] of members, by their numbers, under as many inputs and speeds.

        It is ten times as fast where neighbours are of the same member under similar inputs.
        """
        force = np.empty(which.size)
        library().drivetrains_peak(
            self.members,
            pointer(np.ascontiguousarray(which, np.uintp), "size_t"),
            which.size,
            pointer(np.ascontiguousarray(inputs), "drivetrain_input"),
            pointer(np.ascontiguousarray(speed, np.float64), "double"),
            pointer(force, "double"),
        )
        return force


@cache
def _place_dtype() -> np.dtype[np.void]:
    """Dtype of the struct drivetrain_member, with pointers as numbers."""
    pointers = [(name, np.uintp) for name in ("table", "contact", "drivetrain", "rails", "pads")]
    derived = [(name, struct_dtype(name)) for name in ("contact_scales", "shape_memory")]
    return checked_dtype([*pointers, *derived], "drivetrain_member")


@cache
def _track_dtype() -> np.dtype[np.void]:
    """Dtype of the struct track, with pointers as numbers."""
    parts = [
        (f"{side}_{part}", np.uintp)
        for side in range(PROFILES)
        for part in ("count", "at", "value")
    ]
    return checked_dtype([*parts, ("scale", np.float64), ("peaks", np.uintp)], "track")


def _unique(given: Sequence[Any]) -> tuple[list[Any], NDArray[np.intp]]:
    """Distinct objects, or pairs of objects, and the index of each given one among them."""
    places: dict[Any, int] = {}
    found: list[Any] = []
    place = []
    for one in given:
        key = tuple(map(id, one)) if isinstance(one, tuple) else id(one)
        if key not in places:
            places[key] = len(found)
            found.append(one)
        place.append(places[key])
    return found, np.array(place, dtype=np.intp)


def _records(given: Sequence[Mapping[str, float]], dtype: np.dtype[np.void]) -> NDArray[np.void]:
    names = dtype.names or ()
    return np.array([tuple(one.get(name, 0.0) for name in names) for one in given], dtype)


def _addresses(array: NDArray[Any]) -> NDArray[np.uintp]:
    """Address of each element of a contiguous array."""
    places = np.arange(array.size, dtype=np.uintp) * np.uintp(array.itemsize)
    return np.asarray(places + np.uintp(array.ctypes.data))


def _addresses_of(structs: Sequence[Any]) -> NDArray[np.uintp]:
    """Address of each struct that is not None, else 0."""
    given = [0 if one is None else int(ffi.cast("uintptr_t", one)) for one in structs]
    return np.array(given, dtype=np.uintp)


def _pad_struct(given: NativePads) -> Any:
    parts = (pointer(part, "double") for part in given)
    return ffi.new("pad_table *", (*given.friction.shape, *parts))


def _peak_struct(given: NativePeaks) -> Any:
    branches, *count = given.value.shape
    value = pointer(given.value, "double")
    return ffi.new("peak_map *", (given.first, given.step, count, branches, value))


def _track_records(
    tracks: Sequence[NativeTrack | None], peaks: NDArray[np.uintp]
) -> tuple[NDArray[np.void], FloatArray]:
    """Track structs, and the array that holds the places and values they point to."""
    none: tuple[NativeProfile, ...] = (((), ()),) * PROFILES
    profiles = [profile for track in tracks for profile in (track.profiles if track else none)]
    parts = [part for profile in profiles for part in profile]
    numbers = np.array(list(chain.from_iterable(parts)), dtype=np.float64)
    first = np.cumsum([0, *map(len, parts)])[:-1] * numbers.itemsize + numbers.ctypes.data
    for i, track in enumerate(tracks):
        # The kernel knows equal rails by address.
        if track is not None and track.profiles[0] == track.profiles[1]:
            left = 2 * PROFILES * i
            first[left + 2 : left + 4] = first[left : left + 2]
    count = [len(at) for at, _ in profiles]
    rows = np.stack([count, *first.reshape(-1, 2).T], axis=1).astype(np.uintp)
    scale = np.ones((len(tracks), 1)).view(np.uintp)
    maps = peaks[:, np.newaxis]
    parts_of = np.hstack([rows.reshape(len(tracks), 3 * PROFILES), scale, maps])
    return np.ascontiguousarray(parts_of).view(_track_dtype())[:, 0], numbers
