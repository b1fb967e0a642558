"""Linear systems of a size in each lane: factors with the pivots of each, solutions; real ones and complex ones.

Rows are swapped by selects, in those lanes whose pivots ask for it; where none does, which is the usual case of the
matrices of implicit methods, nothing is.
"""

from __future__ import annotations

from dataclasses import dataclass

from symgen.runtime.ensemble.lanes import Lanes
from symgen.runtime.ensemble.writer import Code, Rows, Value

GIVE = 1e-10  # of constraints of which some follow from others
LEAST_RATIO_WITH_GIVE = GIVE * 1e-4  # of pivots, where accelerations are determined


@dataclass(eq=False)
class Real:
    """Real numbers in rows: a scalar of the field that `factor` and `solve` work in is a tuple of its parts."""

    rows: Rows

    def get(self, i: Value | int) -> tuple[Value, ...]:
        return (self.rows[i],)

    def put(self, i: Value | int, value: tuple[Value, ...]) -> None:
        (self.rows[i],) = value

    def behind(self, first: Value | int) -> Real:
        return Real(self.rows.behind(first))


@dataclass(eq=False)
class Complex:
    """Complex numbers, real parts in one array of rows, imaginary ones in another."""

    real: Rows
    imag: Rows

    def get(self, i: Value | int) -> tuple[Value, ...]:
        return self.real[i], self.imag[i]

    def put(self, i: Value | int, value: tuple[Value, ...]) -> None:
        self.real[i], self.imag[i] = value

    def behind(self, first: Value | int) -> Complex:
        return Complex(self.real.behind(first), self.imag.behind(first))


Numbers = Real | Complex


def _size(a: tuple[Value, ...]) -> Value:
    """As `integrate/linear.magnitude`: |re| + |im|."""
    code = a[0].code
    total = code.size(a[0])
    for part in a[1:]:
        total = total + code.size(part)
    return total


def inverse(a: tuple[Value, ...]) -> tuple[Value, ...]:
    """One over a number."""
    if len(a) == 1:
        return (1.0 / a[0],)
    scale = 1.0 / (a[0] * a[0] + a[1] * a[1])
    return a[0] * scale, -(a[1] * scale)


def times(a: tuple[Value, ...], b: tuple[Value, ...]) -> tuple[Value, ...]:
    """The product of two numbers."""
    if len(a) == 1:
        return (a[0] * b[0],)
    code = a[0].code
    return code.fused(-a[1], b[1], a[0] * b[0]), code.fused(a[0], b[1], a[1] * b[0])


def minus_product(c: tuple[Value, ...], a: tuple[Value, ...], b: tuple[Value, ...]) -> tuple[Value, ...]:
    """c - a b."""
    code = c[0].code
    if len(a) == 1:
        return (code.fused(-a[0], b[0], c[0]),)
    re, im = -a[0], -a[1]
    return (
        code.fused(a[1], b[1], code.fused(re, b[0], c[0])), code.fused(im, b[0], code.fused(re, b[1], c[1]))
    )  # fmt: skip


def _swap(code: Code, where: Value, x: Numbers, i: Value, y: Numbers, j: Value) -> None:
    a, b = x.get(i), y.get(j)
    x.put(i, tuple(code.select(where, q, p) for p, q in zip(a, b, strict=True)))
    y.put(j, tuple(code.select(where, p, q) for p, q in zip(a, b, strict=True)))


def factor(code: Code, matrix: Numbers, pivots: Rows, n: Value) -> Value:
    """Write P a = L U, as `integrate/linear.lu_factor`; returns lanes whose pivots are neither zero nor infinite.

    Parameters
    ----------
    matrix : n × n numbers, row by row
        Overwritten by the factors; the diagonal holds the reciprocals of the pivots.
    pivots : Rows
        Overwritten by the number of the row that was swapped with each.
    """
    sound = code.variable(code.flags(True))
    with code.each(n) as k:
        here = code.as_kind(code.to_number(k), "lanes")
        best, chosen = code.variable(0.0), code.variable(here)
        with code.each(n, k) as i:
            size = _size(matrix.get(i * n + k))
            larger = size > best.value
            best.value = code.select(larger, size, best.value)
            chosen.value = code.select(larger, code.as_kind(code.to_number(i), "lanes"), chosen.value)
        pivots[k] = chosen.value
        sound.value = sound.value & (best.value > 0.0) & code.finite(best.value)
        with code.when(code.any(chosen.value > here)):
            with code.each(n, k + 1) as i:
                where = code.compare("eq", chosen.value, code.as_kind(code.to_number(i), "lanes"))
                with code.when(code.any(where)):
                    with code.each(n) as j:
                        _swap(code, where, matrix, k * n + j, matrix, i * n + j)
        reciprocal = inverse(matrix.get(k * n + k))
        matrix.put(k * n + k, reciprocal)
        with code.each(n, k + 1) as i:
            weight = times(matrix.get(i * n + k), reciprocal)
            matrix.put(i * n + k, weight)
            with code.each(n, k + 1) as j:
                matrix.put(i * n + j, minus_product(matrix.get(i * n + j), weight, matrix.get(k * n + j)))
    return sound.value


def pivot_ratio(code: Code, matrix: Numbers, n: Value) -> Value:
    """The smallest pivot over the largest one of factors, as `integrate/linear.pivot_ratio`."""
    smallest, largest = code.variable(float("inf")), code.variable(0.0)
    with code.each(n) as k:
        size = _size(matrix.get(k * n + k))
        smallest.value = code.smaller(smallest.value, size)
        largest.value = code.larger(largest.value, size)
    return smallest.value / largest.value


def solve(
    code: Code, matrix: Numbers, pivots: Rows, n: Value, right: Numbers, width: Value | int = 1
) -> None:
    """Solve a X = B in place by factors; `right` has n × `width` numbers, row by row."""
    with code.each(n) as k:
        chosen = pivots[k]
        with code.when(code.any(chosen > code.as_kind(code.to_number(k), "lanes"))):
            with code.each(n, k + 1) as i:
                where = code.compare("eq", chosen, code.as_kind(code.to_number(i), "lanes"))
                with code.when(code.any(where)):
                    with code.each(width) as j:
                        _swap(code, where, right, k * width + j, right, i * width + j)
    with code.each(width) as j:
        with code.each(n, 1) as i:
            _take_away(code, matrix, right, n, width, i, j, 0, i)
        with code.down(n - 1, 0) as i:
            _take_away(code, matrix, right, n, width, i, j, i + 1, n)
            right.put(i * width + j, times(right.get(i * width + j), matrix.get(i * n + i)))


def _take_away(
    code: Code, matrix: Numbers, right: Numbers, n: Value, width: Value | int, i: Value, j: Value,
    first: Value | int, end: Value,
) -> None:  # fmt: skip
    """Take the products of row `i` of the matrix with the unknowns `first` to `end` from its right side."""
    total = [code.variable(part) for part in right.get(i * width + j)]
    with code.each(end, first) as k:
        rest = minus_product(
            tuple(part.value for part in total), matrix.get(i * n + k), right.get(k * width + j)
        )
        for part, value in zip(total, rest, strict=True):
            part.value = value
    right.put(i * width + j, tuple(part.value for part in total))


def let_constraints_give(lanes: Lanes, matrix: Numbers, nv: Value, rows: Value) -> None:
    """Let constraints give way by `lanes.give` in [M -Gᵀ; G 0], in parts of how their forces move them: G a = γ - δ λ.

    Constraints that follow from others then share their forces, as those of least norm do, and accelerations change by
    δ of what constraints make of them. That is enough for a matrix of Newton's method.
    """
    code = lanes.code
    with code.each(rows, nv) as k:
        own = code.variable(0.0)
        with code.each(nv) as j:
            inertia = code.size(matrix.get(j * rows + j)[0])
            moved = matrix.get(k * rows + j)[0] * matrix.get(j * rows + k)[0]
            own.value = own.value - code.select(inertia > 0.0, moved / inertia, code.all_lanes(0.0))
        matrix.put(k * rows + k, (matrix.get(k * rows + k)[0] + own.value * lanes.give,))
