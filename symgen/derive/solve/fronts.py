"""Sparse LDLᵀ by fronts, for what is too large to be written out: the plan of a multifrontal elimination.

A front is a full symmetric matrix over the rows that it eliminates and those that these touch; what is left of it is
added to the front of the first row left (Duff and Reid, ACM TOMS 9 (1983) 302; Liu, SIAM Review 34 (1992) 82). The
plan is made of integers alone: in the generated module it is a table, and `TEXT` are the loops that run through it,
which the run time knows and replaces by faster code of the same operations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from heapq import heapify, heappop, heappush

from ..graph.graph import Graph
from ..graph.nodes import FrontPlan
from .dense_solve import element

FACTOR, SOLVE = "factor_fronts", "solve_fronts"
LARGEST_MERGED = 8  # rows of a front that takes in the one before, zeros and all
MOST_ZEROS = 0.4  # share of a merged front's pivot rows

TEXT = {
    FACTOR: '''def factor_fronts(a, s, n):
    """Factorise a sparse symmetric matrix by n fronts: U^T D of the rows that each eliminates, 1/d on the diagonal.

    s begins with the place of each front's record: place in a, rows, how many of these it eliminates, place and rows
    of the front that takes what is left, how many times its pivots count, the number of each row, and the rows that
    what is left has there. Behind each front, a has the diagonal of its pivots as it was; behind all, it gets the
    smallest pivot relative to that.
    """
    ratio = 1.0
    end = 0
    for k in range(n):
        r = s[k]
        f = s[r]
        size = s[r + 1]
        pivots = s[r + 2]
        for p in range(pivots):
            row = f + p * size
            q = s[r + 5] * (a[row + p] / a[f + size * size + p])
            if q < ratio or q != q:
                ratio = q
            d = 1.0 / a[row + p]
            a[row + p] = d
            for i in range(p + 1, size):
                c = d * a[row + i]
                for j in range(i, size):
                    a[f + i * size + j] = a[f + i * size + j] - c * a[row + j]
        m = r + 6 + size
        for i in range(pivots, size):
            row = s[r + 3] + s[m + i - pivots] * s[r + 4]
            for j in range(i, size):
                place = row + s[m + j - pivots]
                a[place] = a[place] + a[f + i * size + j]
        end = f + size * size + pivots
    a[end] = ratio
''',
    SOLVE: '''def solve_fronts(a, b, s, n):
    """Solve in place with the fronts in a: b becomes the solution."""
    for k in range(n):
        r = s[k]
        size = s[r + 1]
        for p in range(s[r + 2]):
            row = s[r] + p * size
            z = a[row + p] * b[s[r + 6 + p]]
            b[s[r + 6 + p]] = z
            for i in range(p + 1, size):
                b[s[r + 6 + i]] = b[s[r + 6 + i]] - a[row + i] * z
    for k in range(n - 1, -1, -1):
        r = s[k]
        size = s[r + 1]
        for p in range(s[r + 2] - 1, -1, -1):
            row = s[r] + p * size
            z = 0.0
            for i in range(size - 1, p, -1):
                z = z + a[row + i] * b[s[r + 6 + i]]
            b[s[r + 6 + p]] = b[s[r + 6 + p]] - a[row + p] * z
''',
}


@dataclass
class _Front:
    pivots: list[int]
    rest: list[int]  # rows below, in the order of elimination
    times: int = 1  # that its pivots count, see `_count_sides`

    @property
    def rows(self) -> list[int]:
        return [*self.pivots, *self.rest]


def plan(neighbours: list[set[int]]) -> FrontPlan:
    """Plan the elimination of a matrix, given the columns of the nonzero entries off the diagonal of each row."""
    fronts = _cheapest(neighbours)
    owner = {row: k for k, front in enumerate(fronts) for row in front.pivots}
    position = {row: k for k, row in enumerate(row for front in fronts for row in front.pivots)}
    bases, end = [], 0
    for front in fronts:
        bases.append(end)
        end += len(front.rows) ** 2 + len(front.pivots)
    records: list[int] = []
    starts: list[int] = []
    places: list[int] = []
    entries: list[tuple[int, int]] = []
    for base, front in zip(bases, fronts, strict=True):
        rows, size = front.rows, len(front.rows)
        starts.append(len(fronts) + len(records))
        parent = owner[front.rest[0]] if front.rest else -1
        above = fronts[parent].rows if front.rest else []
        number = {row: k for k, row in enumerate(above)}
        records += [
            base, size, len(front.pivots), bases[parent] if front.rest else 0, len(above), front.times
        ]  # fmt: skip
        records += [*rows, *(number[row] for row in front.rest)]
        column = {row: k for k, row in enumerate(rows)}
        for p, i in enumerate(front.pivots):
            places += [base + p * size + p, base + size * size + p]
            entries += [(i, i), (i, i)]
            later = sorted(j for j in neighbours[i] if position[j] > position[i])
            places += [base + p * size + column[j] for j in later]
            entries += [(i, j) for j in later]
    return FrontPlan(
        len(fronts), end + 1, (*starts, *records), tuple(places), tuple(entries), _operations(fronts)
    )


def _cheapest(neighbours: list[set[int]]) -> list[_Front]:
    """The fronts of an elimination from all ends in turns, or of one from end to end where that costs less.

    Each pivot waits for a division, two products and a difference of the one before. From both ends of a chain two of
    them are under way at a time, which takes 0.6 of the time. Of a grid, ties by number lead to fewer operations.
    """
    in_turns = _Merged(_eliminate(neighbours, in_turns=True)).in_turns()
    _count_sides(in_turns)
    one_by_one = _Merged(_eliminate(neighbours, in_turns=False)).one_by_one()
    return min(in_turns, one_by_one, key=lambda fronts: _operations(fronts)[0])


def _eliminate(neighbours: list[set[int]], in_turns: bool) -> list[tuple[int, set[int]]]:
    """Rows in an order of minimum degree, each with the rows that it still touches.

    Ties go to the row of the smallest number, or, `in_turns`, to the one which has had its degree for longest.
    """
    left = [set(row) for row in neighbours]
    waiting = [(len(row), 0, i) for i, row in enumerate(left)]
    heapify(waiting)
    done: set[int] = set()
    order: list[tuple[int, set[int]]] = []
    while waiting:
        degree, _, i = heappop(waiting)
        if i in done or degree != len(left[i]):
            continue
        done.add(i)
        touched = left[i]
        order.append((i, touched))
        for j in touched:
            left[j] |= touched
            left[j] -= {i, j}
        for j in sorted(touched):
            heappush(waiting, (len(left[j]), len(order) if in_turns else 0, j))
    return order


class _Merged:
    """Fronts of an elimination; a row joins the front of the first row that it touches where they are alike, or small.

    Attributes
    ----------
    fronts : list of _Front
        One for each row, of which those count that no other has taken in.
    parents, children : list of int, list of list of int
        The row whose front takes what is left of each row's; -1 for none. The other way round.
    taken : list of int
        The row whose front each row's has become part of, its own at first.
    """

    def __init__(self, order: list[tuple[int, set[int]]]) -> None:
        position = {row: k for k, (row, _) in enumerate(order)}
        self.parents = [min((position[j] for j in touched), default=-1) for _, touched in order]
        self.fronts = [_Front([row], sorted(touched, key=position.__getitem__)) for row, touched in order]
        self.taken = list(range(len(order)))
        self.children: list[list[int]] = [[] for _ in order]
        for k, parent in enumerate(self.parents):
            if parent >= 0:
                self.children[parent].append(k)
        for k in range(len(order)):
            self._take_in_one(k)

    def _take_in_one(self, k: int) -> None:
        fronts = self.fronts
        for child in reversed(self.children[k]):
            if self._is_left(child) and _alike(fronts[child], fronts[k]):
                fronts[k].pivots = [*fronts[child].pivots, *fronts[k].pivots]
                self.children[k] += [c for c in self.children[child] if self._is_left(c)]
                self.taken[child] = k
                return

    def _is_left(self, k: int) -> bool:
        return self.taken[k] == k

    def in_turns(self) -> list[_Front]:
        """The fronts in the order of elimination."""
        return [front for k, front in enumerate(self.fronts) if self._is_left(k)]

    def one_by_one(self) -> list[_Front]:
        """The fronts in an order in which each stands shortly behind those that it takes from."""
        result: list[_Front] = []
        for root in (k for k, parent in enumerate(self.parents) if parent < 0):
            stack = [(root, False)]
            while stack:
                k, ready = stack.pop()
                if ready:
                    result.append(self.fronts[k])
                    continue
                stack.append((k, True))
                stack += [(c, False) for c in reversed(self.children[k]) if self._is_left(c)]
        return result


def _count_sides(fronts: list[_Front]) -> None:
    """Set how many times pivots count where sides meet: once, and once more for each row of all sides but the largest.

    A small pivot tells of a dead point where constraints hold the same motion. But a pivot is what a joint's two sides
    give way by, of which one is a single body at first; where two sides of n bodies meet, each is as heavy as they all
    may be, and what is left of it is 1/n though nothing holds it. At a dead point nothing is left, however it counts.
    """
    owner = {row: k for k, front in enumerate(fronts) for row in front.pivots}
    below: list[list[int]] = [[] for _ in fronts]  # rows of the sides that each front takes from
    for k, front in enumerate(fronts):
        front.times = 1 + sum(below[k]) - max(below[k], default=0)
        if front.rest:
            below[owner[front.rest[0]]].append(sum(below[k]) + len(front.pivots))


def _alike(child: _Front, parent: _Front) -> bool:
    """Whether a front may take in one below it: how many zeros its pivot rows would get."""
    size = len(child.pivots) + len(parent.rows)
    zeros = len(child.pivots) * (size - len(child.rows))
    if not zeros:
        return True
    return size <= LARGEST_MERGED and zeros <= MOST_ZEROS * len(child.pivots) * size


def _operations(fronts: list[_Front]) -> tuple[int, int]:
    factor = solve = 0
    for front in fronts:
        size = len(front.rows)
        for p in range(len(front.pivots)):
            below = size - p - 1
            factor += 2 + below + below * (below + 1)
            solve += 2 + 4 * below
        rest = len(front.rest)
        factor += rest * (rest + 1) // 2
    return factor, solve


def factor(g: Graph, rows: list[dict[int, int]], made: FrontPlan) -> int:
    """The node of a factorisation of a symmetric matrix of nodes; all its pivots must be regular in any order."""
    g.front_plans.append(made)
    entries = [rows[i].get(j, g.zero) for i, j in made.entries]
    return g.on_arrays(FACTOR, (g.const(len(g.front_plans) - 1), *entries))


def solve(g: Graph, factors: int, right: Sequence[int]) -> list[int]:
    """Solution for a right-hand side."""
    handle = g.on_arrays(SOLVE, (factors, *right))
    return [element(g, handle, k) for k in range(len(right))]


def condition(g: Graph, factors: int) -> int:
    """The smallest pivot relative to what stood in its place before any other row was eliminated."""
    made = g.front_plans[int(g.args[g.args[factors][0]][0])]
    return element(g, factors, made.n_values - 1)
