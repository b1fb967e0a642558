"""Analytic derivatives of a tree's inverse dynamics by its coordinates and rates.

After Singh, Russell and Wensing (Efficient analytical derivatives of rigid-body dynamics using spatial vector algebra,
2022), with accelerations relative to each link's origin instead of spatial ones, which needs no linear velocities. A
unit of a coordinate or rate adds, seen from what hangs on its joint, an angular velocity δω, an angular acceleration
δα and an acceleration δa of the origin; a mass at r with velocity u relative to the origin then accelerates by
δa + δα × r + 2 δω × u more. So a composite body needs, besides its inertia, 2 Σ m u rᵀ and 2 Σ m u.

Derivatives by a quaternion are those along its angular velocity times N⁺ (see `Variables.by_coordinates`).
"""

from __future__ import annotations

from dataclasses import dataclass

from ..graph.graph import Graph
from ..graph.nodes import SparseRows
from ..graph.vectors import (
    Inertia,
    Matrix,
    Vector,
    cross,
    minus,
    plus,
    scaled,
    times,
    transposed_times,
)
from .links import Link
from .recursive import Tree, Wrench


@dataclass(frozen=True)
class Stirred:
    """A composite body with its motion relative to the origin: `momenta` is 2 Σ m u rᵀ, `momentum` is 2 Σ m u."""

    inertia: Inertia
    momenta: Matrix
    momentum: Vector


@dataclass(frozen=True)
class Perturbation:
    """What a unit of a coordinate or a rate adds to the motion of all that hangs on its joint."""

    spin: Vector  # δω
    alpha: Vector  # δα
    acceleration: Vector  # δa


def add_tree_derivatives(tree: Tree, rows: SparseRows) -> None:
    """Add the derivatives of M a + h of a tree on the world by (q, v) to rows of derivatives, one row for each rate."""
    g, x = tree.g, tree.x
    by_rate = derivatives_along_rates(tree, x.a)
    for i, (by_q, by_v) in by_rate.items():
        along = [by_q.get(k, g.zero) for k in range(len(x.v))]
        for k, entry in enumerate(
            [*x.by_coordinates(along), *(by_v.get(k, g.zero) for k in range(len(x.v)))]
        ):
            if entry != g.zero:
                rows[i][k] = g.add(rows[i].get(k, g.zero), entry)


def derivatives_along_rates(tree: Tree, dv: list[int]) -> dict[int, tuple[dict[int, int], dict[int, int]]]:
    """Per rate, with accelerations dv/dt: derivatives of its force along the rates' directions, and by the rates."""
    g = tree.g
    stirred, wrenches = _stirred(tree), tree.wrenches(dv)
    perturbed = {k: _perturbations(tree, k, dv) for k in tree.moving()}
    double_velocities = {k: _double_velocities(tree, k) for k in tree.moving()}
    result = {rate: ({}, {}) for k in tree.moving() for rate in tree.links[k].rates}
    for k in tree.moving():
        units, spins = tree.unit_wrenches(k), _spin_forces(g, tree.links[k], stirred[k])
        carried = [_carried(g, tree.links[k], e, wrenches[k]) for e in range(len(units))]
        for e, rate in enumerate(tree.links[k].rates):
            changes = [_wrench(g, stirred[k], p) for p in perturbed[k][e]]
            changes[0] = tuple(plus(g, a, b) for a, b in zip(changes[0], carried[e], strict=True))
            unit, spin, j = units[e], spins[e], k
            while j:
                for other, perturbations in zip(tree.links[j].rates, perturbed[j], strict=True):
                    for kind in (0, 1):
                        result[rate][kind][other] = _work(g, unit, spin, perturbations[kind])
                if j != k:
                    for kind in (0, 1):
                        forces = tree.along_joint(j, changes[kind])
                        for other, force in zip(tree.links[j].rates, forces, strict=True):
                            result[other][kind][rate] = force
                unit, spin = _climb(tree, j, unit, spin, double_velocities[j])
                changes = [tree.to_parent(j, change) for change in changes]
                j = tree.links[j].parent
    return result


def _stirred(tree: Tree) -> list[Stirred]:
    """The composite body of each link, with its motion."""
    g = tree.g
    momenta, momentum = [], []
    for link, spin in zip(tree.links, tree.spin, strict=True):
        I = link.inertia.tensor
        trace = g.sum(I[i][i] for i in range(3))
        two = g.const(2.0)
        second = [[g.neg(g.mul(two, entry)) for entry in row] for row in I]
        for i in range(3):
            second[i][i] = g.add(trace, second[i][i])
        columns = [cross(g, spin, [row[j] for row in second]) for j in range(3)]
        momenta.append([[columns[j][i] for j in range(3)] for i in range(3)])
        momentum.append(scaled(g, two, cross(g, spin, link.inertia.first)))
    for k in reversed(tree.moving()):
        link, p = tree.links[k], tree.links[k].parent
        body = Stirred(tree.composites[k], momenta[k], momentum[k])
        before, after = _double_velocities(tree, k)
        if any(x != g.zero for x in (link.slide, *before)):
            body = _shifted(g, body, [g.zero, g.zero, link.slide], before)
        turned = Stirred(
            body.inertia.turned(link.turn), link.turn.up_matrix(body.momenta), link.turn.up(body.momentum)
        )
        body = _shifted(g, turned, link.offset, after)
        momenta[p] = [plus(g, a, b) for a, b in zip(momenta[p], body.momenta, strict=True)]
        momentum[p] = plus(g, momentum[p], body.momentum)
    return [Stirred(*parts) for parts in zip(tree.composites, momenta, momentum, strict=True)]


def _double_velocities(tree: Tree, k: int) -> tuple[Vector, Vector]:
    """Twice the velocity of a link's origin relative to its parent's: the slide's part in its axes, then the rest."""
    g, link = tree.g, tree.links[k]
    two = g.const(2.0)
    rest = cross(g, tree.spin[link.parent], link.offset)
    return scaled(g, two, tree.slide_velocity(k)), scaled(g, two, rest)


def _shifted(g: Graph, body: Stirred, r: Vector, double_velocity: Vector) -> Stirred:
    """The same about an origin from which the present one is at `r` and moves."""
    momentum = plus(g, body.momentum, scaled(g, body.inertia.mass, double_velocity))
    first = body.inertia.first
    momenta = [
        [
            g.add(body.momenta[i][j], g.add(g.mul(double_velocity[i], first[j]), g.mul(momentum[i], r[j])))
            for j in range(3)
        ]
        for i in range(3)
    ]
    return Stirred(body.inertia.shifted(g, r), momenta, momentum)


def _perturbations(tree: Tree, k: int, dv: list[int]) -> list[tuple[Perturbation, Perturbation]]:
    """For each rate of a link: what a unit of its coordinate adds to the motion, and what a unit of the rate adds."""
    g, link, motion = tree.g, tree.links[k], tree.motion(dv)
    omega, carried = tree.spin[k], tree.carried_spin[k]
    slid, slide_velocity = [g.zero, g.zero, link.slide], _double_velocities(tree, k)[0]

    def of_origin(spin: Vector, alpha: Vector) -> Vector:
        """What the slide adds to δa: the origin is a point of the link that has moved along its axis."""
        return plus(g, cross(g, alpha, slid), cross(g, spin, slide_velocity))

    result = []
    for turning, sliding in link.subspace:
        spin = cross(g, carried, turning)
        alpha = plus(g, cross(g, motion.carried_alpha[k], turning), cross(g, carried, spin))
        acceleration = plus(g, cross(g, motion.carried_acceleration[k], turning), of_origin(spin, alpha))
        acceleration = plus(g, acceleration, times(g, motion.gradient[k], sliding))
        by_position = Perturbation(spin, alpha, acceleration)
        alpha = cross(g, plus(g, carried, omega), turning)
        acceleration = plus(g, of_origin(turning, alpha), cross(g, omega, scaled(g, g.const(2.0), sliding)))
        result.append((by_position, Perturbation(turning, alpha, acceleration)))
    return result


def _spin_forces(g: Graph, link: Link, body: Stirred) -> list[Vector]:
    """For each rate of a link: the derivative of its generalised force by δω."""
    trace = g.sum(body.momenta[i][i] for i in range(3))
    return [
        plus(
            g,
            cross(g, body.momentum, sliding),
            minus(g, scaled(g, trace, turning), transposed_times(g, body.momenta, turning)),
        )
        for turning, sliding in link.subspace
    ]


def _carried(g: Graph, link: Link, which: int, wrench: Wrench) -> Wrench:
    """How the wrench on a link changes, seen from its parent, as the link moves along a unit of its coordinate."""
    force, moment = wrench
    turning, sliding = link.subspace[which]
    return cross(g, turning, force), plus(g, cross(g, turning, moment), cross(g, sliding, force))


def _wrench(g: Graph, body: Stirred, p: Perturbation) -> Wrench:
    """The wrench that a perturbation of the motion takes."""
    inertia = body.inertia
    force = plus(g, scaled(g, inertia.mass, p.acceleration), cross(g, p.alpha, inertia.first))
    force = plus(g, force, cross(g, p.spin, body.momentum))
    trace = g.sum(body.momenta[i][i] for i in range(3))
    moment = plus(g, cross(g, inertia.first, p.acceleration), times(g, inertia.tensor, p.alpha))
    stirred = minus(g, scaled(g, trace, p.spin), times(g, body.momenta, p.spin))
    return force, plus(g, moment, stirred)


def _work(g: Graph, unit: Wrench, spin: Vector, p: Perturbation) -> int:
    """The generalised force that a perturbation of an ancestor's motion takes."""
    force, moment = unit
    return g.sum([g.dot(moment, p.alpha), g.dot(force, p.acceleration), g.dot(spin, p.spin)])


def _climb(
    tree: Tree, k: int, unit: Wrench, spin: Vector, double_velocities: tuple[Vector, Vector]
) -> tuple[Wrench, Vector]:
    """A unit wrench and a spin force on link k about the origin of its parent, in its axes."""
    g, link = tree.g, tree.links[k]
    slide, rest = double_velocities
    spin = link.turn.up(plus(g, spin, cross(g, slide, unit[0])))
    unit = tree.to_parent(k, unit)
    return unit, plus(g, spin, cross(g, rest, unit[0]))
