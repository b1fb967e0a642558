"""Baumgarte's stabilisation with gains from the step: a force towards the constraints, held over each step."""

import math

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.quaternions import n_quaternions, quaternion_at, rotation_between
from symgen.runtime.integrate.step_control import EPS, error_scale

# Behind the precomputed p: h² and h times the gains of position and velocity, then an acceleration for every rate.
POSITION_GAIN, VELOCITY_GAIN = range(2)
N_GAINS = 2
_ROUNDED = 0.1  # of the tolerance of a rate: what the last digits of coordinates may do to it in a step


@jitted
def relaxation_time(loop, h):
    """Return how fast a step of length `h` is to take drift back [s]: in one step, but for round-off.

    A correction of coordinates has their last digit at best, and what is rounded off it is not along M⁻¹Gᵀ: as an
    acceleration over the time τ it changes rates by h eps |q| / τ² in a step, along the motion too, where nothing takes
    it back. At tight tolerances the short steps of a method of low order (τ = h) would be wrong by that.
    """
    if loop.addresses[at.STABILISE] == 0:
        return h
    nq, start, most = loop.sizes[at.NQ], 0, 0.0
    for k in range(n_quaternions(loop.sizes) + 1):
        end = quaternion_at(loop.sizes, k)
        for i in range(start, end):
            rate = loop.y[nq + i - k]
            most = max(most, abs(loop.y[i]) / error_scale(loop.control, rate, rate))
        if end < nq:
            for i in range(end - k, end - k + 3):
                most = max(most, 1.0 / error_scale(loop.control, loop.y[nq + i], loop.y[nq + i]))
        start = end + 4
    return max(h, math.sqrt(h * EPS * most / _ROUNDED))


@jitted
def hold_stabilisation(loop, t, over, row, buffer):
    """Hold a new stabilising acceleration, which takes back drift over a time [s], for a step from (t, y).

    It is added to the rhs row of its start.

    Baumgarte, Comput. Methods Appl. Mech. Eng. 1 (1972) 1, asks for G a = γ - 2α Φ' - β² Φ. With gains as large as
    the step allows (β = 1/h), stages, whose own residuals are of order h², would see forces of order 1, and the method
    would lose its order; so the force is that of the start of the step. M⁻¹Gᵀ(G M⁻¹Gᵀ)⁻¹ times the residuals is what
    the kernel `project` moves the state by.
    Nothing happens in runs that do not stabilise (`addresses[STABILISE]` is 0).
    """
    if loop.addresses[at.STABILISE] == 0:
        return
    nq, nv = loop.sizes[at.NQ], loop.sizes[at.NV]
    gains = loop.p[loop.p.shape[0] - nv - N_GAINS :]
    held = gains[N_GAINS:]
    call_kernel(loop.addresses[at.STABILISE], t, loop.y, loop.p, buffer)
    by_position, by_velocity = gains[POSITION_GAIN] / (over * over), gains[VELOCITY_GAIN] / over
    start = 0
    for k in range(n_quaternions(loop.sizes) + 1):
        end = quaternion_at(loop.sizes, k)
        for i in range(start, end):
            held[i - k] = by_position * (buffer[i] - loop.y[i])
        if end < nq:
            a, b, c = rotation_between(loop.y, buffer, end)
            held[end - k] = by_position * a
            held[end - k + 1] = by_position * b
            held[end - k + 2] = by_position * c
        start = end + 4
    for i in range(nv):
        held[i] += by_velocity * (buffer[nq + i] - loop.y[nq + i])
        row[nq + i] += held[i]


@jitted
def release_stabilisation(loop):
    """Hold no acceleration any more; returns whether the run stabilises, so that rows have to be evaluated anew."""
    if loop.addresses[at.STABILISE] == 0:
        return False
    for i in range(loop.p.shape[0] - loop.sizes[at.NV], loop.p.shape[0]):
        loop.p[i] = 0.0
    return True
