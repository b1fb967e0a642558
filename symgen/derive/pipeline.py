"""From a model description to its equations: the derivation, top to bottom."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import replace

from symgen.runtime.graph.spelling import reset_function

from ..model.description import Description
from . import sensitivity
from .balances import with_balances
from .constraints import acceleration, constraint_forces
from .contacts import SWITCHED, Switches, has_switches
from .derivation import Derivation
from .dynamics import Mechanics, inverse_dynamics, residual_by_state
from .graph.differentiate import finite_at_roots, is_guarded, jacobian, sparse_jacobian
from .graph.elimination import eliminated_jacobian
from .graph.graph import Graph
from .graph.hoist import gather
from .graph.nodes import SparseRows
from .graph.vectors import normalised
from .header import header
from .input_rates import with_input_rates
from .jumps import with_branches
from .limits import limit_function
from .marks import Mark, height_function, mark_function, mark_records, marks
from .program import CLOSED_PREFIX, Function, Program
from .solve import factorise as ldl
from .starts import levels, start_conditions, start_function, start_record
from .structure import structure
from .time_terms import own_terms, term_count, time_function
from .trees.derivatives import add_tree_derivatives
from .variables import with_rates
from .windings import winding_function

LARGEST_TREE_TRIED_ALL_WAYS = 8
# Numbers in a state; beyond, the derivatives of the virtual power are always cheapest.
LARGEST_TRIED_ALL_WAYS = 60
# Operations of a residual, in all and for each number in a state; beyond, elimination is always cheapest. Of plane
# chains of bodies, whose derivatives are dense and follow from what hangs below each, it makes up to three times more.
LONGEST_TRIED_ALL_WAYS, LONGEST_OF_A_STATE = 2000, 30
# The same of one with choices whose other side may break: sweeps go through each of them by itself.
LONGEST_SWEPT = 1000


def derive(
    description: Description,
    source: str = "",
    *,
    gathered: bool = True,
    articulated: bool = True,
    jacobian: bool = False,
    late: Collection[str] = (),
) -> Program:
    """Derive the equations of motion, all of them together, and every function that the model needs.

    Parameters
    ----------
    description : Description
        A checked description.
    source : str
        Hash of the model's text, kept in the module's header.
    gathered, articulated : bool
        Whether parameters are collected in products, and whether trees are solved body by body where that costs less;
        not, to see what that gains. Models with stops or dry friction take no notice.
    jacobian : bool
        Whether there are functions for the derivatives of `rhs`; not of models with stops or dry friction.
    late : collection of str
        Functions that are left out, and named in the header, those with stops closed by names of their own.

    Returns
    -------
    Program
    """
    drawn = description
    description = with_balances(with_input_rates(description))
    if has_switches(description):
        return derive_switched(description, source, late)
    late = [name for name in late if not name.startswith(CLOSED_PREFIX)]
    d = Derivation(with_branches(description, description), articulated=articulated, own=description)
    found = marks(d.description if description is drawn else with_rates(drawn))
    own = tuple(functions(d, gathered, late))
    if jacobian:
        own += tuple(sensitivity.derivatives(d, lambda: _residual(d, d.form), len(description.inputs)))
    own += (
        *drawn_marks(d, found),
        *start_function(d.loader, d.description),
        *limit_function(d.loader.load, description),
        *_start_conditions(d),
        *time_function(own_terms(d.g, own)),
    )
    program = Program(d.g, own, {})
    head = header(d.description, d, source, program.operations()) | {"subsystems": []} | mark_records(found)
    head |= term_count(own)
    if jacobian:
        head["jacobian"] = True
    if late:
        head["late"] = late
    head |= solves(program) | _start_record(d)
    head["inputs"] = head["inputs"][: len(description.inputs)]
    return replace(program, header=head, findings=tuple(structure(d).findings))


def derive_switched(description: Description, source: str, late: Collection[str]) -> Program:
    """Derive a model with stops or dry friction twice: with all of them open and sliding, and with each on a switch."""
    of_closed = {name.removeprefix(CLOSED_PREFIX) for name in late if name.startswith(CLOSED_PREFIX)}
    switches = Switches.of(description)
    d = Derivation(with_branches(switches.form(), description), switches, own=description)
    closed = Derivation(with_branches(switches.closed.form(), description), switches.closed, own=description)
    for form, own in ((d, switches), (closed, switches.closed)):
        own.name_forces(form.loader, form.description, form.multipliers, form.margins)
    d.does_work = closed.does_work = not (d.conservative and closed.conservative)
    watched = Function("switches", *switches.watched(d.loader))
    kept = (*SWITCHED, "solve")
    second = Program(closed.g, tuple(f for f in functions(closed, late=of_closed) if f.name in kept), {})
    found = marks(description)
    own = tuple(functions(d, late=late))
    own += (
        *drawn_marks(d, found),
        *start_function(d.loader, description),
        *limit_function(d.loader.load, description),
        *_start_conditions(d),
        watched,
        *time_function(own_terms(d.g, own)),
    )
    program = Program(d.g, own, {}, closed=second)
    head = header(d.description, d, source, program.operations())
    head |= {
        "inputs": head["inputs"][: len(description.inputs)],
        "switches": switches.records(),
        **({} if description.impacts == "simultaneous" else {"impacts": description.impacts}),
        "subsystems": [],
        **_start_record(d),
        **mark_records(found),
        **term_count(own),
        **({"late": list(late)} if late else {}),
    }
    second = replace(second, header=switches.closed_header(head))
    return replace(program, header=head, findings=tuple(structure(d).findings), closed=second)


def drawn_marks(d: Derivation, found: list[Mark]) -> Iterator[Function]:
    """The function of the marks; loads that follow what sensors tell are drawn as the equations have them."""
    for function in mark_function(d.loader, found):
        nodes = d.g.substitute(list(function.outputs), d.settled.values)
        yield replace(function, outputs=tuple(nodes))
    yield from height_function(d.loader, found)


def solves(program: Program) -> dict[str, bool]:
    """What the header says of the function `solve`."""
    return {"solve": True} if "solve" in program.names() else {}


def functions(d: Derivation, gathered: bool = True, late: Collection[str] = ()) -> Iterator[Function]:
    """The functions of the ABI that this model has, parameters gathered, in the order of the generated file."""
    for function in _functions(d, late):
        yield replace(function, outputs=gather(d.g, function.outputs)) if gathered else function


def _functions(d: Derivation, late: Collection[str]) -> Iterator[Function]:
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
    yield from _residual_functions(d, late)
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
    if d.factors.is_rearranged or (d.factors.n_nodes and not d.corner):
        yield solution(d)
    yield from _observers(d)


def _residual_functions(d: Derivation, late: Collection[str]) -> Iterator[Function]:
    """M a - f - Gᵀλ and G a - γ, with their derivatives; `a` is an input, so no inverse is differentiated."""
    g, x = d.g, d.x
    residual = _residual(d, d.form)
    in_full = tuple(d.levels.at(residual, x.lam))
    yield Function("residual", "M a - f - G^T lambda, then G a - gamma.", in_full)
    if "residual_jacobian" in late:
        return
    rows = _residual_by_state(d, residual)
    first, G = len(x.q) + len(x.v), d.jacobian_rows
    for row, entries in zip(rows, [*d.mass_rows, *G], strict=True):
        row.update({first + k: entry for k, entry in entries.items()})
    for j, entries in enumerate(G):
        for k, entry in entries.items():
            rows[k][first + len(x.v) + j] = g.neg(entry)
    for k, node in d.corner.items():
        rows[len(x.v) + k][first + len(x.v) + k] = node
    d.levels.differentiate(rows, residual, [*x.q, *x.v], x)
    doc = "Residual derivatives by q, v, a, lambda."
    yield Function.matrix("residual_jacobian", doc, rows, first + len(x.v) + len(x.lam))


def _residual(d: Derivation, form: Mechanics) -> list[int]:
    """M a - f - Gᵀ λ with the inertia and the forces of `form`, then G a - γ."""
    g, x = d.g, d.x
    dynamics = inverse_dynamics(d.loader, form, x, x.a)
    reactions = constraint_forces(d.loader, d.constraints, x)
    momentum = [g.sub(f, r) for f, r in zip(dynamics, reactions, strict=True)]
    held = acceleration(d.loader, d.constraints.velocity, x, x.a)
    for k, node in d.corner.items():
        held[k] = g.add(held[k], g.mul(node, x.lam[k]))
    return [*momentum, *held]


def _start_conditions(d: Derivation) -> Iterator[Function]:
    return start_conditions(d, lambda: d.levels.at(_residual(d, d.form), d.x.lam))


def _start_record(d: Derivation) -> dict[str, dict]:
    """What the header says of the conditions of a start, if there are any."""
    return {} if d.own.start is None else {"start": start_record(d.own) | {"levels": levels(d)}}


def _residual_by_state(d: Derivation, residual: list[int]) -> SparseRows:
    """Derivatives of the residual by q and v, in whichever way costs least.

    Trees on the world have recursive derivatives of their own; the rest is differentiated as its virtual power, or
    row by row, or column by column; where it is long, by elimination.
    """
    g, state = d.g, [*d.x.q, *d.x.v]
    known = [entry for row in (*d.mass_rows, *d.jacobian_rows) for entry in row.values()]

    def cost(rows: SparseRows) -> int:
        return g.count([*known, *(entry for row in rows for entry in row.values())])

    trees = [tree for tree in d.form.trees if tree.on_world]
    rest = replace(d.form, trees=[tree for tree in d.form.trees if not tree.on_world])
    longest = max(LONGEST_TRIED_ALL_WAYS, LONGEST_OF_A_STATE * len(state))
    is_long = g.count(residual) > longest
    with finite_at_roots(g, residual):
        if is_long and g.count(of_rest := _residual(d, rest) if trees else residual) > longest:
            best = eliminated_jacobian(g, of_rest, state)
        else:
            best = residual_by_state(d.loader, rest, d.constraints, d.x)
            if len(state) <= LARGEST_TRIED_ALL_WAYS:
                of_rest = _residual(d, rest) if trees else residual
                way = eliminated_jacobian if _is_long_to_sweep(g, of_rest) else sparse_jacobian
                best = min(best, way(g, of_rest, state), key=cost)
    for tree in trees:
        add_tree_derivatives(tree, best)
    if trees and len(state) <= LARGEST_TREE_TRIED_ALL_WAYS:
        with finite_at_roots(g, residual):
            best = min(best, sparse_jacobian(g, residual, state), key=cost)
    return best


def _is_long_to_sweep(g: Graph, residual: list[int]) -> bool:
    """Whether sweeps over a residual take long, and what they make as well."""
    return g.count(residual) > LONGEST_SWEPT and any(is_guarded(g, node) for node in g.reachable(residual))


def _projection(d: Derivation) -> Function:
    """One Gauss step in the mass metric on positions, then one on velocities with the same factor.

    Quaternions move along q + N δ and get their length back.
    """
    g, x, c = d.g, d.x, d.constraints
    nh, m = len(c.position), len(x.lam)
    q, v, drift = list(x.q), x.v, []
    if nh:
        targets = [*[g.neg(r) for r in c.position], *[g.zero] * (m - nh)]
        step = x.displacement(d.rates_to_meet(targets))
        q = [g.add(k, step[k]) for k in x.q]
    for k, _ in x.quaternions:
        q[k : k + 4] = normalised(g, q[k : k + 4])
    if m:
        drift = g.substitute(c.velocity, dict(zip(x.q, q, strict=True)))
        change = d.rates_to_meet([g.neg(r) for r in drift])
        v = [g.add(a, b) for a, b in zip(x.v, change, strict=True)]
    doc = (
        "State moved onto the constraints, and the residuals it had." if m else "State with unit quaternions."
    )
    return Function("project", doc, (*q, *v, *c.position, *drift))


def solution(d: Derivation) -> Function:
    """Accelerations and multipliers for a right-hand side that stands in the places of these.

    What does not depend on it is a factorisation, which series need once a step.
    """
    g, x = d.g, d.x
    n, m = len(x.v), len(x.lam)
    found = ldl.solve(g, d.factors, [*x.a, *(x.lam[k] for k in d.kept)])
    multipliers = [g.zero] * m
    for k, value in zip(d.kept, found[n:], strict=True):
        multipliers[k] = g.neg(value)
    ratios = [*d.factors.conditions, *[g.one] * (m - len(d.factors.conditions))]
    doc = "a, lambda of M a - G^T lambda = r, G a = s, for r, s in their places"
    doc += "; ratios of pivots." if m else "."
    return Function("solve", doc, (*found[:n], *multipliers, *ratios))


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
    sensed = d.sensed
    if d.description.outputs:
        nodes = [load(e) for _, e in d.description.outputs]
        yield Function("outputs", "Outputs.", tuple(nodes if sensed is None else sensed.observed(nodes)))
    looks = load if sensed is None else sensed.event
    if d.description.events:
        yield Function("events", "Event functions.", tuple(looks(e.when) for e in d.description.events))
    yield from winding_function(load, d.description)
    coordinate = {c.name: k for k, c in enumerate(d.description.coordinates)}
    rate = {r.name: len(d.x.q) + k for k, r in enumerate(d.description.rates)}
    for event in d.description.events:
        if event.action == "reset":
            state = [*d.x.q, *d.x.v]
            for reset in event.resets:
                state[(rate if reset.is_rate else coordinate)[reset.target]] = looks(reset.value)
            yield Function(reset_function(event.name), f"State after event '{event.name}'.", tuple(state))
