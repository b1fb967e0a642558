"""Runge-Kutta methods of fixed step in lanes, with cubic dense output."""

from __future__ import annotations

from collections.abc import Callable

from symgen.runtime.ensemble.breaks import Followed, follow
from symgen.runtime.ensemble.dense_output import cubic_dense, nested_at
from symgen.runtime.ensemble.lanes import Lanes, commit, copy_rows, evaluate_start, reach, write_frames
from symgen.runtime.ensemble.writer import Rows, Value
from symgen.runtime.integrate.explicit.tableau import ErkTableau


def begin(lanes: Lanes) -> Value:
    """Write what finds the derivative at the start; returns the step."""
    evaluate_start(lanes)
    return lanes.code.as_kind(lanes.step, "lanes")


def grid_step(lanes: Lanes) -> tuple[Value, Value, Value]:
    """Return where a step of the grid begins and ends, and its length."""
    code = lanes.code
    t, stop, step = lanes.own("t"), lanes.next_stop(), lanes.own("h")
    # Times of the grid, which do not drift; steps are cut where they have to end.
    on_grid = step * (lanes.own("grid") + 1.0) + lanes.t_start
    on_grid = code.select(on_grid <= t + step * 1e-9, on_grid + step, on_grid)
    at_end = on_grid >= stop - step * 1e-9
    t1 = code.select(at_end, stop, on_grid)
    cut = at_end | (code.size(t1 - t - step) > step * 1e-9)
    return t, t1, code.select(cut, t1 - t, step)


def pass_grid(lanes: Lanes, accepted: Value, t1: Value, derive: Callable[[Value], None]) -> Followed:
    """Count steps that end on the grid, and let lanes enter the next interval; returns where they go on."""
    code = lanes.code
    following = code.as_kind(lanes.t_start, "lanes") + lanes.own("h") * (lanes.own("grid") + 1.0)
    lanes.count("grid", accepted & (t1 >= following - lanes.own("h") * 1e-9))
    return follow(lanes, accepted, t1, derive)


def attempt_of(tableau: Callable[[], ErkTableau]) -> Callable[[Lanes, Value], Value]:
    """Return what writes one step of all lanes with a method; see `lanes.function_run`."""

    def attempt(lanes: Lanes, active: Value) -> Value:
        return _attempt(lanes, active, tableau())

    return attempt


def _attempt(lanes: Lanes, active: Value, method: ErkTableau) -> Value:
    code, n = lanes.code, method.n_stages
    t, t1, h = grid_step(lanes)
    rows = [lanes.k.behind(lanes.n_row * s) for s in range(n + 1)]
    for s in range(1, n):
        _sum(lanes, method.a[s, :s], h, rows, lanes.y_stage)
        lanes.call("rhs", t + h * float(method.c[s]), lanes.y_stage, rows[s])
    _sum(lanes, method.b, h, rows, lanes.y_new)
    end = reach(lanes, active, t1, rows[n], code.flags(False))
    write_frames(
        lanes,
        end.accepted,
        t,
        t1,
        lambda: cubic_dense(lanes, h, rows[0], rows[n]),
        lambda at, out: nested_at(lanes, 4, at, out),
    )
    following = pass_grid(lanes, end.accepted, t1, lambda at: lanes.call("rhs", at, lanes.y_new, rows[n])).t
    copy_rows(lanes, rows[n], rows[0], lanes.ny, end.accepted)
    return commit(lanes, active, end, following, h, active & ~end.accepted)


def _sum(lanes: Lanes, weights, h: Value, rows: list[Rows], out: Rows) -> None:
    code = lanes.code
    with code.each(lanes.ny) as i:
        total: Value | None = None
        for j, weight in enumerate(map(float, weights)):
            if weight != 0.0:
                total = rows[j][i] * weight if total is None else code.fused(rows[j][i], weight, total)
        out[i] = code.fused(h, total, lanes.y[i])
