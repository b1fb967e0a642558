"""Bring a state back onto the constraints, positions and velocities, and quaternions to unit length."""

import math

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate.evaluation import all_finite
from symgen.runtime.integrate.layout import (
    MAX_RESIDUAL,
    NH,
    NM,
    NQ,
    NV,
    PROJECT,
    PROJECTION_FAILED,
    PROJECTION_TOL,
    PROJECTIONS,
    RTOL,
    RUNNING,
)
from symgen.runtime.integrate.quaternions import scale_to_unit
from symgen.runtime.integrate.step_control import error_scale

MAX_GAUSS_STEPS = 6
LEFT_IN_PASSING = 0.01  # in units of the tolerance
# Residuals in parts of rtol: a Gauss step that need not be confirmed tells nothing of constraints that contradict
# each other.
LARGEST_IN_PASSING = 10.0


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
    return gauss_steps(addresses, sizes, p, t, y, control, counters, buffer, False)


@jitted
def project_in_passing(addresses, sizes, p, t, y, control, counters, buffer):
    """Project a state that nobody sees, but the next step starts from: as far as matters to the error of a step.

    A Gauss step that moves the state by a part d of its size leaves d² of it. Where the tolerance is loose, that is far
    below it long before it is round-off, and the next projection takes it off.

    Parameters and result are those of `project_state`.
    """
    return gauss_steps(addresses, sizes, p, t, y, control, counters, buffer, True)


@jitted
def gauss_steps(addresses, sizes, p, t, y, control, counters, buffer, in_passing):
    """Project (q, v) in `y`: until the residual is small, or `in_passing` until what is left does not matter."""
    if addresses[PROJECT] == 0:
        return RUNNING
    n = sizes[NQ] + sizes[NV]
    if sizes[NM] > 0:
        scale_to_unit(sizes, y)
    enough = math.sqrt(control[PROJECTION_TOL])
    for _ in range(MAX_GAUSS_STEPS):
        call_kernel(addresses[PROJECT], t, y, p, buffer)
        counters[PROJECTIONS] += 1
        if not all_finite(buffer, projection_size(sizes)):
            return PROJECTION_FAILED
        residual = 0.0
        for i in range(n, projection_size(sizes)):
            residual = max(residual, abs(buffer[i]))
        converged = residual <= enough
        if in_passing and not converged and residual <= LARGEST_IN_PASSING * control[RTOL]:
            converged = moves_little(control, n, y, buffer)
        for i in range(n):
            y[i] = buffer[i]
        if converged:
            control[MAX_RESIDUAL] = max(control[MAX_RESIDUAL], residual)
            return RUNNING
    return PROJECTION_FAILED


@jitted
def moves_little(control, n, y, moved):
    """Whether the Gauss step from `y` to `moved` leaves less than `LEFT_IN_PASSING` (root mean square)."""
    total = 0.0
    for i in range(n):
        ratio = (moved[i] - y[i]) / error_scale(control, y[i], moved[i])
        total += ratio * ratio
    # In units of the tolerance, d is ratio * RTOL, and what is left is d² / RTOL.
    return control[RTOL] * total <= LEFT_IN_PASSING * n
