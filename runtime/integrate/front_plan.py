"""The plan of a multifrontal factorisation: which columns are eliminated together, and where their rows meet."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

# The pattern of a matrix with its transpose is that of a symmetric one, whose elimination is known before any number
# is: a tree, in which the columns that share their rows make one front, a full matrix (Duff, Reid, ACM TOMS 9 (1983)
# 302; Liu, SIAM Review 34 (1992) 82).

# A front takes in the last one below it while they are so narrow, or so few of its entries are zeros.
_NARROW = 6
_MOST_ZEROS = 0.04


class FrontPlan(NamedTuple):
    """Fronts in an order in which those below come before; unknowns are numbered in the order of elimination.

    Attributes
    ----------
    order : ndarray of int64, shape (n,)
        The unknown that is eliminated k-th.
    first : ndarray of int64, shape (n_fronts + 1,)
        Where the columns of each front begin.
    border_start : ndarray of int64, shape (n_fronts + 1,)
        Where the border of each front begins.
    border, above : ndarray of int64, shape (n_borders,)
        The other unknowns of each front, ascending; and their places in the front above.
    n_below : ndarray of int64, shape (n_fronts,)
        How many fronts hand over to each: those that wait, last come first served.
    entry_start : ndarray of int64, shape (n_fronts + 1,)
        Where the entries of the matrix that each front takes begin.
    entry, place : ndarray of int64, shape (n_values,)
        Numbers of these entries, and their places in the front, row by row.
    value_start : ndarray of int64, shape (n_fronts + 1,)
        Where the factors of each front begin among all: s rows of the whole front, then s columns below.
    largest : int
        Rows of the largest front.
    n_waiting : int
        How many numbers wait at most.
    products : int
        Products of a factorisation.
    """

    order: np.ndarray
    first: np.ndarray
    border_start: np.ndarray
    border: np.ndarray
    above: np.ndarray
    n_below: np.ndarray
    entry_start: np.ndarray
    entry: np.ndarray
    place: np.ndarray
    value_start: np.ndarray
    largest: int
    n_waiting: int
    products: int


def front_plan(rows: np.ndarray, column: np.ndarray, order: np.ndarray) -> FrontPlan:
    """Plan the elimination of a matrix, whose entries have these places, in nearly the given order: from below."""
    parent = _tree(_neighbours(rows, column, order, lower=False))
    order = order[_postorder(parent)]
    fronts = _joined(_fronts(_neighbours(rows, column, order, lower=True)))
    return _tables(fronts, rows, column, order)


def without_fronts(n: int) -> FrontPlan:
    """A plan that is given up at once: its first front has a column, but no entry that could be a pivot."""
    none, one = np.zeros(0, dtype=np.int64), np.zeros(1, dtype=np.int64)
    starts = np.zeros(2, dtype=np.int64)
    return FrontPlan(
        np.arange(n), np.array([0, 1]), starts, none, none, one, starts, none, none, starts, largest=1, n_waiting=0,
        products=0,
    )  # fmt: skip


def _neighbours(rows: np.ndarray, column: np.ndarray, order: np.ndarray, lower: bool) -> list[list[int]]:
    """For each unknown, by its number in the order, those after (`lower`) or before it that an entry joins it to."""
    n = len(order)
    place = np.argsort(order)
    i, j = place[rows], place[column]
    first, last = np.minimum(i, j), np.maximum(i, j)
    off = first != last
    key, other = (first[off], last[off]) if lower else (last[off], first[off])
    pairs = np.unique(key * n + other)
    ends = np.searchsorted(pairs, np.arange(1, n + 1) * n).tolist()
    flat = (pairs % n).tolist()
    return [flat[a:b] for a, b in zip([0, *ends], ends, strict=False)]


def _tree(before: list[list[int]]) -> list[int]:
    """The elimination tree: for each column the first row below in it, -1 for none (Liu, ACM TOMS 12 (1986) 127)."""
    parent = [-1] * len(before)
    shortcut = [-1] * len(before)
    for j, own in enumerate(before):
        for x in own:
            while x != -1 and x != j:
                further = shortcut[x]
                shortcut[x] = j
                if further == -1:
                    parent[x] = j
                x = further
    return parent


def _postorder(parent: list[int]) -> list[int]:
    """Columns such that all below a column come right before it."""
    below: list[list[int]] = [[] for _ in parent]
    stack: list[int] = []
    for j, above in enumerate(parent):
        (below[above] if above >= 0 else stack).append(j)
    found = []
    while stack:
        j = stack.pop()
        found.append(j)
        stack += below[j]
    return found[::-1]


def _fronts(after: list[list[int]]) -> list[tuple[int, int, list[int]]]:
    """First column, number of columns and border of each front: columns whose rows are those of the column before."""
    pending: list[set[int] | None] = [None] * len(after)
    fronts: list[tuple[int, int, list[int]]] = []
    for j, own in enumerate(after):
        rows = set(own)
        given = pending[j]
        if given is not None:
            rows |= given
            rows.discard(j)
            pending[j] = None
        if fronts and (last := fronts[-1])[2] and last[2][0] == j and len(last[2]) == len(rows) + 1:
            fronts[-1] = (last[0], last[1] + 1, last[2][1:])
        else:
            fronts.append((j, 1, sorted(rows)))
        if rows:
            above = min(rows)
            known = pending[above]
            pending[above] = rows if known is None else known | rows
    return fronts


def _joined(fronts: list[tuple[int, int, list[int]]]) -> list[tuple[int, int, list[int]]]:
    """Fronts of which each has taken in those right below that are narrow or nearly of its pattern."""
    found: list[tuple[int, int, list[int]]] = []
    zeros: list[int] = []
    for front in fronts:
        first, width, border = front
        more = 0
        while found:
            start, narrow, rows = found[-1]
            if not rows or not first <= rows[0] < first + width:
                break
            total, size = width + narrow, width + len(border)
            empty = zeros[-1] + more + narrow * (size - len(rows))
            few = empty <= _MOST_ZEROS * total * (total + len(border))
            if not few and (total > _NARROW or narrow * (size - len(rows)) > 2 * total):
                break
            first, width, more = start, total, empty
            found.pop()
            zeros.pop()
        found.append((first, width, border))
        zeros.append(more)
    return found


def _tables(
    fronts: list[tuple[int, int, list[int]]], rows: np.ndarray, column: np.ndarray, order: np.ndarray
) -> FrontPlan:
    n, n_fronts = len(order), len(fronts)
    first = np.array([f[0] for f in fronts] + [n], dtype=np.int64)
    width = np.diff(first)
    length = np.array([len(f[2]) for f in fronts], dtype=np.int64)
    size = width + length
    border_start = np.concatenate([[0], np.cumsum(length)])
    border = np.array([x for f in fronts for x in f[2]], dtype=np.int64)
    owner = np.repeat(np.arange(n_fronts), width)  # the front of each column
    child = np.repeat(np.arange(n_fronts), length)
    has = length > 0
    parent = np.full(n_fronts, -1)
    parent[has] = owner[border[border_start[:-1][has]]]
    above = _local(parent[child], border, first, border_start, border, n)
    n_below = np.bincount(parent[has], minlength=n_fronts)
    place = np.argsort(order)
    i, j = place[rows], place[column]
    front = owner[np.minimum(i, j)]
    by_front = np.argsort(front, kind="stable")
    local = _local(front, i, first, border_start, border, n) * size[front]
    local += _local(front, j, first, border_start, border, n)
    waiting = most = 0
    held: list[int] = []
    for k in range(n_fronts):
        for _ in range(n_below[k]):
            waiting -= held.pop()
        held.append(int(length[k]) ** 2)
        waiting += held[-1]
        most = max(most, waiting)
    s, b = width.astype(float), length.astype(float)
    steps = s * b * b + s * (s - 1) * b + (s - 1) * s * (2 * s - 1) / 6
    return FrontPlan(
        *(
            np.ascontiguousarray(x, dtype=np.int64)
            for x in (
                order, first, border_start, border, above, n_below,
                np.searchsorted(front[by_front], np.arange(n_fronts + 1)), by_front, local[by_front],
                np.concatenate([[0], np.cumsum(width * (size + length))]),
            )
        ),
        int(size.max(initial=0)),
        most,
        int(steps.sum()),
    )  # fmt: skip


def _local(
    front: np.ndarray,
    unknown: np.ndarray,
    first: np.ndarray,
    border_start: np.ndarray,
    border: np.ndarray,
    n: int,
) -> np.ndarray:
    """The place of each unknown in a front that has it."""
    width = np.diff(first)
    keys = np.repeat(np.arange(len(width)), np.diff(border_start)) * n + border
    found = np.searchsorted(keys, front * n + unknown) - border_start[front] + width[front]
    inside = unknown < first[front + 1]
    return np.where(inside, unknown - first[front], found)
