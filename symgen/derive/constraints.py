"""Constraints on the graph: positions, velocities, accelerations, Jacobian and constraint forces."""

from __future__ import annotations

from dataclasses import dataclass

from ..model.description import Description
from .graph.differentiate import forward, reverse, sparse_jacobian
from .graph.nodes import SparseRows
from .kinematics import time_derivative
from .load import Loader
from .variables import Variables


@dataclass(frozen=True)
class Constraints:
    """Holonomic constraints Φ(q, t) = 0 first, then velocity constraints c(q, v, t) = 0."""

    position: list[int]  # Φ
    velocity: list[int]  # dΦ/dt, then c
    jacobian: SparseRows  # G
    gamma: list[int]  # G a = γ


def constraints(loader: Loader, description: Description, x: Variables) -> Constraints:
    """All levels of the constraints of a description."""
    g = loader.g
    position = [loader.load(c.expression) for c in description.constraints]
    nonholonomic = [loader.load(c.expression) for c in description.velocity_constraints]
    velocity = [*time_derivative(loader, position), *nonholonomic]
    if x.marks or x.quaternions:
        G = sparse_jacobian(g, velocity, x.v)
    else:
        G = sparse_jacobian(g, position, x.q) + sparse_jacobian(g, nonholonomic, x.v)
    bias = acceleration(loader, velocity, x, [g.zero] * len(x.v))
    return Constraints(position, velocity, G, [g.neg(b) for b in bias])


def acceleration(loader: Loader, velocity: list[int], x: Variables, accelerations: list[int]) -> list[int]:
    """Time derivatives of velocity-level constraints for given accelerations: G a - γ."""
    return forward(loader.g, velocity, x.motion(accelerations))


def constraint_forces(loader: Loader, c: Constraints, x: Variables) -> list[int]:
    """Gᵀ λ, by one reverse sweep: no products with the elements of G."""
    g = loader.g
    if x.marks or x.quaternions:
        by_rate = reverse(g, list(zip(c.velocity, x.lam, strict=True)), g.mask[x.v[0]])
        return [by_rate.get(v, g.zero) for v in x.v]
    from_position = reverse(g, list(zip(c.position, x.lam, strict=False)), g.mask[x.q[0]])
    rest = list(zip(c.velocity[len(c.position) :], x.lam[len(c.position) :], strict=True))
    from_velocity = reverse(g, rest, g.mask[x.v[0]])
    return [
        g.add(from_position.get(q, g.zero), from_velocity.get(v, g.zero))
        for q, v in zip(x.q, x.v, strict=True)
    ]


def rheonomic_power(loader: Loader, c: Constraints, x: Variables, multipliers: list[int]) -> int:
    """Power of the constraint forces, λᵀ G v = -λᵀ (what is left of the velocity level at v = 0)."""
    g = loader.g
    drift = g.substitute(c.velocity, dict.fromkeys(x.v, g.zero))
    return g.neg(g.dot(multipliers, drift))
