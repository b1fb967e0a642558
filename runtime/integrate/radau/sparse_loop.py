"""Radau IIA for large models: the steps of `loop.py`, with sparse Newton systems."""

import math
from typing import Any, NamedTuple

import numpy as np

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
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
def advance_radau_sparse(method, loop):
    """Advance as `advance_radau` does; `method` is a `SparseRadauIIA`."""
    w = sparse_radau_work(method, loop.sizes, loop.work)
    if not begin_radau(method, loop, w):
        return at.NOT_FINITE
    done = 0
    while (
        done < loop.counters[at.MAX_STEPS_PER_CALL]
        and loop.counters[at.N_LOGGED_STEPS] < loop.step_log.shape[0]
    ):
        if watch_is_near(loop.control):
            return at.NEAR_WATCH
        t0 = loop.control[at.T]
        status, t1 = sparse_radau_step(method, loop, w)
        if status != at.RUNNING:
            return status
        status = commit_radau(
            method,
            loop,
            t0,
            t1,
            w,
        )
        if status != at.RUNNING:
            return status
        done += 1
    return at.RUNNING


@jitted
def sparse_radau_step(method, loop, w):
    """Try steps until one is accepted; see `radau_step`."""
    set_tolerances(method, loop, w)
    cause = at.STEP_TOO_SMALL
    while True:
        t, t1 = loop.control[at.T], step_end(loop.control)
        h = t1 - t
        if too_small(loop.control):
            return cause, t
        if not loop.counters[HAVE_JACOBIAN]:
            status = differentiate_sparse(method.pattern, loop, t, loop.f, w.arguments, w.entries)
            if status != at.RUNNING:
                return status, t
            loop.counters[HAVE_JACOBIAN], loop.counters[JACOBIAN_IS_FRESH], loop.counters[HAVE_FACTORS] = (
                1,
                1,
                0,
            )
        cause = try_sparse_step(method, h, loop, t, w)
        if cause != at.RUNNING:
            shrink_step(cause, h, loop, w)
            continue
        error = estimate_sparse_error(method, h, loop, t, w)
        cause = at.STEP_TOO_SMALL if math.isfinite(error) else at.NOT_FINITE
        if error < 1.0:
            cause = reach_end(method, h, loop, t, t1, w)
            if cause == at.RUNNING:
                accept_radau(method, error, h, loop, w)
                return at.RUNNING, t1
            error = math.inf
        reject_radau(method, error, h, loop, w)


@jitted
def try_sparse_step(method, h, loop, t, w):
    """Solve the stages of a step of length `h`; returns RUNNING or why that failed."""
    # Lengths of equal steps differ by round-off of time, which is nothing to Newton.
    if not loop.counters[HAVE_FACTORS] or abs(h - w.numbers[FACTORED_FOR]) > 1e-6 * h:
        loop.counters[HAVE_FACTORS] = 0
        status = factor_sparse_stages(method, h, loop, w)
        if status != at.RUNNING:
            return status
        loop.counters[HAVE_FACTORS] = 1
    predict_stages(method, h, loop.counters[HAVE_HISTORY] != 0, loop, w)
    return solve_sparse_stages(method, h, loop, t, w)
