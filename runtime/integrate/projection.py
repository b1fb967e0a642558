"""Bring a state back onto the constraints, positions and velocities, and quaternions to unit length."""

import math

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.loop import all_finite
from symgen.runtime.integrate.quaternions import scale_to_unit
from symgen.runtime.integrate.step_control import error_scale

# What is left of residuals: of constraints of the usual sizes; where lengths are in micrometres or in parsecs, of what
# they change by.
RESIDUAL_LEFT, LEAST_USUAL, MOST_USUAL = 1e-12, 1e-3, 1e3
# Near rest the rates hold too little of the energy to carry its whole error.
LEAST_KINETIC = 0.05
# A larger error of the kinetic energy, relative, is not one to be smoothed over.
LARGEST_ERROR = 0.05


@jitted
def scale_energy(loop, t, y, buffer):
    """Scale the rates of `y` so that T + V - work is `control[ENERGY_LEVEL]`; what that took goes to ENERGY_STEP.

    Scaled rates satisfy constraints that do not move as they did before. Nothing happens in runs without energy scaling
    (`addresses[ENERGY]` is 0).

    Parameters
    ----------
    y : ndarray
        (q, v), on the constraints, and work; v is changed in place.
    buffer : ndarray
        Overwritten; two entries at least.
    """
    if loop.addresses[at.ENERGY] == 0:
        return
    level = loop.control[at.ENERGY_LEVEL]
    if loop.sizes[at.NY] > loop.sizes[at.NQ] + loop.sizes[at.NV]:
        level += y[loop.sizes[at.NQ] + loop.sizes[at.NV]]
    loop.control[at.ENERGY_STEP] = 0.0
    call_kernel(loop.addresses[at.ENERGY], t, y, loop.p, buffer)
    kinetic, potential = buffer[0], buffer[1]
    error = kinetic + potential - level
    if not (
        kinetic > LEAST_KINETIC * (abs(level) + abs(potential)) and abs(error) <= LARGEST_ERROR * kinetic
    ):
        return
    factor = math.sqrt((kinetic - error) / kinetic)
    for i in range(loop.sizes[at.NQ], loop.sizes[at.NQ] + loop.sizes[at.NV]):
        y[i] *= factor
    loop.control[at.ENERGY_STEP] = error


@jitted
def count_energy(loop):
    """Add what the accepted step took to the sum, which is the error that the run would have."""
    if loop.addresses[at.ENERGY] == 0:
        return
    loop.control[at.ENERGY_TAKEN] += loop.control[at.ENERGY_STEP]
    loop.control[at.MOST_ENERGY_TAKEN] = max(
        loop.control[at.MOST_ENERGY_TAKEN], abs(loop.control[at.ENERGY_TAKEN])
    )


MAX_GAUSS_STEPS = 6
LEFT_IN_PASSING = 0.01  # in units of the tolerance
# Residuals in parts of rtol: a Gauss step that need not be confirmed tells nothing of constraints that contradict
# each other.
LARGEST_IN_PASSING = 10.0


@jitted
def projection_size(sizes):
    """Length of the buffer that `project_state` needs: the row that the kernel `project` writes."""
    return sizes[at.NQ] + sizes[at.NV] + sizes[at.NH] + sizes[at.NM]


@jitted
def project_state(loop, t, y, buffer):
    """Project (q, v) in `y` onto the constraints, in place, with quaternions of unit length.

    Nothing happens where the model has neither (`addresses[PROJECT]` is 0).

    The kernel makes one mass-weighted Gauss step for positions, one for velocities, and reports the residual it
    started from. Gauss steps converge quadratically, so one more is taken only while the reported residual is
    above the square root of the tolerance. Quaternions are scaled to unit length before, too: what that changes in
    the constraints would not show in the residual, and by a Gauss step their lengths change to second order only.

    Parameters
    ----------
    t : float [s]
    y : ndarray, shape (NY,)
    buffer : ndarray, shape (projection_size(sizes),)

    Returns
    -------
    int
        RUNNING, or PROJECTION_FAILED where the residual does not become small (`y` is then of no use).
    """
    return gauss_steps(loop, t, y, buffer, False)


@jitted
def project_in_passing(loop, t, y, buffer):
    """Project a state that nobody sees, but the next step starts from: as far as matters to the error of a step.

    A Gauss step that moves the state by a part d of its size leaves d² of it. Where the tolerance is loose, that is far
    below it long before it is round-off, and the next projection takes it off.

    Parameters and result are those of `project_state`.
    """
    return gauss_steps(loop, t, y, buffer, True)


@jitted
def gauss_steps(loop, t, y, buffer, in_passing):
    """Project (q, v) in `y`: until the residual is small, or `in_passing` until what is left does not matter."""
    if loop.addresses[at.PROJECT] == 0:
        return at.RUNNING
    n = loop.sizes[at.NQ] + loop.sizes[at.NV]
    if loop.sizes[at.NM] > 0:
        scale_to_unit(loop.sizes, y)
    enough = math.sqrt(loop.control[at.PROJECTION_TOL])
    for _ in range(MAX_GAUSS_STEPS):
        call_kernel(loop.addresses[at.PROJECT], t, y, loop.p, buffer)
        loop.counters[at.PROJECTIONS] += 1
        if not all_finite(buffer, projection_size(loop.sizes)):
            return at.PROJECTION_FAILED
        residual = 0.0
        for i in range(n, projection_size(loop.sizes)):
            residual = max(residual, abs(buffer[i]))
        converged = residual <= enough
        if in_passing and not converged and residual <= LARGEST_IN_PASSING * loop.control[at.RTOL]:
            converged = moves_little(loop.control, n, y, buffer)
        for i in range(n):
            y[i] = buffer[i]
        if converged:
            loop.control[at.MAX_RESIDUAL] = max(loop.control[at.MAX_RESIDUAL], residual)
            return at.RUNNING
    return at.PROJECTION_FAILED


@jitted
def moves_little(control, n, y, moved):
    """Whether the Gauss step from `y` to `moved` leaves less than `LEFT_IN_PASSING` (root mean square)."""
    total = 0.0
    for i in range(n):
        ratio = (moved[i] - y[i]) / error_scale(control, y[i], moved[i])
        total += ratio * ratio
    # In units of the tolerance, d is ratio * RTOL, and what is left is d² / RTOL.
    return control[at.RTOL] * total <= LEFT_IN_PASSING * n
