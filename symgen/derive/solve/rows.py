"""Block LDLᵀ of symmetric matrices as operations: the rows that are left, one step of the elimination, the solution."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from ..graph.graph import Graph
from ..graph.vectors import Matrix
from . import dense_solve, fronts


class Step:
    """One step of an elimination, and what it does to the numbers x of a right-hand side on the way down and back."""

    def down(self, g: Graph, x: list[int]) -> None:
        """Do to a right-hand side what the step does to the matrix."""

    def back(self, g: Graph, x: list[int]) -> None:
        """Find what the step determines from what was determined behind it."""


@dataclass(frozen=True)
class Pivot(Step):
    """One block step of the elimination: a single row, or a coordinate and the constraint that determines it.

    `inverse` is the inverse of the block on `rows`; `lower` maps each row below to its entries of L.
    """

    rows: tuple[int, ...]
    inverse: Matrix
    lower: dict[int, list[int]]

    def down(self, g: Graph, x: list[int]) -> None:
        for i, entries in self.lower.items():
            for k, entry in zip(self.rows, entries, strict=True):
                x[i] = g.sub(x[i], g.mul(entry, x[k]))

    def back(self, g: Graph, x: list[int]) -> None:
        here = [x[k] for k in self.rows]
        for position, k in enumerate(self.rows):
            x[k] = g.dot(self.inverse[position], here)
            for i, entries in self.lower.items():
                x[k] = g.sub(x[k], g.mul(entries[position], x[i]))


@dataclass(frozen=True)
class Substitution(Step):
    """A velocity, `node`, replaced by what it is made of: `inputs` are factors of rows and other such velocities."""

    node: int
    inputs: dict[int, int]

    def down(self, g: Graph, x: list[int]) -> None:
        for i, factor in self.inputs.items():
            x[i] = g.add(x[i], g.mul(factor, x[self.node]))

    def back(self, g: Graph, x: list[int]) -> None:
        x[self.node] = g.sum(g.mul(factor, x[i]) for i, factor in self.inputs.items())


@dataclass(frozen=True)
class Combination(Step):
    """Two constraints replaced by a c + b d and a d - b c, of which the second one is without a coordinate."""

    rows: tuple[int, int]
    a: int
    b: int

    def down(self, g: Graph, x: list[int]) -> None:
        c, d = (x[i] for i in self.rows)
        x[self.rows[0]] = g.add(g.mul(self.a, c), g.mul(self.b, d))
        x[self.rows[1]] = g.sub(g.mul(self.a, d), g.mul(self.b, c))

    def back(self, g: Graph, x: list[int]) -> None:
        c, d = (x[i] for i in self.rows)
        x[self.rows[0]] = g.sub(g.mul(self.a, c), g.mul(self.b, d))
        x[self.rows[1]] = g.add(g.mul(self.b, c), g.mul(self.a, d))


@dataclass(frozen=True)
class Weighting(Step):
    """The equation of a constraint added to those of its coordinates, times `factors`: M + w gᵀg in the place of M."""

    constraint: int
    factors: dict[int, int]

    def down(self, g: Graph, x: list[int]) -> None:
        for i, factor in self.factors.items():
            x[i] = g.add(x[i], g.mul(factor, x[self.constraint]))


@dataclass(frozen=True)
class Factors:
    """Block LDLᵀ in elimination order; rows below nv are coordinates, the next ones constraints.

    `conditions` are the constraint pivots relative to their values before other constraints were eliminated:
    1 for constraints that do not influence each other, 0 for dependent ones.
    """

    pivots: list[Step]
    conditions: list[int]
    rest: tuple[int, ...] = ()  # rows that are left to a dense factorisation by loops
    dense: int = -1  # and its node
    by_fronts: bool = False  # whether that factorisation is sparse
    n_nodes: int = 0  # velocities behind the rows, see `lifting.py`
    velocities: dict[int, int] = field(default_factory=dict)  # rows of what stands for them on the graph

    @property
    def is_rearranged(self) -> bool:
        """Whether rows were combined or weighted, so that no order of pivots alone gives these factors."""
        return any(isinstance(step, Combination | Weighting) for step in self.pivots)


class Rows:
    """A matrix while it is eliminated: `entries` has both triangles of what is left of it.

    Rows below `n` are coordinates, the next `m` constraints.

    Attributes
    ----------
    before_constraints : dict of int to int
        The diagonal of constraints from eliminated coordinates alone.
    touched : list of int
        The rows that the last step has changed.
    """

    def __init__(
        self, g: Graph, n: int, m: int, entries: dict[int, dict[int, int]], switched: Mapping[int, int]
    ) -> None:
        self.g, self.n, self.m, self.entries = g, n, m, entries
        self.left = set(entries)
        self.switched = (
            switched  # constraints with something in their diagonal: a pivot with one could be zero
        )
        self.before_constraints = dict(switched)
        self.result = Factors([], [])
        self.n_entries = sum(map(len, entries.values()))
        self.touched = sorted(entries)

    def eliminate(self, k: int) -> None:
        g, row = self.g, self.entries[k]
        pivot = row.get(k, g.zero)
        if k >= self.n:
            reference = self.before_constraints.get(k, pivot)
            self.result.conditions.append(g.div(pivot, reference) if pivot != g.zero else g.zero)
        if pivot == g.zero:  # a dependent constraint: without it the others give the same motion
            self._apply(Pivot((k,), [[g.zero]], {i: [g.zero] for i in row}))
            return
        inverse = g.div(g.one, pivot)
        lower = {
            i: [g.one if value == pivot else g.mul(value, inverse)] for i, value in row.items() if i != k
        }
        self._apply(Pivot((k,), [[inverse]], lower))

    def eliminate_pair(self, z: int, c: int) -> None:
        """Eliminate the block [[e, h], [h, 0]] of a coordinate and a constraint: regular whatever e is."""
        g, rows = self.g, self.entries
        inverse = g.div(g.one, rows[z][c])
        corner = g.neg(g.mul(g.mul(inverse, rows[z].get(z, g.zero)), inverse))
        block = [[g.zero, inverse], [inverse, corner]]
        others = sorted((rows[z].keys() | rows[c].keys()) - {z, c})
        couplings = {i: [rows[i].get(z, g.zero), rows[i].get(c, g.zero)] for i in others}
        lower = {i: [g.dot(pair, column) for column in block] for i, pair in couplings.items()}
        self._apply(Pivot((z, c), block, lower))

    def add_weighted(self, c: int, weight: int) -> None:
        """Add w gᵀg of the row g of a constraint that has nothing in its diagonal: the solution stays what it is."""
        g, row = self.g, dict(self.entries[c])
        factors = {j: g.mul(weight, value) for j, value in row.items()}
        order = sorted(row)
        for position, i in enumerate(order):
            for j in order[position:]:
                total = g.add(self.entries[i].get(j, g.zero), g.mul(factors[i], row[j]))
                self.n_entries += (2 if i != j else 1) * (j not in self.entries[i])
                self.entries[i][j] = self.entries[j][i] = total
        self.result.pivots.append(Weighting(c, factors))

    def combine(self, c: int, d: int, z: int) -> None:
        """Take a coordinate out of constraint d by constraint c: a turn and a stretch, which loses no digits.

        Both have nothing in their diagonals.
        """
        g, rows = self.g, (dict(self.entries[c]), dict(self.entries[d]))
        a, b = rows[0][z], rows[1][z]
        for j in sorted(rows[0].keys() | rows[1].keys()):
            of_c, of_d = (row.get(j, g.zero) for row in rows)
            self._set(c, j, g.add(g.mul(a, of_c), g.mul(b, of_d)))
            self._set(d, j, g.zero if j == z else g.sub(g.mul(a, of_d), g.mul(b, of_c)))
        self.touched = [c, d, *rows[0].keys(), *rows[1].keys()]
        self.result.pivots.append(Combination((c, d), a, b))

    def _set(self, i: int, j: int, value: int) -> None:
        """Set an entry beside the diagonal."""
        self.n_entries += 2 * ((value != self.g.zero) - (j in self.entries[i]))
        if value == self.g.zero:
            self.entries[i].pop(j, None)
            self.entries[j].pop(i, None)
        else:
            self.entries[i][j] = self.entries[j][i] = value

    def _apply(self, pivot: Pivot) -> None:
        """Subtract L D Lᵀ of a pivot from the rows that are left."""
        g = self.g
        removed = {k: self.entries.pop(k) for k in pivot.rows}
        self.left -= removed.keys()
        self.n_entries -= sum(map(len, removed.values()))
        from_coordinate = pivot.rows[0] < self.n
        others = sorted(pivot.lower)
        self.touched = others
        for position, i in enumerate(others):
            for k in pivot.rows:
                self.n_entries -= self.entries[i].pop(k, None) is not None
            for j in others[position:]:
                terms = zip(pivot.lower[i], pivot.rows, strict=True)
                value = g.sum(g.mul(entry, removed[k].get(j, g.zero)) for entry, k in terms)
                if value != g.zero:
                    self._subtract(i, j, value, from_coordinate)
        self.result.pivots.append(pivot)

    def _subtract(self, i: int, j: int, value: int, from_coordinate: bool) -> None:
        g = self.g
        updated = g.sub(self.entries[i].get(j, g.zero), value)
        if i == j and self.n <= i < self.n + self.m and from_coordinate:
            self.before_constraints[i] = g.sub(self.before_constraints.get(i, g.zero), value)
        if updated == g.zero:
            if i == j and i in self.entries[i]:  # without inertia it no longer holds its constraints back
                self.touched = sorted({*self.touched, *self.entries[i]})
            self.n_entries -= (2 if i != j else 1) * (j in self.entries[i])
            self.entries[i].pop(j, None)
            self.entries[j].pop(i, None)
        else:
            self.n_entries += (2 if i != j else 1) * (j not in self.entries[i])
            self.entries[i][j] = self.entries[j][i] = updated


def solve(g: Graph, factors: Factors, right: list[int], along: Mapping[int, int] | None = None) -> list[int]:
    """Solution of [M Gᵀ; G 0] x = right.

    `along` are forces on `factors.velocities` beside those in `right`.
    """
    x = [*right, *[g.zero] * factors.n_nodes]
    for velocity, force in (along or {}).items():
        x[factors.velocities[velocity]] = g.add(x[factors.velocities[velocity]], force)
    for step in factors.pivots:
        step.down(g, x)
    if factors.rest:
        by_loops = fronts.solve if factors.by_fronts else dense_solve.solve
        dense = by_loops(g, factors.dense, [x[i] for i in factors.rest])
        for i, value in zip(factors.rest, dense, strict=True):
            x[i] = value
    for step in reversed(factors.pivots):
        step.back(g, x)
    return x[: len(right)]


def pivot_ratio(g: Graph, factors: Factors) -> int:
    """Smallest relative pivot of the constraints (1 if there is none to compare)."""
    ratio = g.one
    for condition in factors.conditions:
        ratio = g.minimum(ratio, condition)
    return ratio
