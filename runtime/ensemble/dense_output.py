"""Dense output of steps in lanes, in the basis of `integrate/nested_basis.py`."""

from __future__ import annotations

from symgen.runtime.ensemble.lanes import Lanes
from symgen.runtime.ensemble.writer import Rows, Value


def dense_rows(lanes: Lanes, n: int) -> list[Rows]:
    """The first `n` terms of all components."""
    return [lanes.dense.behind(lanes.ny * r) for r in range(n)]


def nested_at(lanes: Lanes, n: int, theta: Value, out: Rows) -> None:
    """Write the states at places of the step, of `n` terms, as `dense.evaluate_dense`."""
    code, dense, other = lanes.code, dense_rows(lanes, n), 1.0 - theta
    with code.each(lanes.ny) as i:
        total = dense[-1][i]
        for r in range(n - 2, -1, -1):
            total = code.fused(total, theta if r % 2 == 0 else other, dense[r][i])
        out[i] = total


def cubic_dense(lanes: Lanes, h: Value, before: Rows, after: Rows) -> None:
    """The cubic through both ends, as `dense.hermite_dense`."""
    with lanes.code.each(lanes.ny) as i:
        rise = lanes.y_new[i] - lanes.y[i]
        bend = h * before[i] - rise
        terms = lanes.y[i], rise, bend, rise - h * after[i] - bend
        for row, value in zip(dense_rows(lanes, 4), terms, strict=True):
            row[i] = value
