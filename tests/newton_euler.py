"""Test support: M, h and energies of trees of joints in NumPy, body by body with Jacobians in world axes.

Nothing of the derivation is used. Rates enter through the motion of each joint's child relative to its parent, with
M = Σ Jᵀ m J + Jωᵀ I Jω and h from the accelerations at dv/dt = 0 (Newton-Euler by virtual power).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from symgen.model.description import Description

X, Y, Z = np.eye(3)


@dataclass
class Frame:
    """A frame's motion in world axes; columns of the Jacobians belong to the rates."""

    R: np.ndarray
    p: np.ndarray
    v: np.ndarray
    w: np.ndarray
    a: np.ndarray  # at dv/dt = 0
    alpha: np.ndarray
    Jv: np.ndarray
    Jw: np.ndarray

    def moved(self, r: np.ndarray) -> Frame:
        """The same rigid body's frame with its origin at r (world axes) from the present one."""
        w, alpha = self.w, self.alpha
        a = self.a + np.cross(alpha, r) + np.cross(w, np.cross(w, r))
        Jv = self.Jv + np.cross(self.Jw.T, r).T
        return Frame(self.R, self.p + r, self.v + np.cross(w, r), w, a, alpha, Jv, self.Jw)

    def turned(self, R: np.ndarray) -> Frame:
        return Frame(self.R @ R, self.p, self.v, self.w, self.a, self.alpha, self.Jv, self.Jw)


@dataclass
class NewtonEuler:
    """A description's tree on the world in one state."""

    d: Description
    y: np.ndarray
    frames: dict[str, Frame] = field(default_factory=dict)

    def __post_init__(self):
        d = self.d
        nq, self.n = len(d.coordinates), len(d.rates)
        self.q = dict(zip((c.name for c in d.coordinates), self.y[:nq], strict=True))
        self.v = dict(zip((r.name for r in d.rates), self.y[nq:], strict=True))
        self.column = {r.name: k for k, r in enumerate(d.rates)}
        zero = np.zeros((3, self.n))
        self.frames["world"] = Frame(np.eye(3), *np.zeros((5, 3)), zero, zero)
        for joint in d.joints:
            self.frames[joint.child] = self._child(joint)

    def _child(self, joint) -> Frame:
        f = self.frames[joint.parent]
        f = f.moved(f.R @ np.array(joint.xyz, dtype=float)).turned(rpy(np.array(joint.rpy, dtype=float)))
        axis = np.array(joint.axis, dtype=float) if joint.axis else X
        names = list(zip(joint.coordinates, joint.rates, strict=False))
        match joint.type:
            case "revolute" | "continuous":
                return self._revolve(f, axis, *names[0])
            case "prismatic":
                return self._slide(f, axis, *names[0])
            case "screw":
                (coordinate, rate), advance = names[0], float(joint.pitch) / (2 * np.pi)
                return self._slide(self._revolve(f, axis, coordinate, rate), axis, coordinate, rate, advance)
            case "universal":
                return self._revolve(self._revolve(f, axis, *names[0]), np.array(joint.axis2), *names[1])
            case "cylindrical":
                return self._slide(self._revolve(f, axis, *names[0]), axis, *names[1])
            case "planar":
                second = np.array(planar_second(axis))
                f = self._slide(self._slide(f, np.cross(second, axis), *names[0]), second, *names[1])
                return self._revolve(f, axis, *names[2])
            case "spherical":
                return self._ball(f, joint.coordinates, joint.rates)
            case "free":
                for e, name in zip((X, Y, Z), names, strict=False):
                    f = self._slide(f, e, *name)
                return self._ball(f, joint.coordinates[3:], joint.rates[3:])
            case "gimbal" | "floating":
                for e, name in zip((X, Y, Z), names[:-3]):
                    f = self._slide(f, e, *name)
                for letter, name in zip(joint.sequence, names[-3:], strict=True):
                    f = self._revolve(f, {"x": X, "y": Y, "z": Z}[letter], *name)
                return f
            case "fixed":
                return f

    def _revolve(self, f: Frame, axis, coordinate: str, rate: str) -> Frame:
        e, qdot = f.R @ axis, self.v[rate]
        Jw = f.Jw.copy()
        Jw[:, self.column[rate]] += e
        alpha = f.alpha + np.cross(f.w, e * qdot)
        turned = f.R @ about(axis, self.q[coordinate])
        return Frame(turned, f.p, f.v, f.w + e * qdot, f.a, alpha, f.Jv, Jw)

    def _slide(self, f: Frame, axis, coordinate: str, rate: str, ratio: float = 1.0) -> Frame:
        e, qdot = ratio * f.R @ axis, self.v[rate]
        f = f.moved(e * self.q[coordinate])
        Jv = f.Jv.copy()
        Jv[:, self.column[rate]] += e
        return Frame(f.R, f.p, f.v + e * qdot, f.w, f.a + 2 * np.cross(f.w, e * qdot), f.alpha, Jv, f.Jw)

    def _ball(self, f: Frame, coordinates, rates) -> Frame:
        R = f.R @ from_quaternion(np.array([self.q[c] for c in coordinates]))
        relative = R @ np.array([self.v[r] for r in rates])
        Jw = f.Jw.copy()
        for k, r in enumerate(rates):
            Jw[:, self.column[r]] += R[:, k]
        return Frame(R, f.p, f.v, f.w + relative, f.a, f.alpha + np.cross(f.w, relative), f.Jv, Jw)

    def bodies(self):
        """Mass, inertia in world axes, and the frame at the centre of mass of each body."""
        for b in self.d.bodies:
            f = self.frames[b.name]
            com = np.array([*map(float, b.com), 0.0, 0.0, 0.0][:3])
            com = com if len(b.com) == 3 else np.array([*com[:2], 0.0])
            values = [float(x) for x in b.inertia]
            tensor = np.zeros((3, 3))
            if len(values) == 1:
                tensor[2, 2] = values[0]
            elif values:
                xx, yy, zz, xy, xz, yz = [*values, 0.0, 0.0, 0.0][:6]
                tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
            yield float(b.mass), f.R @ tensor @ f.R.T, f.moved(f.R @ com)

    def equations(self) -> tuple[np.ndarray, np.ndarray]:
        """M and h = M a + h - Q at a = 0, with gravity in h."""
        M, h = np.zeros((self.n, self.n)), np.zeros(self.n)
        gravity = np.array(self.d.gravity, dtype=float) if self.d.gravity else np.zeros(3)
        for m, I, f in self.bodies():
            M += m * f.Jv.T @ f.Jv + f.Jw.T @ I @ f.Jw
            h += f.Jv.T @ (m * (f.a - gravity)) + f.Jw.T @ (I @ f.alpha + np.cross(f.w, I @ f.w))
        return M, h

    def energy(self) -> np.ndarray:
        gravity = np.array(self.d.gravity, dtype=float) if self.d.gravity else np.zeros(3)
        T = sum(m * f.v @ f.v / 2 + f.w @ I @ f.w / 2 for m, I, f in self.bodies())
        return np.array([T, -sum(m * gravity @ f.p for m, _, f in self.bodies())])


def planar_second(axis: np.ndarray) -> np.ndarray:
    """The second direction of a planar joint: the coordinate axis most nearly perpendicular, made so."""
    e = min((Y, Z, X), key=lambda e: abs(e @ axis))
    second = e - (e @ axis) * axis
    return second / np.linalg.norm(second)


def about(axis: np.ndarray, angle: float) -> np.ndarray:
    """Rodrigues' rotation."""
    K = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def rpy(angles: np.ndarray) -> np.ndarray:
    """URDF's rotation."""
    return about(Z, angles[2]) @ about(Y, angles[1]) @ about(X, angles[0])


def from_quaternion(q: np.ndarray) -> np.ndarray:
    """Rotation of the unit quaternion w, x, y, z."""
    w, u = q[0], q[1:]
    K = np.array([[0, -u[2], u[1]], [u[2], 0, -u[0]], [-u[1], u[0], 0]])
    return np.eye(3) + 2 * w * K + 2 * K @ K
