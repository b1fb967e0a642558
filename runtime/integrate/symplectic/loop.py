"""Semi-implicit Euler and velocity Verlet with a fixed step."""

from typing import NamedTuple

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate.after_step import finish_scratch_size, finish_step, needs_dense
from symgen.runtime.integrate.baumgarte import hold_stabilisation, release_stabilisation
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
    NM,
    NOT_FINITE,
    NQ,
    NV,
    NW,
    NY,
    PROJECT,
    PROJECTION_FAILED,
    RUNNING,
    T,
)
from symgen.runtime.integrate.projection import project_state, projection_size
from symgen.runtime.integrate.quaternions import move
from symgen.runtime.integrate.step_control import grid_end, watch_is_near

N_DENSE_TERMS = 4


class SymplecticScheme(NamedTuple):
    """Which scheme a loop advances with.

    Attributes
    ----------
    verlet : int
        1 for velocity Verlet, 0 for semi-implicit Euler.
    reuse : int
        1 where the rates are dq/dt, the acceleration depends on neither v nor constraints and no work is carried:
        that of the new positions serves the new velocities as it is, and a Verlet step costs one evaluation,
        otherwise two.
    """

    verlet: int
    reuse: int


@jitted
def symplectic_work_size(sizes):
    """Length of `work`."""
    return sizes[NY] + sizes[N_ROW] + finish_scratch_size(sizes)


@jitted
def advance_semi_implicit(
    method, addresses, sizes, p, control, counters, y, f, work, frame_times, frames, step_log, dense
):
    """Advance with a `SymplecticScheme` until something is for Python to do; see docs/architecture.md."""
    ny, n_row = sizes[NY], sizes[N_ROW]
    y_new, row, scratch = work[:ny], work[ny : ny + n_row], work[ny + n_row :]
    if not counters[F_VALID]:
        if not evaluate(addresses, sizes, p, counters, control[T], y, f):
            return NOT_FINITE
        counters[F_VALID] = 1
    done = 0
    while done < counters[MAX_STEPS_PER_CALL] and counters[N_LOGGED_STEPS] < step_log.shape[0]:
        if watch_is_near(control):
            return NEAR_WATCH
        t0, t1 = control[T], grid_end(control, counters)
        hold_stabilisation(addresses, sizes, p, t0, t1 - t0, y, f, scratch[: projection_size(sizes)])
        if method.verlet:
            verlet_step(method.reuse, addresses, sizes, p, counters, t1, t1 - t0, y, f, y_new, row)
        else:
            semi_implicit_step(sizes, t1 - t0, y, f, y_new)
        status = complete_step(
            method, addresses, sizes, p, control, counters, t1, t1 - t0, y, f, y_new, row, scratch
        )
        if status != RUNNING:
            return status
        if needs_dense(sizes, counters, frame_times, t1):
            hermite_dense(y, y_new, f, row, t1 - t0, ny, dense)
        copy(y_new, y)
        copy(row, f)
        status = finish_step(
            addresses, sizes, p, control, counters, t0, t1, y, dense, N_DENSE_TERMS, scratch,
            frame_times, frames, step_log,
        )  # fmt: skip
        if status != RUNNING:
            return status
        done += 1
    return RUNNING


@jitted
def semi_implicit_step(sizes, h, y, f, y_new):
    """Write the new velocities, then the new positions moved with them (order 1)."""
    nq, nv = sizes[NQ], sizes[NV]
    for i in range(nv):
        y_new[nq + i] = y[nq + i] + h * f[nq + i]
    move(sizes, y, h, y_new, nq, y_new)


@jitted
def verlet_step(reuse, addresses, sizes, p, counters, t1, h, y, f, y_new, row):
    """Write the new positions and velocities of a velocity Verlet step (order 2).

    Hairer, Lubich, Wanner, Acta Numerica 12 (2003) 399, (1.7). Where the acceleration depends on v, the new one is
    taken at predicted velocities v + h a: their error h^2 enters the new velocities as h^3, as the method's own does.
    Quaternions are turned by h (v + h a / 2), which misses the turn of a step by h^3 (w x w') / 12.
    """
    nq, nv = sizes[NQ], sizes[NV]
    for i in range(nv):
        y_new[nq + i] = y[nq + i] + 0.5 * h * f[nq + i]
    move(sizes, y, h, y_new, nq, y_new)
    for i in range(nv):
        y_new[nq + i] = y[nq + i] + h * f[nq + i]
    for i in range(nq + nv, sizes[NY]):
        y_new[i] = y[i]
    evaluate(addresses, sizes, p, counters, t1, y_new, row)
    for i in range(nv):
        y_new[nq + i] = y[nq + i] + 0.5 * h * (f[nq + i] + row[nq + i])
        if reuse:
            row[i] = y_new[nq + i]


@jitted
def complete_step(method, addresses, sizes, p, control, counters, t1, h, y, f, y_new, row, scratch):
    """Project the new state, evaluate its derivative, add the work (trapezoidal rule); returns a status."""
    nq, nv = sizes[NQ], sizes[NV]
    release_stabilisation(addresses, sizes, p)
    if addresses[PROJECT] != 0:
        if project_state(
            addresses, sizes, p, t1, y_new, control, counters, scratch[: projection_size(sizes)]
        ):
            return PROJECTION_FAILED
    if not (method.verlet and method.reuse):
        evaluate(addresses, sizes, p, counters, t1, y_new, row)
    if sizes[NM] > 0:
        control[MIN_PIVOT_RATIO] = min(control[MIN_PIVOT_RATIO], row[sizes[N_ROW] - 1])
    for i in range(nq + nv, nq + nv + sizes[NW]):
        y_new[i] = y[i] + 0.5 * h * (f[i] + row[i])
    return RUNNING if all_finite(y_new, sizes[NY]) and all_finite(row, sizes[NY]) else NOT_FINITE
