"""From a model description to its equations: the derivation, top to bottom."""

from __future__ import annotations

from collections.abc import Iterator

import sympy

from ..model.description import Description
from . import factorise as ldl
from .constraints import Constraints, acceleration, constraint_forces, constraints, rheonomic_power
from .differentiate import jacobian
from .dynamics import (
    Mechanics,
    Variables,
    cheapest_form,
    external_power,
    inverse_dynamics,
    mass_matrix,
    mechanics,
)
from .graph import INPUT, LAM, PARAM, A, Graph, Q, T, V
from .header import header
from .kinematics import Matrix, body_kinematics
from .load import Loader
from .program import Function, Program
from .structure import structure


class Derivation:
    """The parts of one model's equations on its graph, each derived once and shared by the functions that use it."""

    def __init__(self, description: Description) -> None:
        self.description = d = description
        self.g = g = Graph()
        n, m = len(d.coordinates), len(d.constraints) + len(d.velocity_constraints)
        self.x = x = Variables(
            t=g.var(T),
            q=[g.var(Q, k) for k in range(n)],
            v=[g.var(V, k) for k in range(n)],
            a=[g.var(A, k) for k in range(n)],
            lam=[g.var(LAM, k) for k in range(m)],
        )
        self.loader = _loader(g, d, x)
        self.bodies = body_kinematics(self.loader, d)
        self.mech: Mechanics = mechanics(self.loader, d, self.bodies)
        self.mass: Matrix = mass_matrix(self.loader, self.mech, x)
        self.form: Mechanics = cheapest_form(self.loader, self.mech, x, self.mass)
        self.forces = [g.neg(h) for h in inverse_dynamics(self.loader, self.form, x, [g.zero] * n)]
        self.constraints: Constraints = constraints(self.loader, d, x)
        names = [c.name for c in d.coordinates] + [c.name for c in (*d.constraints, *d.velocity_constraints)]
        self.factors = ldl.factorise(g, self.mass, self.constraints.jacobian, names)
        solution = ldl.solve(g, self.factors, [*self.forces, *self.constraints.gamma])
        self.accelerations = solution[:n]
        self.multipliers = [g.neg(value) for value in solution[n:]]
        self.power = g.add(
            external_power(self.loader, self.mech, x, self.mass, self.accelerations),
            rheonomic_power(self.loader, self.constraints, x, self.multipliers),
        )

    @property
    def conservative(self) -> bool:
        """Whether nothing but the gradient of V does work."""
        return self.power == self.g.zero


def _loader(g: Graph, d: Description, x: Variables) -> Loader:
    symbols = {"t": x.t}
    symbols |= {c.name: node for c, node in zip(d.coordinates, x.q, strict=True)}
    symbols |= {p.name: g.var(PARAM, k) for k, p in enumerate(d.parameters)}
    symbols |= {u.name: g.var(INPUT, k) for k, u in enumerate(d.inputs)}
    symbols |= {c.name: g.const(c.value) for c in d.constants}
    loader = Loader(g, symbols, dict(zip([*x.q, x.t], [*x.v, g.one], strict=True)))
    loader.count_terms(_expressions(d))
    for name, expression in d.definitions:
        loader.define(name, expression)
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
    """Derive the equations of motion and every function that the model needs.

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
    functions = tuple(_functions(d))
    program = Program(d.g, functions, {})
    head = header(description, d, source, program.operations())
    return Program(d.g, functions, head, tuple(structure(d).findings))


def _functions(d: Derivation) -> Iterator[Function]:
    """The functions of the ABI that this model has, in the order of the generated file."""
    x, c = d.x, d.constraints
    m = len(x.lam)
    work = [] if d.conservative else [d.power]
    ratio = [ldl.pivot_ratio(d.g, d.factors)] if m else []
    yield Function(
        "rhs",
        "State derivative: rates, accelerations"
        + (", power" if work else "")
        + (", multipliers, pivot ratio." if m else "."),
        (*x.v, *d.accelerations, *work, *d.multipliers, *ratio),
    )
    flat = [entry for row in d.mass for entry in row]
    yield Function("mass_matrix", "Mass matrix M, row by row.", tuple(flat), sparse=True)
    yield Function("forces", "Forces f of M a = f + G^T lambda.", tuple(d.forces))
    yield Function("energy", "Kinetic and potential energy.", (d.mech.kinetic, d.mech.potential))
    yield from _residual_functions(d)
    if m:
        yield Function(
            "constraint_residual", "Position residuals, velocity residuals.", (*c.position, *c.velocity)
        )
        flat = [entry for row in c.jacobian for entry in row]
        yield Function("constraint_jacobian", "Constraint Jacobian G, row by row.", tuple(flat), sparse=True)
        yield Function("gamma", "Right-hand side of G a = gamma.", tuple(c.gamma))
        yield _projection(d)
    yield from _observers(d)


def _residual_functions(d: Derivation) -> Iterator[Function]:
    """M a - f - Gᵀλ and G a - γ, with their derivatives; `a` is an input, so no inverse is differentiated."""
    g, x = d.g, d.x
    dynamics = inverse_dynamics(d.loader, d.form, x, x.a)
    reactions = constraint_forces(d.loader, d.constraints, x)
    momentum = [g.sub(f, r) for f, r in zip(dynamics, reactions, strict=True)]
    kinematic = acceleration(d.loader, d.constraints.velocity, x, x.a)
    residual = [*momentum, *kinematic]
    yield Function("residual", "M a - f - G^T lambda, then G a - gamma.", tuple(residual))
    by_state = jacobian(g, residual, [*x.q, *x.v])
    G = d.constraints.jacobian
    entries: list[int] = []
    for row, matrix_row in zip(by_state, [*d.mass, *G], strict=True):
        k = len(entries) // (3 * len(x.q) + len(x.lam))
        by_multiplier = [g.neg(G[j][k]) if k < len(x.v) else g.zero for j in range(len(x.lam))]
        entries += [*row, *matrix_row, *by_multiplier]
    yield Function(
        "residual_jacobian", "Residual derivatives by q, v, a, lambda.", tuple(entries), sparse=True
    )


def _projection(d: Derivation) -> Function:
    """One Gauss step in the mass metric on positions, then one on velocities with the same factor."""
    g, x, c = d.g, d.x, d.constraints
    n, nh = len(x.q), len(c.position)
    at_rest = [g.zero] * (len(x.lam) - nh)
    step = ldl.solve(g, d.factors, [*[g.zero] * n, *[g.neg(r) for r in c.position], *at_rest])[:n]
    q = [g.add(a, b) for a, b in zip(x.q, step, strict=True)] if nh else x.q
    drift = g.substitute(c.velocity, dict(zip(x.q, q, strict=True)))
    change = ldl.solve(g, d.factors, [*[g.zero] * n, *[g.neg(r) for r in drift]])[:n]
    v = [g.add(a, b) for a, b in zip(x.v, change, strict=True)]
    return Function(
        "project",
        "State moved onto the constraints, and the residuals it had.",
        (*q, *v, *c.position, *drift),
    )


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
    index = {c.name: k for k, c in enumerate(d.description.coordinates)}
    for event in d.description.events:
        if event.action == "reset":
            state = [*d.x.q, *d.x.v]
            for reset in event.resets:
                state[index[reset.target] + (len(d.x.q) if reset.is_rate else 0)] = load(reset.value)
            yield Function(f"reset_{event.name}", f"State after event '{event.name}'.", tuple(state))
