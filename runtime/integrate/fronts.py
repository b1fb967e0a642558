"""LU factors by fronts: the matrix is eliminated in small full ones, each of which hands on what is left of it."""

from typing import NamedTuple

import numpy as np

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.linear import magnitude, unsigned

# Duff, Reid, ACM TOMS 9 (1983) 302. Rows become pivots by size within their front, so that the pattern of the factors
# is known beforehand; whether that was enough is for the caller to see.


# So many rows of real numbers, or half as many of complex ones, are subtracted from others at a time.
SOURCES = 8
# Fronts of so many columns are solved with by arithmetic of real numbers, several rows or columns at a time.
WIDE = 4


class FrontLU(NamedTuple):
    """Factors of a matrix of n rows by a `FrontPlan`, and work arrays.

    Attributes
    ----------
    values : ndarray, shape (value_start[-1],), real or complex
        For each front of s columns, its first s rows, with the reciprocals of the pivots; then s columns of the others,
        one behind the other.
    front : ndarray, shape (largest²,)
        The front that is being eliminated, row by row.
    waiting : ndarray, shape (n_waiting,)
        What fronts hand on, first come last served.
    pivots : ndarray of int64, shape (n,)
        The row, in its front, that was swapped with each.
    held : ndarray of int64, shape (n,)
        The fronts of what is waiting.
    sources : ndarray, shape (SOURCES * largest,), real or complex
        Rows whose multiples are subtracted from others.
    """

    values: np.ndarray
    front: np.ndarray
    waiting: np.ndarray
    pivots: np.ndarray
    held: np.ndarray
    sources: np.ndarray


@jitted
def eliminate_fronts(plan, entries, lu):
    """Factor a matrix with these entries, in their order in the matrix; returns RUNNING or SINGULAR_MATRIX."""
    n_held, end = 0, 0
    for k in range(plan.n_below.shape[0]):
        first, width = plan.first[k], plan.first[k + 1] - plan.first[k]
        n_border = plan.border_start[k + 1] - plan.border_start[k]
        size = width + n_border
        if width == 1 and plan.n_below[k] == 0:
            if not eliminate_leaf(plan, k, n_border, end, entries, lu):
                return at.SINGULAR_MATRIX
            lu.pivots[first] = 0
            end += n_border * n_border
            lu.held[n_held] = k
            n_held += 1
            continue
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
        status = eliminate_front(front, size, width, lu.pivots[first : first + width], lu.sources)
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
def eliminate_leaf(plan, k, n, end, entries, lu):
    """Eliminate a front of one column that nothing is handed on to; returns whether it has a pivot.

    All its entries are in its row and its column: what it hands on, from `end` on, is their product.
    """
    start, waiting = unsigned(plan.value_start[k]), unsigned(end)
    for i in range(unsigned(2 * n + 1)):
        lu.values[start + i] = 0.0
    for e in range(unsigned(plan.entry_start[k]), unsigned(plan.entry_start[k + 1])):
        place = plan.place[e]  # row by row: those of the first come first
        target = place if place <= n else n + place // (n + 1)
        lu.values[start + unsigned(target)] += entries[unsigned(plan.entry[e])]
    size = magnitude(lu.values[start])
    if not (size > 0.0 and np.isfinite(size)):
        return False
    inverse = 1.0 / lu.values[start]
    lu.values[start] = inverse
    row, column = start + unsigned(1), start + unsigned(1 + n)
    for i in range(unsigned(n)):
        factor = lu.values[column + i] * inverse
        lu.values[column + i] = factor
        for j in range(unsigned(n)):
            lu.waiting[waiting + i * unsigned(n) + j] = 0.0 - factor * lu.values[row + j]
    return True


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
def eliminate_front(front, size, width, pivots, sources):
    """Eliminate the first `width` columns of a full matrix, with pivots in as many rows; returns a status.

    A few columns at a time: what stands right of them takes all of their rows at once. A complex multiple f a is
    Re f times a and Im f times i a, so that this is arithmetic of real numbers only.

    Parameters
    ----------
    sources : ndarray, shape (SOURCES * largest,), real or complex
        Scratch.
    """
    reals = front.itemsize // 8
    flat, rows = front.view(np.float64), sources.view(np.float64)
    step = SOURCES // reals
    for k in range(0, width, step):
        end = min(k + step, width)
        status = eliminate_panel(front, size, width, k, end, pivots)
        if status != at.RUNNING:
            return status
        length, n = (size - end) * reals, 0
        if length == 0:
            continue
        for i in range(k, end):
            first = i * size * reals
            row = flat[first + end * reals : first + size * reals]
            subtract_rows(row, flat[first + k * reals : first + i * reals], rows, n)
            copy_entries(row, rows[n * length : (n + 1) * length])
            n += 1
            if reals == 2:
                turn_entries(row, rows[n * length : (n + 1) * length])
                n += 1
        i = end
        if n == SOURCES:
            while i + 1 < size:
                first, second = i * size * reals, (i + 1) * size * reals
                subtract_from_two(
                    flat[first + end * reals : first + size * reals],
                    flat[second + end * reals : second + size * reals],
                    flat[first + k * reals : first + end * reals], flat[second + k * reals : second + end * reals],
                    rows,
                )  # fmt: skip
                i += 2
        while i < size:
            first = i * size * reals
            row = flat[first + end * reals : first + size * reals]
            subtract_rows(row, flat[first + k * reals : first + end * reals], rows, n)
            i += 1
    return at.RUNNING


@jitted
def eliminate_panel(front, size, width, begin, end, pivots):
    """Eliminate columns `begin` to `end`, within these; rows swapped are so in all columns. Returns a status."""
    for k in range(begin, end):
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
        for i in range(k + 1, size):
            factor = front[i * size + k] * inverse
            front[i * size + k] = factor
            for j in range(k + 1, end):
                front[i * size + j] -= factor * row[j]
    return at.RUNNING


@jitted(distinct_arrays=True)
def turn_entries(source, target):
    """Write i times complex numbers, real and imaginary parts in turns."""
    for j in range(unsigned(source.shape[0] // 2)):
        target[2 * j] = -source[2 * j + 1]
        target[2 * j + 1] = source[2 * j]


@jitted
def subtract_rows(target, factors, rows, n):
    """Subtract multiples of the first `n` of `rows`, each as long as `target`."""
    length, k = target.shape[0], 0
    if k + SOURCES <= n:
        subtract_eight(target, factors, rows)
        k = SOURCES
    while k + 2 <= n:
        first, second = k * length, (k + 1) * length
        subtract_two(
            target, factors[k], factors[k + 1], rows[first : first + length], rows[second : second + length]
        )
        k += 2
    if k < n:
        subtract(target, factors[k], rows[k * length : (k + 1) * length])


@jitted(distinct_arrays=True)
def subtract(target, factor, source):
    """Subtract a multiple of `source` from `target`."""
    for j in range(unsigned(target.shape[0])):
        target[j] -= factor * source[j]


@jitted(distinct_arrays=True)
def subtract_two(target, f, g, a, b):
    """Subtract multiples of two rows from `target`."""
    for j in range(unsigned(target.shape[0])):
        target[j] -= f * a[j] + g * b[j]


@jitted(distinct_arrays=True)
def subtract_eight(target, factors, rows):
    """Subtract multiples of eight rows from `target`."""
    a, b, c, d = factors[0], factors[1], factors[2], factors[3]
    e, f, g, h = factors[4], factors[5], factors[6], factors[7]
    n = unsigned(target.shape[0])
    for j in range(n):
        first = a * rows[j] + b * rows[n + j] + (c * rows[2 * n + j] + d * rows[3 * n + j])
        second = e * rows[4 * n + j] + f * rows[5 * n + j] + (g * rows[6 * n + j] + h * rows[7 * n + j])
        target[j] -= first + second


@jitted(distinct_arrays=True)
def subtract_from_two(target, other, factors, others, rows):
    """Subtract multiples of eight rows from two."""
    a, b, c, d = factors[0], factors[1], factors[2], factors[3]
    e, f, g, h = factors[4], factors[5], factors[6], factors[7]
    p, q, r, s = others[0], others[1], others[2], others[3]
    t, u, v, w = others[4], others[5], others[6], others[7]
    n = unsigned(target.shape[0])
    for j in range(n):
        i, k, l, m = rows[j], rows[n + j], rows[2 * n + j], rows[3 * n + j]
        o, x, y, z = rows[4 * n + j], rows[5 * n + j], rows[6 * n + j], rows[7 * n + j]
        target[j] -= a * i + b * k + (c * l + d * m) + (e * o + f * x + (g * y + h * z))
        other[j] -= p * i + q * k + (r * l + s * m) + (t * o + u * x + (v * y + w * z))


@jitted
def keep_factors(front, size, width, values):
    """Copy the factors of a front: its first `width` rows, then as many columns of the others."""
    copy_entries(front[: width * size], values[: width * size])
    n = size - width
    for k in range(width):
        column = values[width * size + k * n : width * size + (k + 1) * n]
        for i in range(n):
            column[i] = front[(width + i) * size + k]


@jitted
def solve_fronts(plan, lu, x):
    """Solve with the factors of `eliminate_fronts`; right-hand side and solution stand in the order of elimination."""
    for k in range(plan.n_below.shape[0]):
        first, width = plan.first[k], plan.first[k + 1] - plan.first[k]
        if width == 1:
            subtract_column(
                first, plan.border_start[k], plan.border_start[k + 1], plan.value_start[k], plan, lu, x
            )
            continue
        border = plan.border[plan.border_start[k] : plan.border_start[k + 1]]
        n_border = border.shape[0]
        size = width + n_border
        values, own = lu.values[plan.value_start[k] : plan.value_start[k + 1]], x[first : first + width]
        for i in range(width):
            chosen = lu.pivots[first + i]
            own[i], own[chosen] = own[chosen], own[i]
        for i in range(1, width):
            own[i] -= scalar_product(values[i * size : i * size + i], own)
        if width >= WIDE:
            subtract_columns(values[width * size :], own, border, lu.sources, x)
            continue
        for i in range(width):
            factor, column = own[i], values[width * size + i * n_border :]
            for j in range(unsigned(n_border)):
                x[unsigned(border[j])] -= factor * column[j]
    for from_end in range(plan.n_below.shape[0]):
        k = plan.n_below.shape[0] - 1 - from_end
        first, width = plan.first[k], plan.first[k + 1] - plan.first[k]
        if width == 1:
            solve_row(first, plan.border_start[k], plan.border_start[k + 1], plan.value_start[k], plan, lu, x)
            continue
        border = plan.border[plan.border_start[k] : plan.border_start[k + 1]]
        size = width + border.shape[0]
        values = lu.values[plan.value_start[k] : plan.value_start[k + 1]]
        if width >= WIDE:
            subtract_border(values, first, width, border, lu.sources, x)
        for i in range(width - 1, -1, -1):
            row = values[i * size : (i + 1) * size]
            total = x[first + i] - scalar_product(row[i + 1 : width], x[first + i + 1 :])
            if width < WIDE:
                for j in range(unsigned(border.shape[0])):
                    total -= row[unsigned(width) + j] * x[unsigned(border[j])]
            x[first + i] = total * row[i]


@jitted
def subtract_column(first, begin, end, start, plan, lu, x):
    """Subtract from the unknowns of the border of a front of one column, `begin` to `end`, its column times its own.

    Half of the fronts of a net are such, so short that divided arrays would take longer than the arithmetic.
    """
    factor, column = x[unsigned(first)], unsigned(start + 1 + end - begin)
    for j in range(unsigned(end - begin)):
        x[unsigned(plan.border[unsigned(begin) + j])] -= factor * lu.values[column + j]


@jitted
def solve_row(first, begin, end, start, plan, lu, x):
    """Solve for the unknown of a front of one column, given those of its border."""
    total, row = x[unsigned(first)], unsigned(start + 1)
    for j in range(unsigned(end - begin)):
        total -= lu.values[row + j] * x[unsigned(plan.border[unsigned(begin) + j])]
    x[unsigned(first)] = total * lu.values[unsigned(start)]


@jitted
def subtract_columns(columns, own, border, scratch, x):
    """Subtract from the unknowns of a front's border its columns times its own unknowns.

    Complex columns are multiplied by the real and the imaginary parts one after the other.
    """
    reals, width = x.itemsize // 8, own.shape[0]
    n = border.shape[0] * reals
    buffer, rows, factors, flat = (
        scratch.view(np.float64), columns.view(np.float64), own.view(np.float64), x.view(np.float64)
    )  # fmt: skip
    by_real, by_imaginary, real, imaginary = (
        buffer[:n], buffer[n : 2 * n], buffer[2 * n : 2 * n + width], buffer[2 * n + width : 2 * n + 2 * width]
    )  # fmt: skip
    for j in range(unsigned(n)):
        by_real[j] = 0.0
    for k in range(width):
        real[k] = factors[k * reals]
    if reals == 2:
        for j in range(unsigned(n)):
            by_imaginary[j] = 0.0
        for k in range(width):
            imaginary[k] = factors[2 * k + 1]
    for k in range(0, width, SOURCES):
        end = min(k + SOURCES, width)
        part = rows[k * n : end * n]
        if reals == 1:
            subtract_rows(by_real, real[k:end], part, end - k)
        elif end - k == SOURCES:
            subtract_from_two(by_real, by_imaginary, real[k:end], imaginary[k:end], part)
        else:
            subtract_rows(by_real, real[k:end], part, end - k)
            subtract_rows(by_imaginary, imaginary[k:end], part, end - k)
    for j in range(border.shape[0]):
        i = border[j]
        if reals == 1:
            flat[i] += by_real[j]
        else:
            flat[2 * i] += by_real[2 * j] - by_imaginary[2 * j + 1]
            flat[2 * i + 1] += by_real[2 * j + 1] + by_imaginary[2 * j]


@jitted
def subtract_border(values, first, width, border, scratch, x):
    """Subtract from a front's own unknowns its rows times the unknowns of its border."""
    reals, n_border = x.itemsize // 8, border.shape[0]
    n, size = n_border * reals, (width + n_border) * reals
    buffer, rows, flat = scratch.view(np.float64), values.view(np.float64), x.view(np.float64)
    known, swapped = buffer[:n], buffer[n : 2 * n]
    for j in range(n_border):
        i = border[j]
        if reals == 1:
            known[j] = flat[i]
        else:
            known[2 * j], known[2 * j + 1] = flat[2 * i], flat[2 * i + 1]
            swapped[2 * j], swapped[2 * j + 1] = flat[2 * i + 1], flat[2 * i]
    for i in range(width):
        row = rows[i * size + width * reals : (i + 1) * size]
        even, odd = sums_of_products(row, known)
        if reals == 1:
            flat[first + i] -= even + odd
        else:
            flat[2 * (first + i)] -= even - odd
            even, odd = sums_of_products(row, swapped)
            flat[2 * (first + i) + 1] -= even + odd


@jitted
def sums_of_products(row, other):
    """The sums of products of entries at even and at odd places, eight at a time."""
    n = unsigned(row.shape[0])
    whole = n - n % unsigned(8)
    a, b, c, d, e, f, g, h = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(unsigned(0), whole, unsigned(8)):
        a += row[j] * other[j]
        b += row[j + unsigned(1)] * other[j + unsigned(1)]
        c += row[j + unsigned(2)] * other[j + unsigned(2)]
        d += row[j + unsigned(3)] * other[j + unsigned(3)]
        e += row[j + unsigned(4)] * other[j + unsigned(4)]
        f += row[j + unsigned(5)] * other[j + unsigned(5)]
        g += row[j + unsigned(6)] * other[j + unsigned(6)]
        h += row[j + unsigned(7)] * other[j + unsigned(7)]
    for j in range(whole, n):
        if j % unsigned(2) == 0:
            a += row[j] * other[j]
        else:
            b += row[j] * other[j]
    return a + c + (e + g), b + d + (f + h)


@jitted
def scalar_product(a, b):
    """The sum of products of the entries of `a` with the first of `b`."""
    total = a.dtype.type(0)
    for j in range(unsigned(a.shape[0])):
        total += a[j] * b[j]
    return total
