"""Equations of motion on the graph: energies, mass matrix, and inverse dynamics by virtual power.

Inertia forces come from d'Alembert's principle in Lagrange's form. Where T = 1/2 c u² with u the exact time
derivative of a function of (q, t), the generalised inertia force is (∂u/∂v)ᵀ c du/dt, since d/dt(∂u/∂v) = ∂u/∂q
there; for a rotating body it is (∂ω/∂v)ᵀ (I dω/dt + ω × I ω). So one forward sweep (accelerations) and one reverse
sweep over v (virtual power) give all of M a + h, as recursive Newton–Euler does. Other kinetic energies take the
general form d/dt(∂T/∂v) - ∂T/∂q.

The virtual power of a system on the graph: its derivatives by virtual velocities are the equations of motion.

P(q, v, a, λ, t; w, μ) = wᵀ (M a - f - Gᵀ λ) + μᵀ (G a - γ) is linear in the virtual velocities w and the weights μ, and
costs O(n) operations as sums over bodies, where the equations themselves are another sweep away from it. So all
derivatives of the equations are its mixed second derivatives, and edge pushing gathers, as on the kinetic energy, what
hangs below a joint before it meets what is above.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from ..model.description import Description, Load
from .constraints import Constraints, acceleration
from .graph.differentiate import forward, reverse
from .graph.hessian import mixed_hessian, sparse_hessian
from .graph.nodes import PARAM, VIRTUAL, Q, SparseRows, V
from .graph.vectors import cross, plus, times, transposed_times
from .kinematics import BodyKinematics, Scene, time_derivative
from .load import Loader
from .trees.recursive import Tree
from .variables import Variables

LARGEST_QUADRATIC_FORM = 12  # rates; beyond, virtual power is always cheaper
LARGEST_QUADRATIC_FORM_OF_A_TREE = 4


@dataclass(frozen=True)
class Mechanics:
    """What the description says, on the graph.

    `kinetic` is T without that of the `trees` on the world, which is quadratic in the rates; `energy` is all of T and
    V. `potential` is what generalised forces are derived from: V without the gravity that acts on trees. `products`
    are terms c·u·w of T with u, w exact time derivatives; `kinetic_rest` is what else T holds. `bodies` are those
    placed by hand. `applied` are pairs (velocity, force) of the loads: their power is that of non-conservative forces.
    `weightless` is `potential` without that of the bodies in `gravity`, which is zero where it is not uniform.
    First-order states are rates of mass 1 that have no kinetic energy, no force but their derivative.
    """

    kinetic: int
    potential: int
    energy: tuple[int, int]
    dissipation: int
    bodies: list[BodyKinematics]
    trees: list[Tree]
    products: list[tuple[int, int, int]]
    kinetic_rest: int
    applied: list[tuple[int, int]]
    generalised: dict[int, int]  # force on each rate, by index
    gravity: list[int]
    weightless: int


def mechanics(loader: Loader, description: Description, scene: Scene, x: Variables) -> Mechanics:
    """Energies and applied forces of a description."""
    g = loader.g
    half = g.const(0.5)
    kinetic, potential = g.zero, g.zero
    by_hand = [b for b in scene.bodies if b.velocity is not None]
    for b in by_hand:
        kinetic = g.add(kinetic, g.mul(g.mul(half, b.mass), g.dot(b.velocity, b.velocity)))
        if b.omega is not None and b.inertia is not None:
            kinetic = g.add(kinetic, g.mul(half, g.dot(b.omega, times(g, b.inertia, b.omega))))
        potential = g.sub(potential, g.mul(b.mass, g.dot(scene.gravity, b.position)))
    extra = loader.load(description.kinetic) if description.kinetic is not None else g.zero
    products, rest = _split_products(loader, extra)
    extra_potential = loader.load(description.potential) if description.potential is not None else g.zero
    kinetic = g.sum([kinetic, *(tree.kinetic for tree in scene.trees if not tree.on_world), extra])
    potential = g.add(potential, extra_potential)
    of_trees = g.sum(tree.gravity_potential(scene.gravity) for tree in scene.trees)
    whole_kinetic = g.sum([kinetic, *(tree.kinetic for tree in scene.trees if tree.on_world)])
    index = {r.name: k for k, r in enumerate(description.rates)}
    along = {index[name]: loader.load(force) for name, force in description.forces}
    x.changes.update({k: along.pop(k) for k in sorted(x.states)})
    return Mechanics(
        kinetic=kinetic,
        potential=potential if scene.uniform_gravity else g.add(potential, of_trees),
        energy=(whole_kinetic, g.add(potential, of_trees)),
        dissipation=loader.load(description.dissipation) if description.dissipation is not None else g.zero,
        bodies=by_hand,
        trees=scene.trees,
        products=products,
        kinetic_rest=rest,
        applied=[
            *(pair for load in description.loads for pair in _load_pairs(loader, load, scene.bodies)),
            *((loader.load(u), loader.load(force)) for u, force in description.rubbing),
        ],
        generalised=along,
        gravity=scene.gravity if scene.uniform_gravity else [g.zero] * 3,
        weightless=extra_potential if scene.uniform_gravity else g.add(potential, of_trees),
    )


def _load_pairs(loader: Loader, load: Load, bodies: list[BodyKinematics]) -> list[tuple[int, int]]:
    g = loader.g
    if load.force:
        velocity = time_derivative(loader, [loader.load(x) for x in load.point])
        return list(zip(velocity, [loader.load(x) for x in load.force], strict=True))
    body = next(b for b in bodies if b.body.name == load.body)
    torque = [loader.load(x) for x in load.torque]
    if len(torque) == 1:
        torque = [g.zero, g.zero, torque[0]]
    return list(zip(body.omega, transposed_times(g, body.rotation, torque), strict=True))


def _split_products(loader: Loader, kinetic: int) -> tuple[list[tuple[int, int, int]], int]:
    """Terms (c, u, w) = c·u·w of a kinetic energy with constant c and exact u, w; and the sum of the others."""
    g = loader.g
    products, rest = [], g.zero
    stack = [(kinetic, g.one)]
    while stack:
        node, factor = stack.pop()
        op, args = g.op[node], g.args[node]
        if op in ("add", "sub"):
            stack.append((args[1], factor if op == "add" else g.neg(factor)))
            stack.append((args[0], factor))
        elif op == "neg":
            stack.append((args[0], g.neg(factor)))
        elif op == "mul" and not g.mask[args[0]] & ~PARAM:
            stack.append((args[1], g.mul(factor, args[0])))
        elif op == "mul" and not g.mask[args[1]] & ~PARAM:
            stack.append((args[0], g.mul(factor, args[1])))
        elif op == "div" and not g.mask[args[1]] & ~PARAM:
            stack.append((args[0], g.div(factor, args[1])))
        elif op == "mul" and _is_exact(loader, args[0]) and _is_exact(loader, args[1]):
            products.append((factor, *args))
        elif node != g.zero:
            rest = g.add(rest, g.mul(factor, node))
    return products, rest


def _is_exact(loader: Loader, node: int) -> bool:
    """Whether a node is a constant combination of time derivatives of functions of q and t."""
    g = loader.g
    stack = [node]
    while stack:
        current = stack.pop()
        if current in loader.exact:
            continue
        op, args = g.op[current], g.args[current]
        if op in ("add", "sub", "neg"):
            stack.extend(args)
        elif op == "mul" and not g.mask[args[0]] & ~PARAM:
            stack.append(args[1])
        elif op == "mul" and not g.mask[args[1]] & ~PARAM:
            stack.append(args[0])
        elif op == "div" and not g.mask[args[1]] & ~PARAM:
            stack.append(args[0])
        else:
            return False
    return True


def mass_matrix(loader: Loader, mech: Mechanics, x: Variables) -> SparseRows:
    """M: the second derivatives of T by the rates, and composite bodies for trees on the world."""
    g = loader.g
    rows = sparse_hessian(g, mech.kinetic, x.v)
    for tree in mech.trees:
        if tree.on_world:
            for (i, j), entry in tree.mass_entries().items():
                rows[i][j] = g.add(rows[i].get(j, g.zero), entry)
    for k in x.states:
        rows[k][k] = g.one
    return [{j: entry for j, entry in sorted(row.items()) if entry != g.zero} for row in rows]


def inverse_dynamics(
    loader: Loader,
    mech: Mechanics,
    x: Variables,
    accelerations: list[int],
    apart: dict[int, int] | None = None,
) -> list[int]:
    """M a + h - Q for given accelerations (zeros give -f), without constraint forces.

    What acts along one of the velocities in `apart` is added there and left out of the result.
    """
    g = loader.g
    motion = x.motion(accelerations)
    seeds = [(u, force) for u, force in inertia_pairs(loader, mech, motion)]
    seeds += [(u, g.neg(force)) for u, force in mech.applied]
    potential = mech.potential
    if apart is not None:
        potential = mech.weightless
        for b in mech.bodies:
            seeds += [(u, g.neg(g.mul(b.mass, a))) for u, a in zip(b.velocity, mech.gravity, strict=True)]
        for u, force in seeds:
            if u in apart:
                apart[u] = g.add(apart[u], force)
        seeds = [(u, force) for u, force in seeds if u not in apart]
    seeds.append((mech.dissipation, g.one))
    down = [(mech.kinetic_rest, g.const(-1.0))]
    if x.marks or x.quaternions:  # ∂(dV/dt)/∂v is Nᵀ ∂V/∂q, and stops at points
        seeds += [(change, g.one) for change in forward(g, [potential], loader.rates)]
    else:
        down.insert(0, (potential, g.one))
    by_rate = reverse(g, seeds, V)
    by_position = x.by_rates(reverse(g, down, Q))
    result = [g.add(r, p) for r, p in zip(x.along_rates(by_rate), by_position, strict=True)]
    for k, force in mech.generalised.items():
        result[k] = g.sub(result[k], force)
    if mech.kinetic_rest != g.zero:
        momentum = reverse(g, [(mech.kinetic_rest, g.one)], V)
        p = [momentum.get(v, g.zero) for v in x.v]
        result = [g.add(r, change) for r, change in zip(result, forward(g, p, motion), strict=True)]
        result = [g.add(r, turning) for r, turning in zip(result, turning_momentum(x, p), strict=True)]
    for k, change in x.changes.items():
        result[k] = g.sub(accelerations[k], change)
    return result


def turning_momentum(x: Variables, p: list[int]) -> list[int]:
    """ω × p for the angular velocities of quaternions: what dp/dt lacks in their turning axes (Boltzmann-Hamel)."""
    result = [x.g.zero] * len(p)
    for _, i in x.quaternions:
        result[i : i + 3] = cross(x.g, x.v[i : i + 3], p[i : i + 3])
    return result


def inertia_pairs(loader: Loader, mech: Mechanics, motion: dict[int, int]) -> list[tuple[int, int]]:
    """Pairs (velocity, force) whose virtual power is that of the inertia forces, and of gravity on trees."""
    g = loader.g
    pairs: list[tuple[int, int]] = []
    moving = [u for b in mech.bodies for u in (*b.velocity, *(b.omega or ()))]
    moving += [u for _, *factors in mech.products for u in factors]
    rate = dict(zip(moving, forward(g, moving, motion), strict=True))
    for b in mech.bodies:
        pairs += [(u, g.mul(b.mass, rate[u])) for u in b.velocity]
        if b.omega is not None and b.inertia is not None:
            alpha = [rate[u] for u in b.omega]
            spin = cross(g, b.omega, times(g, b.inertia, b.omega))
            pairs += list(zip(b.omega, plus(g, times(g, b.inertia, alpha), spin), strict=True))
    for c, u, w in mech.products:
        pairs.append((u, g.mul(c, rate[w])))
        pairs.append((w, g.mul(c, rate[u])))
    for tree in mech.trees:
        pairs += tree.pairs([motion[v] for v in tree.x.v])
    return pairs


def external_power(
    loader: Loader, mech: Mechanics, x: Variables, mass: SparseRows, accelerations: list[int]
) -> int:
    """Power of all that is not the gradient of V, except constraint forces: dE/dt for E = T + V.

    With the Jacobi integral h = v·∂T/∂v - T + V: dh/dt = Q·v - ∂T/∂t + ∂V/∂t, and E = h + (2T - v·∂T/∂v), whose last
    part vanishes where T is a quadratic form in the rates.
    """
    g = loader.g
    power = g.dot(applied_forces(mech, x), x.v)
    by_time = forward(g, list(mech.energy), {x.t: g.one} | {x.v[k]: rate for k, rate in x.changes.items()})
    power = g.add(power, g.sub(by_time[1], by_time[0]))
    if not _is_quadratic(loader, mech, x, mass):
        momentum = reverse(g, [(mech.kinetic, g.one)], V)
        excess = g.mul(g.const(2.0), mech.kinetic)
        for v in x.v:
            excess = g.sub(excess, g.mul(v, momentum.get(v, g.zero)))
        power = g.add(power, forward(g, [excess], x.motion(accelerations))[0])
    return power


def applied_forces(mech: Mechanics, x: Variables) -> list[int]:
    """Generalised forces of all that has no potential, by rates."""
    g = x.g
    seeds = [*mech.applied, (mech.dissipation, g.const(-1.0))]
    by_rate = reverse(g, seeds, V)
    return [g.add(r, mech.generalised.get(k, g.zero)) for k, r in enumerate(x.along_rates(by_rate))]


def _is_quadratic(loader: Loader, mech: Mechanics, x: Variables, mass: SparseRows) -> bool:
    """Whether T is a quadratic form in the rates; prescribed motion, for one, adds terms of lower degree."""
    g = loader.g
    if any(g.mask[entry] & V for row in mass for entry in row.values()):
        return False
    momentum = reverse(g, [(mech.kinetic, g.one)], V)
    at_rest = dict.fromkeys(x.v, g.zero)
    values = g.substitute([mech.kinetic, *(momentum.get(v, g.zero) for v in x.v)], at_rest)
    return all(node == g.zero for node in values)


def cheapest_form(loader: Loader, mech: Mechanics, x: Variables, mass: SparseRows) -> Mechanics:
    """The mechanics with its kinetic energy in the form that gives the cheaper equations.

    Virtual power costs O(n) operations, but does not see that, say, the bob of a pendulum has no centrifugal moment.
    T = vᵀ M v / 2 with the entries of M, where sin² + cos² has been found, does; it costs O(n²).
    """
    g = loader.g
    largest = LARGEST_QUADRATIC_FORM_OF_A_TREE if mech.trees else LARGEST_QUADRATIC_FORM
    if len(x.v) > largest or not _is_quadratic(loader, mech, x, mass):
        return mech
    momentum = [g.dot(row, x.v) for row in g.dense(list(map(x.without_states, mass)), len(x.v))]
    quadratic = g.mul(g.const(0.5), g.dot(momentum, x.v))
    whole = {"potential": mech.energy[1], "weightless": mech.energy[1]}
    other = replace(mech, bodies=[], trees=[], products=[], kinetic_rest=quadratic, **whole)
    at_rest = [g.zero] * len(x.v)

    def cost(form: Mechanics) -> int:
        entries = [entry for row in mass for entry in row.values()]
        return g.count([*entries, *inverse_dynamics(loader, form, x, at_rest)])

    return min(mech, other, key=cost)


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
    virtual_rates = x.of_motion(w)
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
    terms += [g.mul(w[k], g.sub(x.a[k], change)) for k, change in x.changes.items()]
    return g.sum(terms)


def _constraint_power(loader: Loader, c: Constraints, x: Variables, w: list[int], weights: list[int]) -> int:
    """-λᵀ G w + μᵀ (G a - γ)."""
    g = loader.g
    virtual_rates = x.of_motion(w)
    if x.marks or x.quaternions:
        velocities = forward(g, c.velocity, virtual_rates)
    else:
        n_holonomic = len(c.position)
        velocities = forward(g, c.position, x.displacement(w))
        velocities += forward(g, c.velocity[n_holonomic:], virtual_rates)
    return g.sub(g.dot(weights, acceleration(loader, c.velocity, x, x.a)), g.dot(x.lam, velocities))
