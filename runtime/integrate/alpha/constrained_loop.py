"""The generalised-α method and HHT with constraints on positions, index 3 or stabilised index 2, with a fixed step."""

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate.after_step import finish_step, needs_dense
from symgen.runtime.integrate.alpha.constrained import carry_on, solve_end
from symgen.runtime.integrate.alpha.constrained_start import start
from symgen.runtime.integrate.alpha.constrained_work import (
    HAVE_START,
    STARTED_FOR,
    constrained_alpha_work,
)
from symgen.runtime.integrate.copying import copy
from symgen.runtime.integrate.dense import hermite_dense
from symgen.runtime.integrate.evaluation import all_finite, evaluate
from symgen.runtime.integrate.layout import (
    F_VALID,
    MAX_STEPS_PER_CALL,
    MIN_PIVOT_RATIO,
    N_LOGGED_STEPS,
    N_ROW,
    NEAR_WATCH,
    NOT_FINITE,
    NQ,
    NV,
    NW,
    NY,
    RUNNING,
    T,
)
from symgen.runtime.integrate.projection import project_state, projection_size
from symgen.runtime.integrate.step_control import grid_end, grid_length, watch_is_near

N_DENSE_TERMS = 4


@jitted
def advance_constrained_alpha(
    method, addresses, sizes, p, control, counters, y, f, work, frame_times, frames, step_log, dense
):
    """Advance with a `ConstrainedAlpha` method until something is for Python to do; see `constrained`.

    The velocities of index-3 form leave G v = 0 by O(h²); `y` has those projected onto it, while the recursion goes on
    with its own. A step of another length starts the recursion anew. `control[NEWTON_TOL]` is in units of the error
    tolerance; 0 means DEFAULT_NEWTON_TOL. Arguments and result are those of all step loops, see docs/architecture.md.
    """
    w = constrained_alpha_work(method, sizes, work)
    if not counters[F_VALID]:
        if not evaluate(addresses, sizes, p, counters, control[T], y, f):
            return NOT_FINITE
        counters[F_VALID], counters[HAVE_START] = 1, 0
    done = 0
    while done < counters[MAX_STEPS_PER_CALL] and counters[N_LOGGED_STEPS] < step_log.shape[0]:
        if watch_is_near(control):
            return NEAR_WATCH
        t0 = control[T]
        t1 = grid_end(control, counters)
        h = grid_length(control, t0, t1)
        status = RUNNING
        if not counters[HAVE_START] or abs(h - w.numbers[STARTED_FOR]) > 1e-6 * h:
            status = start(method, h, addresses, sizes, p, counters, t0, y, f, w)
        if status == RUNNING:
            status = solve_end(method, h, addresses, sizes, p, control, counters, t0, t1, y, w)
        if status == RUNNING:
            status = reach_end(h, addresses, sizes, p, control, counters, t1, y, f, w)
        if status != RUNNING:
            return status
        if needs_dense(sizes, counters, frame_times, t1):
            hermite_dense(y, w.y_new, f, w.row, h, sizes[NY], dense)
        copy(w.y_new, y)
        copy(w.row, f)
        carry_on(sizes, w)
        status = finish_step(
            addresses, sizes, p, control, counters, t0, t1, y, dense, N_DENSE_TERMS, w.scratch,
            frame_times, frames, step_log,
        )  # fmt: skip
        if status != RUNNING:
            return status
        done += 1
    return RUNNING


@jitted
def reach_end(h, addresses, sizes, p, control, counters, t1, y, f, w):
    """Project the new state, evaluate its rhs row, add the work (trapezoidal rule); returns a status."""
    n = sizes[NQ] + sizes[NV]
    for i in range(n):
        w.y_new[i] = w.arguments[i]
    status = project_state(
        addresses, sizes, p, t1, w.y_new, control, counters, w.scratch[: projection_size(sizes)]
    )
    if status != RUNNING:
        return status
    if not evaluate(addresses, sizes, p, counters, t1, w.y_new, w.row):
        return NOT_FINITE
    control[MIN_PIVOT_RATIO] = min(control[MIN_PIVOT_RATIO], w.row[sizes[N_ROW] - 1])
    for i in range(n, n + sizes[NW]):
        w.y_new[i] = y[i] + 0.5 * h * (f[i] + w.row[i])
    return RUNNING if all_finite(w.y_new, sizes[NY]) else NOT_FINITE
