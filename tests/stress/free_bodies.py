"""Bodies on joints, in fields, under loads and springs, with loops closed, against free-body diagrams.

The reference knows each body by its centre, quaternion, velocity and turning in world axes. A joint is a list of rows:
a place of one body along an axis of another, or two axes at right angles; accelerations and joint forces follow from
Newton's and Euler's equations with the second derivatives of these rows. Rates at the start are derivatives of poses by
a complex step. Places, velocities, accelerations, turning, powers, and what joints do to their children are compared as
sensors tell them.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from symgen import Model
from symgen.runtime.integrate.methods import METHODS, find_method

from .judging import attempt, judge_end
from .models import made
from .scenario import RIGHT, Outcome, Scenario

_CASES = 3  # with each method
_RTOLS = (1e-5, 1e-7, 1e-9)
_STEP = 1e-20  # of derivatives in the complex plane
_LEAST = 1e-2  # of a magnitude that counts as motion
_LOST = 1e-4  # between two references
_RANK = 1e-3  # of the least singular value of the rows
_X, _Y, _Z = np.eye(3)
_FREEDOMS = {
    "revolute": 1, "prismatic": 1, "screw": 1, "universal": 2, "cylindrical": 2, "planar": 3, "spherical": 3,
    "free": 6, "gimbal": 3, "floating": 6,
}  # fmt: skip
_TYPES = tuple(_FREEDOMS)
_HELD = {
    "revolute": 5, "prismatic": 5, "screw": 5, "universal": 4, "cylindrical": 4, "planar": 3, "spherical": 3,
    "fixed": 6,
}  # fmt: skip


def _cross(a: np.ndarray) -> np.ndarray:
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def about(axis: np.ndarray, angle: complex) -> np.ndarray:
    """Return the rotation about an axis of length 1."""
    k = _cross(axis)
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * (k @ k)


def of_rpy(rpy: np.ndarray) -> np.ndarray:
    """Return the rotation by roll, pitch and yaw."""
    return about(_Z, rpy[2]) @ about(_Y, rpy[1]) @ about(_X, rpy[0])


def to_rpy(R: np.ndarray) -> np.ndarray:
    """Return roll, pitch and yaw."""
    return np.array([np.arctan2(R[2, 1], R[2, 2]), np.arcsin(-R[2, 0]), np.arctan2(R[1, 0], R[0, 0])])


def of_quaternion(q: np.ndarray) -> np.ndarray:
    """Return the rotation of a quaternion, which need not be of length 1."""
    w, v = q[0], q[1:]
    return ((w * w - v @ v) * np.eye(3) + 2 * np.outer(v, v) + 2 * w * _cross(v)) / (w * w + v @ v)


def turned(q: np.ndarray, w: np.ndarray) -> np.ndarray:
    """Return how a quaternion changes, by the turning in its own axes."""
    return 0.5 * np.concatenate([[-w @ q[1:]], q[0] * w + np.cross(q[1:], w)])


def perpendicular(n: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return two directions across one."""
    a = np.cross(n, np.eye(3)[np.argmin(np.abs(n))])
    a /= np.linalg.norm(a)
    return a, np.cross(n, a)


@dataclass
class Row:
    """A place of B along `a`, which is fixed in A, less `lead` times the angle; or `a` in A across `b` in B."""

    A: int
    B: int
    a: np.ndarray
    b: np.ndarray
    at: tuple[np.ndarray, np.ndarray] | None = None
    lead: float = 0.0


def rows(
    kind: str, A: int, B: int, frames: tuple, axis: np.ndarray, axis2: np.ndarray, pitch: float
) -> list[Row]:
    """Return what a joint between two frames holds; frames are (place, rotation) in the bodies."""
    (pa, Ra), (pb, Rb) = frames
    n, m = Ra @ axis, Rb @ axis
    # The same two directions of the joint frame in both bodies.
    s, t = perpendicular(axis)
    across = [Row(A, B, n, Rb @ s), Row(A, B, n, Rb @ t)]
    off = [Row(A, B, Ra @ u, _X, (pa, pb)) for u in (s, t)]
    along = Row(A, B, n, m, (pa, pb))
    one = [*off, along]
    if kind == "revolute":
        return [*one, *across]
    if kind == "prismatic":
        return [*off, *across, Row(A, B, Ra @ s, Rb @ t)]
    if kind == "screw":
        return [*off, Row(A, B, n, m, (pa, pb), pitch / (2 * np.pi)), *across]
    if kind == "universal":
        return [*one, Row(A, B, n, Rb @ axis2)]
    if kind == "cylindrical":
        return [*off, *across]
    if kind == "planar":
        return [along, *across]
    if kind in ("spherical", "gimbal"):
        return one
    if kind == "fixed":
        return [*one, *across, Row(A, B, Ra @ s, Rb @ t)]
    return []


@dataclass
class Link:
    """A body and the joint that places it."""

    name: str
    mass: float
    com: np.ndarray
    inertia: np.ndarray
    parent: int
    kind: str
    xyz: np.ndarray
    rpy: np.ndarray
    axis: np.ndarray
    axis2: np.ndarray
    pitch: float
    sequence: str
    start: np.ndarray
    rate: np.ndarray
    stiffness: float = 0.0
    rest: float = 0.0
    damping: float = 0.0
    armature: float = 0.0

    def pose(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return where the child is in the joint frame."""
        kind, n, zero = self.kind, self.axis, np.zeros(3)
        if kind == "revolute":
            return zero, about(n, q[0])
        if kind == "prismatic":
            return n * q[0], np.eye(3)
        if kind == "screw":
            return n * q[0] * self.pitch / (2 * np.pi), about(n, q[0])
        if kind == "universal":
            return zero, about(n, q[0]) @ about(self.axis2, q[1])
        if kind == "cylindrical":
            return n * q[1], about(n, q[0])
        if kind == "planar":
            s, t = self.plane()
            return s * q[0] + t * q[1], about(n, q[2])
        if kind == "spherical":
            return zero, of_quaternion(q)
        if kind == "free":
            return q[:3], of_quaternion(q[3:])
        place, angles = (zero, q) if kind == "gimbal" else (q[:3], q[3:])
        R = np.eye(3)
        for letter, angle in zip(self.sequence, angles, strict=True):
            R = R @ about(np.eye(3)["xyz".index(letter)], angle)
        return place, R

    def plane(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the directions of a planar joint with its axis along z."""
        return _X, _Y

    def moved(self) -> np.ndarray:
        """Return derivatives of the coordinates by time at the start."""
        if self.kind == "spherical":
            return turned(self.start, self.rate)
        if self.kind == "free":
            return np.concatenate([self.rate[:3], turned(self.start[3:], self.rate[3:])])
        return self.rate


@dataclass
class Load:
    """A force at a point of a body, or a torque on it; `frame` is a body or world; it goes as cos(speed t)."""

    body: int
    at: np.ndarray | None
    value: np.ndarray
    speed: float
    frame: int
    reaction: int | None


@dataclass
class Spring:
    """Between points of two bodies."""

    A: int
    B: int
    pa: np.ndarray
    pb: np.ndarray
    stiffness: float
    length: float
    damping: float
    preload: float


@dataclass(eq=False)
class Rotor:
    """It spins in a body under a torque that goes as cos(speed t): its momentum about the axis is known."""

    body: int
    axis: np.ndarray
    inertia: float
    rate: float
    torque: float
    speed: float

    def momentum(self, t: float, turning: float) -> float:
        """Return it, where the body turned about the axis so fast at the start."""
        return self.inertia * (self.rate + turning) + self.torque * float(np.sin(self.speed * t)) / self.speed


@dataclass
class Case:
    """Bodies, and all that acts on them."""

    links: list[Link]
    gravity: np.ndarray
    potential: tuple[float, float, float] | None = None
    attractor: tuple[np.ndarray, float, bool] | None = None
    constant: float = 0.0
    loads: list[Load] = field(default_factory=list)
    springs: list[Spring] = field(default_factory=list)
    closure: dict[str, Any] | None = None
    rotors: list[Rotor] = field(default_factory=list)

    def __post_init__(self):
        self.joints = []
        for k, link in enumerate(self.links):
            parent = self.links[link.parent].com if link.parent >= 0 else np.zeros(3)
            frames = ((link.xyz - parent, of_rpy(link.rpy)), (-link.com, np.eye(3)))
            self.joints.append(rows(link.kind, link.parent, k, frames, link.axis, link.axis2, link.pitch))
        self.rows = [row for joint in self.joints for row in joint]
        if self.closure is not None:
            told = self.closure
            A, B = told["bodies"]
            frames = tuple(
                (at - (self.links[k].com if k >= 0 else 0.0), of_rpy(rpy))
                for k, (at, rpy) in zip((A, B), told["frames"], strict=True)
            )
            self.rows += rows(told["kind"], A, B, frames, told["axis"], told["axis2"], told["pitch"])
        self.seen_from, self._turned = len(self.links) - 2, None
        self.turning = [k for k, link in enumerate(self.links) if link.kind in ("revolute", "screw")]

    # ---- the start

    def poses(self, q: list[np.ndarray]) -> tuple[list[np.ndarray], list[np.ndarray]]:
        """Return origins and rotations of all bodies' frames."""
        places, rotations = [], []
        for link, values in zip(self.links, q, strict=True):
            p, R = (
                (places[link.parent], rotations[link.parent])
                if link.parent >= 0
                else (np.zeros(3), np.eye(3))
            )
            place, turn = link.pose(values)
            origin = of_rpy(link.rpy)
            places.append(p + R @ (link.xyz + origin @ place))
            rotations.append(R @ origin @ turn)
        return places, rotations

    def start(self) -> np.ndarray:
        """Return centres, quaternions, velocities, turnings, and the angles that springs need."""
        places, rotations = self.poses([link.start + 1j * _STEP * link.moved() for link in self.links])
        state = []
        for link, p, R in zip(self.links, places, rotations, strict=True):
            c = p + R @ link.com
            of_R = R.imag / _STEP @ R.real.T
            state += [c.real, _quaternion(R.real), c.imag / _STEP, [of_R[2, 1], of_R[0, 2], of_R[1, 0]]]
        state += [[self.links[k].start[0]] for k in self.turning]
        return np.concatenate(state)

    def solvable(self) -> bool:
        """Whether rows are independent where it starts."""
        c, q, v, w, _ = self.split(self.start())
        G = np.zeros((len(self.rows), 6 * len(self.links)))
        for i, row in enumerate(self.rows):
            self._row(row, c, [of_quaternion(one) for one in q], v, w, G[i])
        return not self.rows or np.linalg.svd(G, compute_uv=False)[-1] > _RANK

    # ---- the motion

    def split(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return centres, quaternions, velocities, turnings and angles."""
        n = len(self.links)
        own = y[: 13 * n].reshape(n, 13)
        return own[:, :3], own[:, 3:7], own[:, 7:10], own[:, 10:], y[13 * n :]

    def body(self, k: int, c: np.ndarray, R: list, v: np.ndarray, w: np.ndarray) -> tuple:
        """Return a body's, or the world's, centre, rotation, velocity and turning."""
        return (c[k], R[k], v[k], w[k]) if k >= 0 else (np.zeros(3), np.eye(3), np.zeros(3), np.zeros(3))

    def accelerations(self, t: float, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return accelerations of all bodies, multipliers, and what acts in joints besides (6 for each child)."""
        n = len(self.links)
        c, q, v, w, angles = self.split(y)
        R = [of_quaternion(one) for one in q]
        M, f = np.zeros((6 * n, 6 * n)), np.zeros(6 * n)
        for k, link in enumerate(self.links):
            tensor = R[k] @ link.inertia @ R[k].T
            M[6 * k : 6 * k + 3, 6 * k : 6 * k + 3] = link.mass * np.eye(3)
            M[6 * k + 3 : 6 * k + 6, 6 * k + 3 : 6 * k + 6] = tensor
            f[6 * k : 6 * k + 3] += link.mass * self.gravity
            f[6 * k + 3 : 6 * k + 6] -= np.cross(w[k], tensor @ w[k])
            self._fields(k, link, c, tensor, f)
        for load in self.loads:
            value = (R[load.frame] if load.frame >= 0 else np.eye(3)) @ load.value * np.cos(load.speed * t)
            cb, Rb, _, _ = self.body(load.body, c, R, v, w)
            for k, sign in ((load.body, 1.0), (load.reaction, -1.0)):
                if k is None or k < 0:
                    continue
                if load.at is None:
                    f[6 * k + 3 : 6 * k + 6] += sign * value
                else:
                    place = cb + Rb @ (load.at - self.links[load.body].com)
                    push(f, k, sign * value, place - c[k])
        for spring in self.springs:
            pull, arms, _ = self._spring(spring, c, R, v, w)
            push(f, spring.A, pull, arms[0])
            push(f, spring.B, -pull, arms[1])
        for rotor in self.rotors:
            k, axis = rotor.body, R[rotor.body] @ rotor.axis
            torque = rotor.torque * np.cos(rotor.speed * t)
            f[6 * k + 3 : 6 * k + 6] -= torque * axis + self._momentum(rotor, t) * np.cross(w[k], axis)
        own = np.zeros((n, 6))
        for k, link in enumerate(self.links):
            self._in_joint(k, link, c, R, v, w, angles, f, own)
            if link.armature:
                _, g, bias = self._rotor(k, link, R, w, len(f))
                M += link.armature * np.outer(g, g)
                f -= link.armature * g * bias
        G, gamma = np.zeros((len(self.rows), 6 * n)), np.zeros(len(self.rows))
        for i, row in enumerate(self.rows):
            gamma[i] = self._row(row, c, R, v, w, G[i])
        m = len(self.rows)
        K = np.block([[M, -G.T], [G, np.zeros((m, m))]])
        found = np.linalg.solve(K, np.concatenate([f, gamma]))
        for k, link in enumerate(self.links):
            if link.armature:
                axis, g, bias = self._rotor(k, link, R, w, len(f))
                own[k, 3:] -= link.armature * (g @ found[: len(f)] + bias) * axis
        return found[: 6 * n], found[6 * n :], own

    def _spring(self, spring: Spring, c, R, v, w) -> tuple[np.ndarray, list[np.ndarray], float]:
        """Return with what a spring pulls its first end, arms of both ends, and the power that it gives."""
        places, speeds, arms = [], [], []
        for k, at in ((spring.A, spring.pa), (spring.B, spring.pb)):
            cb, Rb, vb, wb = self.body(k, c, R, v, w)
            arms.append(Rb @ (at - (self.links[k].com if k >= 0 else 0.0)))
            places.append(cb + arms[-1])
            speeds.append(vb + np.cross(wb, arms[-1]))
        d, rate = places[1] - places[0], speeds[1] - speeds[0]
        length = np.linalg.norm(d)
        e = d / length
        size = spring.stiffness * (length - spring.length) + spring.preload + spring.damping * (e @ rate)
        return size * e, arms, -size * float(e @ rate)

    def _momentum(self, rotor: Rotor, t: float) -> float:
        if self._turned is None:
            _, q, _, w, _ = self.split(self.start())
            self._turned = [of_quaternion(q[r.body]) @ r.axis @ w[r.body] for r in self.rotors]
        return rotor.momentum(t, self._turned[self.rotors.index(rotor)])

    def _fields(self, k: int, link: Link, c: np.ndarray, tensor: np.ndarray, f: np.ndarray) -> None:
        force, torque = np.zeros(3), np.zeros(3)
        if self.potential is not None:
            a, b, s = self.potential  # a x²/2 + b sin(y) + s x z
            x, y, z = c[k]
            force -= link.mass * np.array([a * x + s * z, b * np.cos(y), s * x])
        if self.attractor is not None:
            at, mu, gradient = self.attractor
            r = c[k] - at
            size = np.linalg.norm(r)
            e = r / size
            force -= link.mass * mu * e / size**2
            if gradient:
                # V = -mu/(2 r³) (tr I - 3 e I e)
                shape = np.trace(tensor) - 3 * e @ tensor @ e
                of_shape = -6 * (tensor @ e - e * (e @ tensor @ e)) / size
                force += mu / 2 * (-3 * e / size**4 * shape + of_shape / size**3)
                torque += 3 * mu / size**3 * np.cross(e, tensor @ e)
        if self.constant:
            for j, other in enumerate(self.links):
                if j != k:
                    r = c[j] - c[k]
                    force += self.constant * link.mass * other.mass * r / np.linalg.norm(r) ** 3
        f[6 * k : 6 * k + 3] += force
        f[6 * k + 3 : 6 * k + 6] += torque

    def _in_joint(self, k, link, c, R, v, w, angles, f, own) -> None:
        """Add springs and dampers of a joint: opposite on its parent."""
        if not (link.stiffness or link.damping):
            return
        A = link.parent
        ca, Ra, va, wa = self.body(A, c, R, v, w)
        n = Ra @ of_rpy(link.rpy) @ link.axis
        place = c[k] - R[k] @ link.com
        force, torque = np.zeros(3), np.zeros(3)
        if link.kind in ("revolute", "screw"):
            turn = n @ (w[k] - wa)
            torque = -n * (link.stiffness * (angles[self.turning.index(k)] - link.rest) + link.damping * turn)
        elif link.kind == "prismatic":
            arm = Ra @ (link.xyz - (self.links[A].com if A >= 0 else 0.0))
            d = place - ca - arm
            rate = v[k] - np.cross(w[k], R[k] @ link.com) - va - np.cross(wa, place - ca)
            force = -n * (link.stiffness * (n @ d - link.rest) + link.damping * (n @ rate))
        elif link.kind == "spherical":
            torque = -link.damping * (w[k] - wa)
        for body, sign in ((k, 1.0), (A, -1.0)):
            if body >= 0:
                push(f, body, sign * force, place - c[body])
                f[6 * body + 3 : 6 * body + 6] += sign * torque
        own[k, :3] = force
        own[k, 3:] = torque + np.cross(place - c[k], force)

    def _rotor(self, k: int, link: Link, R: list, w: np.ndarray, size: int) -> tuple:
        """Return the axis of a hinge, its rate by all velocities and turnings, and the rest of its acceleration."""
        A = link.parent
        RA, wa = (R[A], w[A]) if A >= 0 else (np.eye(3), np.zeros(3))
        n = RA @ of_rpy(link.rpy) @ link.axis
        g = np.zeros(size)
        put(g, k, np.zeros(3), n)
        put(g, A, np.zeros(3), -n)
        return n, g, np.cross(wa, n) @ (w[k] - wa)

    def _row(self, row: Row, c, R, v, w, g: np.ndarray) -> float:
        """Write a row's derivatives by velocities and turnings; return what its second derivative lacks."""
        ca, Ra, va, wa = self.body(row.A, c, R, v, w)
        cb, Rb, vb, wb = self.body(row.B, c, R, v, w)
        u = Ra @ row.a
        if row.at is None:
            b = Rb @ row.b
            put(g, row.A, np.zeros(3), np.cross(u, b))
            put(g, row.B, np.zeros(3), np.cross(b, u))
            ua, ub = np.cross(wa, u), np.cross(wb, b)
            return -(np.cross(wa, ua) @ b + u @ np.cross(wb, ub) + 2 * ua @ ub)
        ra, rb = Ra @ row.at[0], Rb @ row.at[1]
        d = cb + rb - ca - ra
        ua = np.cross(wa, u)
        of_d = vb + np.cross(wb, rb) - va - np.cross(wa, ra)
        put(g, row.A, -u, np.cross(u, ra) + np.cross(u, d) + row.lead * u)
        put(g, row.B, u, np.cross(rb, u) - row.lead * u)
        bias = u @ np.cross(wb, np.cross(wb, rb)) - u @ np.cross(wa, np.cross(wa, ra))
        bias += 2 * ua @ of_d + np.cross(wa, ua) @ d
        return -bias + row.lead * ua @ (wb - wa)

    def motion(self, t: float, y: np.ndarray) -> np.ndarray:
        """Return what the state changes by."""
        n = len(self.links)
        _, q, v, w, _ = self.split(y)
        a = self.accelerations(t, y)[0].reshape(n, 6)
        out = np.empty((n, 13))
        out[:, :3], out[:, 7:] = v, a
        for k in range(n):
            out[k, 3:7] = 0.5 * np.concatenate(
                [[-w[k] @ q[k, 1:]], q[k, 0] * w[k] + np.cross(w[k], q[k, 1:])]
            )
        rates = []
        for k in self.turning:
            link = self.links[k]
            RA = of_quaternion(q[link.parent]) if link.parent >= 0 else np.eye(3)
            wa = w[link.parent] if link.parent >= 0 else np.zeros(3)
            rates.append(RA @ of_rpy(link.rpy) @ link.axis @ (w[k] - wa))
        return np.concatenate([out.ravel(), rates])

    # ---- what is compared

    def sensors(self, t: float, y: np.ndarray) -> np.ndarray:
        """Return what `tell` names, three numbers each."""
        n = len(self.links)
        c, q, v, w, _ = self.split(y)
        a, multipliers, own = self.accelerations(t, y)
        a = a.reshape(n, 6)
        R = [of_quaternion(one) for one in q]
        G = np.zeros((len(self.rows), 6 * n))
        for i, row in enumerate(self.rows):
            self._row(row, c, R, v, w, G[i])
        seen, first = [], 0
        for k, link in enumerate(self.links):
            seen += [c[k], c[k] + R[k] @ (_X - link.com), v[k], w[k], a[k, :3], a[k, 3:]]
            last = first + len(self.joints[k])
            if last > first or own[k].any():
                of_rows = G[first:last, 6 * k : 6 * k + 6].T @ multipliers[first:last] + own[k]
                RA = R[link.parent] if link.parent >= 0 else np.eye(3)
                ca = c[link.parent] - RA @ self.links[link.parent].com if link.parent >= 0 else np.zeros(3)
                at = ca + RA @ link.xyz
                axes = (RA @ of_rpy(link.rpy)).T
                seen += [axes @ of_rows[:3], axes @ (of_rows[3:] + np.cross(c[k] - at, of_rows[:3]))]
            first = last
        last = len(self.links) - 1
        ca, Ra = self.body(self.seen_from, c, R, v, w)[:2]
        com = self.links[self.seen_from].com if self.seen_from >= 0 else np.zeros(3)
        tip = R[last] @ (_X - self.links[last].com)
        seen += [Ra.T @ (c[last] + tip - ca) + com, Ra.T @ (v[last] + np.cross(w[last], tip))]
        seen.append(np.array([np.linalg.norm(c[last] + tip - ca + Ra @ com), 0.0, 0.0]))
        seen.append(np.cos(angles_of(Ra.T @ R[last])))
        seen += [np.array([self._spring(s, c, R, v, w)[2], 0.0, 0.0]) for s in self.springs]
        for rotor in self.rotors:
            turns = self._momentum(rotor, t) / rotor.inertia - R[rotor.body] @ rotor.axis @ w[rotor.body]
            seen.append(np.array([turns, 0.0, 0.0]))
        if self.closure is not None:
            kind = self.closure["kind"]
            n_force = {"prismatic": 2, "screw": 2, "cylindrical": 2, "planar": 1}.get(kind, 3)
            force = np.linalg.norm(multipliers[first : first + n_force])
            seen.append(np.array([force, 0.0, 0.0]) if kind != "screw" else np.zeros(3))
        return np.array(seen)

    def model(self) -> tuple[Model, list[list[str]]]:
        """Return it as a model, and names of the outputs that say what `sensors` does."""
        of_place = "{}*here_x^2/2 + {}*sin(here_y) + {}*here_x*here_z"
        g = {} if self.potential is None else {"potential": of_place.format(*self.potential)}
        if self.constant:
            g["constant"] = self.constant
        m = Model("free_bodies")
        m.gravity(*map(float, self.gravity), **g)
        seen = self.describe(m)
        if self.attractor is not None:
            at, mu, gradient = self.attractor
            m.attractor("sun", at=list(map(float, at)), mu=mu, gradient=gradient)
        return m, seen

    def placed(self, places: list[tuple[np.ndarray, np.ndarray]]) -> tuple[Model, list[list[str]]]:
        """Return it as an assembly within others, each placed and turned; without fields.

        Sensors along world axes have their values in the assembly's own world.
        """
        m, turn, parts = Model("placed"), np.eye(3), []
        for _, rpy in places:
            parts.append((parts[-1] if parts else m).assembly(f"part{len(parts)}"))
            turn = turn @ of_rpy(rpy)
        seen = self.describe(parts[-1])
        for k in reversed(range(len(parts))):
            xyz, rpy = (list(map(float, numbers)) for numbers in places[k])
            (parts[k - 1] if k else m).use("u", f"part{k}", xyz=xyz, rpy=rpy)
        m.gravity(*map(float, turn @ self.gravity))
        within = "u." * len(parts)

        def inside(name: str) -> str:
            return f"dot({within}{name[4:]}" if name.startswith("dot(") else within + name

        return m, [[inside(name) for name in group] for group in seen]

    def describe(self, m: Model) -> list[list[str]]:
        """Say all but what gravity does; return names of the outputs."""
        names = [link.name for link in self.links]
        named = lambda k: names[k] if k >= 0 else "world"  # noqa: E731
        for link in self.links:
            tensor = link.inertia
            six = [tensor[0, 0], tensor[1, 1], tensor[2, 2], tensor[0, 1], tensor[0, 2], tensor[1, 2]]
            m.body(link.name, mass=link.mass, com=tuple(map(float, link.com)), inertia=tuple(map(float, six)))
        for k, link in enumerate(self.links):
            told: dict[str, Any] = {}
            if link.kind in ("gimbal", "floating"):
                told["sequence"] = link.sequence
            if link.kind in ("revolute", "prismatic", "screw", "universal", "cylindrical", "planar"):
                told["axis"] = list(map(float, link.axis))
            if link.kind == "universal":
                told["axis2"] = list(map(float, link.axis2))
            if link.kind == "screw":
                told["pitch"] = link.pitch
            for key in ("stiffness", "rest", "damping", "armature"):
                if getattr(link, key):
                    told[key] = getattr(link, key)
            one = len(link.rate) == 1
            told["start"] = float(link.start[0]) if one else list(map(float, link.start))
            told["rate"] = float(link.rate[0]) if one else list(map(float, link.rate))
            if self.closure is not None:
                told["guess"], told["rate_guess"] = told.pop("start"), told.pop("rate")
            origin = {"xyz": list(map(float, link.xyz)), "rpy": list(map(float, link.rpy))}
            m.joint(
                f"joint{k}", type=link.kind, child=link.name, parent=named(link.parent), origin=origin, **told
            )
        for i, load in enumerate(self.loads):
            told = {} if load.frame < 0 else {"frame": named(load.frame)}
            if load.reaction is not None:
                told["reaction"] = named(load.reaction)
            value = [f"{x!r}*cos({load.speed!r}*t)" for x in map(float, load.value)]
            if load.at is None:
                m.load(f"load{i}", body=named(load.body), torque=value, **told)
            else:
                m.point(f"at{i}", named(load.body), list(map(float, load.at)))
                m.load(f"load{i}", point=f"at{i}", force=value, **told)
        for i, s in enumerate(self.springs):
            m.point(f"from{i}", named(s.A), list(map(float, s.pa)))
            m.point(f"to{i}", named(s.B), list(map(float, s.pb)))
            m.spring(
                f"spring{i}", points=[f"from{i}", f"to{i}"], stiffness=s.stiffness, length=s.length,
                damping=s.damping, preload=s.preload,
            )  # fmt: skip
        for i, rotor in enumerate(self.rotors):
            told = {"inertia": rotor.inertia, "axis": list(map(float, rotor.axis)), "rate": rotor.rate}
            m.rotor(f"rotor{i}", body=named(rotor.body), **told)
            m.force(f"rotor{i}", f"{rotor.torque!r}*cos({rotor.speed!r}*t)")
        if self.closure is not None:
            self._close(m, named)
        return self._tell(m)

    def _close(self, m: Model, named: Any) -> None:
        told = self.closure
        for i, (k, (at, rpy)) in enumerate(zip(told["bodies"], told["frames"], strict=True)):
            m.frame(f"frame{i}", named(k), at=list(map(float, at)), rpy=list(map(float, rpy)))
        more: dict[str, Any] = {}
        if told["kind"] not in ("spherical", "fixed"):
            more["axis"] = list(map(float, told["axis"]))
        if told["kind"] == "universal":
            more["axis2"] = list(map(float, told["axis2"]))
        if told["kind"] == "screw":
            more["pitch"] = told["pitch"]
        m.closure("loop", type=told["kind"], frames=["frame0", "frame1"], **more)

    def _tell(self, m: Model) -> list[list[str]]:
        seen = []

        def of(name: str, sensor: str, words: Any) -> None:
            seen.append([])
            for word in words:
                m.output(f"{name}_{word}", sensor.format(word))
                seen[-1].append(f"{name}_{word}")

        for k, link in enumerate(self.links):
            m.point(f"tip{k}", link.name, [1.0, 0.0, 0.0])
            of(f"place{k}", f"position({link.name}, {{}})", "xyz")
            of(f"top{k}", f"position(tip{k}, {{}})", "xyz")
            of(f"velocity{k}", f"velocity({link.name}, {{}})", "xyz")
            of(f"turning{k}", f"angular_velocity({link.name}, {{}})", "xyz")
            of(f"acceleration{k}", f"acceleration({link.name}, {{}})", "xyz")
            of(f"alpha{k}", f"angular_acceleration({link.name}, {{}})", "xyz")
            if self.joints[k]:
                of(f"force{k}", f"reaction(joint{k}, {{}})", ("fx", "fy", "fz"))
                of(f"torque{k}", f"reaction(joint{k}, {{}})", ("tx", "ty", "tz"))
        last = len(self.links) - 1
        whence = self.links[self.seen_from].name if self.seen_from >= 0 else "world"
        of("seen", f"position(tip{last}, {{}}, {whence})", "xyz")
        of("moves", f"velocity(tip{last}, {{}}, {whence})", "xyz")
        m.frame("here", whence)
        of("apart", f"distance(tip{last}, {{}})", ["here"])
        of("angle", f"cos(angle({whence}, {self.links[last].name}, {{}}))", "xyz")
        for i in range(len(self.springs)):
            of(f"power{i}", f"power(spring{i}{{}})", [""])
        seen += [[f"dot(rotor{i})"] for i in range(len(self.rotors))]
        if self.closure is not None:
            if self.closure["kind"] == "screw":
                seen.append([])
            else:
                m.output("loop_force", "abs(reaction(loop))")
                seen.append(["loop_force"])
        return seen


def angles_of(R: np.ndarray) -> np.ndarray:
    """Return the angles of successive rotations about x, y and z."""
    return np.array(
        [np.arctan2(-R[1, 2], R[2, 2]), np.arcsin(np.clip(R[0, 2], -1, 1)), np.arctan2(-R[0, 1], R[0, 0])]
    )


def push(f: np.ndarray, k: int, force: np.ndarray, arm: np.ndarray) -> None:
    """Add a force at an arm from the centre of a body; the world does not mind."""
    if k >= 0:
        f[6 * k : 6 * k + 3] += force
        f[6 * k + 3 : 6 * k + 6] += np.cross(arm, force)


def put(g: np.ndarray, k: int, of_v: np.ndarray, of_w: np.ndarray) -> None:
    """Add to a row what belongs to a body."""
    if k >= 0:
        g[6 * k : 6 * k + 3] += of_v
        g[6 * k + 3 : 6 * k + 6] += of_w


def _quaternion(R: np.ndarray) -> np.ndarray:
    """Return the quaternion of a rotation, by the largest of its elements."""
    K = np.array([
        [R[0, 0] + R[1, 1] + R[2, 2], 0, 0, 0],
        [R[2, 1] - R[1, 2], R[0, 0] - R[1, 1] - R[2, 2], 0, 0],
        [R[0, 2] - R[2, 0], R[1, 0] + R[0, 1], R[1, 1] - R[0, 0] - R[2, 2], 0],
        [R[1, 0] - R[0, 1], R[2, 0] + R[0, 2], R[2, 1] + R[1, 2], R[2, 2] - R[0, 0] - R[1, 1]],
    ])  # fmt: skip
    _, vectors = np.linalg.eigh(K)  # it looks at the lower triangle
    return vectors[:, -1]


def _number(r: np.random.Generator, low: float, high: float) -> float:
    return round(float(r.uniform(low, high)), 3)


def _vector(r: np.random.Generator, size: float) -> np.ndarray:
    return np.round(r.normal(0.0, size, 3), 3)


def _unit(r: np.random.Generator) -> np.ndarray:
    if r.random() < 0.4:
        return np.eye(3)[r.integers(3)] * float(r.choice([-1.0, 1.0]))
    a = r.normal(size=3)
    return a / np.linalg.norm(a)


def _link(r: np.random.Generator, k: int, kind: str, at_rest: bool) -> Link:
    mass = _number(r, 0.3, 4.0)
    a = r.normal(size=(3, 3)) * 0.25
    tensor = mass * (np.trace(a @ a.T) * np.eye(3) - a @ a.T + 0.02 * np.eye(3))
    axis = _Z if kind == "planar" else _unit(r)
    axis2 = perpendicular(axis)[0]
    n = _FREEDOMS[kind]
    start, rate = np.round(r.normal(0.0, 0.6, n), 3), np.round(r.normal(0.0, 2.0, n), 3)
    if kind in ("spherical", "free"):
        q = r.normal(size=4)
        q /= np.linalg.norm(q)
        start = q if kind == "spherical" else np.concatenate([start[:3], q])
    sequence = str(r.choice(["zxz", "zyx", "xyz", "yxy"]))
    if kind in ("gimbal", "floating"):
        # away from where the outer axes fold onto each other
        start[-2] = _number(r, 0.9, 2.2) if sequence[0] == sequence[2] else _number(r, -0.5, 0.5)
        rate[-3:] *= 0.4
    link = Link(
        f"body{k}", mass, _vector(r, 0.3), tensor, int(r.integers(-1, k)) if k else -1, kind, _vector(r, 0.4),
        np.round(r.uniform(-1.4, 1.4, 3), 3), axis, axis2, _number(r, -0.5, 0.5), sequence, start,
        0.0 * rate if at_rest else rate,
    )  # fmt: skip
    if kind in ("revolute", "screw", "prismatic") and r.random() < 0.5:
        link.stiffness, link.rest, link.damping = _number(r, 0, 40), _number(r, -1, 1), _number(r, 0, 2)
    if kind == "revolute" and r.random() < 0.3:
        link.armature = _number(r, 0.01, 0.5)
    if kind == "spherical" and r.random() < 0.5:
        link.damping = _number(r, 0, 1)
    return link


def _closed(r: np.random.Generator, links: list[Link]) -> dict[str, Any] | None:
    """Close a loop from the last body where it stands, the second frame moved by what the joint lets."""
    n = sum(_FREEDOMS[link.kind] for link in links)
    kinds = [kind for kind, held in _HELD.items() if held < n]
    if not kinds:
        return None
    kind = str(r.choice(kinds))
    B = len(links) - 1
    A = int(r.choice([k for k in range(-1, B) if k != links[B].parent or k < 0]))
    places, rotations = Case(links, np.zeros(3)).poses([link.start for link in links])
    axis = _unit(r)
    axis2 = _unit(r)
    at, rpy = _vector(r, 0.4), np.round(r.uniform(-1.4, 1.4, 3), 3)
    place, R = places[B] + rotations[B] @ at, rotations[B] @ of_rpy(rpy)
    pitch, shift, turn = _number(r, -0.5, 0.5), _number(r, -0.3, 0.3), np.eye(3)
    if kind in ("revolute", "cylindrical", "planar"):
        turn = about(axis, _number(r, -2, 2))
    if kind == "spherical":
        turn = of_rpy(r.normal(size=3))
    if kind == "universal":
        # The axis of the first frame, at right angles to the second axis in the second one.
        axis = perpendicular(axis2)[0]
        turn = about(axis2, _number(r, -2, 2)) @ about(axis, _number(r, -2, 2))
    if kind in ("prismatic", "cylindrical"):
        place = place + R @ axis * shift
    if kind == "planar":
        place = place + R @ perpendicular(axis)[0] * shift
    R = R @ turn
    if A >= 0:
        place, R = rotations[A].T @ (place - places[A]), rotations[A].T @ R
    frames = ((place, to_rpy(R)), (at, rpy))
    return {"kind": kind, "bodies": (A, B), "frames": frames, "axis": axis, "axis2": axis2, "pitch": pitch}


def draw(r: np.random.Generator, closed: bool) -> Case:
    """Draw a case."""
    n = int(r.integers(1, 4)) + (1 if closed else 0)
    kinds = [str(r.choice(_TYPES[:7] if closed else _TYPES)) for _ in range(n)]
    links = [_link(r, k, kind, closed) for k, kind in enumerate(kinds)]
    closure = _closed(r, links) if closed else None
    gravity = np.array([0.0, 0.0, -9.81]) if r.random() < 0.6 else _vector(r, 4.0) * float(r.random() < 0.6)
    fields = tuple(_number(r, -4, 4) for _ in range(3)) if r.random() < 0.3 else None
    attractor = (
        (_vector(r, 1.0) + 5.0, _number(r, 5, 100), bool(r.random() < 0.5)) if r.random() < 0.3 else None
    )
    loads, springs = [], []
    for _ in range(int(r.integers(0, 3))):
        k = int(r.integers(n))
        force = r.random() < 0.5
        others = [None, *(j for j in range(-1, n) if j != k)]
        at, value = _vector(r, 0.4) if force else None, _vector(r, 6.0 if force else 2.0)
        speed, frame = _number(r, 0, 4), int(r.integers(-1, n))
        loads.append(Load(k, at, value, speed, frame, others[r.integers(len(others))]))
    for _ in range(int(r.integers(0, 2))):
        B = int(r.integers(n))
        A = int(r.choice([k for k in range(-1, n) if k != B]))
        ends = _vector(r, 0.4) + 2.0 * (A < 0), _vector(r, 0.4)
        told = _number(r, 0, 30), _number(r, 0.5, 3), _number(r, 0, 1), _number(r, -5, 5) * (r.random() < 0.3)
        springs.append(Spring(A, B, *ends, *told))
    constant = _number(r, 0.1, 1.0) if n > 1 and not closed and r.random() < 0.1 else 0.0
    rotors = []
    if r.random() < 0.4:
        told = _number(r, 0.01, 0.3), _number(r, -40, 40), _number(r, -2, 2), _number(r, 0.5, 5)
        rotors.append(Rotor(int(r.integers(n)), _unit(r), *told))
    return Case(links, gravity, fields, attractor, constant, loads, springs, closure, rotors)


def bodies(kind: str, number: int, method: str) -> Outcome:
    """Run bodies, and judge their sensors at the end."""
    r = np.random.default_rng([number, *kind.encode()])
    case, t_end = draw(r, kind == "closed"), float(r.uniform(0.3, 1.5))
    given = {"rtol": float(r.choice(_RTOLS))} if find_method(method).adaptive else {}
    return judged(case, case.model, t_end, method, given)


def placed(number: int, method: str) -> Outcome:
    """Run bodies that are an assembly within none to two others."""
    r = np.random.default_rng([number, *b"placed"])
    case, t_end = draw(r, bool(r.random() < 0.4)), float(r.uniform(0.3, 1.0))
    case.potential = case.attractor = None
    case.constant = 0.0
    given = {"rtol": float(r.choice(_RTOLS))} if find_method(method).adaptive else {}
    places = [(_vector(r, 2.0), np.round(r.uniform(-1.4, 1.4, 3), 3)) for _ in range(int(r.integers(1, 4)))]
    return judged(case, lambda: case.placed(places), t_end, method, given)


def judged(case: Case, model: Any, t_end: float, method: str, given: dict[str, Any]) -> Outcome:
    """Run a case by a method, and hold its end against the reference."""
    if not case.solvable():
        return Outcome(RIGHT, "the loop is at a place where its rows depend on each other")
    y0 = case.start()
    told = {"method": "DOP853", "rtol": 1e-9, "atol": 1e-11}
    times = np.linspace(0.0, t_end, 60)
    known = solve_ivp(case.motion, (0.0, t_end), y0, t_eval=times, **told)
    again = solve_ivp(case.motion, (0.0, t_end), y0, **{**told, "rtol": 1e-7, "atol": 1e-9})
    if known.status or again.status:
        return Outcome(RIGHT, "the reference does not get on")
    seen = np.array([case.sensors(t, y) for t, y in zip(times, known.y.T, strict=True)])
    ranges = np.fmax(np.ptp(seen, axis=0).max(axis=1), _LEAST * np.abs(seen).max(axis=(0, 2))) + 1e-9
    lost = np.abs(case.sensors(t_end, again.y[:, -1]) - seen[-1]).max(axis=1) / ranges
    if lost.max() > _LOST:
        return Outcome(RIGHT, "the reference is lost")
    description, names = model()
    run = attempt(made(description), t_end, method=method, **given)
    if isinstance(run, Outcome):
        return run
    off, where = 0.0, ""
    for k, group in enumerate(names):
        for i, name in enumerate(group):
            one = abs(float(run[name][-1]) - seen[-1, k, i]) / ranges[k]
            if not one <= off:
                off, where = one, name
    kinds = "-".join(link.kind for link in case.links) + (
        f" closed by {case.closure['kind']}" if case.closure else ""
    )
    return judge_end(run, off, f"{kinds}, {method}, {given}, to {t_end:.4g} s, worst {where}")


def scenarios() -> Iterator[Scenario]:
    """Yield cases of trees, of loops, and of assemblies with each method."""
    kinds = {
        "tree": functools.partial(bodies, "tree"),
        "closed": functools.partial(bodies, "closed"),
        "placed": placed,
    }
    for kind, one in kinds.items():
        for k, method in enumerate(METHODS):
            for number in range(_CASES):
                run = functools.partial(one, number * len(METHODS) + k, method)
                short = number == 0 and method in ("dop853", "radau5")
                yield Scenario(
                    f"free bodies: {kind}", f"free bodies: {kind} {number}: {method}", run, method, short
                )
