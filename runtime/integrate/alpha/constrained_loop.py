"""The generalised-α method and HHT with constraints on positions, index 3 or stabilised index 2, with a fixed step."""

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
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
from symgen.runtime.integrate.loop import take_steps
from symgen.runtime.integrate.projection import project_state, projection_size
from symgen.runtime.integrate.step_control import grid_end, grid_length

N_DENSE_TERMS = 4


@jitted
def advance_constrained_alpha(method, loop):
    """Advance with a `ConstrainedAlpha` method until something is for Python to do; see `constrained`.

    The velocities of index-3 form leave G v = 0 by O(h²); `y` has those projected onto it, while the recursion goes on
    with its own. A step of another length starts the recursion anew. `control[NEWTON_TOL]` is in units of the error
    tolerance; 0 means DEFAULT_NEWTON_TOL. Arguments and result are those of all step loops, see docs/step-loops.md.
    """
    w = constrained_alpha_work(method, loop.sizes, loop.work)
    if not loop.counters[at.F_VALID]:
        if not evaluate(loop, loop.control[at.T], loop.y, loop.f):
            return at.NOT_FINITE
        loop.counters[at.F_VALID], loop.counters[HAVE_START] = 1, 0
    return take_steps(constrained_alpha_step, method, loop, w)


@jitted
def constrained_alpha_step(method, loop, w):
    """Take one step of the grid and record it; returns a status."""
    t0 = loop.control[at.T]
    t1 = grid_end(loop)
    h = grid_length(loop.control, t0, t1)
    status = at.RUNNING
    if not loop.counters[HAVE_START] or abs(h - w.numbers[STARTED_FOR]) > 1e-6 * h:
        status = start(method, h, loop, t0, w)
    if status == at.RUNNING:
        status = solve_end(method, h, loop, t0, t1, w)
    if status == at.RUNNING:
        status = reach_end(h, loop, t1, w)
    if status != at.RUNNING:
        return status
    if needs_dense(loop, t1):
        hermite_dense(loop.y, w.y_new, loop.f, w.row, h, loop.sizes[at.NY], loop.dense)
    copy(w.y_new, loop.y)
    copy(w.row, loop.f)
    carry_on(loop.sizes, w)
    return finish_step(loop, t0, t1, loop.dense, N_DENSE_TERMS, w.scratch)


@jitted
def reach_end(h, loop, t1, w):
    """Project the new state, evaluate its rhs row, add the work (trapezoidal rule); returns a status."""
    n = loop.sizes[at.NQ] + loop.sizes[at.NV]
    for i in range(n):
        w.y_new[i] = w.arguments[i]
    status = project_state(loop, t1, w.y_new, w.scratch[: projection_size(loop.sizes)])
    if status != at.RUNNING:
        return status
    if not evaluate(loop, t1, w.y_new, w.row):
        return at.NOT_FINITE
    loop.control[at.MIN_PIVOT_RATIO] = min(loop.control[at.MIN_PIVOT_RATIO], w.row[loop.sizes[at.N_ROW] - 1])
    for i in range(n, n + loop.sizes[at.NW]):
        w.y_new[i] = loop.y[i] + 0.5 * h * (loop.f[i] + w.row[i])
    return at.RUNNING if all_finite(w.y_new, loop.sizes[at.NY]) else at.NOT_FINITE
