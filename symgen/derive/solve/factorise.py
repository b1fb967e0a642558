"""Sparse LDLᵀ of the saddle-point matrix [M Gᵀ; G 0] as straight-line operations, with little fill.

What is left when it is large and full, as the mass matrix of a long chain in relative coordinates, is factorised by
loops.
"""

from __future__ import annotations

from collections.abc import Mapping
from heapq import heappop, heappush

from ...errors import ModelError
from ..graph.graph import Graph
from ..graph.nodes import MOTION, SparseRows
from . import dense_solve, fronts
from .definite import singular_coordinates
from .rows import Factors, Rows, pivot_ratio, solve

__all__ = ["Factors", "factorise", "pivot_ratio", "solve"]

# Constraints, and operations of their elimination, from which on it is done by loops over a table.
FEWEST_IN_FRONTS, LEAST_IN_FRONTS = 80, 6000
LARGEST_BLOCK = 12  # coordinates whose inertia is coupled, where that is done


def factorise(
    g: Graph,
    mass: SparseRows,
    jacobian: SparseRows,
    names: list[str],
    corner: Mapping[int, int] | None = None,
    by_loops: bool = True,
) -> Factors:
    """Factorise by minimum degree, constraints only after all coordinates of their own rows that have inertia.

    That restriction makes every pivot nonzero when M is positive definite and G has full rank: let E be the coordinates
    and C the constraints that are gone. No row of G_C has an entry outside of E. So the next constraint's pivot is one
    of the elimination of -G_CE M_EE⁻¹ G_CEᵀ, a definite matrix, as if nothing but E moved; and what M has become on
    the other coordinates is its Schur complement for E with constraints C, no smaller than without them, so positive
    definite. Fill does not matter: a constraint need not wait for what M alone couples to its coordinates.
    Where M is singular by its structure, since more coordinates move a mass than it has ways to go, constraints g of
    these are weighted, M + w gᵀg: that is definite wherever the whole matrix is regular, and changes nothing of the
    solution (augmented Lagrangians; Golub and Greif, SIAM J. Sci. Comput. 24 (2003) 2076).
    Coordinates that a constraint determines without regard to inertia come first, as pairs with that constraint (see
    `_Elimination._next_pair`). Constraints of others without inertia are combined until one has them alone, by turns
    as in a QR factorisation of their columns: regular wherever the whole matrix is.

    Parameters
    ----------
    g : Graph
    mass : n rows
    jacobian : m rows
    names : list of str
        Names of the n + m rows, for errors and to break ties.
    corner : mapping of int to int, optional
        Nodes in the diagonal of constraints that can be switched off: 0 while one holds, -1 while its row of G is zero.
    by_loops : bool
        Whether what is large and nearly full may be left to loops.

    Raises
    ------
    ModelError
        If a coordinate has neither inertia nor a constraint that determines it.
    """
    return _Elimination.of(g, mass, jacobian, names, corner or {}).run(by_loops)


def pairs(
    g: Graph, mass: SparseRows, jacobian: SparseRows, corner: Mapping[int, int]
) -> tuple[list[tuple[int, int]], bool]:
    """The pairs that `factorise` eliminates first, and whether some coordinates still have no inertia after them."""
    elimination = _Elimination.of(g, mass, jacobian, [], corner)
    found = []
    while (pair := elimination._next_pair()) is not None:
        elimination.eliminate_pair(*pair)
        found.append(pair)
    bare = any(i < elimination.n and i not in elimination.entries[i] for i in elimination.left)
    return found, bare


class _Elimination(Rows):
    """The state of one factorisation.

    Candidates wait in heaps. Whatever changes a row puts it there again, and an entry that no longer holds is
    dropped when it comes up: so each step costs no more than the rows that it touches.
    """

    def __init__(
        self,
        g: Graph,
        n: int,
        entries: dict[int, dict[int, int]],
        names: list[str],
        switched: Mapping[int, int],
    ) -> None:
        super().__init__(g, n, len(entries) - n, entries, switched)
        self.names = names
        self.prescribed: list[int] = []
        self.determined: list[tuple[bool, int, int, int]] = []
        self.by_degree: list[tuple[int, int]] = []
        self.own: dict[int, set[int]] = {}

    @staticmethod
    def of(
        g: Graph, mass: SparseRows, jacobian: SparseRows, names: list[str], corner: Mapping[int, int]
    ) -> _Elimination:
        n, m = len(mass), len(jacobian)
        entries: dict[int, dict[int, int]] = {i: {} for i in range(n + m)}
        for i, row in enumerate(mass):
            entries[i].update(row)
        for k, row in enumerate(jacobian):
            for j, value in row.items():
                entries[n + k][j] = entries[j][n + k] = value
        switched = {n + k: node for k, node in corner.items()}
        for k, node in switched.items():
            entries[k][k] = node
        return _Elimination(g, n, entries, names, switched)

    def run(self, by_loops: bool) -> Factors:
        self._eliminate_pairs()
        self._weight_constraints()
        self._note_own_coordinates()
        self.touched = sorted(self.left)
        if by_loops and self._is_large():
            while (k := self._next_coordinate()) is not None:
                self.eliminate(k)
            if min(self.left) >= self.n and (factors := self._with_fronts()) is not None:
                return factors
            self.touched = sorted(self.left)
            self.by_degree.clear()
        while self.left and not (by_loops and self._rest_is_dense()):
            self.eliminate(self._next())
        return self._with_dense_rest() if self.left else self.result

    def _eliminate_pairs(self) -> None:
        while True:
            while (pair := self._next_pair()) is not None:
                self.eliminate_pair(*pair)
            shared = self._next_shared()
            if shared is None:
                return
            self.combine(*shared)

    def _next_shared(self) -> tuple[int, int, int] | None:
        """Two constraints that share a coordinate without inertia which no pair determines, and the coordinate."""
        shared = []
        for z in self.left:
            row = self.entries[z]
            if z < self.n and z not in row and not any(i < self.n for i in row):
                free = sorted((len(self.entries[c]), c) for c in row if c not in self.switched)
                if len(free) > 1:
                    shared.append((len(free), free[1][0], z, free))
        if not shared:
            return None
        *_, z, free = min(shared)
        return free[0][1], free[1][1], z

    def _weight_constraints(self) -> None:
        """Give motions without inertia some from the constraints that hold them, where M is singular.

        A weight is about the mass that a constraint moves: neither M nor what is added is lost beside the other.
        """
        g = self.g
        constraints = [c for c in sorted(self.left) if c >= self.n and c not in self.switched]
        if not constraints or not isinstance(g, Graph):  # costs are estimated without that
            return
        mass = [{j: node for j, node in self.entries.get(i, {}).items() if j < self.n} for i in range(self.n)]
        singular = singular_coordinates(g, mass)
        weights = {}
        for c in constraints:
            row = self.entries[c]
            if singular & row.keys():
                terms = (
                    g.div(g.mul(value, value), self.entries[j][j])
                    for j, value in sorted(row.items())
                    if self._massive(j)
                )
                weights[c] = g.div(g.one, g.sum(terms))
        for c, weight in weights.items():
            self.add_weighted(c, weight)

    def _is_large(self) -> bool:
        """Whether there are so many constraints that they are left to loops, once all coordinates are eliminated.

        That order costs no fill where inertia couples few coordinates at a time. A constraint that can be switched off
        needs the order in which all its coordinates come right before it.
        """
        if len(self.left) - sum(i < self.n for i in self.left) < FEWEST_IN_FRONTS or self.switched:
            return False
        seen: set[int] = set()
        for start in sorted(i for i in self.left if i < self.n):
            block, waiting = {start}, [start]
            while waiting and start not in seen and len(block) <= LARGEST_BLOCK:
                found = {j for j in self.entries[waiting.pop()] if j < self.n} - block
                block |= found
                waiting += found
            seen |= block
            if len(block) > LARGEST_BLOCK:
                return False
        return True

    def _next_coordinate(self) -> int | None:
        """The coordinate with inertia that touches the fewest rows."""
        for i in self.touched:
            if self._massive(i):
                heappush(self.by_degree, (len(self.entries[i]), i))
        while self.by_degree:
            degree, i = heappop(self.by_degree)
            if i in self.left and degree == len(self.entries[i]) and self._massive(i):
                return i
        return None

    def _with_fronts(self) -> Factors | None:
        """The factors with what is left done by fronts; None where that is not much."""
        g, rest = self.g, sorted(self.left)
        position = {i: k for k, i in enumerate(rest)}
        rows = [{position[j]: node for j, node in self.entries[i].items()} for i in rest]
        plan = fronts.plan([row.keys() - {i} for i, row in enumerate(rows)])
        if plan.operations[0] < LEAST_IN_FRONTS:
            return None
        factors = fronts.factor(g, rows, plan)
        conditions = [*self.result.conditions, fronts.condition(g, factors)]
        return Factors(self.result.pivots, conditions, tuple(rest), factors, by_fronts=True)

    def _rest_is_dense(self) -> bool:
        """Whether what is left is so large and full that loops are faster; all its coordinates need inertia.

        What does not move is written out up to a larger size: the run time does it once.
        """
        n = len(self.left)
        if not dense_solve.worthwhile(n, self.n_entries):
            return False
        if any(i < self.n and i not in self.entries[i] for i in self.left):
            return False
        entries = (entry for i in self.left for entry in self.entries[i].values())
        return n > dense_solve.LARGEST_HOISTED or any(self.g.mask[entry] & MOTION for entry in entries)

    def _with_dense_rest(self) -> Factors:
        g, rest = self.g, sorted(self.left)
        position = {i: k for k, i in enumerate(rest)}
        rows = [{position[j]: node for j, node in self.entries[i].items()} for i in rest]
        n_coordinates = sum(i < self.n for i in rest)
        references = [self.before_constraints.get(i, g.zero) for i in rest]
        dense = dense_solve.factor(g, rows, n_coordinates, references)
        conditions = [dense_solve.condition(g, dense, k) for k in range(n_coordinates, len(rest))]
        return Factors(self.result.pivots, self.result.conditions + conditions, tuple(rest), dense)

    def _next_pair(self) -> tuple[int, int] | None:
        """A coordinate and a constraint whose 2 x 2 block is regular wherever the whole matrix is.

        A constraint on one coordinate alone prescribes it. A coordinate without inertia is given by a
        constraint that has it with a constant coefficient, or by the only constraint that has it while all that
        can be switched off are. Left to the usual order, the first would need a regular M, the second a constraint
        that moves masses: a piston without mass would divide by zero at its dead centres.
        """
        self._collect_pairs()
        while self.prescribed:
            c = heappop(self.prescribed)
            if c in self.left and len(self.entries[c]) == 1:
                return next(iter(self.entries[c])), c
        while self.determined:
            candidate = heappop(self.determined)
            if candidate[2] in self.left and candidate in self._determinations(candidate[2]):
                return candidate[2:]
        return None

    def _collect_pairs(self) -> None:
        """Put what the rows touched last make possible into the heaps."""
        coordinates: set[int] = set()
        for i in self.touched:
            if i < self.n:
                coordinates.add(i)
                continue
            coordinates.update(z for z in self.entries[i] if z < self.n)
            if len(self.entries[i]) == 1 and i not in self.switched:
                heappush(self.prescribed, i)
        for z in coordinates:
            for candidate in self._determinations(z):
                heappush(self.determined, candidate)

    def _determinations(self, z: int) -> list[tuple[bool, int, int, int]]:
        """The constraints that determine a coordinate without inertia, the best one smallest."""
        row = self.entries[z]
        if z in row or any(i < self.n for i in row):
            return []
        free = [(c, value) for c, value in row.items() if c not in self.switched]
        sure = [c for c, value in free if len(free) == 1 or not self.g.mask[value] & MOTION]
        return [(self.g.mask[row[c]] != 0, len(self.entries[c]), z, c) for c in sure]

    def _massive(self, i: int) -> bool:
        return i < self.n and i in self.entries[i]

    def _note_own_coordinates(self) -> None:
        """What each constraint has to wait for, where it has inertia: the coordinates of its own row of G.

        Inertia that a coordinate gets from constraints alone is not covered by the argument in `factorise`, which is
        about M: every constraint waits for such a coordinate.
        """
        bare = {i for i in self.left if i < self.n and i not in self.entries[i]}
        self.own = {i: bare | {j for j in self.entries[i] if j < self.n} for i in self.left if i >= self.n}

    def _eligible(self, i: int) -> bool:
        """Whether a row has a pivot; that of a constraint that can be switched comes from its coordinates alone."""
        row = self.entries[i]
        if i not in row or i < self.n:
            return i in row
        waits_for = row.keys() & self.own[i]
        return not waits_for if i in self.switched else not any(self._massive(j) for j in waits_for)

    def _next(self) -> int:
        for i in self.touched:
            if self._eligible(i):
                heappush(self.by_degree, (len(self.entries[i]), i))
        while self.by_degree:
            degree, i = heappop(self.by_degree)
            if i in self.left and degree == len(self.entries[i]) and self._eligible(i):
                return i
        stuck = ", ".join(sorted(self.names[i] for i in self.left if i < self.n))
        if not stuck:  # constraints that repeat others, found without looking at numbers
            return min(self.left)
        raise ModelError(
            f"the accelerations of {stuck} are not determined: no inertia acts on them and the "
            "constraints do not fix them",
            hint="give a body or a kinetic energy that moves with them, or a constraint to a coordinate "
            "that has inertia",
        )
