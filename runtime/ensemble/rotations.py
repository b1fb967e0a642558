"""Unit quaternions in lanes: what `integrate/quaternions.py` does, for each member."""

from __future__ import annotations

from collections.abc import Callable

from symgen.runtime.ensemble import dense_lu
from symgen.runtime.ensemble.lanes import Lanes
from symgen.runtime.ensemble.writer import INTEGER, Rows, Value
from symgen.runtime.integrate.quaternions import _SMALL

Vector = tuple[Value, Value, Value]
Number = tuple[Value, ...]  # a real one, or real and imaginary part, as in `dense_lu`


def each_position(
    lanes: Lanes, shift: Callable[[Value, Value], None], turn: Callable[[Value, Value], None]
) -> None:
    """Go through the positions.

    Parameters
    ----------
    shift : callable
        `shift(i, j)` writes what is done with position `i`, whose rate is `j`.
    turn : callable
        `turn(i, j)` writes the same for the quaternion that begins at `i`, whose rates begin at `j`.
    """
    code = lanes.code
    if not lanes.with_quaternions:
        with code.each(lanes.nq) as i:
            shift(i, i)
        return
    start = code.variable(0, INTEGER)

    def shift_to(end: Value, number: Value) -> None:
        with code.each(end, start.value) as i:
            shift(i, i - number)

    with code.each(lanes.n_quaternions) as number:
        first = lanes.quaternions[number]
        shift_to(first, number)
        turn(first, first - number)
        start.value = first + 4
    shift_to(lanes.nq, lanes.n_quaternions)


def each_quaternion(lanes: Lanes, turn: Callable[[Value, Value], None]) -> None:
    """Go through the quaternions alone."""
    if not lanes.with_quaternions:
        return
    with lanes.code.each(lanes.n_quaternions) as number:
        first = lanes.quaternions[number]
        turn(first, first - number)


def parts(rows: Rows, first: Value, n: int = 3) -> tuple[Value, ...]:
    """Read the `n` numbers from `first` on."""
    return tuple(rows[first + k] for k in range(n))


def put(rows: Rows, first: Value, values: tuple[Value, ...]) -> None:
    """Write numbers from `first` on."""
    for k, value in enumerate(values):
        rows[first + k] = value


def retract(lanes: Lanes, h: Value, rates: Rows, out: Rows) -> None:
    """Move the positions of `y` by h times `rates`, as `quaternions.retract`."""
    code, y = lanes.code, lanes.y

    def shift(i: Value, j: Value) -> None:
        out[i] = code.fused(h, rates[j], y[i])

    def turn(i: Value, j: Value) -> None:
        put(out, i, rotated(parts(y, i, 4), tuple(h * rate for rate in parts(rates, j))))

    each_position(lanes, shift, turn)


def rotated(q: tuple[Value, ...], turn: Vector) -> tuple[Value, ...]:
    """Return a quaternion, turned by a rotation vector in body axes, as `quaternions.rotate`."""
    code = q[0].code
    squared = (turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2]) * 0.25
    half = code.root(squared)
    sine, cosine = code.sincos(half)
    sinc = code.select(squared > 0.0, sine / half, code.all_lanes(1.0)) * 0.5
    return multiplied(q, cosine, tuple(sinc * part for part in turn))


def multiplied(q: tuple[Value, ...], scalar: Value, vector: Vector) -> tuple[Value, ...]:
    """Return the product of a quaternion with (scalar, vector)."""
    (w, x, y, z), (a, b, c) = q, vector
    return (
        w * scalar - x * a - y * b - z * c, x * scalar + w * a + y * c - z * b,
        y * scalar + w * b + z * a - x * c, z * scalar + w * c + x * b - y * a,
    )  # fmt: skip


def by_rotation(q: tuple[Value, ...], row: tuple[Value, ...]) -> Vector:
    """Return derivatives by the rotation vector from those by the quaternion, as `quaternions.by_rotation`."""
    (qw, qx, qy, qz), (w, x, y, z) = (part * 0.5 for part in q), row
    return (
        qw * x + qz * y - qy * z - qx * w, qw * y + qx * z - qz * x - qy * w, qw * z + qy * x - qx * y - qz * w
    )  # fmt: skip


def cross(a: Vector, b: Vector) -> Vector:
    """Return a×b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def dot(a: Vector, b: Vector) -> Value:
    """Return a·b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def chart_rate(turn: Vector, omega: Vector) -> Vector:
    """Return the derivative of a rotation vector at an angular velocity, as `quaternions.chart_rate`."""
    squared = dot(turn, turn)
    code = squared.code
    near = squared * (1.0 / 1209600.0) + 1.0 / 30240.0
    near = (near * squared + 1.0 / 720.0) * squared + 1.0 / 12.0
    third = code.variable(near)
    far = squared >= _SMALL
    with code.when(code.any(far)):
        half = code.root(squared) * 0.5
        sine, cosine = code.sincos(half)
        third.value = code.select(far, (1.0 - half * cosine / sine) / squared, near)
    first = cross(turn, omega)
    second = cross(turn, first)
    return tuple(
        u + x * 0.5 + third.value * y for u, x, y in zip(omega, first, second, strict=True)
    )  # fmt: skip


def chart_variation(turn: Vector, change: Vector) -> Vector:
    """Return the small rotation that a change of a rotation vector makes, as `quaternions.chart_variation`."""
    squared = dot(turn, turn)
    code = squared.code
    near_second = 0.5 - squared * (1.0 / 24.0 - squared * (1.0 / 720.0 - squared * (1.0 / 40320.0)))
    near_third = 1.0 / 6.0 - squared * (1.0 / 120.0 - squared * (1.0 / 5040.0 - squared * (1.0 / 362880.0)))
    second, third = code.variable(near_second), code.variable(near_third)
    far = squared >= _SMALL
    with code.when(code.any(far)):
        angle = code.root(squared)
        sine, cosine = code.sincos(angle)
        second.value = code.select(far, (1.0 - cosine) / squared, near_second)
        third.value = code.select(far, (angle - sine) / (angle * squared), near_third)
    first = cross(turn, change)
    twice = cross(turn, first)
    return tuple(
        x - second.value * u + third.value * v for x, u, v in zip(change, first, twice, strict=True)
    )  # fmt: skip


def solve_rotation(g: Number, omega: Vector, right: tuple[Number, ...]) -> tuple[Number, ...]:
    """Return s of g s + ω×s / 2 = `right`, as `quaternions.solve_rotation`; real or complex."""
    half = tuple(part * 0.5 for part in omega)
    inverse = dense_lu.inverse(g)
    below = dense_lu.inverse(_sum(dense_lu.times(g, g), (dot(half, half),)))
    along = dense_lu.times(_combined(half, right), inverse)
    solution = []
    for k in range(3):
        after, last = (k + 1) % 3, (k + 2) % 3
        turned = _combined((half[last], -half[after], half[k]), (right[after], right[last], along))
        solution.append(dense_lu.times(_sum(dense_lu.times(g, right[k]), turned), below))
    return tuple(solution)


def _combined(weights: Vector, numbers: tuple[Number, ...]) -> Number:
    """Return the sum of numbers, each times a real weight."""
    return tuple(
        weights[0] * a + weights[1] * b + weights[2] * c for a, b, c in zip(*numbers, strict=True)
    )  # fmt: skip


def _sum(a: Number, b: Number) -> Number:
    """Return a + b, of which `b` may be real."""
    return a[0] + b[0], *((x + y for x, y in zip(a[1:], b[1:], strict=True)) if len(b) > 1 else a[1:])
