"""Derivatives of the state's derivative by the state and by parameters, as functions of their own, where asked for.

The residual M a - f - Gᵀ λ, G a - γ is differentiated with `a` and λ held, and the equations of motion, factored
already, are solved for what `a` does: no inverse is differentiated.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from ..errors import ModelError
from ..model.description import Description
from .contacts import has_switches
from .derivation import Derivation
from .graph.differentiate import finite_at_roots, sparse_jacobian
from .graph.nodes import INPUT, PARAM, SparseRows
from .program import Function
from .solve import factorise as ldl

BY_STATE, BY_PARAMETERS = "rhs_by_state", "rhs_by_parameters"


def refuse_switches(description: Description) -> None:
    """Say that derivatives are not to be had where forces switch.

    Raises
    ------
    ModelError
        The model has stops or dry friction.
    """
    if has_switches(description):
        raise ModelError(
            f"model '{description.name}' has stops or dry friction: its state has no derivative where they switch",
            hint="leave the Jacobians out, or give friction its `smooth` form",
        )


def derivatives(d: Derivation, residual: Callable[[], list[int]], n_inputs: int) -> Iterator[Function]:
    """Yield the functions: of (dq/dt, dv/dt), by q and v, and by parameters and inputs.

    Parameters
    ----------
    d : Derivation
    residual : callable
        Makes the residual, in the variables a and λ.
    n_inputs : int
        Of the model; those behind hold the branches of jumps.
    """
    g, x = d.g, d.x
    state = [*x.q, *x.v]
    given = [g.var(PARAM, k) for k in range(len(d.description.parameters))] + [
        g.var(INPUT, k) for k in range(n_inputs)
    ]
    of_motion = residual()
    yield Function.matrix(
        BY_STATE,
        "Derivatives of rates and accelerations by q, v, row by row.",
        _rows(d, of_motion, state),
        len(state),
    )
    if given:
        doc = "Derivatives of rates and accelerations by parameters, then inputs, row by row."
        yield Function.matrix(BY_PARAMETERS, doc, _rows(d, of_motion, given), len(given))


def _rows(d: Derivation, residual: list[int], by: list[int]) -> SparseRows:
    g, x = d.g, d.x
    nv, kept = len(x.v), d.kept
    with finite_at_roots(g, residual):
        partial = sparse_jacobian(g, residual, by)
    places = [(i, j) for i, row in enumerate(partial) for j in row]
    known = dict(zip([*x.a, *x.lam], [*d.accelerations, *d.multipliers], strict=True))
    entries = dict(zip(places, g.substitute([partial[i][j] for i, j in places], known), strict=True))
    accelerations: SparseRows = [{} for _ in range(nv)]
    for j in range(len(by)):
        right = [g.neg(entries.get((i, j), g.zero)) for i in (*range(nv), *(nv + k for k in kept))]
        if any(node != g.zero for node in right):
            for i, node in enumerate(ldl.solve(g, d.factors, right)[:nv]):
                if node != g.zero:
                    accelerations[i][j] = node
    return [*sparse_jacobian(g, list(x.qdot), by), *accelerations]
