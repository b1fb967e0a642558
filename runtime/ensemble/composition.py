"""Symmetric compositions of velocity Verlet in lanes: the steps of `integrate/composition.py`, one for each member."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from symgen.runtime.ensemble.dense_output import dense_rows, nested_at
from symgen.runtime.ensemble.lanes import Lanes, commit, copy_rows, reach, write_frames
from symgen.runtime.ensemble.runge_kutta import grid_step, pass_grid
from symgen.runtime.ensemble.writer import Rows, Value
from symgen.runtime.integrate.composition import N_DENSE_TERMS, PLACES, composition

PART = 3  # numbers of `parts` for each step: its drift, the kick before it, and when that is, in units of the whole
_OF_ANY_ORDER = composition(4)  # dense output is the same


def attempt(lanes: Lanes, active: Value) -> Value:
    """Write one step of all lanes; returns in which of them the member is done."""
    code = lanes.code
    t, t1, h = grid_step(lanes)
    before, row = lanes.k, lanes.k.behind(lanes.n_row)
    _compose(lanes, t, t1, h, before, row)
    has_work = lanes.n < lanes.ny
    with code.when(~has_work):
        copy_rows(lanes, lanes.y_new.behind(lanes.nq), row, lanes.n - lanes.nq)
    end = reach(lanes, active, t1, new=row, passing=code.flags(False), evaluate=has_work)
    write_frames(
        lanes, end.accepted, t, t1, lambda: _make_dense(lanes, t, h, before, row),
        lambda theta, out: nested_at(lanes, N_DENSE_TERMS, theta, out),
    )  # fmt: skip
    followed = pass_grid(lanes, end.accepted, t1, lambda at: lanes.call("rhs", at, lanes.y_new, row))
    zero = code.all_lanes(0.0)
    with code.when(code.any(followed.passed)):
        with code.each(lanes.ny) as i:
            lanes.newton[i] = code.select(followed.passed, zero, lanes.newton[i])
    copy_rows(lanes, row, before, lanes.ny, end.accepted)
    return commit(lanes, active, end, followed.t, h, active & ~end.accepted)


def _compose(lanes: Lanes, t: Value, t1: Value, h: Value, before: Rows, row: Rows) -> None:
    """Write the new states to `y_new` and accelerations there to `row`, as `composition.compose_step`."""
    code, y, parts, nq = lanes.code, lanes.y_new, lanes.parts, lanes.nq
    copy_rows(lanes, lanes.y, y, lanes.ny)
    copy_rows(lanes, before, row, lanes.ny)
    with code.each(lanes.n_parts) as s:
        own, following = parts.behind(s * PART), parts.behind(s * PART + PART)
        _kick(lanes, h * own[1], h * own[2] + t, row)
        with code.each(nq) as i:
            _add_compensated(lanes, h * own[0] * y[nq + i], i)
        is_last = code.equal(s + 1, lanes.n_parts)
        lanes.call("rhs", code.select(is_last, t1, h * following[2] + t), y, row)
    _kick(lanes, h * parts[lanes.n_parts * PART + 1], t1, row)


def _kick(lanes: Lanes, length: Value, t: Value, row: Rows) -> None:
    """Move velocities, and work with the power at their mean, as `composition.kick`."""
    code, n, between = lanes.code, lanes.n, lanes.k.behind(lanes.n_row * 2)
    with code.when(n < lanes.ny):
        copy_rows(lanes, lanes.y_new, lanes.y_stage, lanes.ny)
        half = length * 0.5
        with code.each(n, lanes.nq) as i:
            lanes.y_stage[i] = code.fused(half, row[i], lanes.y_stage[i])
        lanes.call("rhs", t, lanes.y_stage, between)
        _add_compensated(lanes, length * between[n], n)
    with code.each(n, lanes.nq) as i:
        _add_compensated(lanes, length * row[i], i)


def _add_compensated(lanes: Lanes, increment: Value, i: Value) -> None:
    """Add to the new state what rounding shall not lose, as `loop.add_compensated`; `newton` has the rest."""
    y, rest = lanes.y_new, lanes.newton
    term, old = rest[i] + increment, y[i]
    total = old + term
    rest[i] = (old - total) + term
    y[i] = total


def _make_dense(lanes: Lanes, t: Value, h: Value, before: Rows, row: Rows) -> None:
    """Write positions of degree 7, as `composition.composition_dense`."""
    code, nq, method = lanes.code, lanes.nq, _OF_ANY_ORDER
    dense = dense_rows(lanes, N_DENSE_TERMS)
    with code.each(lanes.ny) as i:
        dense[0][i], dense[1][i] = lanes.y[i], lanes.y_new[i] - lanes.y[i]
    between = [lanes.k.behind(lanes.n_row * (2 + k)) for k in range(len(PLACES))]

    def of_ends(i: Value) -> list[Value]:
        rise = dense[1][i]
        return [
            h * lanes.y[nq + i] - rise, h * lanes.y_new[nq + i] - rise, h * h * before[nq + i], h * h * row[nq + i]
        ]  # fmt: skip

    for k, place in enumerate(PLACES):
        copy_rows(lanes, lanes.y, lanes.y_stage, lanes.ny)
        with code.each(nq) as i:
            data, rise = of_ends(i), dense[1][i]
            lanes.y_stage[i] = lanes.y[i] + (rise * place + _combined(method.between[k], data))
            lanes.y_stage[nq + i] = (rise + _combined(method.between[2 + k], data)) / h
        lanes.call("rhs", h * place + t, lanes.y_stage, between[k])
    with code.each(nq) as i:
        data = [*of_ends(i), *(h * h * other[nq + i] for other in between)]
        bends = [_combined(weights, data) for weights in method.bends]
        slopes = [_combined(weights, bends) / h for weights in method.rates]
        for terms, place in ((bends, i), (slopes, nq + i)):
            _put_terms(lanes, terms, place)
    with code.when(lanes.n < lanes.ny):
        n = lanes.n
        data = [h * power[n] - dense[1][n] for power in (before, row, *between)]
        _put_terms(lanes, [_combined(weights, data) for weights in method.work], n)


def _put_terms(lanes: Lanes, terms: list[Value], i: Value) -> None:
    """Write the terms of a component behind the first two; those that it has not are zero."""
    rows = dense_rows(lanes, N_DENSE_TERMS)[2:]
    for row, value in zip(rows, [*terms, *[0.0] * (len(rows) - len(terms))], strict=True):
        row[i] = value


def _combined(weights: Sequence[float] | np.ndarray, data: list[Value]) -> Value:
    """The sum of numbers, each times its weight."""
    total = data[0] * float(weights[0])
    for weight, value in zip(map(float, weights[1:]), data[1:], strict=True):
        total = value.code.fused(value, weight, total)
    return total
