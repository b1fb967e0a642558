"""Coordinates without inertia that forces alone hold: what acts on them is in balance at every instant.

A node between a spring and a damper has no mass, so that the forces along its coordinate add up to nothing. Where
these depend on its rate, that is a velocity constraint and the rate follows; where they do not, it is a constraint
between positions. Its multiplier is zero wherever it holds: the row of the node in M a = f + G^T lambda, where M has
nothing, says 0 = f + G^T lambda, and f is what is held at zero. So constraints are what integrators see.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..errors import ModelError
from ..model import algebra
from ..model.description import Constraint, Description
from .dynamics import inverse_dynamics, mass_matrix, mechanics
from .graph.differentiate import sparse_jacobian
from .graph.evaluate import evaluate
from .graph.graph import Graph
from .graph.nodes import INPUT, PARAM, SENSED, Q, V
from .input_rates import with_input_rates
from .kinematics import Scene
from .load import Loader, make_loader
from .variables import variables, with_rates

_PLACES, _DEPENDENT = 3, 1e-9  # where ranks are looked at, and what is none


def balance_symbol(name: str) -> algebra.Symbol:
    """What stands for the force on a coordinate; no name of a model has a space in it."""
    return algebra.Symbol(f"{name} balance")


def with_balances(description: Description) -> Description:
    """The description with a constraint for each coordinate that forces hold in balance.

    Raises
    ------
    ModelError
        The forces leave such a coordinate open.
    """
    if not description.balanced:
        return description
    d = with_rates(description)
    g = Graph()
    x = variables(g, d)
    loader = make_loader(g, d, x)
    mech = mechanics(loader, d, Scene(loader, d, x), x)
    rates = [next(k for k, r in enumerate(d.rates) if r.coordinate == name) for name in d.balanced]
    inertia = mass_matrix(loader, mech, x)
    moved = [name for name, k in zip(d.balanced, rates, strict=True) if not inertia[k]]
    if not moved:
        return description
    forces = inverse_dynamics(loader, mech, x, [g.zero] * len(x.v))
    rates = [next(k for k, r in enumerate(d.rates) if r.coordinate == name) for name in moved]
    nodes = [forces[k] for k in rates]
    own = [x.v[k] for k in rates]
    n_inputs = len(d.inputs)
    by_rate = sparse_jacobian(g, nodes, own)
    places = {r: next(c for c, k in x.plain if k == r) for r in rates}
    own_places = [x.q[places[k]] for k in rates]
    by_place = sparse_jacobian(g, nodes, own_places)
    _refuse_switches(loader, d, moved, own, own_places)
    held: list[Constraint] = []
    rolling: list[Constraint] = []
    for name, node, row, other in zip(moved, nodes, by_rate, by_place, strict=True):
        if g.mask[node] & SENSED:
            message = f"the force on '{name}', which has no inertia, follows a reaction or an acceleration"
            raise ModelError(
                message, hint="give it a small mass, or let the force follow a state that measures"
            )
        constraint = Constraint(f"{name}_balance", balance_symbol(name))
        if row:
            rolling.append(replace(constraint, kind="velocity"))
        elif g.mask[node] & V or not other:
            message = (
                f"the forces on '{name}', which has no inertia, do not say where it is or how fast it moves"
            )
            raise ModelError(message, hint="give it a mass, a spring, a damper, or a constraint")
        else:
            held.append(constraint)
    pushed = {k for k in range(n_inputs) if rolling and g.var(INPUT, k) in set(g.reachable(nodes))}
    description = with_input_rates(description, frozenset(d.inputs[k].name for k in pushed))
    names = {c.name for c in (*d.constraints, *d.velocity_constraints)}
    for c in (*held, *rolling):
        if c.name in names:
            raise ModelError(f"the balance of a coordinate makes the constraint '{c.name}', which is taken")
    rows = [row if row else other for row, other in zip(by_rate, by_place, strict=True)]
    _refuse_open(g, d, moved, rows)
    return replace(
        description,
        balanced=tuple(moved),
        constraints=(*description.constraints, *held),
        velocity_constraints=(*description.velocity_constraints, *rolling),
    )


def _refuse_switches(
    loader: Loader, d: Description, names: list[str], rates: list[int], places: list[int]
) -> None:
    """Refuse stops and dry friction on what is in balance: their forces are not among those that are balanced."""
    dry = "give it a small mass, or the friction a 'smooth' speed"
    rubbing = [("dry friction", f"friction.{f.name}", v, dry) for f in d.frictions for v in f.speeds]
    rigid = "give it a small mass, or take a contact with a 'stiffness'"
    hitting = [("a stop", f"stops.{s.name}", s.gap, rigid) for s in d.stops]
    for acting, own in ((rubbing, rates), (hitting, places)):
        rows = sparse_jacobian(loader.g, [loader.load(x) for _, _, x, _ in acting], own)
        for (what, table, _, hint), row in zip(acting, rows, strict=True):
            if row:
                message = f"{what} acts on '{names[min(row)]}', which has no inertia"
                raise ModelError(message, table=table, hint=hint)


def _refuse_open(g: Graph, d: Description, names: list[str], rows: list[dict[int, int]]) -> None:
    """Refuse forces that leave a combination of coordinates open, as those of a damper between two nodes do."""
    random, n = np.random.default_rng(20240229), len(names)
    best = 0
    for _ in range(_PLACES):
        values = {g.var(PARAM, k): float(p.value) for k, p in enumerate(d.parameters)}
        values |= {g.var(INPUT, k): float(u.default) for k, u in enumerate(d.inputs)}
        for kind, count in ((Q, len(d.coordinates)), (V, len(d.rates))):
            values |= {g.var(kind, k): float(random.uniform(0.1, 1.0)) for k in range(count)}
        values |= {g.var(1): float(random.uniform(0.1, 1.0))}
        matrix = np.zeros((n, n))
        for i, row in enumerate(rows):
            matrix[i, list(row)] = evaluate(g, list(row.values()), values)
        if not np.isfinite(matrix).all():
            return
        largest = np.abs(matrix).max(axis=1, keepdims=True)
        scaled = matrix / np.where(largest > 0.0, largest, 1.0)
        best = max(best, int(np.sum(np.linalg.svd(scaled, compute_uv=False) > _DEPENDENT)))
    if best < n:
        message = (
            f"the forces on {', '.join(names)}, which have no inertia, do not say how each of them moves"
        )
        raise ModelError(message, hint="give one of them a mass, or write what holds them as a constraint")
