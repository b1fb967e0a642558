"""Structure of a model that methods and people can use: what is constant, diagonal, conservative, separable."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from .graph import INPUT, MOTION, T, V

if TYPE_CHECKING:
    from .pipeline import Derivation


@dataclass(frozen=True)
class Structure:
    """Flags for the module's header, and findings in words for the report."""

    flags: dict[str, bool]
    findings: list[str] = field(default_factory=list)


def structure(d: Derivation) -> Structure:
    """Find the structure of derived equations by the dependency masks of their nodes."""
    g = d.g
    masks = [g.mask[entry] for row in d.mass for entry in row]
    constant_mass = not any(mask & MOTION for mask in masks)
    n = len(d.mass)
    diagonal = all(d.mass[i][j] == g.zero for i in range(n) for j in range(n) if i != j)
    force_mask = 0
    for node in d.forces:
        force_mask |= g.mask[node]
    everything = force_mask
    for node in (*d.constraints.position, *d.constraints.velocity, d.mech.kinetic, d.mech.potential, d.power):
        everything |= g.mask[node]
    flags = {
        "conservative": d.conservative,
        "time_dependent": bool(everything & T),
        "constant_mass": constant_mass,
        "diagonal_mass": diagonal,
        "velocity_dependent": bool(force_mask & V),
        "separable": constant_mass and not force_mask & (V | T | INPUT) and not d.x.lam,
    }
    return Structure(flags, list(_findings(d, flags)))


def _findings(d: Derivation, flags: dict[str, bool]):
    g, n = d.g, len(d.mass)
    filled = sum(entry != g.zero for row in d.mass for entry in row)
    shape = "diagonal" if flags["diagonal_mass"] else f"{filled} of {n * n} entries nonzero"
    yield f"mass matrix {n} x {n}: {shape}{', constant' if flags['constant_mass'] else ''}"
    if d.x.lam:
        c = d.constraints
        filled = sum(entry != g.zero for row in c.jacobian for entry in row)
        yield (
            f"{len(c.position)} holonomic and {len(d.x.lam) - len(c.position)} velocity constraints, "
            f"Jacobian {len(d.x.lam)} x {n} with {filled} nonzero entries"
        )
    yield (
        "conservative: T + V stays"
        if flags["conservative"]
        else "not conservative: the work done is integrated with the motion"
    )
    if not flags["time_dependent"]:
        yield "no explicit time"
    ignorable = [c.name for k, c in enumerate(d.description.coordinates) if _ignorable(d, k)]
    if ignorable:
        yield f"coordinates that no force, energy or constraint depends on: {', '.join(ignorable)}"


def _ignorable(d: Derivation, k: int) -> bool:
    """Whether nothing in the equations depends on coordinate k itself."""
    g = d.g
    nodes = [*d.forces, *d.constraints.position, *d.constraints.velocity, *(e for row in d.mass for e in row)]
    return d.x.q[k] not in set(g.reachable(nodes))
