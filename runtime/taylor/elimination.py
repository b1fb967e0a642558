"""Solve with the matrix of accelerations and multipliers: a sparse LDLᵀ factorisation, written out.

[M Gᵀ; G 0] (a; -λ) = -r. As in `symgen.derive.solve.factorise`: minimum degree, a constraint only after all of its
coordinates that have inertia, and in pairs what inertia does not determine.
"""

from __future__ import annotations

from dataclasses import dataclass

from symgen.runtime.taylor.code import ONE, Code, Value
from symgen.runtime.taylor.refusal import Refusal

# Up to this size the inverse is formed: its products wait for each other less than substitutions do.
LARGEST_INVERSE = 6


@dataclass(frozen=True)
class Pivot:
    """Rows eliminated together, the inverse of their block, and L below: row -> one value for each."""

    rows: tuple[int, ...]
    inverse: list[list[Value]]
    lower: dict[int, list[Value]]


class Factors:
    """The factors of a symmetric matrix given by its entries (both triangles) in rows below `n`, constraints above.

    Attributes
    ----------
    pivots : list of Pivot
    conditions : list of str
        The constraints' pivots, relative to their values before other constraints were eliminated.
    """

    def __init__(self, code: Code, n: int, entries: dict[int, dict[int, str]]) -> None:
        self.code, self.n, self.entries = code, n, entries
        self.left = set(entries)
        # A pivot with a constraint that can be switched off could be zero.
        self.switched = {c for c in entries if c >= n and c in entries[c]}
        self.pivots: list[Pivot] = []
        self.conditions: list[Value] = []
        self._taken_off: list[tuple[dict[int, Value], list[Value]]] = []
        self._before: dict[int, Value] = {}
        self._inverse_matrix: list[list[Value]] | None = None
        while (pair := self._next_pair()) is not None:
            self._eliminate(pair)
        while self.left:
            self._eliminate((self._next(),))

    def solve(self, right: list[Value]) -> list[Value]:
        """Return the solution for a right-hand side."""
        if len(right) > LARGEST_INVERSE:
            return self._substitute(right)
        if self._inverse_matrix is None:
            n = range(len(right))
            columns = [self._substitute([ONE if i == j else None for i in n]) for j in n]
            self._inverse_matrix = [list(row) for row in zip(*columns)]
        return [self._product(row, right) for row in self._inverse_matrix]

    def take_off(self, column: dict[int, Value], row: dict[int, Value]) -> None:
        """Take the product of a column and a row off the matrix (Sherman, Morrison, Ann. Math. Stat. 21 (1950) 124).

        Entries are given by their places. To be called before anything is solved for.
        """
        code = self.code
        response = self._substitute([column.get(i) for i in range(len(self.entries))])
        rest: Value = ONE
        for i, value in row.items():
            rest = code.fnma(value, response[i], rest)
        inverse = code.div(ONE, rest)
        self._taken_off.append((row, [code.mul(value, inverse) for value in response]))

    def _product(self, row: list[Value], right: list[Value]) -> Value:
        total: Value = None
        for factor, value in zip(row, right):
            total = self.code.fma(factor, value, total)
        return total

    def _substitute(self, right: list[Value]) -> list[Value]:
        code = self.code
        x = list(right)
        for pivot in self.pivots:
            for row, factors in pivot.lower.items():
                for factor, i in zip(factors, pivot.rows):
                    x[row] = code.fnma(factor, x[i], x[row])
        for pivot in self.pivots:
            own = [x[i] for i in pivot.rows]
            for i, inverse in zip(pivot.rows, pivot.inverse):
                total: Value = None
                for factor, value in zip(inverse, own):
                    total = code.fma(factor, value, total)
                x[i] = total
        for pivot in reversed(self.pivots):
            for row, factors in pivot.lower.items():
                for factor, i in zip(factors, pivot.rows):
                    x[i] = code.fnma(factor, x[row], x[i])
        for taken, response in self._taken_off:
            share: Value = None
            for i, value in taken.items():
                share = code.fma(value, x[i], share)
            x = [code.fma(share, value, before) for value, before in zip(response, x)]
        return x

    def _next_pair(self) -> tuple[int, ...] | None:
        for c in sorted(i for i in self.left - self.switched if i >= self.n):
            if len(self.entries[c]) == 1:
                return (next(iter(self.entries[c])), c)
        candidates = []
        for z in self.left:
            row = self.entries[z]
            if z < self.n and row and all(i >= self.n for i in row):
                candidates += [(len(row), len(self.entries[c]), z, c) for c in row if c not in self.switched]
        return min(candidates)[2:] if candidates else None

    def _massive(self, i: int) -> bool:
        return i < self.n and i in self.entries[i]

    def _next(self) -> int:
        rows = self.entries
        eligible = [
            i
            for i in self.left
            if i in rows[i] and (i < self.n or not any(self._massive(j) for j in rows[i]))
        ]
        if not eligible:
            raise Refusal("accelerations that neither inertia nor constraints determine")
        return min(eligible, key=lambda i: (len(rows[i]), i))

    def _eliminate(self, rows: tuple[int, ...]) -> None:
        code = self.code
        inverse = self._inverse(rows)
        below = sorted({j for i in rows for j in self.entries[i]} - set(rows))
        columns = {j: [self.entries[j].get(i) for i in rows] for j in below}
        lower: dict[int, list[Value]] = {}
        for j, column in columns.items():
            products: list[Value] = []
            for c in range(len(rows)):
                total: Value = None
                for k, value in enumerate(column):
                    total = code.fma(value, inverse[k][c], total)
                products.append(total)
            lower[j] = products
        for number, j in enumerate(below):
            for k in below[: number + 1]:
                value: Value = self.entries[j].get(k)
                for factor, other in zip(lower[j], columns[k]):
                    value = code.fnma(factor, other, value)
                if value is not None:
                    self.entries[j][k] = self.entries[k][j] = value
        self.left -= set(rows)
        for j in below:
            for i in rows:
                self.entries[j].pop(i, None)
        self.pivots.append(Pivot(rows, inverse, lower))
        if rows[0] < self.n:
            self._note_diagonals(below)

    def _note_diagonals(self, below: list[int]) -> None:
        for c in below:
            if c >= self.n and c in self.entries[c]:
                self._before[c] = self.entries[c][c]

    def _inverse(self, rows: tuple[int, ...]) -> list[list[Value]]:
        code = self.code
        if len(rows) == 1:
            i = rows[0]
            if i >= self.n and self._before.get(i) not in (None, self.entries[i][i]):
                self.conditions.append(code.div(self.entries[i][i], self._before[i]))
            return [[code.div(ONE, self.entries[i][i])]]
        z, c = rows
        coupling = code.div(ONE, self.entries[z][c])
        own = self.entries[z].get(z)
        corner = None if own is None else code.neg(code.mul(own, code.mul(coupling, coupling)))
        return [[None, coupling], [coupling, corner]]
