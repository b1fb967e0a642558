"""Scenes as plane mechanisms of Exudyn's: rigid bodies and point masses joined by constraints and springs."""

from __future__ import annotations

from collections.abc import Callable
from math import asin, cos, sin, sqrt
from types import SimpleNamespace

import numpy as np
from exudyn import itemInterface as items
from exudyn_model import Model
from exudyn_plane import REST, Body, Place, Plane

RIGID_BODY = 3  # coordinates of each


def spring_pendulum(
    stiffness: float, damping: float, length: float, mass: float, g: float, q: np.ndarray, v: np.ndarray
) -> Model:
    """Return a point mass on a spring from the origin."""
    plane = Plane(g)
    mass = plane.point(mass, Place(q, v))
    plane.spring((plane.ground, mass), (REST, mass.centre), stiffness, damping, length)
    plane.mbs.Assemble()
    return Model(plane.mbs, lambda q, v: (q, v))


def slider_crank(p: SimpleNamespace, q: np.ndarray, v: np.ndarray) -> Model:
    """Return two rods and a point mass, eight coordinates, held by seven constraints."""
    plane = Plane(p.g)
    crank, joint = plane.rod(p.mc, p.Jc, p.r, REST, q[0], v[0])
    rod, _ = plane.rod(p.m, p.J, p.l, joint, q[1], v[1])
    piston = plane.point(p.mp, Place(np.array([q[2], 0.0]), np.array([v[2], 0.0])))
    plane.pin(REST, plane.ground, crank)
    plane.pin(joint, crank, rod)
    plane.pin(piston.centre, piston, rod)
    plane.prescribe(piston, 1)
    plane.mbs.Assemble()
    angles_and_x = [2, 5, 6]
    return Model(plane.mbs, lambda q, v: (q[angles_and_x], v[angles_and_x]), constrained=True)


def four_bar(p: SimpleNamespace, q: np.ndarray, v: np.ndarray) -> Model:
    """Return three slender rods, nine coordinates, held by eight constraints."""
    plane = Plane(p.g)
    far = Place(np.array([p.d, 0.0]), np.zeros(2))
    crank, first = plane.rod(p.ma, p.ma * p.a**2 / 12.0, p.a, REST, q[0], v[0])
    coupler, _ = plane.rod(p.mb, p.mb * p.b**2 / 12.0, p.b, first, q[1], v[1])
    rocker, second = plane.rod(p.mc, p.mc * p.c**2 / 12.0, p.c, far, q[2], v[2])
    plane.pin(REST, plane.ground, crank)
    plane.pin(first, crank, coupler)
    plane.pin(second, rocker, coupler)
    plane.pin(far, plane.ground, rocker)
    return _angles(plane, np.eye(3))


def n_four_bar(p: SimpleNamespace, q: np.ndarray, v: np.ndarray) -> Model:
    """Return N + 1 rockers and N couplers between them, 6 N + 3 coordinates, held by 6 N + 2 constraints."""
    plane = Plane(p.g)
    inertia = p.m * p.L**2 / 12.0
    before: tuple[Body, Place] | None = None
    # The coordinates are rocker 0, rocker 1, coupler 1, rocker 2, coupler 2, ...
    for k in range((len(q) + 1) // 2):
        i = max(0, 2 * k - 1)
        foot = Place(np.array([k * p.L, 0.0]), np.zeros(2))
        rocker, top = plane.rod(p.m, inertia, p.L, foot, q[i], v[i])
        plane.pin(foot, plane.ground, rocker)
        if before is not None:
            coupler, _ = plane.rod(p.m, inertia, p.L, before[1], q[i + 1], v[i + 1])
            plane.pin(before[1], before[0], coupler)
            plane.pin(top, rocker, coupler)
        before = rocker, top
    return _angles(plane, np.eye(len(q)))


def andrews(p: SimpleNamespace, q: np.ndarray, v: np.ndarray) -> Model:
    """Return seven rigid bodies, 21 coordinates, held by 20 constraints, with a spring and a torque.

    Names as in Hairer and Wanner, Solving Ordinary Differential Equations II, section VII.7.
    """
    # The angles of K1 to K7 from those of the scene, of which Theta, Phi and Omega are relative.
    absolute = np.eye(7)
    absolute[1, 0] = absolute[3, 4] = absolute[5, 6] = 1.0
    angle, rate = absolute @ q, absolute @ v
    plane = Plane(0.0)
    a, b = (Place(np.array(x), np.zeros(2)) for x in ((p.xa, p.ya), (p.xb, p.yb)))

    def add(k: int, pivot: Place, base: np.ndarray, x: float, y: float) -> Body:
        """Add body k with its centre of mass at (x, y) from `base`, in the body's axes."""
        mass, inertia = getattr(p, f"m{k}"), getattr(p, f"I{k}")
        return plane.body(mass, inertia, pivot, _at(base, angle[k - 1], x, y), angle[k - 1], rate[k - 1])

    k1 = add(1, REST, REST.x, p.ra, 0.0)
    crank = k1.place(_at(REST.x, angle[0], p.rr, 0.0))
    k2 = add(2, crank, crank.x, -p.da, 0.0)
    k3 = add(3, b, b.x, p.sb, -p.sa)
    k5 = add(5, a, a.x, p.ta, p.tb)
    e = k5.place(_at(a.x, angle[4], p.zt, 0.0))
    k4 = add(4, e, e.x, 0.0, p.ea - p.e)
    k7 = add(7, a, a.x, -p.ub, -p.ua)
    h = k7.place(_at(a.x, angle[6], 0.0, -p.u))
    k6 = add(6, h, h.x, p.zf - p.fa, 0.0)
    meeting = k3.place(_at(b.x, angle[2], 0.0, -p.ss))
    plane.pin(REST, plane.ground, k1)
    plane.pin(crank, k1, k2)
    plane.pin(b, plane.ground, k3)
    plane.pin(a, plane.ground, k5, k7)
    plane.pin(e, k5, k4)
    plane.pin(h, k7, k6)
    plane.pin(meeting, k3, k2, k4, k6)
    hook = Place(np.array([p.xc, p.yc]), np.zeros(2))
    pulled = k3.place(_at(b.x, angle[2], p.sd, -p.sc))
    plane.spring((plane.ground, k3), (hook, pulled), p.c0, 0.0, p.l0)
    turned = plane.mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=k1.node, coordinate=2))
    plane.mbs.AddLoad(items.LoadCoordinate(markerNumber=turned, load=p.mom))
    return _angles(plane, np.linalg.inv(absolute)[:, [0, 1, 2, 4, 3, 6, 5]])  # as the bodies were added


def car_axis(p: SimpleNamespace, q: np.ndarray, v: np.ndarray) -> Model:
    """Return two masses on springs and the line between the wheels, a body that is turned as the road tells.

    The left wheel is its pivot, the right wheel a point of it at the distance L, and the left mass slides along its
    y axis. Turned by the road alone, neither body's moment of inertia does anything: both are 1.
    """
    plane = Plane(p.g)
    line = plane.body(0.0, 1.0, REST, REST.x, 0.0, p.r * p.w / p.L)
    wheel = line.place(np.array([p.L, 0.0]))
    mass = p.M * p.eps**2 / 2.0
    left = plane.body(mass, 1.0, Place(q[:2], v[:2]), q[:2], 0.0, line.rate)
    right = plane.point(mass, Place(q[2:], v[2:]))
    plane.pin(REST, plane.ground, line)
    plane.prescribe(line, 2, **_road(p.r / p.L, p.w))
    plane.slide(line, left, [0.0, 1.0, 0.0])
    plane.mbs.AddObject(
        items.ObjectConnectorDistance(
            markerNumbers=[plane.marker(body, body.centre) for body in (left, right)], distance=p.L
        )
    )
    plane.spring((plane.ground, left), (REST, left.centre), 1.0, 0.0, p.L0)
    plane.spring((line, right), (wheel, right.centre), 1.0, 0.0, p.L0)
    plane.mbs.Assemble()
    places = [RIGID_BODY, RIGID_BODY + 1, 2 * RIGID_BODY, 2 * RIGID_BODY + 1]
    return Model(plane.mbs, lambda q, v: (q[places], v[places]), constrained=True)


def _road(slope: float, w: float) -> dict[str, Callable]:
    """Return the angle between the wheels over time and its rate, as user functions of Exudyn's."""

    def angle(mbs, t, number, offset):
        return asin(slope * sin(w * t))

    def rate(mbs, t, number, offset):
        return slope * w * cos(w * t) / sqrt(1.0 - (slope * sin(w * t)) ** 2)

    return {"offsetUserFunction": angle, "offsetUserFunction_t": rate}


def _at(base: np.ndarray, angle: float, x: float, y: float) -> np.ndarray:
    """Return the point (x, y) of a body that is turned by `angle`, from the point `base` of it."""
    c, s = np.cos(angle), np.sin(angle)
    return base + np.array([c * x - s * y, s * x + c * y])


def _angles(plane: Plane, coordinates: np.ndarray) -> Model:
    """Return a system of rigid bodies; `coordinates` times their angles are the scene's coordinates."""
    plane.mbs.Assemble()
    own = slice(RIGID_BODY - 1, None, RIGID_BODY)
    return Model(plane.mbs, lambda q, v: (coordinates @ q[own], coordinates @ v[own]), constrained=True)
