"""The locomotive: its parameters, its bodies and springs in Exudyn, and the motion of its wheels.

x points forward, y to the left, z up. The coordinates q are displacements from a reference in which
every wheel bears its share of the weight: of the body, two bogies and four axles x, y, z and three
angles (`RigidBodyRxyz`), then the angles of four wheelsets about their axles, of the four hollow
shafts that the motors drive, and the train's way. An axle does not turn with its wheels, so that no
angle becomes large but that of the curve.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np

import contactlib as cl
from contactlib.base.quantities import FloatArray
from contactlib.base.units import STANDARD_GRAVITY

AXLES = 4
ENDS = np.array([1.0, -1.0])  # front and rear; left and right
SPIN, SHAFT, TRAIN = slice(42, 46), slice(46, 50), 50  # coordinates behind those of the bodies
COORDINATES = 51
Forces = FloatArray
"""Creep forces, lateral forces [N] and spin moments [N.m] on the wheels, in this order."""
Three = tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class Vehicle:
    """Masses, dimensions and springs in SI units; `vehicle.toml` describes each."""

    train_mass: float
    wheelset_mass: float
    wheelset_inertia: float
    bogie_mass: float
    bogie_inertia: Three
    body_mass: float
    body_inertia: Three
    half_wheelbase: float
    half_pivot_distance: float
    half_gauge: float
    half_boxes: float
    half_secondary: float
    bogie_height: float
    body_height: float
    link_height: float
    secondary_height: float
    drawhook_height: float
    half_length: float
    conicity: float
    primary_stiffness: Three
    primary_damping: Three
    secondary_stiffness: Three
    secondary_damping: Three
    yaw_stiffness: float
    yaw_damping: float
    link_stiffness: float
    link_damping: float
    drawbar_stiffness: float
    drawbar_damping: float
    rail_stiffness: float
    rail_damping: float
    gear_ratio: float
    rotor_inertia: float
    quill_stiffness: float
    quill_damping: float

    @classmethod
    def load(cls) -> Self:
        """Vehicle of the file beside this module."""
        file = Path(__file__).with_name("vehicle.toml")
        found: dict[str, Any] = tomllib.loads(file.read_text(encoding="ascii"))
        given: Any = {k: tuple(v) if isinstance(v, list) else v for k, v in found.items()}
        return cls(**given)

    @property
    def mass(self) -> float:
        """Mass of the locomotive [kg]."""
        return self.body_mass + 2.0 * self.bogie_mass + AXLES * self.wheelset_mass


class Alignment(NamedTuple):
    """Level track from the origin along x: straight, or a curve to the left [1/m]."""

    curvature: float = 0.0

    def at(self, distance: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Position x, y [m] and heading [rad] of the track at a distance along it [m]."""
        half = 0.5 * self.curvature * distance
        chord = distance * np.sinc(half / np.pi)
        return chord * np.cos(half), chord * np.sin(half), 2.0 * half

    def of(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Distance along the track, and to the left of it [m]."""
        k = self.curvature
        if k == 0.0:
            return x, y
        along, across = k * x, 1.0 - k * y
        radius = np.sqrt(along * along + across * across)
        return 2.0 * np.arctan(along / (radius + across)) / k, (1.0 - radius) / k


STRAIGHT = Alignment()


class Motion(NamedTuple):
    """Motion of the four axles and their eight wheels; vectors have three components last.

    Attributes
    ----------
    distance, offset : ndarray
        Of the axles' centres along the track and to the left of it [m].
    forward, left : ndarray
        Unit vectors along and across the track at each axle.
    axes, own : ndarray
        Axes about which their three angles turn body, bogies and axles, and their own axes.
    axle, turning : ndarray
        Unit vector along each axle, and its angular velocity without the wheels' spin [rad/s].
    arm : ndarray
        From an axle's centre to its two contacts [m].
    slip, lateral_velocity, spin_velocity, speed, load : ndarray
        Of each wheel: slip velocity, positive in traction [m/s], velocity to the left [m/s] and
        about the normal [rad/s] of its surface against the rail, its centre's speed [m/s], its
        load [N].
    """

    distance: FloatArray
    offset: FloatArray
    forward: FloatArray
    left: FloatArray
    axes: FloatArray
    own: FloatArray
    axle: FloatArray
    turning: FloatArray
    arm: FloatArray
    slip: FloatArray
    lateral_velocity: FloatArray
    spin_velocity: FloatArray
    speed: FloatArray
    load: FloatArray


def vectors(x: FloatArray, y: Any, z: Any) -> FloatArray:
    """Vectors from their components; the first has the shape of all."""
    return np.stack(np.broadcast_arrays(x, y, z), axis=-1)


def dot(a: FloatArray, b: FloatArray) -> FloatArray:
    """Scalar product of vectors."""
    return np.asarray((a * b).sum(axis=-1))


def directions(angles: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Axes about which three angles turn a body, and the body's own axes; both in rows."""
    cosine, sine = np.cos(angles), np.sin(angles)
    ca, cb, cc = (cosine[..., i] for i in range(3))
    sa, sb, sc = (sine[..., i] for i in range(3))
    none = np.zeros_like(ca)
    axes, own = np.empty((2, *angles.shape, 3))
    axes[..., 0, :] = 1.0, 0.0, 0.0
    axes[..., 1, :] = left = vectors(none, ca, sa)
    axes[..., 2, :] = own[..., 2, :] = vectors(sb, -cb * sa, cb * ca)
    forward = vectors(cb, sa * sb, -ca * sb)
    cc, sc = cc[..., None], sc[..., None]
    own[..., 0, :], own[..., 1, :] = cc * forward + sc * left, cc * left - sc * forward
    return axes, own


@dataclass(frozen=True, eq=False)
class Locomotive:
    """A vehicle whose wheelsets have the contact, inertia and train resistance of `wheelset`.

    Raises
    ------
    ValueError
        If the weight is not that of the wheelsets' nominal loads.
    """

    vehicle: Vehicle
    wheelset: cl.Wheelset
    alignment: Alignment = STRAIGHT

    def __post_init__(self) -> None:
        load = AXLES * self.wheelset.element.axle_load
        if not np.isclose(self.vehicle.mass * STANDARD_GRAVITY, load, rtol=1e-3):
            raise ValueError(
                f"Vehicle.mass = {self.vehicle.mass!r} weighs "
                f"{self.vehicle.mass * STANDARD_GRAVITY:.6g} N: "
                f"must be the wheelsets' nominal loads, {load!r}"
            )

    @property
    def shaft_inertia(self) -> float:
        """Inertia of a motor's rotor at the axle [kg.m2]."""
        return self.vehicle.rotor_inertia * self.vehicle.gear_ratio**2

    @property
    def wheel_inertia(self) -> float:
        """Inertia of a wheelset without the rotor [kg.m2]."""
        return self.wheelset.inertia - self.shaft_inertia

    @cached_property
    def wheel(self) -> cl.ForceElement:
        """The force element of one wheel."""
        return replace(self.wheelset.element, wheels=1)

    @cached_property
    def reference(self) -> FloatArray:
        """Coordinates in the reference, in which all other angles are zero."""
        v, found = self.vehicle, np.zeros(COORDINATES)
        pivots = v.half_pivot_distance * ENDS
        x, y, heading = self.alignment.at((pivots[:, None] + v.half_wheelbase * ENDS).ravel())
        axles = np.stack([x, y, np.full(AXLES, self.wheelset.radius)], axis=-1)
        bogies = axles.reshape(2, 2, 3).mean(axis=1)
        bogies[:, 2] = v.bogie_height
        body = np.array([*bogies.mean(axis=0)[:2], v.body_height])
        bodies = found[:42].reshape(7, 6)
        bodies[:, :3] = np.vstack([body, bogies, axles])
        bodies[:, 5] = [0.0, *self.alignment.curvature * pivots, *heading]
        return found

    def start(self, speed: float) -> FloatArray:
        """Rates of the coordinates in pure rolling [m/s, rad/s]."""
        found, k = np.zeros(COORDINATES), self.alignment.curvature
        at, rates = self.reference[:42].reshape(7, 6), found[:42].reshape(7, 6)
        rates[:, 0], rates[:, 1] = speed * (1.0 - k * at[:, 1]), speed * k * at[:, 0]
        rates[:, 5] = speed * k
        found[SPIN] = found[SHAFT] = speed / self.wheelset.radius
        found[TRAIN] = speed
        return found

    def motion(self, q: FloatArray, rates: FloatArray) -> Motion:
        """Motion of the wheels, of one state or of many; coordinates are the last dimension."""
        v, radius = self.vehicle, self.wheelset.radius
        bodies = (q + self.reference)[..., :42].reshape(*q.shape[:-1], 7, 6)
        axes, own = directions(bodies[..., 3:])
        at, moving = bodies[..., 3:, :], rates[..., 18:42].reshape(*q.shape[:-1], AXLES, 6)
        axle = own[..., 3:, 1, :]
        turning = (moving[..., 3:, None] * axes[..., 3:, :, :]).sum(axis=-2)
        distance, offset = self.alignment.of(at[..., 0], at[..., 1])
        heading = self.alignment.curvature * distance
        c, s, none = np.cos(heading), np.sin(heading), np.zeros_like(heading)
        forward, left = vectors(c, s, none), vectors(-s, c, none)

        # From the centre to a wheel's centre, and down from there, across the axle.
        sideways = v.half_gauge * ENDS[:, None] * axle[..., None, :]
        tilt = axle[..., 2:]
        down = (tilt * axle - np.array([0.0, 0.0, 1.0])) / np.sqrt(1.0 - tilt * tilt)
        rolling = radius + v.conicity * ENDS * offset[..., None]
        arm = sideways + rolling[..., None] * down[..., None, :]
        spinning = (rates[..., SPIN] - dot(turning, axle))[..., None] * axle + turning
        swing = np.cross(turning[..., None, :], sideways)
        centre = moving[..., None, :3] + swing
        contact = moving[..., None, :3] + np.cross(spinning[..., None, :], arm)
        # The tread's cone leans the normal towards the middle of the track.
        lean = v.conicity * ENDS * dot(spinning, left)[..., None]
        height = at[..., 2:3] - radius + sideways[..., 2]
        rail = v.rail_stiffness * height + v.rail_damping * centre[..., 2]
        return Motion(
            distance=distance,
            offset=offset,
            forward=forward,
            left=left,
            axes=axes,
            own=own,
            axle=axle,
            turning=turning,
            arm=arm,
            slip=-dot(contact, forward[..., None, :]),
            lateral_velocity=dot(contact, left[..., None, :]),
            spin_velocity=spinning[..., 2:] - lean,
            speed=dot(centre, forward[..., None, :]),
            load=np.maximum(self.wheel.axle_load - rail, 0.0),
        )
