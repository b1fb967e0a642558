"""Tables on the graph: the piece of a curve or a map that holds is chosen by comparisons, and is a polynomial.

What is chosen among are numbers, in trees as shallow as can be, so that derivatives are those of the piece, exactly,
and machine code, series, ranges over time and all else that knows choices knows tables. Pieces are cubics in Hermite's
form, with the slopes at the knots: for `pchip` those of Fritsch and Carlson (SIAM J. Numer. Anal. 17 (1980) 238), as
SciPy's PchipInterpolator has them, for `cubic` those of the spline whose third derivative does not jump at the second
and the last knot but one. Maps are products: linear ones with four values, cubic ones with values, slopes and twists
at the corners (de Boor, J. Math. Phys. 41 (1962) 212).

Where a motion goes over the knots of a force, `jumps.py` holds the piece: its number is the whole part of a place that
rises by one from knot to knot, -1 and n - 1 are outside.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ..model.description import Table
from ..model.functions import PIECE, PLACE, SLOPE, VALUE, Tabulated, tabulated
from .graph.differentiate import forward
from .graph.graph import Graph
from .graph.nodes import VIRTUAL

Choice = Callable[[Sequence[float]], int]  # the one of some numbers that belongs to the piece: a node


def tabulated_node(
    g: Graph, tables: Mapping[str, Table], function: type[Tabulated], args: Sequence[int]
) -> int:
    """The node of a table's value, its integral, or a place in it.

    Parameters
    ----------
    g : Graph
    tables : mapping of str to Table
    function : type
        Says which table, and what of it.
    args : sequence of int
        Its arguments, and behind them the numbers of the piece where it is held.
    """
    table = tables[function.table]
    if function.role == PLACE:
        return _place(g, table, function.axis, args[0])
    if function.role.startswith(SLOPE):
        return _slope(g, tables, function, args)
    n = len(table.axes)
    held = args[n:] if function.role.startswith(PIECE) else [None] * n
    axes = [_Axis(g, table, k, args[k], held[k]) for k in range(n)]
    if function.role in (VALUE, PIECE):
        value = _curve(g, table, axes[0]) if n == 1 else _map(g, table, axes)
    else:
        value = _integral(g, table, axes[0])
    for axis in axes if table.outside == "refuse" else ():
        value = axis.refused(value)
    return value


def _slope(g: Graph, tables: Mapping[str, Table], function: type[Tabulated], args: Sequence[int]) -> int:
    """A partial derivative of the value: that of the piece which holds."""
    n = len(args)
    own = [g.var(VIRTUAL, k) for k in range(n)]  # arguments that stand for themselves
    found = tabulated_node(g, tables, tabulated(function.table, VALUE, n), own)
    for axis in map(int, function.role.removeprefix(SLOPE)):
        (found,) = forward(g, [found], {own[axis]: g.one})
    (found,) = g.substitute([found], dict(zip(own, args, strict=True)))
    return found


def _place(g: Graph, table: Table, k: int, x: int) -> int:
    """A number that is whole at knots, and rises by one from each to the next."""
    axis = _Axis(g, table, k, x, None)
    knots = table.axes[k]
    inside = [0, *range(len(knots) - 1), len(knots) - 2]
    s = g.add(axis.choose(inside), axis.u)
    goes_on = table.kind == "linear" and table.outside == "extend"  # no piece of its own outside
    low, high = (0.25, len(knots) - 1.25) if goes_on else (-0.5, len(knots) - 0.5)
    return g.maximum(g.const(low), g.minimum(g.const(high), s))


class _Axis:
    """An argument of a table: its piece, and where in it."""

    def __init__(self, g: Graph, table: Table, k: int, x: int, piece: int | None) -> None:
        self.g, self.table, self.x, self.piece = g, table, x, piece
        self.knots = table.axes[k]
        n, width = len(self.knots), np.diff(self.knots).tolist()
        self.h = self.choose([width[0], *width, width[-1]])
        start = self.choose([self.knots[0], *self.knots[:-1], self.knots[n - 2]])
        self.from_start = g.sub(x, start)
        self.u = g.mul(self.from_start, self.choose([1.0 / x for x in [width[0], *width, width[-1]]]))
        self.goes_on = table.kind == "linear" and table.outside != "hold"

    def choose(self, values: Sequence[float]) -> int:
        """The one of n + 1 numbers that belongs to the piece: below, between the knots, above."""
        return self._among(values, 0, len(values))

    def nodes(self, values: Sequence[int]) -> int:
        """The same of nodes."""
        return self._among_nodes(list(values), 0, len(values))

    def _among(self, values: Sequence[float], first: int, end: int) -> int:
        if all(x == values[first] for x in values[first + 1 : end]):
            return self.g.const(values[first])
        return self._select(first, end, lambda a, b: self._among(values, a, b))

    def _among_nodes(self, values: list[int], first: int, end: int) -> int:
        if all(x == values[first] for x in values[first + 1 : end]):
            return values[first]
        return self._select(first, end, lambda a, b: self._among_nodes(values, a, b))

    def _select(self, first: int, end: int, part: Callable[[int, int], int]) -> int:
        middle = (first + end) // 2
        return self._below(middle, part(first, middle), part(middle, end))

    def _below(self, number: int, then: int, otherwise: int) -> int:
        """`then` where the piece stands before that `number` in lists of all."""
        g = self.g
        if self.piece is None:
            return g.select(self.x, g.const(self.knots[number - 1]), then, otherwise)
        return g.select(self.piece, g.const(number - 1.5), then, otherwise)

    def outside(self, low: int, inside: int, high: int) -> int:
        """One of three nodes."""
        return self._below(1, low, self._below(len(self.knots), inside, high))

    def refused(self, value: int) -> int:
        """A value that is no number outside, but for a part of a piece: a step may reach that far before it ends."""
        g, part = self.g, 0.5
        low = self.knots[0] - part * (self.knots[1] - self.knots[0])
        high = self.knots[-1] + part * (self.knots[-1] - self.knots[-2])
        below, above = g.sub(self.x, g.const(low)), g.sub(g.const(high), self.x)
        nothing = [g.call("log", x) for x in (below, above)]
        return g.select(below, g.zero, nothing[0], g.select(above, g.zero, nothing[1], value))

    def basis(self) -> list[int]:
        """Factors of the value and the slope at the piece's start, then at its end."""
        g, u = self.g, self.u
        if self.table.kind == "linear":
            inside = [g.sub(g.one, u), g.zero, u, g.zero]
        else:
            left = g.sub(g.one, u)
            fast = g.add(g.one, g.add(u, u))
            ends = g.mul(g.mul(u, u), g.sub(g.const(3.0), g.add(u, u)))
            inside = [
                g.mul(g.mul(left, left), fast),
                g.mul(g.mul(self.from_start, left), left),
                ends,
                g.neg(g.mul(g.mul(self.from_start, u), left)),
            ]
        if self.goes_on:
            return inside
        along, back = (self.from_start, g.sub(self.from_start, self.h))
        if self.table.outside == "hold":
            along = back = g.zero
        low, high = [g.one, along, g.zero, g.zero], [g.zero, g.zero, g.one, back]
        return [self.outside(*three) for three in zip(low, inside, high, strict=True)]

    def integrals(self) -> list[int]:
        """The same of the integral from the piece's start; above the table from its last knot."""
        g, u, along = self.g, self.u, self.from_start
        half, square = g.const(0.5), g.mul(self.u, self.u)
        if self.table.kind == "linear":
            rising = g.mul(half, g.mul(along, u))
            inside = [g.sub(along, rising), g.zero, rising, g.zero]
        else:
            ends = g.mul(along, g.sub(square, g.mul(half, g.mul(square, u))))
            a = g.sub(half, g.mul(g.const(2.0 / 3.0), u))
            b = g.sub(g.mul(g.const(0.25), u), g.const(1.0 / 3.0))
            quarter = g.mul(g.const(0.25), square)
            inside = [
                g.sub(along, ends),
                g.mul(g.mul(along, along), g.add(a, quarter)),
                ends,
                g.mul(g.mul(g.mul(along, along), u), b),
            ]
        if self.goes_on:
            return inside
        back = g.sub(along, self.h)
        bent = [g.mul(half, g.mul(x, x)) for x in (along, back)]
        if self.table.outside == "hold":
            bent = [g.zero, g.zero]
        low, high = [along, bent[0], g.zero, g.zero], [g.zero, g.zero, back, bent[1]]
        return [self.outside(*three) for three in zip(low, inside, high, strict=True)]


def _ends(values: Sequence) -> tuple[list, list]:
    """What belongs to the start and to the end of each piece, of what belongs to knots."""
    inner = list(values)
    return [inner[0], *inner[:-1], inner[-2]], [inner[1], *inner[1:], inner[-1]]


def _curve(g: Graph, table: Table, axis: _Axis) -> int:
    fields = [table.values, slopes(table.kind, table.axes[0], table.values)]
    return _combined(g, axis, axis.basis(), fields)


def _combined(g: Graph, axis: _Axis, basis: list[int], fields: Sequence[Sequence[float]]) -> int:
    terms = []
    for end in (0, 1):
        for k, field in enumerate(fields):
            factor = basis[2 * end + k]
            if factor != g.zero:
                terms.append(g.mul(axis.choose(_ends(field)[end]), factor))
    return g.sum(terms)


def _integral(g: Graph, table: Table, axis: _Axis) -> int:
    x, f = np.array(table.axes[0]), np.array(table.values)
    d, h = np.array(slopes(table.kind, table.axes[0], table.values)), np.diff(x)
    pieces = 0.5 * h * (f[:-1] + f[1:])
    if table.kind != "linear":
        pieces += h * h * (d[:-1] - d[1:]) / 12.0
    done = np.concatenate([[0.0], np.cumsum(pieces)]).tolist()
    before = axis.choose([done[0], *done[:-1], done[-2] if axis.goes_on else done[-1]])
    fields = [table.values, d.tolist()]
    return g.add(before, _combined(g, axis, axis.integrals(), fields))


def _map(g: Graph, table: Table, axes: list[_Axis]) -> int:
    """The sum over both axes' factors of the values at corners, with their slopes and twists."""
    x, y = axes
    f = np.array(table.values).reshape(len(x.knots), len(y.knots))
    if table.kind == "linear":
        fields = [[f]]
    else:
        by_x, by_y = slope_matrix(x.knots), slope_matrix(y.knots)
        fields = [[f, f @ by_y.T], [by_x @ f, by_x @ f @ by_y.T]]
    along_x, along_y = x.basis(), y.basis()
    terms = []
    for a, row in enumerate(fields):
        for b, field in enumerate(row):
            for end in (0, 1):
                if along_x[2 * end + a] == g.zero:
                    continue
                line = [x.choose(_ends(column)[end]) for column in field.T.tolist()]
                for other in (0, 1):
                    corner = y.nodes(_ends(line)[other])
                    terms.append(g.mul(g.mul(along_x[2 * end + a], along_y[2 * other + b]), corner))
    return g.sum(terms)


def slopes(kind: str, x: Sequence[float], f: Sequence[float]) -> list[float]:
    """The slopes of a curve at its knots; of a linear one those of the pieces' beginnings, which nothing uses."""
    x, f = np.array(x), np.array(f)
    if kind == "cubic":
        return (slope_matrix(x) @ f).tolist()
    h = np.diff(x)
    rise = np.diff(f) / h
    if kind == "linear" or len(x) == 2:
        return [*rise.tolist(), float(rise[-1])]
    found = [_end_slope(h[0], h[1], rise[0], rise[1])]
    for k in range(1, len(rise)):
        if rise[k - 1] * rise[k] <= 0.0:
            found.append(0.0)
            continue
        a, b = 2.0 * h[k] + h[k - 1], h[k] + 2.0 * h[k - 1]
        found.append(float((a + b) / (a / rise[k - 1] + b / rise[k])))
    return [*found, _end_slope(h[-1], h[-2], rise[-1], rise[-2])]


def _end_slope(h0: float, h1: float, rise0: float, rise1: float) -> float:
    """Of the parabola through the last three points, held where it would not be monotone."""
    slope = ((2.0 * h0 + h1) * rise0 - h0 * rise1) / (h0 + h1)
    if np.sign(slope) != np.sign(rise0):
        return 0.0
    if np.sign(rise0) != np.sign(rise1) and abs(slope) > 3.0 * abs(rise0):
        return float(3.0 * rise0)
    return float(slope)


def slope_matrix(x: Sequence[float]) -> np.ndarray:
    """The matrix that makes of values the slopes of the cubic spline through them, without knots next to the ends."""
    x = np.array(x, dtype=float)
    n, h = len(x), np.diff(x)
    rises = np.zeros((n - 1, n))
    rises[np.arange(n - 1), np.arange(n - 1)], rises[np.arange(n - 1), np.arange(1, n)] = -1.0 / h, 1.0 / h
    if n == 2:
        return np.vstack([rises, rises])
    if n == 3:  # the parabola
        bend = (rises[1] - rises[0]) / (x[2] - x[0])
        return np.array([rises[0] - h[0] * bend, rises[0] + h[0] * bend, rises[1] + h[1] * bend])
    left, right = np.zeros((n, n)), np.zeros((n, n))
    for k in range(1, n - 1):
        left[k, k - 1 : k + 2] = h[k], 2.0 * (h[k - 1] + h[k]), h[k - 1]
        right[k] = 3.0 * (h[k] * rises[k - 1] + h[k - 1] * rises[k])
    for row, a, b, first, second, next_to in (
        (0, h[0], h[1], 0, 1, 1),
        (n - 1, h[-1], h[-2], n - 2, n - 3, n - 2),
    ):
        d = a + b
        left[row, row], left[row, next_to] = b, d
        right[row] = ((a + 2.0 * d) * b * rises[first] + a * a * rises[second]) / d
    return np.linalg.solve(left, right)
