"""The scenes as Exudyn's own multibody models: it has no way to take equations that are compiled elsewhere."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
from job import Job

sys.exudynFast = True  # its build without range checks
import exudyn  # noqa: E402
from exudyn import itemInterface as items  # noqa: E402

State = tuple[np.ndarray, np.ndarray]
ORIGIN = [0.0, 0.0, 0.0]
CONTAINER = exudyn.SystemContainer()  # outlives its systems


@dataclass(frozen=True)
class Model:
    """An assembled system.

    Attributes
    ----------
    mbs : exudyn.MainSystem
    state : callable
        (coordinates, velocities) of Exudyn -> (q, v) of the scene.
    constrained : bool
        Whether there are algebraic equations, which its explicit methods refuse.
    """

    mbs: exudyn.MainSystem
    state: Callable[[np.ndarray, np.ndarray], State]
    constrained: bool = False


def build(job: Job) -> Model | None:
    """Return the model of a scene with its start, None where none is written."""
    maker = MAKERS.get(job.system.name)
    if maker is None:
        return None
    names = [entry["name"] for entry in (*job.system.parameters, *job.system.inputs)]
    p = dict(zip(names, job.p.tolist(), strict=True))
    p |= {entry["name"]: entry["value"] for entry in job.system.constants}
    return maker(SimpleNamespace(**p), job.start[: job.system.nq], job.start[job.system.nq :])


def _tree(
    gravity: Sequence[float],
    axes: str,
    links: Sequence[Mapping],
    q: np.ndarray,
    v: np.ndarray,
    turned: np.ndarray,
) -> exudyn.MainSystem:
    """Return a chain of hinges in minimal coordinates, the relative angles.

    Parameters
    ----------
    axes : str
        "XYZ": of each hinge, in the frame of the link before.
    links : sequence of dict
        offset (of the hinge in the link before), com, mass, inertia (about the centre of mass).
    turned : ndarray, shape (3, 3)
        Of the first hinge's frame.
    """
    mbs = CONTAINER.AddSystem()
    n = len(axes)
    node = mbs.AddNode(
        items.NodeGenericODE2(
            numberOfODE2Coordinates=n, referenceCoordinates=[0.0] * n,
            initialCoordinates=list(q), initialCoordinates_t=list(v),
        )
    )  # fmt: skip
    mbs.AddObject(
        items.ObjectKinematicTree(
            nodeNumber=node,
            gravity=list(gravity),
            jointTypes=[getattr(exudyn.JointType, f"Revolute{axis}") for axis in axes],
            linkParents=list(range(-1, n - 1)),
            jointTransformations=exudyn.Matrix3DList([turned, *[np.eye(3)] * (n - 1)]),
            jointOffsets=exudyn.Vector3DList([link["offset"] for link in links]),
            linkInertiasCOM=exudyn.Matrix3DList([np.diag(link["inertia"]) for link in links]),
            linkCOMs=exudyn.Vector3DList([link["com"] for link in links]),
            linkMasses=[link["mass"] for link in links],
        )
    )
    mbs.Assemble()
    return mbs


def _pendula(masses, lengths, g: float, along: int, q: np.ndarray, v: np.ndarray) -> Model:
    """Return point masses on a chain of rods, all of which lie along an axis where the absolute angles are 0.

    Parameters
    ----------
    along : int
        0: the x axis, 1: straight down.
    """
    towards = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])[along]
    tips = [length * towards for length in lengths]
    links = [
        {"offset": offset, "com": tip, "mass": mass, "inertia": ORIGIN}
        for offset, tip, mass in zip([np.zeros(3), *tips[:-1]], tips, masses, strict=True)
    ]
    relative = [np.diff(values, prepend=0.0) for values in (q, v)]
    mbs = _tree([0.0, -g, 0.0], "Z" * len(links), links, *relative, np.eye(3))
    return Model(mbs, lambda q, v: (np.cumsum(q), np.cumsum(v)))


def _heavy_top(p: SimpleNamespace, q: np.ndarray, v: np.ndarray) -> Model:
    c, s = np.cos(p.tilt), np.sin(p.tilt)
    massless = {"offset": ORIGIN, "com": ORIGIN, "mass": 0.0, "inertia": ORIGIN}
    top = {"offset": ORIGIN, "com": [0.0, p.l, 0.0], "mass": p.m, "inertia": [p.Jt, p.Ja, p.Jt]}
    turned = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    mbs = _tree([0.0, 0.0, -p.g], "XZY", [massless, massless, top], q, v, turned)
    return Model(mbs, lambda q, v: (q, v))


class _Plane:
    """A system in the xy plane, in redundant coordinates: the positions and angles of bodies. Gravity is along -y."""

    def __init__(self, gravity: float):
        self.mbs = CONTAINER.AddSystem()
        self.gravity = gravity
        self.origin = self._marker(self.mbs.AddObject(items.ObjectGround()), 0.0)

    def point(self, mass: float, q: Sequence[float], v: Sequence[float]) -> int:
        """Add a point mass; returns its node."""
        node = self.mbs.AddNode(items.NodePoint2D(initialCoordinates=list(q), initialVelocities=list(v)))
        self._weigh(self.mbs.AddObject(items.ObjectMassPoint2D(physicsMass=mass, nodeNumber=node)))
        return node

    def rod(
        self,
        mass: float,
        inertia: float,
        length: float,
        start: tuple[np.ndarray, np.ndarray],
        angle: float,
        rate: float,
    ) -> tuple[list[int], tuple[np.ndarray, np.ndarray]]:
        """Add a rod; returns the markers of its ends, and position and velocity of its far end.

        Parameters
        ----------
        start : tuple of ndarray, shape (2,)
            Position and velocity of its near end.
        """
        half = 0.5 * length * np.array([np.cos(angle), np.sin(angle)])
        turning = rate * np.array([-half[1], half[0]])
        node = self.mbs.AddNode(
            items.NodeRigidBody2D(
                initialCoordinates=[*(start[0] + half), angle],
                initialVelocities=[*(start[1] + turning), rate],
            )
        )
        body = items.ObjectRigidBody2D(physicsMass=mass, physicsInertia=inertia, nodeNumber=node)
        number = self.mbs.AddObject(body)
        self._weigh(number)
        ends = [self._marker(number, -0.5 * length), self._marker(number, 0.5 * length)]
        return ends, (start[0] + 2.0 * half, start[1] + 2.0 * turning)

    def pin(self, *markers: int) -> None:
        """Join two markers by a hinge: two constraints."""
        self.mbs.AddObject(items.ObjectJointRevolute2D(markerNumbers=list(markers)))

    def guide(self, node: int) -> None:
        """Hold a point on the x axis: one constraint."""
        fixed = self.mbs.AddNode(items.NodePointGround())
        ends = [items.MarkerNodeCoordinate(nodeNumber=number, coordinate=1) for number in (fixed, node)]
        self.mbs.AddObject(items.ObjectConnectorCoordinate(markerNumbers=[*map(self.mbs.AddMarker, ends)]))

    def at(self, node: int) -> int:
        """Return the marker of a node."""
        return self.mbs.AddMarker(items.MarkerNodePosition(nodeNumber=node))

    def _marker(self, body: int, x: float) -> int:
        return self.mbs.AddMarker(items.MarkerBodyPosition(bodyNumber=body, localPosition=[x, 0.0, 0.0]))

    def _weigh(self, body: int) -> None:
        marker = self.mbs.AddMarker(items.MarkerBodyMass(bodyNumber=body))
        weight = [0.0, -self.gravity, 0.0]
        self.mbs.AddLoad(items.LoadMassProportional(markerNumber=marker, loadVector=weight))


def _spring(
    stiffness: float, damping: float, length: float, mass: float, g: float, q: np.ndarray, v: np.ndarray
) -> Model:
    """Return a point mass on a spring from the origin."""
    plane = _Plane(g)
    markers = [plane.origin, plane.at(plane.point(mass, q, v))]
    spring = items.ObjectConnectorSpringDamper(
        markerNumbers=markers, referenceLength=length, stiffness=stiffness, damping=damping
    )
    plane.mbs.AddObject(spring)
    plane.mbs.Assemble()
    return Model(plane.mbs, lambda q, v: (q, v))


def _slider_crank(p: SimpleNamespace, q: np.ndarray, v: np.ndarray) -> Model:
    """Return two rods and a point mass, eight coordinates, held by seven constraints."""
    plane = _Plane(p.g)
    origin = (np.zeros(2), np.zeros(2))
    crank, joint = plane.rod(p.mc, p.Jc, p.r, origin, q[0], v[0])
    rod, _ = plane.rod(p.m, p.J, p.l, joint, q[1], v[1])
    piston = plane.point(p.mp, [q[2], 0.0], [v[2], 0.0])
    plane.pin(plane.origin, crank[0])
    plane.pin(crank[1], rod[0])
    plane.pin(rod[1], plane.at(piston))
    plane.guide(piston)
    plane.mbs.Assemble()
    angles_and_x = [2, 5, 6]
    return Model(plane.mbs, lambda q, v: (q[angles_and_x], v[angles_and_x]), constrained=True)


MAKERS: dict[str, Callable[[SimpleNamespace, np.ndarray, np.ndarray], Model]] = {
    "pendulum": lambda p, q, v: _pendula([p.m], [p.L], p.g, 1, q, v),
    "double_pendulum": lambda p, q, v: _pendula([p.m1, p.m2], [p.L1, p.L2], p.g, 1, q, v),
    "double_pendulum_level": lambda p, q, v: _pendula([p.m1, p.m2], [p.L1, p.L2], p.g, 0, q, v),
    "n_pendulum": lambda p, q, v: _pendula([p.m] * len(q), [p.L] * len(q), p.g, 1, q, v),
    "spinning_top": _heavy_top,
    "stiff_spring_pendulum": lambda p, q, v: _spring(p.eps**-2, 0.0, 1.0, 1.0, 1.0, q, v),
    "damped_spring_pendulum": lambda p, q, v: _spring(p.k, p.c, p.l0, p.m, p.g, q, v),
    "slider_crank": _slider_crank,
}
