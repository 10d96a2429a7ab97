"""The only module that touches the native library.

It hands numpy arrays and C structs across and knows no contact mechanics. The declarations are
read from the C headers themselves, so nothing is declared twice.
"""

from __future__ import annotations

import platform
import re
import struct
import zlib
from collections.abc import Mapping, Sequence
from functools import cache
from itertools import chain
from pathlib import Path
from threading import Lock
from typing import Any, NamedTuple

import numpy as np
from cffi import FFI
from numpy.typing import NDArray

from contactlib.files import PACKAGE, package_folder
from contactlib.parameters import FloatArray, Limits

HEADERS = (
    "variable.h",
    "creep_table.h",
    "force_element.h",
    "wheelset.h",
    "wheelset_step.h",
    "track.h",
    "drivetrain.h",
    "model.h",
    "token.h",
)
SUFFIXES = {"linux": ".so", "windows": ".dll", "darwin": ".dylib"}

NativeProfile = tuple[Sequence[float], Sequence[float]]  # places and values
NativeTrack = tuple[NativeProfile, NativeProfile, NativeProfile]  # left, right; over time

ffi: Any = FFI()
_LOADING = Lock()


def platform_name() -> str:
    """FMI 3 platform tuple of this machine, such as ``x86_64-linux``."""
    machine = platform.machine().lower()
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(machine, machine)
    return f"{machine}-{platform.system().lower()}"


def library_path(name: str) -> Path:
    """File of the native library of platform tuple `name`; it need not exist."""
    suffix = SUFFIXES.get(name.partition("-")[2], ".so")
    return PACKAGE / "_native" / name / f"contactlib{suffix}"


def library() -> Any:
    """The loaded native library, loaded once whatever the number of threads.

    Raises
    ------
    ImportError
        If it was not built for this machine.
    """
    with _LOADING:
        return _load()


@cache
def _load() -> Any:
    for header in HEADERS:
        text = (package_folder("fmu") / header).read_text(encoding="ascii")
        text = re.sub(r"^#.*$", "", text, flags=re.MULTILINE)
        ffi.cdef(text.replace("CONTACTLIB_API ", ""), override=True)
    path = library_path(platform_name())
    if not path.is_file():
        raise ImportError(
            f"contactlib has no native library for {platform_name()} at {path}; "
            "install the package again with 'pip install .' to build it"
        )
    return ffi.dlopen(str(path))


def token() -> str:
    """Digest of the C sources that the library was built from."""
    return str(ffi.string(library().contactlib_token()).decode())


# ---- binary files ---------------------------------------------------------------------------


def framed(magic: bytes, version: int, contents: bytes) -> bytes:
    """Put the frame of fmu/checked_file.h around `contents`."""
    rest = struct.pack("<Q", 24 + len(contents)) + contents
    return magic + struct.pack("<II", version, zlib.crc32(rest)) + rest


TABLE_MAGIC, TABLE_VERSION = b"CREEPTAB", 2  # as fmu/creep_table.c has them


# ---- table ----------------------------------------------------------------------------------


class NativeTable:
    """A table that the kernel has checked and can read.

    Raises
    ------
    ValueError
        If the bytes are not a whole, undamaged table.
    """

    def __init__(self, data: bytes) -> None:
        lib = library()
        # Eight-byte alignment, which a bytes object does not promise.
        self._buffer = np.zeros(-(-len(data) // 8), dtype=np.uint64)
        self._buffer.view(np.uint8)[: len(data)] = np.frombuffer(data, np.uint8)
        self.struct = ffi.new("creep_table *")
        error = lib.creep_table_open(self.struct, _pointer(self._buffer, "uint64_t"), len(data))
        if error != ffi.NULL:
            raise ValueError(ffi.string(error).decode() + _versions(data))

    def evaluate(self, x: FloatArray, k_hat: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Traction ratio and slope; `k_hat` has the shape of `x` or one element."""
        x = np.asarray(x, dtype=np.float64, order="C")
        k_hat = np.asarray(k_hat, dtype=np.float64, order="C")
        ratio, slope = np.empty_like(x), np.empty_like(x)
        library().creep_table_evaluate_many(
            self.struct,
            x.size,
            _pointer(x, "double"),
            _pointer(k_hat, "double"),
            int(k_hat.size > 1),
            _pointer(ratio, "double"),
            _pointer(slope, "double"),
        )
        return ratio, slope


def _versions(data: bytes) -> str:
    """What to add to what is wrong with a table: its version if that is another."""
    found = int.from_bytes(data[8:12], "little")
    of_table = len(data) >= 24 and data[:8] == TABLE_MAGIC and found != TABLE_VERSION
    return f": {found}, this contactlib reads {TABLE_VERSION}" if of_table else ""


class Node(NamedTuple):
    """Where a law is sampled to make a table; see fmu/creep_table.h."""

    normalized_creepage: FloatArray
    line: FloatArray
    weight: FloatArray


def table_nodes(u: FloatArray, k_hat: float, **shape: int) -> Node:
    """Law arguments at the spline coordinates `u`, 0 <= u < 1, of a table of this shape."""
    lib, node = library(), ffi.new("creep_node *")
    table, rows = ffi.new("creep_table *", shape), []
    for value in u:
        lib.creep_table_node(table, value, k_hat, node)
        rows.append((node.normalized_creepage, node.line, node.weight))
    return Node(*np.array(rows).T)


def table_place(normalized_creepage: float, k_hat: float) -> float:
    """Parameter t of the table at a creepage and a k_hat above zero."""
    return float(library().creep_table_place(normalized_creepage, k_hat))


# ---- force element --------------------------------------------------------------------------


@cache
def force_input_limits() -> Mapping[str, Limits]:
    """Limits of the force element's inputs, by name."""
    return {v.name: v.limits for v in model_variables("force_element") if v.role == "input"}


@cache
def wheelset_limits() -> Mapping[str, Limits]:
    """Limits of the wheelset's inputs and states, by name."""
    return {v.name: v.limits for v in model_variables("wheelset") if v.role in ("input", "state")}


def _struct_dtype(name: str) -> np.dtype[np.void]:
    library()
    fields = ffi.typeof(name).fields
    return np.dtype([(field, np.float64) for field, _ in fields])


@cache
def force_input_dtype() -> np.dtype[np.void]:
    """Structured dtype of the force element's input."""
    return _struct_dtype("force_element_input")


@cache
def force_output_dtype() -> np.dtype[np.void]:
    """Structured dtype of the force element's output."""
    return _struct_dtype("force_element_output")


def contact_scales(
    parameters: Mapping[str, float], normal_load: float, friction_scale: float = 1.0
) -> Any:
    """Struct of the saturation creepage, k_hat and process zone ratio at a load above zero."""
    lib, scales = library(), ffi.new("contact_scales *")
    given = ffi.new("force_element_parameters *", dict(parameters))
    lib.force_element_scales(given, normal_load, friction_scale, scales)
    return scales


class NativeForceElement:
    """Parameters and table of a force element, ready to evaluate."""

    def __init__(self, table: NativeTable, parameters: Mapping[str, float]) -> None:
        library()
        self._table = table
        self._parameters = ffi.new("force_element_parameters *", dict(parameters))

    def evaluate(self, inputs: NDArray[np.void]) -> NDArray[np.void]:
        """Output records of input records, one for one."""
        inputs = np.asarray(inputs, dtype=force_input_dtype(), order="C")
        outputs = np.empty(inputs.shape, dtype=force_output_dtype())
        library().force_element_evaluate_many(
            self._table.struct,
            self._parameters,
            inputs.size,
            _pointer(inputs, "force_element_input"),
            _pointer(outputs, "force_element_output"),
        )
        return outputs

    def evaluate_one(self, omega: float, speed: float, load: float, friction_scale: float) -> Any:
        """Output struct at one point: the quick way for an integrator. Checks nothing."""
        given = ffi.new("force_element_input *", (omega, speed, load, friction_scale))
        result = ffi.new("force_element_output *")
        library().force_element_evaluate(self._table.struct, self._parameters, given, result)
        return result


# ---- wheelset -------------------------------------------------------------------------------


class NativeWheelset:
    """Parameters of the equations of motion, ready to evaluate."""

    def __init__(self, parameters: Mapping[str, float]) -> None:
        library()
        self._parameters = ffi.new("wheelset_parameters *", dict(parameters))

    def motion(
        self, omega: float, speed: float, torque: float, resistance: float, contact: Any
    ) -> Any:
        """Rates struct of one state; `contact` is an output struct of the force element."""
        rates = ffi.new("wheelset_rates *")
        library().wheelset_motion(
            self._parameters, omega, speed, torque, resistance, contact, rates
        )
        return rates


def contact_with_force(creep_force: float) -> Any:
    """Contact struct that carries nothing but a force, for a force made elsewhere."""
    library()
    return ffi.new("force_element_output *", {"creep_force": creep_force})


# ---- drivetrain -----------------------------------------------------------------------------


@cache
def drivetrain_dtype(what: str) -> np.dtype[np.void]:
    """Structured dtype of a drivetrain's ``input``, ``state`` or ``output``."""
    return _struct_dtype(f"drivetrain_{what}")


class NativeMember(NamedTuple):
    """Table, parameters and track of one drivetrain among many.

    A profile of the track is its places and its values; without a track, friction is as the input
    says.
    """

    table: NativeTable
    contact: Mapping[str, float]
    drivetrain: Mapping[str, float]
    body: Mapping[str, float]
    track: NativeTrack | None = None


class NativeFleet:
    """Drivetrains ready to step together, each with its own parameters. Checks nothing.

    Members that share an object share its copy here. What comes out for a member is the same to
    the last bit whatever the others are.
    """

    def __init__(self, members: Sequence[NativeMember]) -> None:
        lib = library()
        self.size = len(members)
        places = np.zeros(self.size, _place_dtype())
        contacts, of_contact = _unique([member.contact for member in members])
        bodies, of_body = _unique([(member.drivetrain, member.body) for member in members])
        tracks, of_track = _unique([member.track for member in members])
        contact = _records(contacts, _struct_dtype("force_element_parameters"))
        flat = [{**drivetrain, **body} for drivetrain, body in bodies]
        drivetrain = _records(flat, _drivetrain_fields())
        scales = np.zeros(len(contacts), _struct_dtype("contact_scales"))
        for i, load in enumerate(contact["nominal_load"].tolist()):
            lib.force_element_scales(
                _pointer(contact[i : i + 1], "force_element_parameters"),
                load,
                1.0,
                _pointer(scales[i : i + 1], "contact_scales"),
            )
        rails, profiles = _track_records(tracks)
        places["table"] = [int(ffi.cast("uintptr_t", m.table.struct)) for m in members]
        places["contact"] = _addresses(contact)[of_contact]
        places["drivetrain"] = _addresses(drivetrain)[of_body]
        without = np.array([track is None for track in tracks])
        places["rails"] = np.where(without, 0, _addresses(rails))[of_track]
        for name in scales.dtype.names or ():
            places[name] = scales[name][of_contact]
        self._kept = [m.table for m in members], contact, drivetrain, rails, profiles, places
        self._members = _pointer(places, "drivetrain_member")

    def advance(
        self,
        inputs: NDArray[np.void],
        states: NDArray[np.void],
        time: float,
        step: float,
        tolerance: float,
        substeps: FloatArray,
        failed: NDArray[np.bool_] | None = None,
    ) -> None:
        """Step states and substeps on, in place; the arrays are of one length and contiguous.

        The inputs' friction becomes the track's at the start. Where the integrator gives up
        `failed` is set; such a member stays as it is from then on.

        Raises
        ------
        RuntimeError
            If the integrator gives up, and `failed` is left out.
        """
        alone = failed is None
        if failed is None:
            failed = np.zeros(self.size, dtype=np.bool_)
        library().drivetrain_advance_many(
            self._members,
            self.size,
            _pointer(inputs, "drivetrain_input"),
            _pointer(states, "drivetrain_state"),
            time,
            step,
            tolerance,
            _pointer(substeps, "double"),
            _pointer(failed, "unsigned char"),
        )
        if alone and failed.any():
            raise RuntimeError(
                f"drivetrain {np.flatnonzero(failed)[0]}: the tolerance is not met within the "
                "largest number of substeps"
            )

    def evaluate(self, inputs: NDArray[np.void], states: NDArray[np.void]) -> NDArray[np.void]:
        """Output records of input and state records, both of shape (..., n)."""
        inputs, states = np.ascontiguousarray(inputs), np.ascontiguousarray(states)
        outputs = np.empty(states.shape, dtype=drivetrain_dtype("output"))
        library().drivetrain_evaluate_many(
            self._members,
            self.size,
            states.size // self.size,
            _pointer(inputs, "drivetrain_input"),
            _pointer(states, "drivetrain_state"),
            _pointer(outputs, "drivetrain_output"),
        )
        return outputs


@cache
def _place_dtype() -> np.dtype[np.void]:
    """The struct drivetrain_member, with pointers as numbers."""
    pointers = [(name, np.uintp) for name in ("table", "contact", "drivetrain", "rails")]
    scales = [(name, np.float64) for name in _struct_dtype("contact_scales").names or ()]
    return _of_size([*pointers, *scales], "drivetrain_member")


@cache
def _drivetrain_fields() -> np.dtype[np.void]:
    """The struct drivetrain_parameters, the body's fields among its own."""
    fields = ffi.typeof("drivetrain_parameters").fields
    body = _struct_dtype("wheelset_parameters").names or ()
    names = [name for field, _ in fields for name in (body if field == "body" else [field])]
    return _of_size([(name, np.float64) for name in names], "drivetrain_parameters")


@cache
def _track_dtype() -> np.dtype[np.void]:
    """The struct track, with pointers as numbers."""
    parts = [(f"{side}_{part}", np.uintp) for side in range(3) for part in ("count", "at", "value")]
    return _of_size(parts, "track")


def _of_size(fields: list[tuple[str, Any]], struct_name: str) -> np.dtype[np.void]:
    found = np.dtype(fields)
    if found.itemsize != ffi.sizeof(struct_name):
        raise ImportError(f"{struct_name} of the native library is not laid out as expected")
    return found


def _unique(given: Sequence[Any]) -> tuple[list[Any], NDArray[np.intp]]:
    """Objects that differ, or pairs of them, and the place of each among them."""
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
    """Of each element of a contiguous array."""
    places = np.arange(array.size, dtype=np.uintp) * np.uintp(array.itemsize)
    return np.asarray(places + np.uintp(array.ctypes.data))


def _track_records(tracks: Sequence[NativeTrack | None]) -> tuple[NDArray[np.void], FloatArray]:
    """Track structs, and the array of all their places and values that they point into."""
    profiles = [profile for track in tracks for profile in track or (((), ()),) * 3]
    parts = [part for profile in profiles for part in profile]
    numbers = np.array(list(chain.from_iterable(parts)), dtype=np.float64)
    first = np.cumsum([0, *map(len, parts)])[:-1] * numbers.itemsize + numbers.ctypes.data
    count = [len(at) for at, _ in profiles]
    rows = np.stack([count, *first.reshape(-1, 2).T], axis=1).astype(np.uintp)
    return rows.reshape(len(tracks), 9).view(_track_dtype())[:, 0], numbers


# ---- models that an FMU can hold ------------------------------------------------------------

MODEL_KINDS = ("force_element", "wheelset", "wheelset_body")
GIVEN = ("fixed_parameter", "tunable_parameter", "input", "state")  # roles with a start value


class Variable(NamedTuple):
    """One entry of a model's list of variables."""

    name: str
    unit: str
    description: str
    role: str
    limits: Limits
    only_relaxed: bool

    @property
    def boolean(self) -> bool:
        """Whether it is a truth value."""
        return self.unit == "Boolean"


@cache
def model_variables(kind: str) -> tuple[Variable, ...]:
    """The list of variables of a kind of model; an index is an FMI value reference."""
    model = _model(kind)
    roles = ffi.typeof("variable_role").elements

    def text(cdata: Any) -> str:
        return str(ffi.string(cdata).decode())

    return tuple(
        Variable(
            text(v.name),
            text(v.unit),
            text(v.description),
            roles[v.role].lower(),
            Limits(at_least=v.minimum, at_most=v.maximum),
            v.part == library().IF_RELAXED,
        )
        for v in (model.variables[i] for i in range(model.count))
    )


def _model(kind: str) -> Any:
    if kind not in MODEL_KINDS:
        raise ValueError(f"kind = {kind!r} must be one of: {', '.join(MODEL_KINDS)}")
    return library().model_of(kind.encode())


class NativeModel:
    """What an FMU holds, without FMI: values by name, steps and directional derivatives.

    Checks nothing but names: it is for what has been checked.
    """

    def __init__(self, kind: str, table: NativeTable, start: Mapping[str, float]) -> None:
        self._model, self._table = _model(kind), table
        self._entries = {v.name: i for i, v in enumerate(model_variables(kind))}
        self._values = ffi.new("model_values *")
        self.set(**start)
        self.evaluate()

    def set(self, **values: float) -> None:
        """Set variables of any role; the outputs stay until `evaluate`."""
        for name, value in values.items():
            library().model_set(self._entry(name), self._values, float(value))

    def get(self, *names: str) -> list[float]:
        """Values by name."""
        return [library().model_get(self._entry(name), self._values) for name in names]

    def evaluate(self) -> None:
        """Make the outputs and derivatives from all else."""
        library().model_evaluate(self._model, self._table.struct, self._values)

    def advance(self, step: float, tolerance: float = 1e-6) -> None:
        """Step the states with the inputs held.

        Raises
        ------
        RuntimeError
            If the integrator gives up.
        """
        error = library().model_advance(
            self._model, self._table.struct, self._values, step, tolerance
        )
        if error != ffi.NULL:
            raise RuntimeError(ffi.string(error).decode())
        self.evaluate()

    def tangent(self, unknowns: Sequence[str], direction: Mapping[str, float]) -> list[float]:
        """Change of outputs and derivatives when all else changes along a direction."""
        lib = library()
        moved, change = ffi.new("model_values *"), ffi.new("model_values *")
        for name, value in direction.items():
            lib.model_set(self._entry(name), moved, float(value))
        lib.model_tangent(self._model, self._table.struct, self._values, moved, change)
        return [lib.model_get(self._entry(name), change) for name in unknowns]

    def _entry(self, name: str) -> Any:
        return ffi.addressof(self._model.variables[self._entries[name]])


def _pointer(array: NDArray[Any], kind: str) -> Any:
    """First of a contiguous array's elements, as C's of that kind; it keeps the array alive."""
    return ffi.from_buffer(f"{kind}[]", array)
