"""Coordinates that the energies do not depend on, and the momenta that stay because of that (Noether 1918).

Structure alone does not show them: the energy of a top is full of its three angles until sin² + cos² is found
everywhere. So the functions are evaluated where only one coordinate differs: at random numbers, also for the
parameters, no others than ignorable coordinates leave all values the same.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .dynamics import applied_forces
from .graph.evaluate import evaluate

if TYPE_CHECKING:
    from .derivation import Derivation

N_TRIALS = 2
MOST_TRIED = 400  # coordinates; the search costs time and memory as their square
TOLERANCE = 1e-10  # relative; round-off is 1e-13, the least dependence at random numbers of size 1 far larger


def ignorable_coordinates(d: Derivation) -> list[int]:
    """Indices of coordinates that no energy, applied force or constraint depends on; not of quaternions."""
    c = d.constraints
    return _without_effect(d, [*d.mech.energy, *applied_forces(d.mech, d.x), *c.position, *c.velocity])


def conserved_momenta(d: Derivation) -> list[int]:
    """Indices of rates whose momentum ∂T/∂v stays: no energy depends on the coordinate, nothing else acts along it."""
    forces = applied_forces(d.mech, d.x)
    constrained = {k for row in d.jacobian_rows for k in row}
    rate = dict(d.x.plain)
    found = [rate[k] for k in _without_effect(d, list(d.mech.energy))]
    return [i for i in found if forces[i] == d.g.zero and i not in constrained]


def _without_effect(d: Derivation, nodes: list[int]) -> list[int]:
    """Coordinates with a rate of their own that no node depends on, in order."""
    g, x = d.g, d.x
    left = [k for k, _ in x.plain]
    if len(left) > MOST_TRIED:
        return []
    order = g.reachable(nodes)
    rng = np.random.default_rng(20)
    for _ in range(N_TRIALS):
        if not left:
            break
        values = {node: rng.uniform(0.4, 1.2) for node in order if g.op[node] == "var"}
        for column, k in enumerate(left, 1):
            if x.q[k] in values:
                varied = np.full(len(left) + 1, values[x.q[k]])
                varied[column] = rng.uniform(0.4, 1.2)
                values[x.q[k]] = varied
        changed = np.zeros(len(left) + 1, dtype=bool)
        for value in evaluate(g, nodes, values):
            value = np.broadcast_to(value, len(left) + 1)
            changed |= ~(np.abs(value - value[0]) <= TOLERANCE * (1.0 + np.abs(value[0])))
        left = [k for k, moved in zip(left, changed[1:], strict=True) if not moved]
    return sorted(left)
