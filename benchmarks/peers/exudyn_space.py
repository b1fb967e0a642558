"""Scenes as Exudyn's systems in space: trees of hinges in minimal coordinates, and a free body."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import SimpleNamespace

import numpy as np
from exudyn import itemInterface as items
from exudyn_model import CONTAINER, Model, State, exudyn

ORIGIN = [0.0, 0.0, 0.0]


def _tree(
    gravity: Sequence[float],
    axes: str,
    links: Sequence[Mapping],
    q: np.ndarray,
    v: np.ndarray,
    turned: np.ndarray,
) -> tuple[exudyn.MainSystem, int]:
    """Return a chain of hinges in minimal coordinates, the relative angles, and the number of its object.

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
    tree = mbs.AddObject(
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
    return mbs, tree


def pendula(masses, lengths, g: float, along: int, q: np.ndarray, v: np.ndarray) -> Model:
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
    mbs, _ = _tree([0.0, -g, 0.0], "Z" * len(links), links, *relative, np.eye(3))
    mbs.Assemble()
    return Model(mbs, lambda q, v: (np.cumsum(q), np.cumsum(v)))


def heavy_top(p: SimpleNamespace, q: np.ndarray, v: np.ndarray) -> Model:
    """Return the top in three angles."""
    c, s = np.cos(p.tilt), np.sin(p.tilt)
    massless = {"offset": ORIGIN, "com": ORIGIN, "mass": 0.0, "inertia": ORIGIN}
    top = {"offset": ORIGIN, "com": [0.0, p.l, 0.0], "mass": p.m, "inertia": [p.Jt, p.Ja, p.Jt]}
    turned = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    mbs, _ = _tree([0.0, 0.0, -p.g], "XZY", [massless, massless, top], q, v, turned)
    mbs.Assemble()
    return Model(mbs, lambda q, v: (q, v))


def bricard(p: SimpleNamespace, q: np.ndarray, v: np.ndarray) -> Model:
    """Return five bars in relative angles, the end of the last held by a hinge: five constraints, one too many."""
    directions = np.array([[1, 0, 0], [0, -1, 0], [0, 0, 1], [-1, 0, 0], [0, 1, 0]]) * p.l
    across, along = p.m * (p.l**2 + p.w**2) / 12.0, p.m * p.w**2 / 6.0
    links = [
        {"offset": offset, "com": bar / 2.0, "mass": p.m, "inertia": np.where(bar == 0.0, across, along)}
        for offset, bar in zip([np.zeros(3), *directions[:-1]], directions, strict=True)
    ]
    mbs, tree = _tree([0.0, -p.g, 0.0], "YZXYZ", links, q, v, np.eye(3))
    ground = mbs.AddObject(items.ObjectGround())
    post = mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=ground, localPosition=[0.0, 0.0, p.l]))
    corner = mbs.AddMarker(
        items.MarkerKinematicTreeRigid(objectNumber=tree, linkNumber=4, localPosition=[0.0, p.l, 0.0])
    )
    turns_about_x = [1, 1, 1, 0, 1, 1]
    mbs.AddObject(items.ObjectJointGeneric(markerNumbers=[post, corner], constrainedAxes=turns_about_x))
    mbs.Assemble()
    return Model(mbs, lambda q, v: (q, v), constrained=True, redundant=True)


def heavy_top_absolute(p: SimpleNamespace, q: np.ndarray, v: np.ndarray) -> Model:
    """Return a free body in Euler parameters, held at its tip: three constraints, and one of their length."""
    mbs = CONTAINER.AddSystem()
    unturned = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    node = mbs.AddNode(
        items.NodeRigidBodyEP(
            referenceCoordinates=list(unturned),
            initialCoordinates=list(q - unturned),
            initialVelocities=[*v[:3], *(0.5 * _from_left(q[3:])[:, 1:] @ v[3:])],
        )
    )
    inertia = [p.Jt, p.Ja, p.Jt, 0.0, 0.0, 0.0]
    top = mbs.AddObject(items.ObjectRigidBody(mass=p.m, inertia=inertia, nodeNumber=node))
    weighed = mbs.AddMarker(items.MarkerBodyMass(bodyNumber=top))
    mbs.AddLoad(items.LoadMassProportional(markerNumber=weighed, loadVector=[0.0, 0.0, -p.g]))
    pivot = mbs.AddMarker(items.MarkerBodyPosition(bodyNumber=mbs.AddObject(items.ObjectGround())))
    tip = mbs.AddMarker(items.MarkerBodyPosition(bodyNumber=top, localPosition=[0.0, -p.l, 0.0]))
    mbs.AddObject(items.ObjectJointSpherical(markerNumbers=[pivot, tip]))
    mbs.Assemble()

    def state(q: np.ndarray, v: np.ndarray) -> State:
        q = unturned + q
        return q, np.concatenate([v[:3], 2.0 * (_from_left(q[3:]).T @ v[3:])[1:]])

    return Model(mbs, state, constrained=True)


def _from_left(p: np.ndarray) -> np.ndarray:
    """Return the matrix that multiplies quaternions (w, x, y, z) by `p` from the left."""
    w, x, y, z = p
    return np.array([[w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w]])
