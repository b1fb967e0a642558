"""The virtual power of a system on the graph: its derivatives by virtual velocities are the equations of motion.

P(q, v, a, λ, t; w, μ) = wᵀ (M a - f - Gᵀ λ) + μᵀ (G a - γ) is linear in the virtual velocities w and the weights μ, and
costs O(n) operations as sums over bodies, where the equations themselves are another sweep away from it. So all
derivatives of the equations are its mixed second derivatives, and edge pushing gathers, as on the kinetic energy, what
hangs below a joint before it meets what is above.
"""

from __future__ import annotations

from .constraints import Constraints, acceleration
from .dynamics import Mechanics, inertia_pairs, turning_momentum
from .graph.differentiate import forward, reverse
from .graph.hessian import mixed_hessian
from .graph.kinds import VIRTUAL, V
from .graph.nodes import SparseRows
from .load import Loader
from .variables import Variables


def residual_by_state(loader: Loader, mech: Mechanics, constraints: Constraints, x: Variables) -> SparseRows:
    """Derivatives of (M a - f - Gᵀ λ, G a - γ) by (q, v)."""
    g = loader.g
    w = [g.var(VIRTUAL, k) for k in range(len(x.v))]
    weights = [g.var(VIRTUAL, len(w) + k) for k in range(len(x.lam))]
    power = g.add(
        _inertial_and_applied(loader, mech, x, w), _constraint_power(loader, constraints, x, w, weights)
    )
    return mixed_hessian(g, power, [*w, *weights], [*x.q, *x.v])


def _inertial_and_applied(loader: Loader, mech: Mechanics, x: Variables, w: list[int]) -> int:
    """wᵀ (M a - f): power of inertia and applied forces under virtual velocities."""
    g = loader.g
    motion = x.motion(x.a)
    virtual_rates = dict(zip(x.v, w, strict=True))
    pairs = inertia_pairs(loader, mech, motion) + [(u, g.neg(force)) for u, force in mech.applied]
    virtual = g.substitute([u for u, _ in pairs], virtual_rates)
    terms = [g.dot(virtual, [force for _, force in pairs])]
    displacement = x.displacement(w)
    up, down = forward(g, [mech.potential, mech.kinetic_rest], displacement)
    terms += [up, g.neg(down), *forward(g, [mech.dissipation], virtual_rates)]
    momentum = forward(g, [mech.kinetic_rest], virtual_rates)
    terms += forward(g, momentum, motion)
    if x.quaternions:
        by_rate = reverse(g, [(mech.kinetic_rest, g.one)], V)
        terms.append(g.dot(w, turning_momentum(x, [by_rate.get(v, g.zero) for v in x.v])))
    terms += [g.neg(g.mul(w[k], force)) for k, force in sorted(mech.generalised.items())]
    return g.sum(terms)


def _constraint_power(loader: Loader, c: Constraints, x: Variables, w: list[int], weights: list[int]) -> int:
    """-λᵀ G w + μᵀ (G a - γ)."""
    g = loader.g
    virtual_rates = dict(zip(x.v, w, strict=True))
    if x.marks or x.quaternions:
        velocities = forward(g, c.velocity, virtual_rates)
    else:
        n_holonomic = len(c.position)
        velocities = forward(g, c.position, x.displacement(w))
        velocities += forward(g, c.velocity[n_holonomic:], virtual_rates)
    return g.sub(g.dot(weights, acceleration(loader, c.velocity, x, x.a)), g.dot(x.lam, velocities))
