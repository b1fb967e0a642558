"""Dormand and Prince's method of order 8(5,3) in lanes: the steps of `integrate/explicit/`, one for each member."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from symgen.runtime.ensemble.breaks import follow
from symgen.runtime.ensemble.events import act_on_events, arm, find_events
from symgen.runtime.ensemble.first_step import choose_anew, first_step
from symgen.runtime.ensemble.lanes import Lanes, commit, copy_rows, evaluate_start, reach, write_frames
from symgen.runtime.ensemble.writer import Rows, Value
from symgen.runtime.integrate.explicit.dop853 import (
    DOP853_A,
    DOP853_C,
    DOP853_D,
    DOP853_ERROR_3,
    DOP853_ERROR_5,
)
from symgen.runtime.integrate.explicit.tableau import SAFETY
from symgen.runtime.integrate.step_control import EPS

N_ROWS = 16  # of stage derivatives
_NEW = 12  # the row of the new state
_SHRINK, _GROW = 0.333, 6.0
_ORDER = 8


def _eighth_root(lanes: Lanes, a: Value) -> Value:
    code = lanes.code
    return code.root(code.root(code.root(a)))


def begin(lanes: Lanes) -> Value:
    """Write what finds the derivative at the start and the length of the first step."""
    evaluate_start(lanes)
    return first_step(lanes, lanes.own("t"), lanes.k.behind(lanes.n_row), partial(_eighth_root, lanes))


def attempt(lanes: Lanes, active: Value) -> Value:
    """Write one step of all lanes; returns in which of them the member is done."""
    code = lanes.code
    arm(lanes, active)
    t, wanted = lanes.own("t"), lanes.own("h")
    stop = lanes.next_stop()
    t1 = code.select(t + wanted * 1.01 >= stop, stop, t + wanted)
    h = t1 - t
    too_small = ~(wanted > code.larger(code.size(t) * (16.0 * EPS), code.as_kind(lanes.h_min, "lanes")))
    rows = [lanes.k.behind(lanes.n_row * s) for s in range(N_ROWS)]
    least = code.variable(float("inf"))
    for s in range(1, _NEW):
        _sum(lanes, DOP853_A[s], h, rows, lanes.y_stage)
        lanes.call("rhs", t + h * DOP853_C[s], lanes.y_stage, rows[s])
        with code.when(lanes.m > 0):
            least.value = code.smaller(least.value, rows[s][lanes.n_row - 1])
    _sum(lanes, DOP853_A[_NEW], h, rows, lanes.y_new)
    error = _error(lanes, h, rows)
    new = rows[_NEW]
    end = reach(lanes, active & (error <= 1.0), t1, new, t1 < stop)
    with code.when(lanes.m > 0):
        lanes.set_own("pivot", code.smaller(lanes.own("pivot"), least.value), end.accepted)
    infinite = end.infinite | (active & ~code.finite(error))
    _choose_step(lanes, active, end.accepted, end.lost | infinite, h, wanted, _eighth_root(lanes, error))
    small = active & ~end.accepted & too_small
    dense, states_at = partial(_dense, lanes, t, h, rows), partial(_at, lanes)
    stopped = find_events(lanes, end.accepted, t, t1, dense, states_at)

    def dense_of_frames() -> None:
        with code.when(code.equal(lanes.n_events, 0)):  # else it is there, and of the whole step
            dense()

    write_frames(lanes, stopped.accepted, t, stopped.t, dense_of_frames, states_at, whole=h)

    def derive(at: Value) -> None:
        lanes.call("rhs", at, lanes.y_new, new)

    stopped = act_on_events(lanes, stopped, derive)
    followed = follow(lanes, stopped.accepted, stopped.t, derive)
    end = replace(end, accepted=stopped.accepted, infinite=infinite)
    copy_rows(lanes, new, rows[0], lanes.ny, end.accepted)
    done = commit(lanes, active, end, followed.t, stopped.t - t, small, stopped.leaving, stopped.ended)
    choose_anew(lanes, followed, rows[1], partial(_eighth_root, lanes))
    return done


def _sum(lanes: Lanes, weights: dict[int, float], h: Value, rows: list[Rows], out: Rows) -> None:
    """Write y + h Σ weights[j] k[j] to `out`."""
    code = lanes.code
    with code.each(lanes.ny) as i:
        total: Value | None = None
        for j, weight in weights.items():
            total = rows[j][i] * weight if total is None else code.fused(rows[j][i], weight, total)
        out[i] = code.fused(h, total, lanes.y[i])


def _error(lanes: Lanes, h: Value, rows: list[Rows]) -> Value:
    """The error in units of the tolerance, as `explicit.loop.norm_of_two`."""
    code = lanes.code
    fifth, third = code.variable(0.0), code.variable(0.0)
    weights = DOP853_A[_NEW]
    differences = {j: weights.get(j, 0.0) - DOP853_ERROR_3.get(j, 0.0) for j in (*weights,)}
    with code.each(lanes.n) as i:
        scale = lanes.scale(lanes.y[i], lanes.y_new[i])
        for total, parts in ((fifth, DOP853_ERROR_5), (third, differences)):
            value: Value | None = None
            for j, weight in parts.items():
                value = rows[j][i] * weight if value is None else code.fused(rows[j][i], weight, value)
            value = value / scale
            total.value = total.value + value * value
    below = fifth.value + third.value * 0.01
    error = h * fifth.value / code.root(below * code.to_number(lanes.n))
    return code.select(code.compare("eq", below, 0.0), code.all_lanes(0.0), error)


def _choose_step(
    lanes: Lanes, active: Value, accepted: Value, broken: Value, h: Value, wanted: Value, root: Value
) -> None:
    """Set the next step, as `accept_step` and `reject_step`; `root` is the eighth root of the error."""
    code = lanes.code
    factor = code.smaller(root / SAFETY, 1.0 / _SHRINK)
    factor = code.larger(factor, 1.0 / _GROW)
    longer = h / factor
    longer = code.select(h < wanted, code.larger(longer, wanted), longer)
    longer = code.select(lanes.own("last_rejected") > 0.5, code.smaller(longer, h), longer)
    longer = code.smaller(longer, lanes.longest_step(lanes.own("t") + h))
    by_error = code.smaller(root / SAFETY, 1.0 / _SHRINK)
    shorter = h / code.select(broken, code.all_lanes(1.0 / _SHRINK), by_error)
    lanes.set_own("h", code.select(accepted, longer, shorter), active)
    lanes.set_own("last_rejected", code.select(accepted, code.all_lanes(0.0), code.all_lanes(1.0)), active)


def _dense(lanes: Lanes, t: Value, h: Value, rows: list[Rows]) -> None:
    """Work out the rows of dense output, as `explicit.loop.erk_dense`."""
    code = lanes.code
    for s in range(_NEW + 1, N_ROWS):
        _sum(lanes, DOP853_A[s], h, rows, lanes.y_stage)
        lanes.call("rhs", t + h * DOP853_C[s], lanes.y_stage, rows[s])
    ny = lanes.ny
    dense = [lanes.dense.behind(ny * r) for r in range(8)]
    with code.each(ny) as i:
        rise = lanes.y_new[i] - lanes.y[i]
        bend = h * rows[0][i] - rise
        dense[0][i] = lanes.y[i]
        dense[1][i] = rise
        dense[2][i] = bend
        dense[3][i] = rise - h * rows[_NEW][i] - bend
        for r, weights in enumerate(DOP853_D):
            total: Value | None = None
            for j, weight in weights.items():
                total = rows[j][i] * weight if total is None else code.fused(rows[j][i], weight, total)
            dense[4 + r][i] = h * total


def _at(lanes: Lanes, theta: Value, out: Rows) -> None:
    """Write the states at places of the step, as `dense.evaluate_dense`."""
    code, ny = lanes.code, lanes.ny
    dense = [lanes.dense.behind(ny * r) for r in range(8)]
    other = 1.0 - theta
    with code.each(ny) as i:
        total = dense[7][i]
        for r in range(6, -1, -1):
            total = code.fused(total, theta if r % 2 == 0 else other, dense[r][i])
        out[i] = total
