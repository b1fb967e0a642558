"""Velocity Verlet with a fixed step in lanes: the steps of `integrate/semi_implicit.py`, one for each member."""

from __future__ import annotations

from symgen.runtime.ensemble.lanes import Lanes, commit, copy_rows, reach, write_frames
from symgen.runtime.ensemble.runge_kutta import cubic_at, cubic_dense, grid_step, pass_grid
from symgen.runtime.ensemble.writer import INTEGER, Rows, Value


def attempt(lanes: Lanes, active: Value) -> Value:
    """Write one step of all lanes; returns in which of them the member is done."""
    code, y, new = lanes.code, lanes.y, lanes.y_new
    t, t1, h = grid_step(lanes)
    before, after = lanes.k, lanes.k.behind(lanes.n_row)
    half = h * 0.5
    with code.each(lanes.n, lanes.nq) as i:
        lanes.y_stage[i] = code.fused(half, before[i], y[i])
    _retract(lanes, h, lanes.y_stage, new)
    # Where the acceleration depends on rates, it is taken at predicted ones.
    with code.each(lanes.n, lanes.nq) as i:
        new[i] = code.fused(h, before[i], y[i])
    with code.each(lanes.ny, lanes.n) as i:
        new[i] = y[i]
    lanes.call("rhs", t1, new, after)
    with code.each(lanes.n, lanes.nq) as i:
        new[i] = code.fused(half, before[i] + after[i], y[i])
    serves = code.compare("ne", lanes.one_evaluation, 0)
    with code.when(serves):
        with code.each(lanes.nq) as i:
            after[i] = new[lanes.nq + i]
    end = reach(lanes, active, t1, new=after, passing=code.flags(False), evaluate=~serves)
    with code.each(lanes.ny, lanes.n) as i:
        new[i] = code.fused(half, before[i] + after[i], y[i])
    write_frames(
        lanes, end.accepted, t, t1, lambda: cubic_dense(lanes, h, before, after),
        lambda theta, out: cubic_at(lanes, theta, out),
    )  # fmt: skip
    following = pass_grid(lanes, end.accepted, t1, lambda at: lanes.call("rhs", at, new, after))
    copy_rows(lanes, after, before, lanes.ny, end.accepted)
    return commit(lanes, active, end, following, h, active & ~end.accepted)


def _retract(lanes: Lanes, h: Value, rates: Rows, out: Rows) -> None:
    """Move positions by h times the rates behind `nq` in `rates`, as `quaternions.retract`."""
    code, y, nq = lanes.code, lanes.y, lanes.nq
    start = code.variable(0, INTEGER)

    def shift(end: Value, number: Value) -> None:
        with code.each(end, start.value) as i:
            out[i] = code.fused(h, rates[nq + i - number], y[i])

    with code.each(lanes.n_quaternions) as number:
        first = lanes.quaternions[number]
        shift(first, number)
        turn = [h * rates[nq + first - number + axis] for axis in range(3)]
        _rotate(lanes, first, turn, out)
        start.value = first + 4
    shift(nq, lanes.n_quaternions)


def _rotate(lanes: Lanes, first: Value, turn: list[Value], out: Rows) -> None:
    """Turn a quaternion by a rotation vector in body axes, as `quaternions.rotate`."""
    code = lanes.code
    squared = (turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2]) * 0.25
    half = code.root(squared)
    sine, cosine = code.sincos(half)
    sinc = code.select(squared > 0.0, sine / half, code.all_lanes(1.0)) * 0.5
    a, b, c = (sinc * part for part in turn)
    w, x, y, z = (lanes.y[first + k] for k in range(4))
    turned = (
        w * cosine - x * a - y * b - z * c, x * cosine + w * a + y * c - z * b,
        y * cosine + w * b + z * a - x * c, z * cosine + w * c + x * b - y * a,
    )  # fmt: skip
    for k, value in enumerate(turned):
        out[first + k] = value
