"""Sparse LU factors, column by column, with pivots in whatever rows are large enough."""

import math
from typing import NamedTuple

import numpy as np

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.linear import magnitude

# Left-looking elimination, column by column (Gilbert, Peierls, SIAM J. Sci. Stat. Comput. 9 (1988) 862, as in Davis,
# Direct Methods for Sparse Linear Systems, 2006, chapter 6): the pattern of a column follows from a depth-first search
# in the columns of L before it, so that the time is proportional to the arithmetic, whichever rows become pivots.

# A diagonal entry becomes the pivot unless another in its column is this many times larger. The second number is for
# where the first leads to more entries than there is room for.
LEAST_DIAGONAL, LEAST_DIAGONAL_WITHOUT_ROOM = 0.1, 1e-4
NO_ROOM = -100  # inside of this file only
N_TABLES = 5  # integers for each row: pivots, marks, the search's stack and its places, the pattern


class SparseLU(NamedTuple):
    """Factors of a matrix with n rows: L of unit diagonal, U by columns; rows in the order of the pivots.

    Attributes
    ----------
    lower_start, upper_start : ndarray of int64, shape (n + 1,)
        Where each column begins among the entries.
    lower_row, upper_row : ndarray of int64, shape (room,)
    lower, upper : ndarray, shape (room,), real or complex
        Entries; the diagonal of L is left out, that of U is the last of its column, as its reciprocal.
    tables : ndarray of int64, shape (N_TABLES, n)
        The pivot's place of each row, then scratch of `sparse_factor`, which leaves n at the first place of it where
        pivots and patterns are those of LEAST_DIAGONAL.
    scale : ndarray, shape (n,)
        What each row is multiplied by before it is compared with others; to be set before `sparse_factor`.
    x : ndarray, shape (n,), real or complex
        Scratch.
    """

    lower_start: np.ndarray
    upper_start: np.ndarray
    lower_row: np.ndarray
    upper_row: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    tables: np.ndarray
    scale: np.ndarray
    x: np.ndarray


@jitted
def sparse_lu_size(n, room, width):
    """Length of the array that `sparse_lu` (`width` 1) or `complex_sparse_lu` (`width` 2) divides."""
    return 2 * (n + 1) + (2 + 2 * width) * room + (N_TABLES + 1 + width) * n


@jitted
def sparse_lu(n, room, work):
    """Divide `work` into the factors of a real matrix with n rows."""
    start, rows, tables, scale, rest = divide(n, room, work)
    return SparseLU(
        start[0],
        start[1],
        rows[0],
        rows[1],
        rest[:room],
        rest[room : 2 * room],
        tables,
        scale,
        rest[2 * room :],
    )


@jitted
def complex_sparse_lu(n, room, work):
    """Divide `work` into the factors of a complex matrix with n rows."""
    start, rows, tables, scale, rest = divide(n, room, work)
    values = rest.view(np.complex128)
    return SparseLU(
        start[0], start[1], rows[0], rows[1], values[:room], values[room : 2 * room], tables, scale,
        values[2 * room :],
    )  # fmt: skip


@jitted
def divide(n, room, work):
    """The parts of `work` that are the same for real and complex factors, and the rest."""
    start, rest = work[: 2 * (n + 1)].view(np.int64).reshape((2, n + 1)), work[2 * (n + 1) :]
    rows, rest = rest[: 2 * room].view(np.int64).reshape((2, room)), rest[2 * room :]
    tables, rest = rest[: N_TABLES * n].view(np.int64).reshape((N_TABLES, n)), rest[N_TABLES * n :]
    return start, rows, tables, rest[:n], rest[n:]


@jitted
def sparse_factor(start, row, values, order, lu):
    """Factor a matrix; rows become pivots by size, but the diagonal's where it is nearly as large.

    Parameters
    ----------
    start, row : ndarray of int64
        Where each column begins among the entries, and the rows of these.
    values : ndarray, real or complex
        The entries.
    order : ndarray of int64, shape (n,)
        In which columns are eliminated.
    lu : SparseLU
        Overwritten.

    Returns
    -------
    int
        RUNNING, or SINGULAR_MATRIX where a column has no pivot, or the factors have no room.
    """
    n = order.shape[0]
    if lu.tables[1, 0] == n and eliminate_again(start, row, values, order, lu):
        return at.RUNNING
    status = eliminate(start, row, values, order, LEAST_DIAGONAL, lu)
    if status == at.RUNNING:
        lu.tables[1, 0] = n
    elif status == NO_ROOM:
        status = eliminate(start, row, values, order, LEAST_DIAGONAL_WITHOUT_ROOM, lu)
    return at.RUNNING if status == at.RUNNING else at.SINGULAR_MATRIX


@jitted
def eliminate_again(start, row, values, order, lu):
    """Factor another matrix of the same pattern; returns whether the pivots are those that `eliminate` would take.

    The patterns of columns follow from the pivots, so that there is nothing to search for, and all comes out to the
    same bits: what was factored before leaves no trace.
    """
    place, x = lu.tables[0], lu.x
    for i in range(order.shape[0]):
        x[i] = 0.0
    for k in range(order.shape[0]):
        column = order[k]
        for e in range(start[column], start[column + 1]):
            x[place[row[e]]] = lu.scale[row[e]] * values[e]
        last = lu.upper_start[k + 1] - 1
        for s in range(lu.upper_start[k], last):
            j = lu.upper_row[s]
            above = x[j]
            lu.upper[s] = above
            x[j] = 0.0
            for e in range(lu.lower_start[j], lu.lower_start[j + 1]):
                x[lu.lower_row[e]] -= lu.lower[e] * above
        first, end = lu.lower_start[k], lu.lower_start[k + 1]
        pivot, others, diagonal = magnitude(x[k]), 0.0, -1.0
        for e in range(first, end):
            others = max(others, magnitude(x[lu.lower_row[e]]))
            if lu.lower_row[e] == place[column]:
                diagonal = magnitude(x[place[column]])
        if place[column] == k:
            taken = pivot > 0.0 and pivot >= LEAST_DIAGONAL * max(pivot, others)
        else:  # two of one size are left to `eliminate`, which takes the first of its search
            taken = pivot > others and diagonal < LEAST_DIAGONAL * pivot
        if not (taken and math.isfinite(pivot + others)):
            return False
        inverse = 1.0 / x[k]
        lu.upper[last] = inverse
        x[k] = 0.0
        for e in range(first, end):
            i = lu.lower_row[e]
            lu.lower[e] = x[i] * inverse
            x[i] = 0.0
    return True


@jitted
def eliminate(start, row, values, order, least, lu):
    """Factor with pivots on the diagonal where that is at least `least` of the largest in its column."""
    n = order.shape[0]
    place, marks, pattern = lu.tables[0], lu.tables[1], lu.tables[4]
    for i in range(n):
        place[i], marks[i] = -1, -1
        lu.x[i] = 0.0
    n_lower, n_upper = 0, 0
    for k in range(n):
        lu.lower_start[k], lu.upper_start[k] = n_lower, n_upper
        if n_lower + n > lu.lower.shape[0] or n_upper + n > lu.upper.shape[0]:
            return NO_ROOM
        column = order[k]
        top = find_pattern(start, row, column, k, lu)
        for e in range(start[column], start[column + 1]):
            lu.x[row[e]] = lu.scale[row[e]] * values[e]
        best, pivot_row = 0.0, -1
        for s in range(top, n):
            i = pattern[s]
            j = place[i]
            if j >= 0:
                above = lu.x[i]
                lu.upper_row[n_upper], lu.upper[n_upper] = j, above
                n_upper += 1
                lu.x[i] = 0.0
                for e in range(lu.lower_start[j], lu.lower_start[j + 1]):
                    lu.x[lu.lower_row[e]] -= lu.lower[e] * above
        for s in range(top, n):
            i = pattern[s]
            if place[i] < 0 and magnitude(lu.x[i]) > best:
                best, pivot_row = magnitude(lu.x[i]), i
        if pivot_row < 0 or not math.isfinite(best):
            return at.SINGULAR_MATRIX
        if place[column] < 0 and marks[column] == k and magnitude(lu.x[column]) >= least * best:
            pivot_row = column
        inverse = 1.0 / lu.x[pivot_row]
        lu.upper_row[n_upper], lu.upper[n_upper] = k, inverse
        n_upper += 1
        place[pivot_row] = k
        for s in range(top, n):
            i = pattern[s]
            if place[i] < 0:
                lu.lower_row[n_lower], lu.lower[n_lower] = i, lu.x[i] * inverse
                n_lower += 1
            lu.x[i] = 0.0
        lu.lower_start[k + 1] = n_lower
    lu.lower_start[n], lu.upper_start[n] = n_lower, n_upper
    for e in range(n_lower):
        lu.lower_row[e] = place[lu.lower_row[e]]
    return at.RUNNING


@jitted
def find_pattern(start, row, column, k, lu):
    """Write the rows that column `column`, the k-th, will have to the end of `tables[4]`; returns where they begin.

    A row that is a pivot brings those of its column of L; each stands before those that it brings.
    """
    place, marks, stack, reached, pattern = (
        lu.tables[0],
        lu.tables[1],
        lu.tables[2],
        lu.tables[3],
        lu.tables[4],
    )
    top = pattern.shape[0]
    for first in range(start[column], start[column + 1]):
        if marks[row[first]] == k:
            continue
        depth = 0
        stack[0] = row[first]
        while depth >= 0:
            i = stack[depth]
            j = place[i]
            if marks[i] != k:
                marks[i] = k
                reached[depth] = lu.lower_start[j] if j >= 0 else 0
            end = lu.lower_start[j + 1] if j >= 0 else 0
            e = reached[depth]
            while e < end and marks[lu.lower_row[e]] == k:
                e += 1
            reached[depth] = e + 1
            if e < end:
                depth += 1
                stack[depth] = lu.lower_row[e]
            else:
                depth -= 1
                top -= 1
                pattern[top] = i
    return top


@jitted
def sparse_solve(order, lu, b):
    """Solve with the factors of `sparse_factor`; the right-hand side `b`, shape (n,), becomes the solution."""
    n = order.shape[0]
    place, x = lu.tables[0], lu.x
    for i in range(n):
        x[place[i]] = lu.scale[i] * b[i]
    for k in range(n):
        value = x[k]
        for e in range(lu.lower_start[k], lu.lower_start[k + 1]):
            x[lu.lower_row[e]] -= lu.lower[e] * value
    for m in range(n):
        k = n - 1 - m
        last = lu.upper_start[k + 1] - 1
        value = x[k] * lu.upper[last]
        b[order[k]] = value
        for e in range(lu.upper_start[k], last):
            x[lu.upper_row[e]] -= lu.upper[e] * value
