"""Velocity Verlet with a fixed step in lanes: the steps of `integrate/semi_implicit.py`, one for each member."""

from __future__ import annotations

from symgen.runtime.ensemble.dense_output import cubic_dense, nested_at
from symgen.runtime.ensemble.lanes import Lanes, commit, copy_rows, reach, write_frames
from symgen.runtime.ensemble.rotations import retract
from symgen.runtime.ensemble.runge_kutta import grid_step, pass_grid
from symgen.runtime.ensemble.writer import Value


def attempt(lanes: Lanes, active: Value) -> Value:
    """Write one step of all lanes; returns in which of them the member is done."""
    code, y, new = lanes.code, lanes.y, lanes.y_new
    t, t1, h = grid_step(lanes)
    before, after = lanes.k, lanes.k.behind(lanes.n_row)
    half = h * 0.5
    with code.each(lanes.n, lanes.nq) as i:
        lanes.y_stage[i] = code.fused(half, before[i], y[i])
    retract(lanes, h, lanes.y_stage.behind(lanes.nq), new)
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
        lambda theta, out: nested_at(lanes, 4, theta, out),
    )  # fmt: skip
    following = pass_grid(lanes, end.accepted, t1, lambda at: lanes.call("rhs", at, new, after)).t
    copy_rows(lanes, after, before, lanes.ny, end.accepted)
    return commit(lanes, active, end, following, h, active & ~end.accepted)
