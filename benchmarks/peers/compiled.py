"""The right-hand side of a scene as functions that Numba compiles."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from job import Job
from numba import njit


def derivative(job: Job) -> Callable[[float, np.ndarray], np.ndarray]:
    """Return `f(t, y) -> dy/dt`, compiled."""
    rhs, p, n, n_row = job.system.numba("rhs"), job.p, job.n, job.system.n_row

    @njit
    def f(t, y):
        row = np.empty(n_row)
        rhs(t, y, p, row)
        return row[:n]

    f(0.0, job.start)
    return f
