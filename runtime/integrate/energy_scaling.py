"""Keep the energy of a constrained conservative motion: scale the rates after each step."""

import math

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at

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
