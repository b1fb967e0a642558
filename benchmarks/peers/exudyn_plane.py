"""A system of Exudyn's in the xy plane, in redundant coordinates: the positions and angles of bodies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from exudyn import itemInterface as items
from exudyn_model import CONTAINER


@dataclass(frozen=True)
class Place:
    """A point at the start: its position and its velocity, shape (2,) each."""

    x: np.ndarray
    v: np.ndarray


REST = Place(np.zeros(2), np.zeros(2))


@dataclass(frozen=True)
class Body:
    """A body as it is at the start.

    Attributes
    ----------
    number, node : int
        Of Exudyn's object and node; the ground has no node.
    centre : Place
        The centre of mass.
    angle, rate : float
        From the x axis.
    """

    number: int
    node: int | None
    centre: Place
    angle: float
    rate: float

    def place(self, x: np.ndarray) -> Place:
        """Return a point that is fixed in the body, by its position at the start."""
        return Place(x, self.centre.v + self.rate * _turned(x - self.centre.x))

    def local(self, x: np.ndarray) -> list[float]:
        """Return the same point in the body's own axes."""
        c, s = np.cos(self.angle), np.sin(self.angle)
        return [*(np.array([[c, s], [-s, c]]) @ (x - self.centre.x)), 0.0]


class Plane:
    """The system `mbs` while it is put together; gravity is along -y."""

    def __init__(self, gravity: float):
        self.mbs = CONTAINER.AddSystem()
        self.gravity = gravity
        self.ground = Body(self.mbs.AddObject(items.ObjectGround()), None, REST, 0.0, 0.0)

    def point(self, mass: float, centre: Place) -> Body:
        """Add a point mass."""
        given = {"initialCoordinates": list(centre.x), "initialVelocities": list(centre.v)}
        node = self.mbs.AddNode(items.NodePoint2D(**given))
        number = self.mbs.AddObject(items.ObjectMassPoint2D(mass=mass, nodeNumber=node))
        self._weigh(number)
        return Body(number, node, centre, 0.0, 0.0)

    def body(
        self, mass: float, inertia: float, pivot: Place, centre: np.ndarray, angle: float, rate: float
    ) -> Body:
        """Add a rigid body with its centre of mass at `centre`, which turns about `pivot` at the start."""
        velocity = pivot.v + rate * _turned(centre - pivot.x)
        given = {"initialCoordinates": [*centre, angle], "initialVelocities": [*velocity, rate]}
        node = self.mbs.AddNode(items.NodeRigidBody2D(**given))
        number = self.mbs.AddObject(items.ObjectRigidBody2D(mass=mass, inertia=inertia, nodeNumber=node))
        self._weigh(number)
        return Body(number, node, Place(centre, velocity), angle, rate)

    def rod(
        self, mass: float, inertia: float, length: float, near: Place, angle: float, rate: float
    ) -> tuple[Body, Place]:
        """Add a rod from `near`; returns it and its far end."""
        half = 0.5 * length * np.array([np.cos(angle), np.sin(angle)])
        rod = self.body(mass, inertia, near, near.x + half, angle, rate)
        return rod, rod.place(near.x + 2.0 * half)

    def pin(self, at: Place, *bodies: Body) -> None:
        """Join the first body to each of the others by a hinge: two constraints each."""
        for other in bodies[1:]:
            markers = [self.marker(body, at) for body in (bodies[0], other)]
            self.mbs.AddObject(items.ObjectJointRevolute2D(markerNumbers=markers))

    def spring(
        self,
        bodies: tuple[Body, Body],
        ends: tuple[Place, Place],
        stiffness: float,
        damping: float,
        length: float,
    ) -> None:
        """Add a spring and a damper between points of two bodies."""
        markers = [self.marker(body, end) for body, end in zip(bodies, ends, strict=True)]
        self.mbs.AddObject(
            items.ObjectConnectorSpringDamper(
                markerNumbers=markers, referenceLength=length, stiffness=stiffness, damping=damping
            )
        )

    def prescribe(self, body: Body, coordinate: int, **course) -> None:
        """Hold a coordinate of a body at 0, or at the `offsetUserFunction` given: one constraint."""
        fixed = self.mbs.AddNode(items.NodePointGround())
        ends = [(fixed, 0), (body.node, coordinate)]
        markers = [
            self.mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=node, coordinate=number))
            for node, number in ends
        ]
        self.mbs.AddObject(items.ObjectConnectorCoordinate(markerNumbers=markers, **course))

    def slide(self, guide: Body, sliding: Body, axis: list[float]) -> None:
        """Let a body move along an axis of another through its centre of mass, and turn with it: two constraints."""
        markers = [
            self.mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=body.number)) for body in (guide, sliding)
        ]
        across = [axis[1], -axis[0], 0.0]
        self.mbs.AddObject(
            items.ObjectJointPrismatic2D(markerNumbers=markers, axisMarker0=axis, normalMarker1=across)
        )

    def marker(self, body: Body, at: Place) -> int:
        """Return a marker of a point of a body."""
        return self.mbs.AddMarker(
            items.MarkerBodyPosition(bodyNumber=body.number, localPosition=body.local(at.x))
        )

    def _weigh(self, body: int) -> None:
        marker = self.mbs.AddMarker(items.MarkerBodyMass(bodyNumber=body))
        weight = [0.0, -self.gravity, 0.0]
        self.mbs.AddLoad(items.LoadMassProportional(markerNumber=marker, loadVector=weight))


def _turned(x: np.ndarray) -> np.ndarray:
    return np.array([-x[1], x[0]])
