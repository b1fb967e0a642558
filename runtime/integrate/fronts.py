"""LU factors by fronts: the matrix is eliminated in small full ones, each of which hands on what is left of it."""

from typing import NamedTuple

import numpy as np

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.linear import magnitude, unsigned

# Duff, Reid, ACM TOMS 9 (1983) 302. Rows become pivots by size within their front, so that the pattern of the factors
# is known beforehand; whether that was enough is for the caller to see.


class FrontLU(NamedTuple):
    """Factors of a matrix of n rows by a `FrontPlan`, and work arrays.

    Attributes
    ----------
    values : ndarray, shape (value_start[-1],), real or complex
        For each front of s columns, its first s rows, with the reciprocals of the pivots; then s columns of the others.
    front : ndarray, shape (largest²,)
        The front that is being eliminated, row by row.
    waiting : ndarray, shape (n_waiting,)
        What fronts hand on, first come last served.
    pivots : ndarray of int64, shape (n,)
        The row, in its front, that was swapped with each.
    held : ndarray of int64, shape (n,)
        The fronts of what is waiting.
    """

    values: np.ndarray
    front: np.ndarray
    waiting: np.ndarray
    pivots: np.ndarray
    held: np.ndarray


@jitted
def eliminate_fronts(plan, entries, lu):
    """Factor a matrix with these entries, in their order in the matrix; returns RUNNING or SINGULAR_MATRIX."""
    n_held, end = 0, 0
    for k in range(plan.n_below.shape[0]):
        first, width = plan.first[k], plan.first[k + 1] - plan.first[k]
        n_border = plan.border_start[k + 1] - plan.border_start[k]
        size = width + n_border
        front = lu.front[: size * size]
        for i in range(unsigned(size * size)):
            front[i] = 0.0
        for e in range(plan.entry_start[k], plan.entry_start[k + 1]):
            front[plan.place[e]] += entries[plan.entry[e]]
        for _ in range(plan.n_below[k]):
            n_held -= 1
            below = lu.held[n_held]
            above = plan.above[plan.border_start[below] : plan.border_start[below + 1]]
            n = above.shape[0]
            end -= n * n
            add_handed_on(lu.waiting[end : end + n * n], above, size, front)
        status = eliminate_front(front, size, width, lu.pivots[first : first + width])
        if status != at.RUNNING:
            return status
        keep_factors(front, size, width, lu.values[plan.value_start[k] : plan.value_start[k + 1]])
        for i in range(n_border):
            row = (width + i) * size + width
            copy_entries(front[row : row + n_border], lu.waiting[end : end + n_border])
            end += n_border
        lu.held[n_held] = k
        n_held += 1
    return at.RUNNING


@jitted
def copy_entries(source, target):
    """Copy entries of one array to another of its length."""
    for i in range(unsigned(target.shape[0])):
        target[i] = source[i]


@jitted
def add_handed_on(handed, above, size, front):
    """Add what a front below hands on to a front of `size` rows, where `above` are the places of its rows."""
    n = above.shape[0]
    for i in range(unsigned(n)):
        source, target = handed[i * unsigned(n) :], front[unsigned(above[i] * size) :]
        for j in range(unsigned(n)):
            target[unsigned(above[j])] += source[j]


@jitted
def eliminate_front(front, size, width, pivots):
    """Eliminate the first `width` columns of a full matrix, with pivots in as many rows; returns a status.

    What is left below needs the factors of these rows only, and takes four of them at a time.
    """
    for k in range(width):
        best, chosen = 0.0, k
        for i in range(k, width):
            found = magnitude(front[i * size + k])
            if found > best:
                best, chosen = found, i
        pivots[k] = chosen
        if not (best > 0.0 and np.isfinite(best)):
            return at.SINGULAR_MATRIX
        row = front[k * size : (k + 1) * size]
        if chosen != k:
            other = front[chosen * size : (chosen + 1) * size]
            for j in range(unsigned(size)):
                row[j], other[j] = other[j], row[j]
        inverse = 1.0 / row[k]
        row[k] = inverse
        for i in range(k + 1, width):
            factor = front[i * size + k] * inverse
            front[i * size + k] = factor
            subtract(front[i * size + k + 1 : (i + 1) * size], factor, row[k + 1 :])
    for i in range(width, size):
        row = front[i * size : (i + 1) * size]
        for k in range(width):
            factor = row[k] * front[k * size + k]
            row[k] = factor
            subtract(row[k + 1 : width], factor, front[k * size + k + 1 : k * size + width])
        rest, k = row[width:], 0
        while k + 4 <= width:
            a, b, c, d = k * size, (k + 1) * size, (k + 2) * size, (k + 3) * size
            subtract_four(
                rest, row[k : k + 4], front[a + width : a + size], front[b + width : b + size],
                front[c + width : c + size], front[d + width : d + size],
            )  # fmt: skip
            k += 4
        while k < width:
            subtract(rest, row[k], front[k * size + width : (k + 1) * size])
            k += 1
    return at.RUNNING


@jitted
def subtract(target, factor, source):
    """Subtract a multiple of `source` from `target`."""
    for j in range(unsigned(target.shape[0])):
        target[j] -= factor * source[j]


@jitted
def subtract_four(target, factors, a, b, c, d):
    """Subtract multiples of four rows from `target`."""
    f, g, h, i = factors[0], factors[1], factors[2], factors[3]
    for j in range(unsigned(target.shape[0])):
        target[j] -= f * a[j] + g * b[j] + (h * c[j] + i * d[j])


@jitted
def keep_factors(front, size, width, values):
    """Copy the factors of a front: its first `width` rows, then as many columns of the others."""
    copy_entries(front[: width * size], values[: width * size])
    for i in range(width, size):
        first = width * size + (i - width) * width
        copy_entries(front[i * size : i * size + width], values[first : first + width])


@jitted
def solve_fronts(plan, lu, x):
    """Solve with the factors of `eliminate_fronts`; right-hand side and solution stand in the order of elimination."""
    for k in range(plan.n_below.shape[0]):
        first, width = plan.first[k], plan.first[k + 1] - plan.first[k]
        border = plan.border[plan.border_start[k] : plan.border_start[k + 1]]
        size = width + border.shape[0]
        values, own = lu.values[plan.value_start[k] : plan.value_start[k + 1]], x[first : first + width]
        for i in range(width):
            chosen = lu.pivots[first + i]
            own[i], own[chosen] = own[chosen], own[i]
        for i in range(1, width):
            own[i] -= scalar_product(values[i * size : i * size + i], own)
        for i in range(border.shape[0]):
            row = width * size + i * width
            x[border[i]] -= scalar_product(values[row : row + width], own)
    for from_end in range(plan.n_below.shape[0]):
        k = plan.n_below.shape[0] - 1 - from_end
        first, width = plan.first[k], plan.first[k + 1] - plan.first[k]
        border = plan.border[plan.border_start[k] : plan.border_start[k + 1]]
        size = width + border.shape[0]
        values = lu.values[plan.value_start[k] : plan.value_start[k + 1]]
        for i in range(width - 1, -1, -1):
            row = values[i * size : (i + 1) * size]
            total = x[first + i] - scalar_product(row[i + 1 : width], x[first + i + 1 :])
            for j in range(border.shape[0]):
                total -= row[width + j] * x[border[j]]
            x[first + i] = total * row[i]


@jitted
def scalar_product(a, b):
    """The sum of products of the entries of `a` with the first of `b`."""
    total = a.dtype.type(0)
    for j in range(unsigned(a.shape[0])):
        total += a[j] * b[j]
    return total
