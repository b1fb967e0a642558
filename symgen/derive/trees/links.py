"""Links of trees of joints, and the inertia that each of them has to carry."""

from __future__ import annotations

from dataclasses import dataclass

from ..graph.graph import Graph
from ..graph.vectors import Inertia, Matrix, Turn, Vector, zeros

BASE, REVOLUTE, PRISMATIC, SPHERICAL = "base", "revolute", "prismatic", "spherical"


@dataclass
class Link:
    """A moving frame and what is fixed in it.

    A revolute link turns about its third axis, a prismatic one moves along it. Its origin is at `offset` in the
    parent's axes, and further by `slide` along its own third axis; `turn` rotates from the parent's axes to its own.
    `rates` are indices in v. `inertia` is what the recursive algorithms use, see `carry_inertia`.
    """

    kind: str
    parent: int
    turn: Turn
    offset: Vector
    slide: int
    rates: list[int]
    inertia: Inertia


@dataclass(frozen=True)
class Place:
    """A frame fixed in a link: where its origin is in the link's axes, and the rotation from its axes to the link's."""

    link: int
    origin: Vector
    rotation: Matrix


@dataclass
class Links:
    """The links of one tree, parents first; link 0 is the base: the world, or a body that is placed by hand."""

    links: list[Link]
    places: dict[str, Place]


def carry_inertia(g: Graph, links: list[Link]) -> None:
    """Move to the parents what a joint's motion does not move, and so leave the links fewer parameters.

    A rod of any mass along the axis of a revolute joint does not feel its turning; so it may as well be fixed to the
    parent. Every body is the sum of such a rod and a rest with seven parameters (base inertial parameters; Gautier and
    Khalil 1990). Likewise go a point mass in the centre of a spherical joint, and behind a prismatic joint all that
    resists turning only. Motion, energies and joint forces stay the same; so do composite bodies as CRBA uses them.
    """
    for link in reversed(links):
        if link.kind == BASE:
            continue
        carried, link.inertia = _split_inertia(g, link)
        constant = link.turn if link.kind == PRISMATIC else link.turn.constant
        links[link.parent].inertia = links[link.parent].inertia.plus(
            g, carried.turned(constant).shifted(g, link.offset)
        )


def _split_inertia(g: Graph, link: Link) -> tuple[Inertia, Inertia]:
    """What a link can hand to its parent, and what it keeps."""
    own, nothing = link.inertia, Inertia.nothing(g)
    if link.kind == SPHERICAL:
        return Inertia(own.mass, zeros(g), nothing.tensor), Inertia(g.zero, own.first, own.tensor)
    if link.kind == PRISMATIC:
        return Inertia(g.zero, zeros(g), own.tensor), Inertia(own.mass, own.first, nothing.tensor)
    x, y, z = own.first
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = own.tensor
    rod = Inertia(own.mass, [g.zero, g.zero, z], [[yy, g.zero, g.zero], [g.zero, yy, g.zero], zeros(g)])
    kept = [[g.sub(xx, yy), xy, xz], [xy, g.zero, yz], [xz, yz, zz]]
    return rod, Inertia(g.zero, [x, y, g.zero], kept)
