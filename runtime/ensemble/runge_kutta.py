"""Runge-Kutta methods of fixed step in lanes, with cubic dense output."""

from __future__ import annotations

from collections.abc import Callable

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
    t, stop, step = lanes.own("t"), code.as_kind(lanes.t_end, "lanes"), lanes.own("h")
    # Times of the grid, which do not drift; the last step ends at the end.
    on_grid = step * (lanes.own("steps") + 1.0) + lanes.t_start
    at_end = on_grid >= stop - step * 1e-9
    t1 = code.select(at_end, stop, on_grid)
    return t, t1, code.select(at_end, t1 - t, step)


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
        code.call_kernel(lanes.rhs, t + h * float(method.c[s]), lanes.y_stage, lanes.p, rows[s])
    _sum(lanes, method.b, h, rows, lanes.y_new)
    end = reach(lanes, active, t1, rows[n], code.flags(False))
    write_frames(
        lanes,
        end.accepted,
        t,
        t1,
        lambda: cubic_dense(lanes, h, rows[0], rows[n]),
        lambda at, out: cubic_at(lanes, at, out),
    )
    copy_rows(lanes, rows[n], rows[0], lanes.ny, end.accepted)
    return commit(lanes, active, end, t1, h, active & ~end.accepted)


def _sum(lanes: Lanes, weights, h: Value, rows: list[Rows], out: Rows) -> None:
    code = lanes.code
    with code.each(lanes.ny) as i:
        total: Value | None = None
        for j, weight in enumerate(map(float, weights)):
            if weight != 0.0:
                total = rows[j][i] * weight if total is None else code.fused(rows[j][i], weight, total)
        out[i] = code.fused(h, total, lanes.y[i])


def cubic_dense(lanes: Lanes, h: Value, before: Rows, after: Rows) -> None:
    """The cubic through both ends, as `dense.hermite_dense`."""
    dense = [lanes.dense.behind(lanes.ny * r) for r in range(4)]
    with lanes.code.each(lanes.ny) as i:
        rise = lanes.y_new[i] - lanes.y[i]
        bend = h * before[i] - rise
        for row, value in zip(dense, (lanes.y[i], rise, bend, rise - h * after[i] - bend), strict=True):
            row[i] = value


def cubic_at(lanes: Lanes, theta: Value, out: Rows) -> None:
    """Write the states at places of the step."""
    code, dense = lanes.code, [lanes.dense.behind(lanes.ny * r) for r in range(4)]
    other = 1.0 - theta
    with code.each(lanes.ny) as i:
        total = code.fused(dense[3][i], theta, dense[2][i])
        total = code.fused(total, other, dense[1][i])
        out[i] = code.fused(total, theta, dense[0][i])
