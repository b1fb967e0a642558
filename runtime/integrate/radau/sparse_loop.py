"""Radau IIA for large models: the steps of `loop.py`, with sparse Newton systems."""

import math
from typing import Any, NamedTuple

import numpy as np

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate.layout import (
    MAX_STEPS_PER_CALL,
    N_LOGGED_STEPS,
    NEAR_WATCH,
    NOT_FINITE,
    RUNNING,
    STEP_TOO_SMALL,
    T,
)
from symgen.runtime.integrate.radau.error import set_tolerances
from symgen.runtime.integrate.radau.loop import (
    accept_radau,
    begin_radau,
    commit_radau,
    reach_end,
    reject_radau,
    shrink_step,
)
from symgen.runtime.integrate.radau.sparse_stages import (
    estimate_sparse_error,
    factor_sparse_stages,
    solve_sparse_stages,
)
from symgen.runtime.integrate.radau.sparse_work import sparse_radau_work
from symgen.runtime.integrate.radau.stages import predict_stages
from symgen.runtime.integrate.radau.work import (
    FACTORED_FOR,
    HAVE_FACTORS,
    HAVE_HISTORY,
    HAVE_JACOBIAN,
    JACOBIAN_IS_FRESH,
)
from symgen.runtime.integrate.sparse_newton import NewtonPattern, differentiate_sparse
from symgen.runtime.integrate.step_control import step_end, too_small, watch_is_near


class SparseRadauIIA(NamedTuple):
    """The numbers of `RadauIIA`, and the pattern of a model's Newton matrices."""

    a: np.ndarray
    c: Any
    to_stages: np.ndarray
    from_stages: np.ndarray
    mu: float
    nu: np.ndarray
    inverse_squares: np.ndarray
    error: np.ndarray
    error_a: np.ndarray
    amplification: float
    rows: np.ndarray
    pattern: NewtonPattern


@jitted
def advance_radau_sparse(
    method, addresses, sizes, p, control, counters, y, f, work, frame_times, frames, step_log, dense
):
    """Advance as `advance_radau` does; `method` is a `SparseRadauIIA`."""
    w = sparse_radau_work(method, sizes, work)
    if not begin_radau(method, addresses, sizes, p, control, counters, y, f, w):
        return NOT_FINITE
    done = 0
    while done < counters[MAX_STEPS_PER_CALL] and counters[N_LOGGED_STEPS] < step_log.shape[0]:
        if watch_is_near(control):
            return NEAR_WATCH
        t0 = control[T]
        status, t1 = sparse_radau_step(method, addresses, sizes, p, control, counters, y, f, w, dense)
        if status != RUNNING:
            return status
        status = commit_radau(
            method,
            addresses,
            sizes,
            p,
            control,
            counters,
            t0,
            t1,
            y,
            f,
            w,
            frame_times,
            frames,
            step_log,
            dense,
        )
        if status != RUNNING:
            return status
        done += 1
    return RUNNING


@jitted
def sparse_radau_step(method, addresses, sizes, p, control, counters, y, f, w, dense):
    """Try steps until one is accepted; see `radau_step`."""
    set_tolerances(method, sizes, control, y, w)
    cause = STEP_TOO_SMALL
    while True:
        t, t1 = control[T], step_end(control)
        h = t1 - t
        if too_small(control):
            return cause, t
        if not counters[HAVE_JACOBIAN]:
            status = differentiate_sparse(
                method.pattern, addresses, sizes, p, counters, t, y, f, w.arguments, w.entries
            )
            if status != RUNNING:
                return status, t
            counters[HAVE_JACOBIAN], counters[JACOBIAN_IS_FRESH], counters[HAVE_FACTORS] = 1, 1, 0
        cause = try_sparse_step(method, h, addresses, sizes, p, control, counters, t, y, w, dense)
        if cause != RUNNING:
            shrink_step(cause, h, control, counters, w)
            continue
        error = estimate_sparse_error(method, h, addresses, sizes, p, counters, t, y, f, w)
        cause = STEP_TOO_SMALL if math.isfinite(error) else NOT_FINITE
        if error < 1.0:
            cause = reach_end(method, h, addresses, sizes, p, control, counters, t, t1, y, w)
            if cause == RUNNING:
                accept_radau(method, error, h, control, counters, w)
                return RUNNING, t1
            error = math.inf
        reject_radau(method, error, h, control, counters, w)


@jitted
def try_sparse_step(method, h, addresses, sizes, p, control, counters, t, y, w, dense):
    """Solve the stages of a step of length `h`; returns RUNNING or why that failed."""
    # Lengths of equal steps differ by round-off of time, which is nothing to Newton.
    if not counters[HAVE_FACTORS] or abs(h - w.numbers[FACTORED_FOR]) > 1e-6 * h:
        counters[HAVE_FACTORS] = 0
        status = factor_sparse_stages(method, h, sizes, counters, y, w)
        if status != RUNNING:
            return status
        counters[HAVE_FACTORS] = 1
    predict_stages(method, h, counters[HAVE_HISTORY] != 0, sizes, control, y, dense, w)
    return solve_sparse_stages(method, h, addresses, sizes, p, control, counters, t, y, w)
