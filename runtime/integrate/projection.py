"""Bring a state back onto the constraints, positions and velocities, and quaternions to unit length."""

import math

from runtime.code.bridge import call_kernel
from runtime.code.jitted import jitted
from runtime.integrate.layout import (
    MAX_RESIDUAL,
    NH,
    NM,
    NQ,
    NV,
    PROJECT,
    PROJECTION_FAILED,
    PROJECTION_TOL,
    PROJECTIONS,
    RUNNING,
)
from runtime.integrate.quaternions import scale_to_unit

MAX_GAUSS_STEPS = 6


@jitted
def projection_size(sizes):
    """Length of the buffer that `project_state` needs: the row that the kernel `project` writes."""
    return sizes[NQ] + sizes[NV] + sizes[NH] + sizes[NM]


@jitted
def project_state(addresses, sizes, p, t, y, control, counters, buffer):
    """Project (q, v) in `y` onto the constraints, in place, with quaternions of unit length.

    Nothing happens where the model has neither (`addresses[PROJECT]` is 0).

    The kernel makes one mass-weighted Gauss step for positions, one for velocities, and reports the residual it
    started from. Gauss steps converge quadratically, so one more is taken only while the reported residual is
    above the square root of the tolerance. Quaternions are scaled to unit length before, too: what that changes in
    the constraints would not show in the residual, and by a Gauss step their lengths change to second order only.

    Parameters
    ----------
    addresses, sizes, control, counters : ndarray
        See `layout.py`.
    p : ndarray
        Parameters and inputs.
    t : float [s]
    y : ndarray, shape (NY,)
    buffer : ndarray, shape (projection_size(sizes),)

    Returns
    -------
    int
        RUNNING, or PROJECTION_FAILED where the residual does not become small (`y` is then of no use).
    """
    if addresses[PROJECT] == 0:
        return RUNNING
    n = sizes[NQ] + sizes[NV]
    if sizes[NM] > 0:
        scale_to_unit(sizes, y)
    enough = math.sqrt(control[PROJECTION_TOL])
    for _ in range(MAX_GAUSS_STEPS):
        call_kernel(addresses[PROJECT], t, y, p, buffer)
        counters[PROJECTIONS] += 1
        residual = 0.0
        finite = True
        for i in range(n):
            finite = finite and math.isfinite(buffer[i])
        for i in range(n, n + sizes[NH] + sizes[NM]):
            finite = finite and math.isfinite(buffer[i])
            residual = max(residual, abs(buffer[i]))
        if not finite:
            return PROJECTION_FAILED
        for i in range(n):
            y[i] = buffer[i]
        if residual <= enough:
            control[MAX_RESIDUAL] = max(control[MAX_RESIDUAL], residual)
            return RUNNING
    return PROJECTION_FAILED
