"""The variables of a model on its graph, and how velocities follow from rates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

from ..model.description import Description, plain_rate
from .graph.graph import Graph
from .graph.nodes import INPUT, LAM, A, Q, T, V
from .graph.vectors import Matrix, Vector, doubled_rates, rate


@dataclass(frozen=True)
class Mark:
    """A vector fixed in a body of a tree: world components, their first time derivatives, and their second for dv/dt.

    Derivation stops at these nodes: their derivatives follow from the motion of the links with fewer operations.
    """

    components: Vector
    velocity: Vector
    acceleration: Callable[[list[int]], Vector]


@dataclass(frozen=True)
class Variables:
    """Nodes of the variables.

    `plain` are pairs (k, i) with dq_k/dt = v_i; `quaternions` are pairs of first indices in q and in v. `marks` are
    added as they become known, as are `changes`: the derivatives of first-order states, by their indices in v. `driven`
    has the rates of inputs whose rates are inputs.
    """

    g: Graph
    t: int
    q: list[int]
    v: list[int]
    a: list[int]
    lam: list[int]
    qdot: list[int]
    plain: list[tuple[int, int]]
    quaternions: list[tuple[int, int]]
    states: frozenset[int] = frozenset()
    marks: list[Mark] = field(default_factory=list)
    changes: dict[int, int] = field(default_factory=dict)
    driven: dict[int, int] = field(default_factory=dict)

    def without_states(self, row: dict[int, int]) -> dict[int, int]:
        """A row by rates without states: these are no speeds of anything, so that no force acts along them."""
        return {i: node for i, node in row.items() if i not in self.states} if self.states else row

    def of_motion(self, nodes: list[int]) -> dict[int, int]:
        """Nodes by the rates' own, but for states."""
        return {
            v: node for i, (v, node) in enumerate(zip(self.v, nodes, strict=True)) if i not in self.states
        }

    def along_rates(self, by_rate: dict[int, int]) -> list[int]:
        """Forces along the rates that derivatives by the rates' nodes are; none along states."""
        zero, states = self.g.zero, self.states
        return [zero if i in states else by_rate.get(v, zero) for i, v in enumerate(self.v)]

    def changing(self, accelerations: list[int]) -> list[int]:
        """Accelerations with states' derivatives as they are, whatever is tried for the others."""
        return [self.changes.get(i, node) for i, node in enumerate(accelerations)]

    def variable_motion(self, dv: list[int]) -> dict[int, int]:
        """Time derivatives of all variables for given dv/dt."""
        return self.driven | dict(zip([*self.q, *self.v, self.t], [*self.qdot, *dv, self.g.one], strict=True))

    def motion(self, dv: list[int]) -> dict[int, int]:
        """Time derivatives of all variables and marks for given dv/dt."""
        result = self.variable_motion(dv)
        for mark in self.marks:
            acceleration = mark.acceleration(dv)
            moving = [*mark.components, *mark.velocity]
            for node, change in zip(moving, [*mark.velocity, *acceleration], strict=True):
                if self.g.mask[node] & (Q | V):
                    result.setdefault(node, change)
        return result

    def displacement(self, virtual: list[int]) -> dict[int, int]:
        """How the coordinates move under virtual rates: δq = N w."""
        moved = self.g.substitute(self.qdot, dict(zip(self.v, virtual, strict=True)))
        return dict(zip(self.q, moved, strict=True))

    def by_rates(self, by_coordinates: dict[int, int]) -> list[int]:
        """Nᵀ times a gradient by the coordinates, which is given by their nodes."""
        g = self.g
        result = [g.zero] * len(self.v)
        for k, i in self.plain:
            result[i] = by_coordinates.get(self.q[k], g.zero)
        for k, i in self.quaternions:
            gradient = [by_coordinates.get(x, g.zero) for x in self.q[k : k + 4]]
            for j, column in enumerate(zip(*doubled_rates(g, self.q[k : k + 4]), strict=True)):
                result[i + j] = g.mul(g.const(0.5), g.dot(column, gradient))
        return result

    def by_coordinates(self, by_rates: list[int]) -> list[int]:
        """A row of derivatives by q that has the given derivatives along the rates: row · N⁺.

        N⁺ = 4 Nᵀ for a unit quaternion: nothing changes with its length, which integrators do not move along.
        """
        g = self.g
        result = [g.zero] * len(self.q)
        for k, i in self.plain:
            result[k] = by_rates[i]
        for k, i in self.quaternions:
            doubled = [g.mul(g.const(2.0), x) for x in by_rates[i : i + 3]]
            result[k : k + 4] = [g.dot(row, doubled) for row in doubled_rates(g, self.q[k : k + 4])]
        return result

    def kinematic_matrix(self) -> Matrix:
        """N, nq x nv, of dq/dt = N v."""
        g = self.g
        matrix = [[g.zero] * len(self.v) for _ in self.q]
        for k, i in self.plain:
            matrix[k][i] = g.one
        for k, i in self.quaternions:
            for r, row in enumerate(doubled_rates(g, self.q[k : k + 4])):
                matrix[k + r][i : i + 3] = [g.mul(g.const(0.5), x) for x in row]
        return matrix


def with_rates(description: Description) -> Description:
    """The description with its rates: those of the coordinates where none are given."""
    if description.rates:
        return description
    rates = tuple(plain_rate(c) for c in description.coordinates)
    return replace(description, rates=rates)


def variables(g: Graph, description: Description) -> Variables:
    """The variables of a description that has its rates."""
    d = description
    q = [g.var(Q, k) for k in range(len(d.coordinates))]
    v = [g.var(V, k) for k in range(len(d.rates))]
    index = {c.name: k for k, c in enumerate(d.coordinates)}
    plain = [(index[r.coordinate], i) for i, r in enumerate(d.rates) if r.coordinate is not None]
    turning = [i for i, r in enumerate(d.rates) if r.coordinate is None]
    first = [k for k, c in enumerate(d.coordinates) if c.quaternion is not None][::4]
    quaternions = list(zip(first, turning[::3], strict=True))
    qdot = [g.zero] * len(q)
    for k, i in plain:
        qdot[k] = v[i]
    for k, i in quaternions:
        qdot[k : k + 4] = rate(g, q[k : k + 4], v[i : i + 3])
    m = len(d.constraints) + len(d.velocity_constraints)
    return Variables(
        g=g,
        t=g.var(T),
        q=q,
        v=v,
        a=[g.var(A, k) for k in range(len(v))],
        lam=[g.var(LAM, k) for k in range(m)],
        qdot=qdot,
        plain=plain,
        quaternions=quaternions,
        states=frozenset(i for i, r in enumerate(d.rates) if r.state),
        driven=_driven(g, d),
    )


def _driven(g: Graph, d: Description) -> dict[int, int]:
    """The rates of inputs whose rates are inputs."""
    places = (
        {u.name: g.var(INPUT, k) for k, u in enumerate(d.inputs)} if any(u.rate_of for u in d.inputs) else {}
    )
    return {places[u.rate_of]: places[u.name] for u in d.inputs if u.rate_of}
