"""What speaks against the motion of one body with shapes that touch, by NumPy, Newton and Euler alone.

Of a run only frames and events are read; heights, speeds, momenta and energies are computed anew from the states.
Impulses are those that the momentum of the body shows: at an impact, and between frames with nothing in between.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import groupby

import numpy as np
from scipy.optimize import lsq_linear
from scipy.spatial.transform import Rotation

from ..falling_bodies import box_corners

G = 9.81
MASS = 1.0
SUNK = 1e-6  # m
TOUCHES = 1e-8  # m, at an impact
LAW = 1e-7  # of the speeds and impulses at an impact
AGAIN = 1e-6  # s
SLIDES = 0.02  # m/s, from which on the direction of sliding is plain
TURNED = 0.3  # rad between frames, up to which that direction has a mean
FLOOR = -0.4  # m, height of the floor below a pair
TARGET_INERTIA, TARGET_DAMPING = 0.01, 0.02


@dataclass(frozen=True)
class Thrown:
    """A body of mass 1 that is thrown, and what it falls on.

    Attributes
    ----------
    shapes : list of dict
        As in `Model.body`; a mesh by its "corners".
    inertia : ndarray, shape (3,)
        Principal moments; planar bodies have the first.
    restitution, friction, lean : float
        Of the contact; the angle of the plane to the level [rad].
    planar : bool
    target : dict, or None
        The shape of a body on a hinge through the origin, along y (planar ones z), which is hit as well; the plane lies
        lower then.
    """

    shapes: list[dict]
    inertia: np.ndarray
    restitution: float
    friction: float
    planar: bool
    lean: float = 0.0
    target: dict | None = None

    @property
    def normal(self) -> np.ndarray:
        """Of the plane."""
        tilted, up = np.sin(self.lean), np.cos(self.lean)
        return np.array([-tilted, up, 0.0]) if self.planar else np.array([0.0, -tilted, up])

    @property
    def axis(self) -> np.ndarray:
        """Of the hinge of the target."""
        return np.array([0.0, 0.0, 1.0] if self.planar else [0.0, 1.0, 0.0])

    @property
    def gravity(self) -> np.ndarray:
        """The acceleration of what falls [m/s^2]."""
        return np.array([0.0, -G, 0.0]) if self.planar else np.array([0.0, 0.0, -G])

    def points(self) -> Iterator[tuple[np.ndarray, float]]:
        """The places in the body that touch the plane, with their radii."""
        for shape in self.shapes:
            offset = np.array([*shape.get("offset", ()), 0.0, 0.0, 0.0])[:3]
            if "box" in shape:
                corners = box_corners((*shape["box"], 0.0)[:3]) * ([1, 1, 0] if self.planar else 1)
                yield from ((corner + offset, 0.0) for corner in np.unique(corners, axis=0))
            elif "corners" in shape:
                yield from ((corner, 0.0) for corner in shape["corners"])
            elif "sphere" in shape:
                yield offset, shape["sphere"][0]
            else:
                radius, length = shape["capsule"]
                half = np.array([1.0, 0, 0] if self.planar else [0, 0, 1.0]) * length / 2
                yield from ((offset + side * half, radius) for side in (-1, 1))


@dataclass(frozen=True)
class Pose:
    """Where a body and its target are and how they move, by a state; vectors are in the world."""

    thrown: Thrown
    q: np.ndarray
    v: np.ndarray

    @property
    def turn(self) -> Rotation:
        """From the body to the world."""
        if self.thrown.planar:
            return Rotation.from_euler("z", self.q[2])
        return Rotation.from_quat(self.q[[4, 5, 6, 3]])

    @property
    def centre(self) -> np.ndarray:
        return np.array([*self.q[:2], 0.0]) if self.thrown.planar else self.q[:3]

    @property
    def velocity(self) -> np.ndarray:
        return np.array([*self.v[:2], 0.0]) if self.thrown.planar else self.v[:3]

    @property
    def spin(self) -> np.ndarray:
        return np.array([0, 0, self.v[2]]) if self.thrown.planar else self.turn.apply(self.v[3:6])

    @property
    def angular_momentum(self) -> np.ndarray:
        """About the centre of mass."""
        if self.thrown.planar:
            return self.thrown.inertia[0] * self.spin
        return self.turn.apply(self.thrown.inertia * self.v[3:6])

    @property
    def energy(self) -> float:
        """T + V [J]."""
        moving = MASS * self.velocity @ self.velocity + self.spin @ self.angular_momentum
        if self.thrown.target is not None:
            moving += TARGET_INERTIA * self.v[-1] ** 2
        return moving / 2 - MASS * self.thrown.gravity @ self.centre

    def contacts(self) -> list[tuple[float, np.ndarray, np.ndarray, np.ndarray]]:
        """Gap, arm from the centre of mass, normal, and velocity of what lies below, of each point that may touch."""
        normal, turn = self.thrown.normal, self.turn
        height = self.centre @ normal - (FLOOR if self.thrown.target is not None else 0.0)
        found = []
        for place, radius in self.thrown.points():
            arm = turn.apply(place) - radius * normal
            found.append((height + arm @ normal, arm, normal, np.zeros(3)))
        if self.thrown.target is not None:
            found += self._ends_and_corners() if self.thrown.planar else [self._on_target()]
        return found

    def _ends_and_corners(self) -> list[tuple[float, np.ndarray, np.ndarray, np.ndarray]]:
        """In a plane a capsule and a box may lie flat on each other: each end, and each corner between the ends."""
        radius, length = self.thrown.shapes[0]["capsule"]
        halves, back = (
            np.array(self.thrown.target["box"][:2]) / 2,
            Rotation.from_rotvec(self.thrown.axis * self.q[-1]),
        )
        along, found = self.turn.apply([1.0, 0.0, 0.0]), []
        for side in (-1, 1):
            arm = side * length / 2 * along
            here = back.inv().apply(self.centre + arm)
            nearest = back.apply([*np.clip(here[:2], -halves, halves), 0.0])
            found.append(self._met(arm, radius, nearest))
        for corner in np.unique(box_corners((*(2 * halves), 0.0)), axis=0):
            place = back.apply(corner)
            s = (place - self.centre) @ along
            found.append(self._met(s * along, radius, place))
            if abs(s) >= length / 2:
                found[-1] = (np.inf, *found[-1][1:])
        return found

    def _met(self, arm: np.ndarray, radius: float, nearest: np.ndarray):
        """What `contacts` says of a place on the core of a capsule, and the nearest one of the target."""
        apart = self.centre + arm - nearest
        distance = float(np.linalg.norm(apart))
        normal = apart / distance if distance > 1e-9 else self.thrown.normal
        below = np.cross(self.thrown.axis * self.v[-1], nearest)
        return distance - radius, arm - radius * normal, normal, below

    def _on_target(self) -> tuple[float, np.ndarray, np.ndarray, np.ndarray]:
        """By bounded least squares over the cores of both shapes: what they are without their radius."""
        hinge = Rotation.from_rotvec(self.thrown.axis * self.q[-1])
        cores, radii = [], []
        for turn, shape in ((self.turn, self.thrown.shapes[0]), (hinge, self.thrown.target)):
            halves = np.diag(shape["box"]) / 2 if "box" in shape else np.zeros((3, 3))
            if "capsule" in shape:
                halves[2, 2] = shape["capsule"][1] / 2
            cores.append(turn.apply(halves[np.any(halves, axis=1)]).reshape(-1, 3).T)
            radii.append(shape.get("sphere", shape.get("capsule", [0.0]))[0])
        spanned = np.hstack([cores[0], -cores[1]])
        shares = lsq_linear(spanned, -self.centre, (-1.0, 1.0), tol=1e-15).x
        apart = self.centre + spanned @ shares
        distance = float(np.linalg.norm(apart))
        if distance < 1e-9:  # the cores cross: sunk, however it is measured
            return -sum(radii), np.zeros(3), self.thrown.normal, np.zeros(3)
        normal = apart / distance
        arm = cores[0] @ shares[: cores[0].shape[1]] - radii[0] * normal
        below = np.cross(self.thrown.axis * self.v[-1], self.centre + arm - (distance - sum(radii)) * normal)
        return distance - sum(radii), arm, normal, below

    def slip(self, arm: np.ndarray, below: np.ndarray) -> np.ndarray:
        """The velocity of a point against what lies below it."""
        return self.velocity + np.cross(self.spin, arm) - below


def n_near(q: np.ndarray, v: np.ndarray, thrown: Thrown) -> int:
    """How many points touch, or nearly do."""
    return sum(gap < SUNK for gap, *_ in Pose(thrown, q, v).contacts())


def objection(run, thrown: Thrown, allowed: float) -> str:
    """What speaks against a run; '' if nothing does. `allowed` is the error of its steps, in parts."""
    if not np.isfinite(run.states).all():
        return "numbers are not finite"
    poses = [Pose(thrown, q, v) for q, v in zip(run.q, run.v, strict=True)]
    size = abs(poses[0].energy) + 1.0
    for t, pose in zip(run.t, poses, strict=True):
        depth = -min(gap for gap, *_ in pose.contacts())
        if depth > SUNK:
            return f"{depth:.2g} m sunk at {t:.6g} s"
    own = np.array([pose.energy for pose in poses])
    if np.max(np.abs(own - own[0] - run.energy.total + run.energy.total[0])) > 1e-9 * size:
        return "T + V are not those of the states"
    times = np.array([event.t for event in run.events])
    for k in range(len(poses) - 1):
        gained = own[k + 1] - own[k]
        if gained > allowed * size:
            return f"{gained:.2g} J more at {run.t[k + 1]:.6g} s"
        if np.any((times >= run.t[k]) & (times <= run.t[k + 1])):
            continue
        if thrown.friction == 0.0 and thrown.target is None and abs(gained) > allowed * size:
            return f"{gained:.2g} J with nothing that takes them, at {run.t[k + 1]:.6g} s"
        against = between(poses[k], poses[k + 1], run.t[k + 1] - run.t[k], allowed)
        if against:
            return f"{against} before {run.t[k + 1]:.6g} s"
    for t, at_once in groupby(run.events, lambda event: event.t):
        blows = list(at_once)
        again = bool(np.any((times > t) & (times < t + AGAIN)))
        against = any(event.action == "impact" for event in blows) and impact(blows, thrown, size, again)
        if against:
            return f"{against} at {t:.6g} s, {blows[0].name}"
    return ""


def between(a: Pose, b: Pose, span: float, allowed: float) -> str:
    """What speaks against the impulse between two frames without an event in between."""
    impulse = MASS * (b.velocity - a.velocity - a.thrown.gravity * span)
    touching = [
        (x, y) for x, y in zip(a.contacts(), b.contacts(), strict=True) if max(abs(x[0]), abs(y[0])) < SUNK
    ]
    small = allowed * (1.0 + np.linalg.norm(a.velocity))
    if not touching:
        turned = b.angular_momentum - a.angular_momentum
        if max(np.abs(impulse).max(), np.abs(turned).max()) > small:
            return f"flies with an impulse of {np.abs(impulse).max():.2g} Ns"
        return ""
    normals = np.array([x[2] + y[2] for x, y in touching]) / 2
    if (
        np.abs(normals - normals[0]).max() > 1e-12
        or np.abs(touching[0][0][2] - touching[0][1][2]).max() > 1e-12
    ):
        return ""  # forces in several directions
    pressed = float(impulse @ normals[0])
    along = impulse - pressed * normals[0]
    if pressed < -small:
        return f"is pulled down with {-pressed:.2g} Ns"
    most = a.thrown.friction * pressed
    if np.linalg.norm(along) > most + small + 1e-3 * pressed:
        return f"rubs with {np.linalg.norm(along):.2g} Ns of {most:.2g} Ns"
    slips = [pose.slip(arm, below) for pair in touching for pose, (_, arm, _, below) in zip((a, b), pair)]
    fast = [np.linalg.norm(slip) for slip in slips]
    if min(fast) < SLIDES:
        return ""
    directions = np.array(slips) / np.array(fast)[:, None]
    mean = directions.mean(axis=0)
    turned = float(np.arccos(np.clip((directions @ directions.T).min(), -1, 1)))
    if turned > TURNED:
        return ""
    off = np.linalg.norm(along + most * mean / np.linalg.norm(mean))
    # What the direction turns by between frames bends the path of the force, and several points share it unevenly.
    if off > small + pressed * (1e-3 + a.thrown.friction * (turned**2 if len(touching) == 1 else turned)):
        return f"slides with {off:.2g} Ns beside the {most:.2g} Ns of friction"
    return ""


def impact(blows: list, thrown: Thrown, size: float, again: bool) -> str:
    """What speaks against an impact, by its events: Newton's and Coulomb's laws, where a single point strikes.

    What goes down behind it has to strike `again` at once.
    """
    before = Pose(thrown, blows[0].q_before, blows[0].v_before)
    after = Pose(thrown, blows[-1].q_after, blows[-1].v_after)
    change, said = after.energy - before.energy, sum(event.energy_change for event in blows)
    if change > 1e-9 * size or abs(change - said) > 1e-9 * size:
        return f"an impact changes T + V by {change:.2g} J, and says {said:.2g} J"
    all_before, all_after = before.contacts(), after.contacts()
    near = [k for k, contact in enumerate(all_before) if contact[0] < 100 * TOUCHES]
    opening = [after.slip(arm, below) @ normal for gap, arm, normal, below in all_after if gap < TOUCHES]
    if not again and min(opening, default=0.0) < -LAW * size:
        return "a point moves into what it has struck"
    if not near:
        return f"strikes what is {min(gap for gap, *_ in all_before):.2g} m away"
    if len(near) != 1:
        return ""
    _, arm, normal, below = all_before[near[0]]
    below_after = all_after[near[0]][3]
    impulse = MASS * (after.velocity - before.velocity)
    turned = after.angular_momentum - before.angular_momentum - np.cross(arm, impulse)
    scale = LAW * size
    if np.abs(turned).max() > scale:
        return f"momentum is off by {np.abs(turned).max():.2g} Nms"
    if thrown.target is not None and near[0] >= len(list(thrown.points())):
        torque = np.cross(before.centre + arm, impulse) @ thrown.axis
        off = TARGET_INERTIA * (after.v[-1] - before.v[-1]) + torque
        if abs(off) > scale:
            return f"momentum of the target is off by {off:.2g} Nms"
    pressed = float(impulse @ normal)
    along = impulse - pressed * normal
    first, last = before.slip(arm, below), after.slip(arm, below_after)
    u, up = float(first @ normal), float(last @ normal)
    expected = -thrown.restitution * u
    rests = abs(up) <= scale  # a gap that would hardly open is closed
    lowered = change > -1e-9 * size and 0.0 <= up <= expected  # Newton's law would add energy
    if abs(up - expected) > scale and not rests and not lowered:
        return f"parts with {up:.6g} m/s, not {expected:.6g} m/s"
    if rests and expected > 0.05:
        return f"stays though it would part with {expected:.3g} m/s"
    left = last - up * normal
    rubbed = float(np.linalg.norm(along))
    if rubbed > thrown.friction * pressed + scale:
        return f"rubs with {rubbed:.6g} Ns of {thrown.friction * pressed:.6g} Ns"
    slow = float(np.linalg.norm(left))
    if slow > 10 * scale and np.linalg.norm(along + thrown.friction * pressed * left / slow) > 10 * scale:
        return f"slides on with {slow:.3g} m/s, and the impulse is not against that"
    return ""
