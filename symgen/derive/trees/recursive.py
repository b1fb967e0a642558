"""Recursive algorithms for trees of links: Newton-Euler (RNEA), composite rigid bodies (CRBA), energies, poses.

All vectors of a link are in its own axes. Linear motion is that of its origin: classical accelerations, relative to
free fall, so that gravity is an upward acceleration of the base (Luh, Walker and Paul 1980; Featherstone 2008, chapters
5 and 6).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from ..graph.differentiate import forward
from ..graph.graph import Graph
from ..graph.vectors import (
    Inertia,
    Matrix,
    Vector,
    column,
    cross,
    cross_z,
    dot,
    field_gradient,
    identity,
    minus,
    plus,
    scaled,
    times,
    transposed_times,
    zeros,
)
from ..variables import Variables
from .links import Link, Links, along

Wrench = tuple[Vector, Vector]  # force, and moment about the origin


@dataclass(frozen=True)
class BaseMotion:
    """How a tree's base moves: pose in the world, velocity in world axes, angular velocity in its own."""

    position: Vector
    rotation: Matrix
    velocity: Vector
    omega: Vector


@dataclass(frozen=True)
class Motion:
    """Accelerations of all links; those "carried" are of the parent, at the link's origin, in the link's axes."""

    alpha: list[Vector]
    acceleration: list[Vector]  # of the origin, relative to free fall
    gradient: list[Matrix]  # Γ
    carried_alpha: list[Vector]
    carried_acceleration: list[Vector]


class Tree:
    """One tree on the graph.

    Parameters
    ----------
    g : Graph
    x : Variables
    links : Links
    base : BaseMotion, optional
        None for the world.

    Attributes
    ----------
    gravity : list of int
        Acceleration of gravity in world axes, set once it is known; 0 where V is left to stand for it.
    """

    def __init__(self, g: Graph, x: Variables, links: Links, base: BaseMotion | None) -> None:
        self.g, self.x, self.gravity = g, x, zeros(g)
        self.links, self.places = links.links, links.places
        self.on_world = base is None
        self.base = base or BaseMotion(zeros(g), identity(g), zeros(g), zeros(g))
        self.carried_spin, self.spin = self._spins()
        self._motions: dict[tuple[int, ...], Motion] = {}
        self._wrenches: dict[tuple[int, ...], list[Wrench]] = {}

    def moving(self) -> list[int]:
        """Indices of all links but the base, parents first."""
        return list(range(1, len(self.links)))

    def relative(self, link: Link) -> tuple[Vector, Vector]:
        """What the rates of a link's joint add to its angular velocity and to the velocity of its origin."""
        return along(self.g, link.subspace, [self.x.v[i] for i in link.rates])

    def _spins(self) -> tuple[list[Vector], list[Vector]]:
        carried, spin = [self.base.omega], [self.base.omega]
        for link in self.links[1:]:
            before = link.turn.down(spin[link.parent])
            carried.append(before)
            spin.append(plus(self.g, before, self.relative(link)[0]))
        return carried, spin

    @cached_property
    def velocities(self) -> list[Vector]:
        """Velocities of the links' origins."""
        g, base = self.g, self.base
        result = [transposed_times(g, base.rotation, base.velocity)]
        for k, link in enumerate(self.links[1:], 1):
            swept = cross(g, self.spin[link.parent], link.offset)
            velocity = link.turn.down(plus(g, result[link.parent], swept))
            result.append(plus(g, velocity, self.slide_velocity(k)))
        return result

    def slide_velocity(self, k: int) -> Vector:
        """Velocity of a link's origin, relative to where it would be without its slide and with the same spin."""
        g, link = self.g, self.links[k]
        _, velocity = self.relative(link)
        if link.slide == g.zero:
            return velocity
        return plus(g, scaled(g, link.slide, cross_z(g, self.spin[k])), velocity)

    @cached_property
    def poses(self) -> tuple[list[Matrix], list[Vector]]:
        """Rotations from the links' axes to world axes, and positions of their origins in the world."""
        g = self.g
        rotations, positions = [self.base.rotation], [self.base.position]
        for link in self.links[1:]:
            before = rotations[link.parent]
            rotation = link.turn.after(before)
            position = plus(g, positions[link.parent], times(g, before, link.offset))
            position = plus(g, position, scaled(g, link.slide, column(rotation, 2)))
            rotations.append(rotation)
            positions.append(position)
        return rotations, positions

    def motion(self, dv: Vector) -> Motion:
        """Accelerations of the links for accelerations dv/dt."""
        key = tuple(dv)
        if key not in self._motions:
            self._motions[key] = self._accelerate(dv)
        return self._motions[key]

    def _accelerate(self, dv: Vector) -> Motion:
        g = self.g
        alpha0, acc0 = self._base_acceleration(dv)
        m = Motion([alpha0], [acc0], [field_gradient(g, alpha0, self.spin[0])], [alpha0], [acc0])
        for k, link in enumerate(self.links[1:], 1):
            p, carried = link.parent, self.carried_spin[k]
            alpha = link.turn.down(m.alpha[p])
            acc = link.turn.down(plus(g, m.acceleration[p], times(g, m.gradient[p], link.offset)))
            m.carried_alpha.append(alpha)
            m.carried_acceleration.append(acc)
            spin, velocity = self.relative(link)
            turning, sliding = along(g, link.subspace, [dv[i] for i in link.rates])
            alpha = plus(g, plus(g, alpha, cross(g, carried, spin)), turning)
            gradient = field_gradient(g, alpha, self.spin[k])
            coriolis = cross(g, self.spin[k], scaled(g, g.const(2.0), velocity))
            acc = plus(g, plus(g, acc, scaled(g, link.slide, column(gradient, 2))), coriolis)
            acc = plus(g, acc, sliding)
            m.alpha.append(alpha)
            m.acceleration.append(acc)
            m.gradient.append(gradient)
        return m

    def _base_acceleration(self, dv: Vector) -> tuple[Vector, Vector]:
        g, base = self.g, self.base
        moved = [g.zero] * 6
        if not self.on_world:
            moved = forward(g, [*base.omega, *base.velocity], self.x.variable_motion(dv))
        return moved[:3], transposed_times(g, base.rotation, minus(g, moved[3:], self.gravity))

    def wrenches(self, dv: Vector) -> list[Wrench]:
        """Per link: what its joint transmits, so that all that hangs on it moves as given."""
        key = tuple(dv)
        if key not in self._wrenches:
            m = self.motion(dv)
            result = [
                link.inertia.wrench(self.g, self.spin[k], m.gradient[k], m.alpha[k], m.acceleration[k])
                for k, link in enumerate(self.links)
            ]
            for k in reversed(self.moving()):
                parent = self.links[k].parent
                result[parent] = self._add_wrenches(result[parent], self.to_parent(k, result[k]))
            self._wrenches[key] = result
        return self._wrenches[key]

    def to_parent(self, k: int, wrench: Wrench) -> Wrench:
        """A wrench on link k in the axes and about the origin of its parent."""
        g, link = self.g, self.links[k]
        force, moment = wrench
        if link.slide != g.zero:
            moment = minus(g, moment, scaled(g, link.slide, cross_z(g, force)))
        force = link.turn.up(force)
        return force, plus(g, link.turn.up(moment), cross(g, link.offset, force))

    def _add_wrenches(self, a: Wrench, b: Wrench) -> Wrench:
        return plus(self.g, a[0], b[0]), plus(self.g, a[1], b[1])

    def along_joint(self, k: int, wrench: Wrench) -> list[int]:
        """The components of a wrench on link k that its joint's rates do work against."""
        g, (force, moment) = self.g, wrench
        return [
            g.add(dot(g, turning, moment), dot(g, sliding, force))
            for turning, sliding in self.links[k].subspace
        ]

    def joint_forces(self, dv: Vector) -> dict[int, int]:
        """Inverse dynamics: generalised forces by index of the rate."""
        wrenches = self.wrenches(dv)
        result: dict[int, int] = {}
        for k in self.moving():
            result.update(zip(self.links[k].rates, self.along_joint(k, wrenches[k]), strict=True))
        return result

    def pairs(self, dv: Vector) -> list[tuple[int, int]]:
        """Pairs (velocity, inertia and gravity force): of the joints, and of a base that is placed by hand."""
        pairs = [(self.x.v[k], force) for k, force in self.joint_forces(dv).items()]
        return pairs if self.on_world else pairs + self._base_pairs(dv)

    def _base_pairs(self, dv: Vector) -> list[tuple[int, int]]:
        force, moment = self.wrenches(dv)[0]
        pairs = list(zip(self.base.omega, moment, strict=True))
        return pairs + list(zip(self.base.velocity, times(self.g, self.base.rotation, force), strict=True))

    @cached_property
    def composites(self) -> list[Inertia]:
        """Inertia of each link with all that hangs on it."""
        g = self.g
        result = [link.inertia for link in self.links]
        for k in reversed(self.moving()):
            link, carried = self.links[k], result[k]
            if link.slide != g.zero:
                carried = carried.shifted(g, [g.zero, g.zero, link.slide])
            carried = carried.turned(link.turn).shifted(g, link.offset)
            result[link.parent] = result[link.parent].plus(g, carried)
        return result

    def unit_wrenches(self, k: int) -> list[Wrench]:
        """What each rate of link k needs per unit of acceleration, for all that hangs on the link."""
        return [
            self.composites[k].momentum_of(self.g, turning, sliding)
            for turning, sliding in self.links[k].subspace
        ]

    def mass_entries(self) -> dict[tuple[int, int], int]:
        """Upper and lower elements of M by indices of rates, for a tree on the world."""
        result: dict[tuple[int, int], int] = {}
        for k in self.moving():
            for rate, wrench in zip(self.links[k].rates, self.unit_wrenches(k), strict=True):
                j = k
                while j:
                    for i, entry in zip(self.links[j].rates, self.along_joint(j, wrench), strict=True):
                        result[i, rate] = result[rate, i] = entry
                    wrench, j = self.to_parent(j, wrench), self.links[j].parent
        return result

    @cached_property
    def kinetic(self) -> int:
        """Kinetic energy."""
        g, total = self.g, self.g.zero
        for k, link in enumerate(self.links):
            if k == 0 and self.on_world:
                continue
            linear, angular = link.inertia.momentum_of(g, self.spin[k], self.velocities[k])
            energy = g.add(g.dot(self.velocities[k], linear), g.dot(self.spin[k], angular))
            total = g.add(total, energy)
        return g.mul(g.const(0.5), total)

    def gravity_potential(self, gravity: Vector) -> int:
        """Potential energy of gravity, by first moments gathered from the last links to the base."""
        g = self.g
        masses = [link.inertia.mass for link in self.links]
        moments = [link.inertia.first for link in self.links]
        for k in reversed(self.moving()):
            link, moment = self.links[k], moments[k]
            moment = [moment[0], moment[1], g.add(moment[2], g.mul(masses[k], link.slide))]
            moment = plus(g, link.turn.up(moment), scaled(g, masses[k], link.offset))
            masses[link.parent] = g.add(masses[link.parent], masses[k])
            moments[link.parent] = plus(g, moments[link.parent], moment)
        total = plus(g, times(g, self.base.rotation, moments[0]), scaled(g, masses[0], self.base.position))
        return g.neg(g.dot(gravity, total))
