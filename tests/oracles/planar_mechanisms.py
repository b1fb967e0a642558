"""Equations of motion of planar mechanisms, derived by hand: M a = f + G^T lambda, G a = gamma."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy import cos, sin


@dataclass(frozen=True)
class Equations:
    """Mass matrix (n, n), forces (n,), constraint Jacobian (m, n) and gamma (m,) at one state."""

    M: np.ndarray
    f: np.ndarray
    G: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    gamma: np.ndarray = field(default_factory=lambda: np.zeros(0))


Parameters = Mapping[str, float]


def pendulum(q: np.ndarray, v: np.ndarray, p: Parameters) -> Equations:
    """Point mass on a rod, angle from straight down."""
    return Equations(np.array([[p["m"] * p["L"] ** 2]]), np.array([-p["m"] * p["g"] * p["L"] * sin(q[0])]))


def pendulum_linear(q: np.ndarray, v: np.ndarray, p: Parameters) -> Equations:
    """The same for small angles."""
    return Equations(np.array([[p["m"] * p["L"] ** 2]]), np.array([-p["m"] * p["g"] * p["L"] * q[0]]))


def spring_pendulum(q: np.ndarray, v: np.ndarray, p: Parameters) -> Equations:
    """Point mass in polar coordinates (r, theta): centrifugal and Coriolis force, spring, weight."""
    m, r = p["m"], q[0]
    radial = m * r * v[1] ** 2 - p["k"] * (r - p["l0"]) + m * p["g"] * cos(q[1])
    return Equations(
        np.diag([m, m * r**2]), np.array([radial, -2 * m * r * v[0] * v[1] - m * p["g"] * r * sin(q[1])])
    )


def double_pendulum(q: np.ndarray, v: np.ndarray, p: Parameters) -> Equations:
    """Two point masses on rods, absolute angles."""
    m1, m2, L1, L2, g = (p[name] for name in ("m1", "m2", "L1", "L2", "g"))
    c, s = cos(q[0] - q[1]), sin(q[0] - q[1])
    M = np.array([[(m1 + m2) * L1**2, m2 * L1 * L2 * c], [m2 * L1 * L2 * c, m2 * L2**2]])
    f = [
        -m2 * L1 * L2 * s * v[1] ** 2 - (m1 + m2) * g * L1 * sin(q[0]),
        m2 * L1 * L2 * s * v[0] ** 2 - m2 * g * L2 * sin(q[1]),
    ]
    return Equations(M, np.array(f))


def n_pendulum(q: np.ndarray, v: np.ndarray, p: Parameters) -> Equations:
    """Chain of equal point masses: mass i hangs on links 1 to i, so link i carries n - i masses below its own."""
    m, L, g = p["m"], p["L"], p["g"]
    n = len(q)
    carried = np.array([[n - max(i, j) for j in range(n)] for i in range(n)])
    difference = q[:, None] - q[None, :]
    M = m * L**2 * carried * cos(difference)
    centrifugal = (carried * sin(difference)) @ v**2
    return Equations(M, -m * L**2 * centrifugal - m * g * L * np.diag(carried) * sin(q))


def cart_pole(q: np.ndarray, v: np.ndarray, p: Parameters) -> Equations:
    """Cart and inverted pendulum, angle from upright; the cart's input force is p["F"]."""
    mp, l = p["mp"], p["l"]
    coupling = mp * l * cos(q[1])
    M = np.array([[p["M"] + mp, coupling], [coupling, mp * l**2]])
    f = [p["F"] - p["b"] * v[0] + mp * l * sin(q[1]) * v[1] ** 2, mp * p["g"] * l * sin(q[1])]
    return Equations(M, np.array(f))


def slider_crank(q: np.ndarray, v: np.ndarray, p: Parameters) -> Equations:
    """Crank, rod and piston; the rod's end on the piston."""
    r, l, m, mc, g = (p[name] for name in ("r", "l", "m", "mc", "g"))
    theta, phi, _ = q
    coupling, s = m * r * l / 2 * cos(theta - phi), m * r * l / 2 * sin(theta - phi)
    M = np.diag([p["Jc"] + mc * r**2 / 4 + m * r**2, p["J"] + m * l**2 / 4, p["mp"]])
    M[0, 1] = M[1, 0] = coupling
    f = [
        -s * v[1] ** 2 - (mc / 2 + m) * g * r * cos(theta),
        s * v[0] ** 2 - m * g * l / 2 * cos(phi),
        0.0,
    ]
    G = np.array([[-r * sin(theta), -l * sin(phi), -1.0], [r * cos(theta), l * cos(phi), 0.0]])
    gamma = [
        r * cos(theta) * v[0] ** 2 + l * cos(phi) * v[1] ** 2,
        r * sin(theta) * v[0] ** 2 + l * sin(phi) * v[1] ** 2,
    ]
    return Equations(M, np.array(f), G, np.array(gamma))


def four_bar(q: np.ndarray, v: np.ndarray, p: Parameters) -> Equations:
    """Three slender rods in a loop with the ground."""
    a, b, c, ma, mb, mc, g = (p[name] for name in ("a", "b", "c", "ma", "mb", "mc", "g"))
    coupling, s = mb * a * b / 2 * cos(q[0] - q[1]), mb * a * b / 2 * sin(q[0] - q[1])
    M = np.diag([ma * a**2 / 3 + mb * a**2, mb * b**2 / 3, mc * c**2 / 3])
    M[0, 1] = M[1, 0] = coupling
    f = [
        -s * v[1] ** 2 - (ma / 2 + mb) * g * a * cos(q[0]),
        s * v[0] ** 2 - mb * g * b / 2 * cos(q[1]),
        -mc * g * c / 2 * cos(q[2]),
    ]
    arms = np.array([a, b, -c])
    G = np.array([-arms * sin(q), arms * cos(q)])
    return Equations(M, np.array(f), G, np.array([arms * cos(q) @ v**2, arms * sin(q) @ v**2]))


def spring_chain(q: np.ndarray, v: np.ndarray, p: Parameters) -> Equations:
    """Point masses (x1, y1, x2, ...) on springs with dampers along them, the first one held at the origin."""
    positions = np.vstack([[0.0, 0.0], q.reshape(-1, 2)])
    velocities = np.vstack([[0.0, 0.0], v.reshape(-1, 2)])
    arms = np.diff(positions, axis=0)
    lengths = np.linalg.norm(arms, axis=1)
    directions = arms / lengths[:, None]
    stretching = np.sum(directions * np.diff(velocities, axis=0), axis=1)
    tension = (p["k"] * (lengths - p["l"]) + p["c"] * stretching)[:, None] * directions
    forces = -tension
    forces[:-1] += tension[1:]
    forces[:, 1] -= p["m"] * p["g"]
    return Equations(p["m"] * np.eye(len(q)), forces.ravel())


MECHANISMS = {
    "pendulum": pendulum,
    "pendulum_linear": pendulum_linear,
    "spring_pendulum": spring_pendulum,
    "double_pendulum": double_pendulum,
    "n_pendulum": n_pendulum,
    "cart_pole": cart_pole,
    "slider_crank": slider_crank,
    "four_bar": four_bar,
    "spring_chain": spring_chain,
}
