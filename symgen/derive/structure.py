"""Structure of a model that methods and people can use: what is constant, diagonal, conservative, separable.

Coordinates that the energies do not depend on, and the momenta that stay because of that (Noether 1918).

Structure alone does not show them: the energy of a top is full of its three angles until sin² + cos² is found
everywhere. So the functions are evaluated where only one coordinate differs: at random numbers, also for the
parameters, no others than ignorable coordinates leave all values the same.

Which expressions of a description change during a run, by the names in them.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from symgen.model.algebra import postorder

from ..model import algebra
from ..model.description import Description
from .dynamics import applied_forces
from .graph.evaluate import evaluate, without_pattern
from .graph.nodes import INPUT, MOTION, T, V

if TYPE_CHECKING:
    from .derivation import Derivation


FLAGS = (
    "conservative", "time_dependent", "constant_mass", "diagonal_mass", "velocity_dependent", "separable",
)  # fmt: skip
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
    left = [k for k, i in x.plain if i not in x.states]
    if len(left) > MOST_TRIED:
        return []
    order = g.reachable(nodes)
    variables = [node for node in order if g.op[node] == "var"]
    # NumPy's random numbers take longer to load than this takes.
    numbers = iter(without_pattern(N_TRIALS * (len(variables) + len(left))).tolist())
    for _ in range(N_TRIALS):
        if not left:
            break
        values: dict = {node: next(numbers) for node in variables}
        for column, k in enumerate(left, 1):
            if x.q[k] in values:
                varied = np.full(len(left) + 1, values[x.q[k]])
                varied[column] = next(numbers)
                values[x.q[k]] = varied
        changed = np.zeros(len(left) + 1, dtype=bool)
        for value in evaluate(g, nodes, values):
            value = np.broadcast_to(value, len(left) + 1)
            changed |= ~(np.abs(value - value[0]) <= TOLERANCE * (1.0 + np.abs(value[0])))
        left = [k for k, moved in zip(left, changed[1:], strict=True) if not moved]
    return sorted(left)


@dataclass(frozen=True)
class Structure:
    """Flags for the module's header, and findings in words for the report (found when they are asked for)."""

    flags: dict[str, bool]
    derivation: Derivation

    @cached_property
    def findings(self) -> list[str]:
        """Findings, one sentence each."""
        return list(_findings(self.derivation, self.flags))


def structure(d: Derivation) -> Structure:
    """Find the structure of derived equations by the dependency masks of their nodes."""
    g = d.g
    rows = d.mass_rows
    constant_mass = not any(g.mask[entry] & MOTION for row in rows for entry in row.values())
    diagonal = all(row.keys() <= {i} for i, row in enumerate(rows))
    force_mask = 0
    for node in d.forces:
        force_mask |= g.mask[node]
    everything = force_mask
    for node in (*d.constraints.position, *d.constraints.velocity, *d.mech.energy, d.power):
        everything |= g.mask[node]
    flags = {
        "conservative": d.conservative,
        "time_dependent": bool(everything & T),
        "constant_mass": constant_mass,
        "diagonal_mass": diagonal,
        "velocity_dependent": bool(force_mask & V),
        "separable": constant_mass
        and not force_mask & (V | T | INPUT)
        and not d.x.lam
        and not d.x.quaternions,
    }
    return Structure(flags, d)


def _findings(d: Derivation, flags: dict[str, bool]) -> Iterator[str]:
    n = len(rows := d.mass_rows)
    filled = sum(map(len, rows))
    shape = "diagonal" if flags["diagonal_mass"] else f"{filled} of {n * n} entries nonzero"
    yield f"mass matrix {n} x {n}: {shape}{', constant' if flags['constant_mass'] else ''}"
    if d.x.lam:
        c = d.constraints
        filled = sum(map(len, d.jacobian_rows))
        yield (
            f"{len(c.position)} holonomic and {len(d.x.lam) - len(c.position)} velocity constraints, "
            f"Jacobian {len(d.x.lam)} x {n} with {filled} nonzero entries"
        )
    if d.dependent:
        constraints = (*d.description.constraints, *d.description.velocity_constraints)
        names = ", ".join(constraints[k].name for k in d.dependent)
        yield f"redundant constraints, which accelerations and projections are solved without: {names}"
    yield (
        "conservative: T + V stays"
        if flags["conservative"]
        else "not conservative: the work done is integrated with the motion"
    )
    if not flags["time_dependent"]:
        yield "no explicit time"
    ignorable = [d.description.coordinates[k].name for k in ignorable_coordinates(d)]
    if ignorable:
        yield f"ignorable coordinates (no energy, force or constraint depends on them): {', '.join(ignorable)}"
    conserved = [d.description.rates[k].name for k in conserved_momenta(d)]
    if conserved:
        yield f"conserved momenta, the derivatives of T by the rates: {', '.join(conserved)}"


WORLD = "world"


class Movement:
    """Tells what moves.

    Parameters
    ----------
    d : Description
    apart_from : collection of str
        Names that are not looked at.
    """

    def __init__(self, d: Description, apart_from: Collection[str] = ()) -> None:
        self._fixed = {x.name for x in (*d.parameters, *d.constants)} | set(apart_from)
        self._fixed |= {f"{x.name}_{c}" for x in (*d.points, *d.axes) if x.body == WORLD for c in "xyz"}
        for name, expression in d.definitions:
            if not self.of([expression]):
                self._fixed.add(name)

    def of(self, expressions: Iterable[algebra.Expr]) -> bool:
        """Whether one of the expressions depends on more than parameters and constants."""
        nodes = postorder(expressions)
        return any(isinstance(x, algebra.Symbol) and x.name not in self._fixed for x in nodes)
