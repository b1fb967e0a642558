"""The first step of methods with steps of their own choice in lanes, as `step_control.first_step`."""

from __future__ import annotations

from collections.abc import Callable

from symgen.runtime.ensemble.breaks import Followed
from symgen.runtime.ensemble.lanes import Lanes
from symgen.runtime.ensemble.writer import INTEGER, Rows, Value

_FARTHEST, _TRIALS = 100.0, 5  # as there


def first_step(lanes: Lanes, t: Value, row: Rows, root: Callable[[Value], Value]) -> Value:
    """Write what finds the length of the first step from a time on; the derivatives there are in the first row of `k`.

    Parameters
    ----------
    row : Rows
        Scratch: one rhs row.
    root : callable
        The root whose index is the order of the method, of its error estimate where that is lower.
    """
    code = lanes.code
    y, f = lanes.y, lanes.k
    size_f, size_y = code.variable(0.0), code.variable(0.0)
    with code.each(lanes.n) as i:
        scale = lanes.scale(y[i], y[i])
        a, b = f[i] / scale, y[i] / scale
        size_f.value = size_f.value + a * a
        size_y.value = size_y.value + b * b
    told = (size_f.value > 1e-10) & (size_y.value > 1e-10) & code.finite(size_f.value)
    longest = lanes.longest_step(t)
    ahead = code.smaller(longest, lanes.next_stop() - t)
    h = code.variable(code.select(told, code.root(size_y.value / size_f.value) * 0.01, code.all_lanes(1e-6)))
    h.value = code.smaller(h.value, ahead)
    found, going = code.variable(h.value), code.variable(code.flags(True))
    trial = code.variable(0, INTEGER)
    with code.forever() as leave:
        leave(~code.any(going.value))
        leave(trial.value >= _TRIALS)
        step = h.value
        steepest = _steepest(lanes, t, step, row)
        lost = ~code.finite(steepest)
        is_first = code.equal(trial.value, 0)
        back = code.select(is_first, step, step / _FARTHEST)
        suggested = code.select(steepest <= 1e-15, code.larger(step * 1e-3, 1e-6), root(0.01 / steepest))
        reached = (suggested <= step * _FARTHEST) | (step >= ahead)
        chosen = code.larger(code.smaller(suggested, longest), code.as_kind(lanes.h_min, "lanes"))
        result = code.select(lost, back, chosen)
        ending = going.value & (lost | reached)
        found.value = code.select(ending, result, found.value)
        going.value = going.value & ~ending
        h.value = code.select(going.value, code.smaller(step * _FARTHEST, ahead), step)
        trial.value = trial.value + 1
    return code.select(going.value, h.value, found.value)


def choose_anew(lanes: Lanes, followed: Followed, row: Rows, root: Callable[[Value], Value]) -> None:
    """Choose steps as at the start where what comes is another motion; states and derivatives are those there."""
    code = lanes.code
    if not lanes.with_breaks:
        return
    with code.when(code.any(followed.anew)):
        lanes.set_own("h", first_step(lanes, followed.t, row, root), followed.anew)


def _steepest(lanes: Lanes, t: Value, h: Value, row: Rows) -> Value:
    """The larger of |y'| and |y''|, as an Euler step sees them, in units of tolerances."""
    code = lanes.code
    y, f, trial = lanes.y, lanes.k, lanes.y_stage
    with code.each(lanes.ny) as i:
        trial[i] = y[i] + h * f[i]
    lanes.call("rhs", t + h, trial, row)
    size, change = code.variable(0.0), code.variable(0.0)
    with code.each(lanes.n) as i:
        scale = lanes.scale(y[i], trial[i])
        a, b = f[i] / scale, (row[i] - f[i]) / scale
        size.value = size.value + a * a
        change.value = change.value + b * b
    return code.larger(code.root(change.value) / h, code.root(size.value))
