"""A rigid body with corners that falls on the plane z = 0, by Newton, Euler and SciPy: what contacts are compared with.

Impacts are those of one corner, with Newton's restitution along the normal and Coulomb's law for the impulses: the
corner stops in the plane if an impulse within the friction cone does that, else it slides on, and the impulse is
opposite to the speed that is left.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import root
from scipy.spatial.transform import Rotation

G = 9.81


@dataclass(frozen=True)
class Fall:
    """A body by its mass, principal moments of inertia and corners (shape (n, 3), about the centre of mass)."""

    mass: float
    inertia: np.ndarray
    corners: np.ndarray
    restitution: float
    friction: float = 0.0

    def impacts(
        self, state: np.ndarray, count: int, t_end: float
    ) -> tuple[list[tuple[float, int]], np.ndarray]:
        """The times and corners of the first impacts, and the state behind the last of them.

        `state` is place, quaternion (w, x, y, z), velocity, body angular velocity.
        """
        t, found = 0.0, []
        while len(found) < count:
            events = [self._height(k) for k in range(len(self.corners))]
            run = solve_ivp(self._rates, (t, t_end), state, "DOP853", rtol=1e-12, atol=1e-13, events=events)
            if run.status != 1:
                return found, run.y[:, -1]
            (which,) = [k for k, times in enumerate(run.t_events) if len(times)]
            t, state = float(run.t_events[which][0]), run.y_events[which][0].copy()
            found.append((t, which))
            state = self._struck(state, which)
        return found, state

    def _height(self, k: int):
        def height(_, state: np.ndarray) -> float:
            return state[2] + rotation(state).apply(self.corners[k])[2]

        height.terminal, height.direction = True, -1.0
        return height

    def _rates(self, _, state: np.ndarray) -> np.ndarray:
        w, spin = state[10:13], state[3:7]
        turned = 0.5 * np.array(
            [
                -spin[1:] @ w,
                *(spin[0] * w + np.cross(spin[1:], w)),
            ]
        )
        change = -np.cross(w, self.inertia * w) / self.inertia
        return np.concatenate([state[7:10], turned, [0.0, 0.0, -G], change])

    def _struck(self, state: np.ndarray, which: int) -> np.ndarray:
        turn = rotation(state).as_matrix()
        arm = turn @ self.corners[which]
        skew = np.array([[0, -arm[2], arm[1]], [arm[2], 0, -arm[0]], [-arm[1], arm[0], 0]])
        inverse = turn @ np.diag(1 / self.inertia) @ turn.T
        flexible = np.eye(3) / self.mass - skew @ inverse @ skew
        before = state[7:10] - skew @ (turn @ state[10:13])
        impulse = self._impulse(flexible, before)
        after = state.copy()
        after[7:10] += impulse / self.mass
        after[10:13] += turn.T @ (inverse @ np.cross(arm, impulse))
        return after

    def _impulse(self, flexible: np.ndarray, before: np.ndarray) -> np.ndarray:
        up = -self.restitution * before[2]
        if self.friction == 0.0:
            return np.array([0.0, 0.0, (up - before[2]) / flexible[2, 2]])
        stuck = np.linalg.solve(flexible, np.array([0.0, 0.0, up]) - before)
        if np.hypot(*stuck[:2]) <= self.friction * stuck[2]:
            return stuck

        def sliding(angle: np.ndarray) -> np.ndarray:
            along = np.array([np.cos(angle[0]), np.sin(angle[0])])
            direction = np.array([*(-self.friction * along), 1.0])
            after = before + flexible @ (direction * (up - before[2]) / (flexible[2] @ direction))
            return np.array([along[0] * after[1] - along[1] * after[0]])

        for guess in np.arctan2(before[1], before[0]) + np.linspace(0.0, 2 * np.pi, 24, endpoint=False):
            angle = root(sliding, [guess], tol=1e-14).x[0]
            along = np.array([np.cos(angle), np.sin(angle)])
            direction = np.array([*(-self.friction * along), 1.0])
            impulse = direction * (up - before[2]) / (flexible[2] @ direction)
            if along @ (before + flexible @ impulse)[:2] > 0.0 and abs(sliding([angle])[0]) < 1e-11:
                return impulse
        raise ArithmeticError("no direction of sliding")


def rotation(state: np.ndarray) -> Rotation:
    """How the body is turned in a state."""
    return Rotation.from_quat(state[[4, 5, 6, 3]])


def box_corners(edges: tuple[float, float, float]) -> np.ndarray:
    """The corners of a box, in the order in which contacts number them."""
    sides = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    return sides * np.array(edges) / 2
