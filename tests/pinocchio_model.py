"""A joint tree of a description in Pinocchio, the peer that trees are compared with (optional package `pin`)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from newton_euler import planar_second

from symgen.model.description import Body, Description, Joint


@dataclass(frozen=True)
class PinocchioTree:
    """The same tree in Pinocchio, and where our coordinates and rates are in its vectors.

    `angles` pairs our coordinates with its own, `balls` our quaternions (where they begin) with its joints, and
    `rates` has, for each of our rates in order, its index in Pinocchio's velocity.
    """

    model: object
    rates: list[int]
    angles: list[tuple[int, int]]
    balls: list[tuple[int, int]]

    def state(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Its configuration and velocity in our state (q, v)."""
        import pinocchio as pin

        q = pin.neutral(self.model)
        for ours, its in self.angles:
            q[its] = y[ours]
        for ours, k in self.balls:
            joint = self.model.joints[k]
            end = joint.idx_q + joint.nq
            q[end - 4 : end] = y[[ours + 1, ours + 2, ours + 3, ours]]
        map_, _ = self.velocity_map(q, np.zeros(self.model.nv))
        return q, map_ @ y[len(y) - self.model.nv :]

    def velocity_map(self, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """B and b of its velocity B u and acceleration B du/dt + b, where u are our rates.

        They differ in order, and in free joints: the velocity of the origin is in the parent's axes here, in the
        child's there, so its derivative there has the part -w x v.
        """
        import pinocchio as pin

        n = self.model.nv
        B, b = np.zeros((n, n)), np.zeros(n)
        B[self.rates, range(n)] = 1.0
        for _, k in self.balls:
            joint = self.model.joints[k]
            if joint.nq == 7:
                i, at = joint.idx_v, joint.idx_q
                R = pin.Quaternion(*q[[at + 6, at + 3, at + 4, at + 5]]).toRotationMatrix()
                B[i : i + 3] = R.T @ B[i : i + 3]
                b[i : i + 3] = -np.cross(v[i + 3 : i + 6], v[i : i + 3])
        return B, b

    def accelerations(self, y: np.ndarray) -> np.ndarray:
        """Derivatives of our rates under gravity alone, by its articulated-body algorithm."""
        import pinocchio as pin

        q, v = self.state(y)
        B, b = self.velocity_map(q, v)
        return np.linalg.solve(B, pin.aba(self.model, self.model.createData(), q, v, np.zeros(len(v))) - b)

    def mass_matrix(self, y: np.ndarray) -> np.ndarray:
        """M of our rates, by its composite-rigid-body algorithm."""
        import pinocchio as pin

        q, v = self.state(y)
        B, _ = self.velocity_map(q, v)
        M = np.triu(pin.crba(self.model, self.model.createData(), q))
        return B.T @ (M + np.triu(M, 1).T) @ B

    def inverse_dynamics(self, y: np.ndarray, a: np.ndarray) -> np.ndarray:
        """Forces on our rates that make them change by a, by its recursive Newton-Euler algorithm."""
        import pinocchio as pin

        q, v = self.state(y)
        B, b = self.velocity_map(q, v)
        return B.T @ pin.rnea(self.model, self.model.createData(), q, v, B @ a + b)


def pinocchio_tree(description: Description, parameters: dict[str, float]) -> PinocchioTree:
    """The same tree in Pinocchio; every body hangs on a joint.

    Universal, cylindrical and planar joints are chains of revolute and prismatic ones with massless bodies between.
    """
    import pinocchio as pin

    def number(expression) -> float:
        return float(expression.xreplace({s: parameters[s.name] for s in expression.free_symbols}))

    model = pin.Model()
    model.gravity.linear = np.array([number(g) for g in description.gravity or ()] or [0.0] * 3)
    bodies = {body.name: body for body in description.bodies}
    coordinates = {c.name: k for k, c in enumerate(description.coordinates)}
    frames = {"world": (0, pin.SE3.Identity())}  # Pinocchio's joint, and the body frame's place in it
    where, angles, balls = {}, [], []
    for joint in _depth_first(description.joints):
        here, place = frames[joint.parent]
        xyz, rpy = [number(x) for x in joint.xyz], [number(x) for x in joint.rpy]
        place = place * pin.SE3(pin.rpy.rpyToMatrix(*rpy), np.array(xyz))
        first = 0
        for k, part in enumerate(_parts(pin, joint)):
            here, place = model.addJoint(here, part, place, f"{joint.name}_{k}"), pin.SE3.Identity()
            added = model.joints[here]
            where |= {rate: added.idx_v + i for i, rate in enumerate(joint.rates[first : first + added.nv])}
            plain = added.nq - 4 if added.nq > added.nv else added.nq
            own = [coordinates[name] for name in joint.coordinates[first : first + added.nq]]
            angles += [(c, added.idx_q + i) for i, c in enumerate(own[:plain])]
            balls += [(own[plain], here)] if plain < added.nq else []
            first += added.nq
        frames[joint.child] = (here, place)
        model.appendBodyToJoint(here, _inertia(pin, bodies[joint.child], number), place)
    return PinocchioTree(model, [where[rate.name] for rate in description.rates], angles, balls)


def _depth_first(joints: tuple[Joint, ...], parent: str = "world") -> list[Joint]:
    """Joints in the order in which `crba` needs them: rates of what hangs on a joint follow those of the joint."""
    own = [joint for joint in joints if joint.parent == parent]
    return [j for joint in own for j in (joint, *_depth_first(joints, joint.child))]


def _parts(pin, joint: Joint) -> list:
    axis = tuple(joint.axis)
    match joint.type:
        case "revolute" | "continuous":
            return [_revolute(pin, axis)]
        case "prismatic":
            return [_prismatic(pin, axis)]
        case "screw":
            return [pin.JointModelHelicalUnaligned(np.array(axis), float(joint.pitch) / (2 * np.pi))]
        case "universal":
            return [_revolute(pin, axis), _revolute(pin, joint.axis2)]
        case "cylindrical":
            return [_revolute(pin, axis), _prismatic(pin, axis)]
        case "planar":
            second = planar_second(np.array(axis))
            first = np.cross(second, axis)
            return [_prismatic(pin, first), _prismatic(pin, second), _revolute(pin, axis)]
        case "spherical":
            return [pin.JointModelSpherical()]
        case "free":
            return [pin.JointModelFreeFlyer()]
        case "gimbal" | "floating":
            axes = dict(zip("xyz", np.eye(3), strict=True))
            slides = [_prismatic(pin, e) for e in axes.values()] if joint.type == "floating" else []
            return [*slides, *(_revolute(pin, axes[letter]) for letter in joint.sequence)]
    return []


def _revolute(pin, axis):
    return _aligned(pin, "JointModelR", axis) or pin.JointModelRevoluteUnaligned(np.array(axis))


def _prismatic(pin, axis):
    return _aligned(pin, "JointModelP", axis) or pin.JointModelPrismaticUnaligned(np.array(axis))


def _aligned(pin, kind: str, axis):
    for k, letter in enumerate("XYZ"):
        if axis[k] == 1.0:
            return getattr(pin, kind + letter)()
    return None


def _inertia(pin, body: Body, number):
    mass = number(body.mass) if body.mass is not None else 0.0
    com = np.array([number(x) for x in body.com] or [0.0] * 3)
    xx, yy, zz, xy, xz, yz = ([number(x) for x in body.inertia] + [0.0] * 6)[:6]
    return pin.Inertia(mass, com, np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
