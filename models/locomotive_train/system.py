"""The locomotive in Exudyn, and what acts on it from outside: wheels, motors, drawbar."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import exudyn
import numpy as np
from exudyn.itemInterface import (
    MarkerBodyRigid,
    MarkerNodeCoordinate,
    Node1D,
    NodeRigidBodyRxyz,
    ObjectConnectorCoordinateSpringDamper,
    ObjectConnectorRigidBodySpringDamper,
    ObjectGenericODE2,
    ObjectGround,
    ObjectMass1D,
    ObjectRigidBody,
)

from contactlib.base.quantities import FloatArray

from .vehicle import (
    AXLES,
    COORDINATES,
    ENDS,
    SHAFT,
    SPIN,
    TRAIN,
    Forces,
    Locomotive,
    Motion,
    dot,
    vectors,
)

Spring = tuple[int, int, tuple[float, ...], tuple[float, ...], tuple[Any, Any]]


def springs(locomotive: Locomotive) -> list[Spring]:
    """Springs as (body, other body, place on each, (stiffness, damping) in six directions).

    Bodies are the ground (-1), the body (0), the bogies (1, 2) and the axles (3 to 6). A spring's
    directions are those of the first of its bodies.
    """
    v = locomotive.vehicle
    found: list[Spring] = []
    radius = locomotive.wheelset.radius
    for bogie, end in zip((1, 2), ENDS, strict=True):
        pivot = end * v.half_pivot_distance
        link = ((v.link_stiffness, 0, 0, 0, 0, 0), (v.link_damping, 0, 0, 0, 0, 0))
        low = v.link_height
        found.append(
            (0, bogie, (pivot, 0.0, low - v.body_height), (0.0, 0.0, low - v.bogie_height), link)
        )
        side = (
            (*v.secondary_stiffness, 0, 0, 0.5 * v.yaw_stiffness),
            (*v.secondary_damping, 0, 0, 0.5 * v.yaw_damping),
        )
        high = v.secondary_height
        for y in v.half_secondary * ENDS:
            places = (pivot, y, high - v.body_height), (0.0, y, high - v.bogie_height)
            found.append((0, bogie, *places, side))
        box = (*v.primary_stiffness, 0, 0, 0), (*v.primary_damping, 0, 0, 0)
        for axle, x in zip((2 * bogie + 1, 2 * bogie + 2), v.half_wheelbase * ENDS, strict=True):
            for y in v.half_boxes * ENDS:
                found.append((bogie, axle, (x, y, radius - v.bogie_height), (0.0, y, 0.0), box))
    rail = ((0, 0, v.rail_stiffness, 0, 0, 0), (0, 0, v.rail_damping, 0, 0, 0))
    for axle in range(3, 7):
        for y in v.half_gauge * ENDS:
            found.append((-1, axle, (0.0, 0.0, radius), (0.0, y, 0.0), rail))
    return found


def build(locomotive: Locomotive, speed: float, forces: Callable[[], FloatArray]) -> Any:
    """Assembled Exudyn system in pure rolling; `forces` on all coordinates act on it."""
    v, mbs = locomotive.vehicle, exudyn.SystemContainer().AddSystem()
    at, rates = locomotive.reference, locomotive.start(speed)
    masses = [v.body_mass, *[v.bogie_mass] * 2, *[v.wheelset_mass] * AXLES]
    across = (v.wheelset_inertia,) * 3
    inertias = [v.body_inertia, *[v.bogie_inertia] * 2, *[across] * AXLES]
    nodes: list[Any] = []
    bodies: list[Any] = []
    for i, (mass, inertia) in enumerate(zip(masses, inertias, strict=True)):
        own = slice(6 * i, 6 * i + 6)
        node = NodeRigidBodyRxyz(referenceCoordinates=at[own], initialVelocities=rates[own])
        nodes.append(mbs.AddNode(node))
        body = ObjectRigidBody(mass=mass, inertia=[*inertia, 0, 0, 0], nodeNumber=nodes[-1])
        bodies.append(mbs.AddObject(body))
    singles = (locomotive.wheel_inertia, locomotive.shaft_inertia)
    for single in [i for i in singles for _ in range(AXLES)] + [v.train_mass]:
        rate = rates[len(nodes) + 35]
        nodes.append(mbs.AddNode(Node1D(referenceCoordinates=[0.0], initialVelocities=[rate])))
        mbs.AddObject(ObjectMass1D(mass=single, nodeNumber=nodes[-1]))
    bodies.append(mbs.AddObject(ObjectGround()))
    for first, other, place, place_other, (stiffness, damping) in springs(locomotive):
        markers = [
            mbs.AddMarker(MarkerBodyRigid(bodyNumber=bodies[body], localPosition=where))
            for body, where in ((first, place), (other, place_other))
        ]
        mbs.AddObject(
            ObjectConnectorRigidBodySpringDamper(
                markerNumbers=markers, stiffness=np.diag(stiffness), damping=np.diag(damping)
            )
        )
    for wheels, shaft in zip(nodes[7:11], nodes[11:15], strict=True):
        ends = [
            mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=0))
            for node in (wheels, shaft)
        ]
        mbs.AddObject(
            ObjectConnectorCoordinateSpringDamper(
                markerNumbers=ends, stiffness=v.quill_stiffness, damping=v.quill_damping
            )
        )
    mbs.AddObject(
        ObjectGenericODE2(
            nodeNumbers=nodes,
            forceUserFunction=lambda mbs, t, i, q, q_t: forces(),
        )
    )
    mbs.Assemble()
    return mbs


def outer_forces(
    locomotive: Locomotive,
    q: FloatArray,
    rates: FloatArray,
    motion: Motion,
    wheel_forces: Forces,
    torque: FloatArray,
) -> FloatArray:
    """Generalized forces of wheels, motors of a torque at the axle [N.m], drawbar and train."""
    v, wheelset = locomotive.vehicle, locomotive.wheelset
    found = np.zeros(COORDINATES)
    bodies = found[:42].reshape(7, 6)
    creep, lateral, moment = wheel_forces
    pushes = creep[..., None] * motion.forward[:, None] + lateral[..., None] * motion.left[:, None]
    turns = np.cross(motion.arm, pushes).sum(axis=1)
    turns[:, 2] += moment.sum(axis=1)
    turns -= v.conicity * (moment @ ENDS)[:, None] * motion.left  # as the normals lean
    driven, spin = dot(turns, motion.axle), rates[SPIN]
    gyroscopic = (locomotive.wheel_inertia * spin)[:, None] * np.cross(motion.turning, motion.axle)
    turns = turns - driven[:, None] * motion.axle - gyroscopic
    bodies[3:, :3] = pushes.sum(axis=1)
    bodies[3:, 3:] = (motion.axes[3:] * turns[:, None]).sum(axis=-1)
    loss = wheelset.damping * spin
    found[SPIN], found[SHAFT] = driven - loss, torque

    # A motor and its gear turn the bogie back. The rotor turns the other way than the axle.
    quill = v.quill_stiffness * (q[SHAFT] - q[SPIN]) + v.quill_damping * (rates[SHAFT] - spin)
    back = (loss - quill + (torque - quill) / v.gear_ratio)[:, None] * motion.axle
    bodies[1:3, 3:] = (motion.axes[1:3] * back.reshape(2, 1, 2, 3).sum(axis=2)).sum(axis=-1)

    hook = motion.own[0].T @ np.array([-v.half_length, 0.0, v.drawhook_height - v.body_height])
    place, axes = q[:3] + locomotive.reference[:3] + hook, motion.axes[0]
    pull, forward = drawbar(locomotive, place, rates, hook, axes, q[TRAIN:])
    bodies[0, :3] = -pull * forward
    bodies[0, 3:] = axes @ np.cross(hook, bodies[0, :3])
    # Its constant part turns its sign at standstill, smoothly.
    davis, speed = wheelset.resistance, rates[TRAIN:]
    along = davis.constant * np.tanh(speed / wheelset.element.minimum_speed)
    along += davis.linear * speed + davis.quadratic * speed * abs(speed)
    found[TRAIN:] = pull - AXLES * along
    return found


def drawbar(
    locomotive: Locomotive,
    place: FloatArray,
    moving: FloatArray,
    hook: FloatArray,
    axes: FloatArray,
    way: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Pull on the train [N] and its direction along the track, with the hook's end at a place."""
    v, k = locomotive.vehicle, locomotive.alignment.curvature
    velocity = moving[:3] + np.cross(moving[3:6] @ axes, hook)
    distance, offset = locomotive.alignment.of(place[:1], place[1:2])
    heading = k * distance
    # What does work along the track's centre does it on a shorter or longer way beside it.
    forward = vectors(np.cos(heading), np.sin(heading), 0.0)[0] / (1.0 - k * offset)
    start = locomotive.reference[0] - v.half_length  # to first order in the curve
    stretch = distance - start - way
    rate = dot(velocity[None], forward) - moving[TRAIN:]
    return v.drawbar_stiffness * stretch + v.drawbar_damping * rate, forward
