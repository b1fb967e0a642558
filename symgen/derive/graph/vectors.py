"""Unit quaternions (w, x, y, z) on the operation graph: rotation matrices, rates and normalisation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .graph import Graph

Vector = list[int]
Matrix = list[list[int]]


def zeros(g: Graph) -> Vector:
    """The vector 0."""
    return [g.zero] * 3


def identity(g: Graph) -> Matrix:
    """The unit matrix."""
    return [[g.one if i == j else g.zero for j in range(3)] for i in range(3)]


def plus(g: Graph, a: Vector, b: Vector) -> Vector:
    """Sum of vectors."""
    return [g.add(x, y) for x, y in zip(a, b, strict=True)]


def minus(g: Graph, a: Vector, b: Vector) -> Vector:
    """Difference of vectors."""
    return [g.sub(x, y) for x, y in zip(a, b, strict=True)]


def scaled(g: Graph, factor: int, a: Vector) -> Vector:
    """Multiple of a vector."""
    return [g.mul(factor, x) for x in a]


def cross(g: Graph, a: Vector, b: Vector) -> Vector:
    """Vector product."""
    return [
        g.sub(g.mul(a[1], b[2]), g.mul(a[2], b[1])),
        g.sub(g.mul(a[2], b[0]), g.mul(a[0], b[2])),
        g.sub(g.mul(a[0], b[1]), g.mul(a[1], b[0])),
    ]


def cross_z(g: Graph, a: Vector) -> Vector:
    """Vector product with the third unit vector."""
    return [a[1], g.neg(a[0]), g.zero]


def dot(g: Graph, a: Sequence[int], b: Sequence[int]) -> int:
    """Scalar product; most components of joints' vectors are zero, which saves most of the time here."""
    zero = total = g.zero
    for x, y in zip(a, b, strict=True):
        if x != zero and y != zero:
            term = g.mul(x, y)
            total = term if total == zero else g.add(total, term)
    return total


def times(g: Graph, matrix: Matrix, vector: Vector) -> Vector:
    """Matrix times vector."""
    return [dot(g, row, vector) for row in matrix]


def transposed_times(g: Graph, matrix: Matrix, vector: Vector) -> Vector:
    """Transposed matrix times vector."""
    return [dot(g, [row[k] for row in matrix], vector) for k in range(3)]


def product(g: Graph, a: Matrix, b: Matrix) -> Matrix:
    """Product of matrices."""
    columns = list(zip(*b, strict=True))
    return [[dot(g, row, column) for column in columns] for row in a]


def transposed(a: Matrix) -> Matrix:
    """Transposed matrix."""
    return [list(column) for column in zip(*a, strict=True)]


def column(a: Matrix, k: int) -> Vector:
    """Column of a matrix."""
    return [row[k] for row in a]


def field_gradient(g: Graph, alpha: Vector, omega: Vector) -> Matrix:
    """Γ = [α]× + [ω]×[ω]×: a point at r of a rigid body accelerates by Γ r relative to the origin."""
    xx, yy, zz = (g.mul(w, w) for w in omega)
    xy, xz, yz = (g.mul(omega[i], omega[j]) for i, j in ((0, 1), (0, 2), (1, 2)))
    return [
        [g.neg(g.add(yy, zz)), g.sub(xy, alpha[2]), g.add(xz, alpha[1])],
        [g.add(xy, alpha[2]), g.neg(g.add(xx, zz)), g.sub(yz, alpha[0])],
        [g.sub(xz, alpha[1]), g.add(yz, alpha[0]), g.neg(g.add(xx, yy))],
    ]


class Turn:
    """A rotation: a constant one, and after it one about the new third axis if `angle` is given.

    `up` turns components in the rotated frame into components in the frame that it was rotated from. `constant` is the
    first rotation alone.
    """

    def __init__(self, g: Graph, matrix: Matrix, angle: int | None = None) -> None:
        self.g = g
        self.constant = self if angle is None else Turn(g, matrix)
        self.about_z = (g.call("cos", angle), g.call("sin", angle)) if angle is not None else None
        if self.about_z is not None and not _has_unit_entry(g, matrix):
            # A full matrix is applied often enough that it pays to put both rotations into one.
            matrix, self.about_z = [_turn_z(g, *self.about_z, row, -1) for row in matrix], None
        self.matrix = matrix
        self._rows = [_nonzero(g, row) for row in matrix]
        self._columns = [_nonzero(g, row) for row in transposed(matrix)]

    def up(self, a: Vector) -> Vector:
        """R a."""
        if self.about_z is not None:
            a = _turn_z(self.g, *self.about_z, a, 1)
        return [_combination(self.g, row, a) for row in self._rows]

    def down(self, a: Vector) -> Vector:
        """Rᵀ a."""
        a = [_combination(self.g, row, a) for row in self._columns]
        return a if self.about_z is None else _turn_z(self.g, *self.about_z, a, -1)

    def up_matrix(self, a: Matrix) -> Matrix:
        """R a Rᵀ."""
        by_columns = transposed([self.up(column(a, k)) for k in range(3)])
        return [self.up(row) for row in by_columns]

    def up_symmetric(self, a: Matrix) -> Matrix:
        """R a Rᵀ for a symmetric matrix."""
        if self.about_z is not None:
            a = _turn_symmetric_z(self.g, *self.about_z, a)
        return _congruence(self.g, self.matrix, a)

    def after(self, matrix: Matrix) -> Matrix:
        """`matrix` R."""
        turned = product(self.g, matrix, self.matrix)
        if self.about_z is None:
            return turned
        return [_turn_z(self.g, *self.about_z, row, -1) for row in turned]


def _nonzero(g: Graph, row: Sequence[int]) -> list[tuple[int, int]]:
    return [(k, entry) for k, entry in enumerate(row) if entry != g.zero]


def _combination(g: Graph, row: list[tuple[int, int]], a: Vector) -> int:
    """Scalar product of a vector with the nonzero elements of a row."""
    total = g.zero
    for k, entry in row:
        term = a[k] if entry == g.one else g.mul(entry, a[k])
        total = term if total == g.zero else g.add(total, term)
    return total


def _has_unit_entry(g: Graph, matrix: Matrix) -> bool:
    return any(abs(g.value(entry) or 0.0) == 1.0 for row in matrix for entry in row)


def _turn_z(g: Graph, c: int, s: int, a: Vector, sign: int) -> Vector:
    """A vector turned about the third axis, forwards or back."""
    x, y = (g.mul(s, a[1]), g.mul(s, a[0]))
    if sign > 0:
        return [g.sub(g.mul(c, a[0]), x), g.add(g.mul(c, a[1]), y), a[2]]
    return [g.add(g.mul(c, a[0]), x), g.sub(g.mul(c, a[1]), y), a[2]]


def _turn_symmetric_z(g: Graph, c: int, s: int, a: Matrix) -> Matrix:
    """A symmetric tensor turned about the third axis.

    In the plane it is yy times unity, which does not turn, and [[d, xy], [xy, 0]], which turns by
    xx' = c (c d - 2 s xy), yy' = d - xx', xy' = s (c d - 2 s xy) + xy.
    """
    (xx, xy, xz), (_, yy, yz), zz = a[0], a[1], a[2][2]
    d = g.sub(xx, yy)
    half = g.sub(g.mul(c, d), g.mul(g.mul(g.const(2.0), s), xy))
    turned = g.mul(c, half)
    xx, yy, xy = g.add(turned, yy), g.add(g.sub(d, turned), yy), g.add(g.mul(s, half), xy)
    xz, yz, _ = _turn_z(g, c, s, [xz, yz, g.zero], 1)
    return [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]


def _congruence(g: Graph, matrix: Matrix, a: Matrix) -> Matrix:
    """`matrix` a `matrix`ᵀ for symmetric a, only half of it computed."""
    half = product(g, matrix, a)
    result = [[g.zero] * 3 for _ in range(3)]
    for i in range(3):
        for j in range(i, 3):
            result[i][j] = result[j][i] = dot(g, half[i], matrix[j])
    return result


@dataclass(frozen=True)
class Inertia:
    """The ten inertia parameters of a rigid body: mass, first moment and inertia tensor about a frame's origin."""

    mass: int
    first: Vector
    tensor: Matrix

    @staticmethod
    def nothing(g: Graph) -> Inertia:
        """That of a frame without a body."""
        return Inertia(g.zero, zeros(g), [zeros(g) for _ in range(3)])

    def plus(self, g: Graph, other: Inertia) -> Inertia:
        """Two bodies in one frame."""
        tensor = [[g.zero] * 3 for _ in range(3)]
        for i in range(3):
            for j in range(i, 3):
                tensor[i][j] = tensor[j][i] = g.add(self.tensor[i][j], other.tensor[i][j])
        return Inertia(g.add(self.mass, other.mass), plus(g, self.first, other.first), tensor)

    def minus(self, g: Graph, other: Inertia) -> Inertia:
        """What is left of a body without a part of it."""
        tensor = [minus(g, a, b) for a, b in zip(self.tensor, other.tensor, strict=True)]
        return Inertia(g.sub(self.mass, other.mass), minus(g, self.first, other.first), tensor)

    def turned(self, turn: Turn) -> Inertia:
        """The same in the axes of the frame that `turn` was rotated from."""
        return Inertia(self.mass, turn.up(self.first), turn.up_symmetric(self.tensor))

    def shifted(self, g: Graph, r: Vector) -> Inertia:
        """The same about an origin from which the present one is at `r`."""
        push = [g.add(g.add(h, h), g.mul(self.mass, x)) for h, x in zip(self.first, r, strict=True)]
        first = plus(g, self.first, scaled(g, self.mass, r))
        squares = [g.mul(u, x) for u, x in zip(push, r, strict=True)]
        tensor = [[g.zero] * 3 for _ in range(3)]
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            tensor[i][i] = g.add(self.tensor[i][i], g.add(squares[j], squares[k]))
            # h_j r_k + r_j h_k + m r_j r_k, with m r_j in the new first moment
            moved = g.add(g.mul(first[j], r[k]), g.mul(r[j], self.first[k]))
            tensor[j][k] = tensor[k][j] = g.sub(self.tensor[j][k], moved)
        return Inertia(self.mass, first, tensor)

    def momentum_of(self, g: Graph, spin: Vector, velocity: Vector) -> tuple[Vector, Vector]:
        """Momentum and angular momentum about the origin for a spin and the origin's velocity."""
        linear = plus(g, scaled(g, self.mass, velocity), cross(g, spin, self.first))
        angular = plus(g, times(g, self.tensor, spin), cross(g, self.first, velocity))
        return linear, angular

    def wrench(
        self, g: Graph, omega: Vector, gradient: Matrix, alpha: Vector, acc: Vector
    ) -> tuple[Vector, Vector]:
        """Force and moment about the origin that an acceleration `acc` of the origin and Γ take.

        I α + ω × I ω is written with the elements of Γ, which are there already.
        """
        force = plus(g, scaled(g, self.mass, acc), times(g, gradient, self.first))
        w2 = [g.mul(w, w) for w in omega]
        moment = []
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            I = self.tensor
            value = g.mul(I[i][i], alpha[i])
            value = g.add(value, g.mul(g.sub(I[k][k], I[j][j]), g.mul(omega[j], omega[k])))
            value = g.sub(value, g.mul(I[i][j], gradient[k][i]))
            value = g.add(value, g.mul(I[i][k], gradient[j][i]))
            value = g.add(value, g.mul(I[j][k], g.sub(w2[j], w2[k])))
            moment.append(value)
        return force, plus(g, moment, cross(g, self.first, acc))


def rotation_matrix(g: Graph, q: Vector) -> Matrix:
    """The rotation of a quaternion, taken as a unit quaternion: from body axes to those of the joint frame."""
    w, x, y, z = q
    x2, y2, z2 = (g.add(u, u) for u in (x, y, z))
    xx, yy, zz = g.mul(x2, x), g.mul(y2, y), g.mul(z2, z)
    xy, xz, yz = g.mul(x2, y), g.mul(x2, z), g.mul(y2, z)
    wx, wy, wz = g.mul(x2, w), g.mul(y2, w), g.mul(z2, w)
    return [
        [g.sub(g.one, g.add(yy, zz)), g.sub(xy, wz), g.add(xz, wy)],
        [g.add(xy, wz), g.sub(g.one, g.add(xx, zz)), g.sub(yz, wx)],
        [g.sub(xz, wy), g.add(yz, wx), g.sub(g.one, g.add(xx, yy))],
    ]


def doubled_rates(g: Graph, q: Vector) -> Matrix:
    """E, 4 x 3, with dq/dt = E ω / 2 for the angular velocity ω in body axes; EᵀE = |q|²."""
    w, x, y, z = q
    return [
        [g.neg(x), g.neg(y), g.neg(z)],
        [w, g.neg(z), y],
        [z, w, g.neg(x)],
        [g.neg(y), x, w],
    ]


def rate(g: Graph, q: Vector, omega: Vector) -> Vector:
    """dq/dt = q ⊗ (0, ω) / 2."""
    half = [g.mul(g.const(0.5), w) for w in omega]
    return [g.dot(row, half) for row in doubled_rates(g, q)]


def normalised(g: Graph, q: Vector) -> Vector:
    """q / |q|."""
    factor = g.div(g.one, g.call("sqrt", g.dot(q, q)))
    return [g.mul(factor, x) for x in q]
