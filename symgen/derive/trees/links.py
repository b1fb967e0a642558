"""Links of trees of joints, and the inertia that each of them has to carry."""

from __future__ import annotations

from dataclasses import dataclass

from ..graph.graph import Graph
from ..graph.vectors import Inertia, Matrix, Turn, Vector, plus, scaled, zeros

Subspace = list[tuple[Vector, Vector]]


@dataclass
class Link:
    """A moving frame and what is fixed in it.

    Its origin is at `offset` in the parent's axes, and further by `slide` along its own third axis; `turn` rotates from
    the parent's axes to its own. `subspace` is the motion subspace S of its joint (Featherstone 2008, section 3.5): for
    each rate what a unit of it adds to the link's angular velocity and to the velocity of its origin. In the link's own
    axes these are constant, and translations are along the third. `rates` are indices in v. `inertia` is what the
    recursive algorithms use, see `carry_inertia`. A base has no parent (-1).
    """

    parent: int
    turn: Turn
    offset: Vector
    slide: int
    subspace: Subspace
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


def along(g: Graph, subspace: Subspace, values: list[int]) -> tuple[Vector, Vector]:
    """S times values of its rates: an angular and a linear vector."""
    angular, linear = zeros(g), zeros(g)
    for (turning, sliding), value in zip(subspace, values, strict=True):
        angular = plus(g, angular, scaled(g, value, turning))
        linear = plus(g, linear, scaled(g, value, sliding))
    return angular, linear


def carry_inertia(g: Graph, links: list[Link]) -> None:
    """Move to the parents what a joint's motion does not move, and so leave the links fewer parameters.

    A rod of any mass along the axis of a revolute joint does not feel its turning; so it may as well be fixed to the
    parent. Every body is the sum of such a rod and a rest with seven parameters (base inertial parameters; Gautier and
    Khalil 1990). Likewise go a point mass in the centre of a spherical joint, and behind a prismatic joint all that
    resists turning only. Motion, energies and joint forces stay the same; so do composite bodies as CRBA uses them.
    """
    for link in reversed(links):
        if link.parent < 0:
            continue
        carried = _unmoved(g, link)
        link.inertia = link.inertia.minus(g, carried)
        links[link.parent].inertia = links[link.parent].inertia.plus(
            g, carried.turned(link.turn.constant).shifted(g, link.offset)
        )


def _unmoved(g: Graph, link: Link) -> Inertia:
    """The part of a link's inertia that its joint's motion leaves as it is, seen from the parent."""
    own, nothing = link.inertia, zeros(g)
    yy = own.tensor[1][1]
    n_turns = sum(any(x != g.zero for x in turning) for turning, _ in link.subspace)
    slides = any(x != g.zero for _, sliding in link.subspace for x in sliding)
    if n_turns == 0:  # all that has no mass stays when it slides
        return Inertia(g.zero, nothing, own.tensor)
    if n_turns > 1:
        return Inertia(own.mass, nothing, Inertia.nothing(g).tensor)
    rod = [[yy, g.zero, g.zero], [g.zero, yy, g.zero], nothing]
    if slides:
        return Inertia(g.zero, nothing, rod)
    return Inertia(own.mass, [g.zero, g.zero, own.first[2]], rod)
