"""From a model description to its equations: the derivation, top to bottom."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import sympy

from ..model.description import Description
from .constraints import Constraints, acceleration, constraint_forces, constraints, rheonomic_power
from .dynamics import (
    Mechanics,
    cheapest_form,
    external_power,
    inverse_dynamics,
    mass_matrix,
    mechanics,
)
from .graph.differentiate import jacobian
from .graph.gather import gather
from .graph.graph import Graph
from .graph.hessian import hessian
from .graph.kinds import INPUT, PARAM
from .graph.nodes import SparseRows
from .graph.quaternions import normalised
from .graph.vectors import Matrix
from .header import header
from .kinematics import Scene
from .load import Loader
from .program import Function, Program
from .solve import factorise as ldl
from .structure import structure
from .trees.articulated import solve_articulated
from .trees.derivatives import add_tree_derivatives
from .variables import Variables, variables, with_rates
from .virtual_power import residual_by_state

LARGEST_GATHERED = 12  # rates; in larger mass matrices the search takes longer than it saves
LARGEST_TREE_TRIED_ALL_WAYS = 8
# Numbers in a state; beyond, the derivatives of the virtual power are always cheapest.
LARGEST_TRIED_ALL_WAYS = 60


class Derivation:
    """The parts of one model's equations on its graph, each derived once and shared by the functions that use it."""

    def __init__(self, description: Description) -> None:
        self.description = d = with_rates(description)
        self.g = g = Graph()
        self.x: Variables = variables(g, d)
        x, n = self.x, len(d.rates)
        self.loader = _loader(g, d, x)
        self.scene = Scene(self.loader, d, x)
        self.bodies = self.scene.bodies
        self.mech: Mechanics = mechanics(self.loader, d, self.scene)
        self.mass: Matrix = _gathered(g, mass_matrix(self.loader, self.mech, x))
        self.form: Mechanics = cheapest_form(self.loader, self.mech, x, self.mass)
        self.forces = [g.neg(h) for h in inverse_dynamics(self.loader, self.form, x, [g.zero] * n)]
        self.constraints: Constraints = constraints(self.loader, d, x)
        self.mass_rows, self.jacobian_rows = g.sparse(self.mass), g.sparse(self.constraints.jacobian)
        names = [r.name for r in d.rates] + [c.name for c in (*d.constraints, *d.velocity_constraints)]
        self.factors = ldl.factorise(g, self.mass, self.constraints.jacobian, names)
        solution = ldl.solve(g, self.factors, [*self.forces, *self.constraints.gamma])
        articulated = self._by_articulated_bodies()
        if articulated is not None and g.count([*articulated, *self.forces]) < g.count(
            [*solution, *self.forces]
        ):
            solution = articulated
        self.accelerations = solution[:n]
        self.multipliers = [g.neg(value) for value in solution[n:]]
        self.power = g.add(
            external_power(self.loader, self.mech, x, self.mass, self.accelerations),
            rheonomic_power(self.loader, self.constraints, x, self.multipliers),
        )

    def _by_articulated_bodies(self) -> list[int] | None:
        """Accelerations along the trees, where nothing but single joints' inertia adds to theirs."""
        g, x = self.g, self.x
        trees = self.form.trees
        if not trees or x.lam or not all(tree.on_world for tree in trees):
            return None
        rest = hessian(g, self.mech.kinetic, x.v)
        if any(entry != g.zero for i, row in enumerate(rest) for k, entry in enumerate(row) if i != k):
            return None
        return solve_articulated(g, trees, [row[i] for i, row in enumerate(rest)], self.forces)

    @property
    def conservative(self) -> bool:
        """Whether nothing but the gradient of V does work."""
        return self.power == self.g.zero


def _gathered(g: Graph, matrix: Matrix) -> Matrix:
    """The matrix with the parameters in its products gathered: some entries are seen to be zero only then."""
    if len(matrix) > LARGEST_GATHERED:
        return matrix
    flat = gather(g, tuple(entry for row in matrix for entry in row))
    n = len(matrix)
    return [list(flat[k * n : (k + 1) * n]) for k in range(n)]


def _loader(g: Graph, d: Description, x: Variables) -> Loader:
    symbols = {"t": x.t}
    symbols |= {r.name: node for r, node in zip(d.rates, x.v, strict=True)}
    symbols |= {c.name: node for c, node in zip(d.coordinates, x.q, strict=True)}
    symbols |= {p.name: g.var(PARAM, k) for k, p in enumerate(d.parameters)}
    symbols |= {u.name: g.var(INPUT, k) for k, u in enumerate(d.inputs)}
    symbols |= {c.name: g.const(c.value) for c in d.constants}
    loader = Loader(g, symbols, dict(zip([*x.q, x.t], [*x.qdot, g.one], strict=True)))
    loader.count_terms(_expressions(d))
    return loader


def _expressions(d: Description) -> Iterator[sympy.Expr]:
    """All expressions that end up in positions and energies."""
    for _, expression in d.definitions:
        yield expression
    for body in d.bodies:
        yield from body.com
    for expression in (d.kinetic, d.potential, d.dissipation):
        if expression is not None:
            yield expression
    for constraint in (*d.constraints, *d.velocity_constraints):
        yield constraint.expression


def derive(description: Description, source: str = "") -> Program:
    """Derive the equations of motion, all of them together, and every function that the model needs.

    Parameters
    ----------
    description : Description
        A checked description.
    source : str
        Hash of the model's text, kept in the module's header.

    Returns
    -------
    Program
    """
    d = Derivation(description)
    program = Program(d.g, tuple(functions(d)), {})
    head = header(description, d, source, program.operations()) | {"subsystems": []}
    return replace(program, header=head, findings=tuple(structure(d).findings))


def functions(d: Derivation) -> Iterator[Function]:
    """The functions of the ABI that this model has, parameters gathered, in the order of the generated file."""
    for function in _functions(d):
        yield replace(function, outputs=gather(d.g, function.outputs))


def _functions(d: Derivation) -> Iterator[Function]:
    x, c = d.x, d.constraints
    m = len(x.lam)
    work = [] if d.conservative else [d.power]
    ratio = [ldl.pivot_ratio(d.g, d.factors)] if m else []
    yield Function(
        "rhs",
        "State derivative: rates, accelerations"
        + (", power" if work else "")
        + (", multipliers, pivot ratio." if m else "."),
        (*x.qdot, *d.accelerations, *work, *d.multipliers, *ratio),
    )
    yield Function.matrix("mass_matrix", "Mass matrix M, row by row.", d.mass_rows, len(x.v))
    yield Function("forces", "Forces f of M a = f + G^T lambda.", tuple(d.forces))
    yield Function("energy", "Kinetic and potential energy.", d.mech.energy)
    yield from _residual_functions(d)
    if m:
        yield Function(
            "constraint_residual", "Position residuals, velocity residuals.", (*c.position, *c.velocity)
        )
        doc = "Constraint Jacobian G, row by row."
        yield Function.matrix("constraint_jacobian", doc, d.jacobian_rows, len(x.v))
        yield Function("gamma", "Right-hand side of G a = gamma.", tuple(c.gamma))
    if m or x.quaternions:
        yield _projection(d)
    if x.quaternions:
        yield _kinematics(d)
    yield from _observers(d)


def _residual_functions(d: Derivation) -> Iterator[Function]:
    """M a - f - Gᵀλ and G a - γ, with their derivatives; `a` is an input, so no inverse is differentiated."""
    g, x = d.g, d.x
    residual = _residual(d, d.form)
    yield Function("residual", "M a - f - G^T lambda, then G a - gamma.", tuple(residual))
    rows = _residual_by_state(d, residual)
    first, G = len(x.q) + len(x.v), d.jacobian_rows
    for row, entries in zip(rows, [*d.mass_rows, *G], strict=True):
        row.update({first + k: entry for k, entry in entries.items()})
    for j, entries in enumerate(G):
        for k, entry in entries.items():
            rows[k][first + len(x.v) + j] = g.neg(entry)
    doc = "Residual derivatives by q, v, a, lambda."
    yield Function.matrix("residual_jacobian", doc, rows, first + len(x.v) + len(x.lam))


def _residual(d: Derivation, form: Mechanics) -> list[int]:
    """M a - f - Gᵀ λ with the inertia and the forces of `form`, then G a - γ."""
    g, x = d.g, d.x
    dynamics = inverse_dynamics(d.loader, form, x, x.a)
    reactions = constraint_forces(d.loader, d.constraints, x)
    momentum = [g.sub(f, r) for f, r in zip(dynamics, reactions, strict=True)]
    return [*momentum, *acceleration(d.loader, d.constraints.velocity, x, x.a)]


def _residual_by_state(d: Derivation, residual: list[int]) -> SparseRows:
    """Derivatives of the residual by q and v, in whichever way costs least.

    Trees on the world have recursive derivatives of their own; the rest is differentiated as its virtual power, or
    row by row, or column by column.
    """
    g, state = d.g, [*d.x.q, *d.x.v]
    known = [entry for row in (*d.mass, *d.constraints.jacobian) for entry in row]

    def cost(rows: SparseRows) -> int:
        return g.count([*known, *(entry for row in rows for entry in row.values())])

    trees = [tree for tree in d.form.trees if tree.on_world]
    rest = replace(d.form, trees=[tree for tree in d.form.trees if not tree.on_world])
    ways = [residual_by_state(d.loader, rest, d.constraints, d.x)]
    if len(state) <= LARGEST_TRIED_ALL_WAYS:
        ways.append(g.sparse(jacobian(g, _residual(d, rest) if trees else residual, state)))
    best = min(ways, key=cost) if len(ways) > 1 else ways[0]
    for tree in trees:
        add_tree_derivatives(tree, best)
    if trees and len(state) <= LARGEST_TREE_TRIED_ALL_WAYS:
        best = min(best, g.sparse(jacobian(g, residual, state)), key=cost)
    return best


def _projection(d: Derivation) -> Function:
    """One Gauss step in the mass metric on positions, then one on velocities with the same factor.

    Quaternions move along q + N δ and get their length back.
    """
    g, x, c = d.g, d.x, d.constraints
    n, nh, m = len(x.v), len(c.position), len(x.lam)
    q, v, drift = list(x.q), x.v, []
    if nh:
        right = [*[g.zero] * n, *[g.neg(r) for r in c.position], *[g.zero] * (m - nh)]
        step = x.displacement(ldl.solve(g, d.factors, right)[:n])
        q = [g.add(k, step[k]) for k in x.q]
    for k, _ in x.quaternions:
        q[k : k + 4] = normalised(g, q[k : k + 4])
    if m:
        drift = g.substitute(c.velocity, dict(zip(x.q, q, strict=True)))
        change = ldl.solve(g, d.factors, [*[g.zero] * n, *[g.neg(r) for r in drift]])[:n]
        v = [g.add(a, b) for a, b in zip(x.v, change, strict=True)]
    doc = (
        "State moved onto the constraints, and the residuals it had." if m else "State with unit quaternions."
    )
    return Function("project", doc, (*q, *v, *c.position, *drift))


def _kinematics(d: Derivation) -> Function:
    """N of dq/dt = N v, and the derivative of N v by q."""
    x = d.x
    flat = [entry for row in x.kinematic_matrix() for entry in row]
    flat += [entry for row in jacobian(d.g, x.qdot, x.q) for entry in row]
    entries = {k: entry for k, entry in enumerate(flat) if entry != d.g.zero}
    doc = "N of dq/dt = N v, row by row; derivative of N v by q."
    return Function("kinematics", doc, tuple(entries.values()), tuple(entries))


def _observers(d: Derivation) -> Iterator[Function]:
    """What is looked at, not integrated: poses, shapes, outputs, events and their resets."""
    load = d.loader.load
    if d.bodies:
        poses = [node for b in d.bodies for node in (*b.position, *(e for row in b.rotation for e in row))]
        yield Function("poses", "Per body: position, rotation matrix (body to world).", tuple(poses))
    sizes = [load(s) for b in d.bodies if b.body.shape is not None for s in b.body.shape.sizes]
    if sizes:
        yield Function("shapes", "Sizes of the bodies' shapes.", tuple(sizes))
    if d.description.outputs:
        yield Function("outputs", "Outputs.", tuple(load(e) for _, e in d.description.outputs))
    if d.description.events:
        yield Function("events", "Event functions.", tuple(load(e.when) for e in d.description.events))
    coordinate = {c.name: k for k, c in enumerate(d.description.coordinates)}
    rate = {r.name: len(d.x.q) + k for k, r in enumerate(d.description.rates)}
    for event in d.description.events:
        if event.action == "reset":
            state = [*d.x.q, *d.x.v]
            for reset in event.resets:
                state[(rate if reset.is_rate else coordinate)[reset.target]] = load(reset.value)
            yield Function(f"reset_{event.name}", f"State after event '{event.name}'.", tuple(state))
