"""Structure of a model that methods and people can use: what is constant, diagonal, conservative, separable."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from .graph.kinds import INPUT, MOTION, T, V
from .symmetries import conserved_momenta, ignorable_coordinates

if TYPE_CHECKING:
    from .derivation import Derivation


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
