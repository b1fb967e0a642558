"""Keep the energy of a constrained conservative motion: scale the rates after each step."""

import math

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate.layout import (
    ENERGY,
    ENERGY_LEVEL,
    ENERGY_STEP,
    ENERGY_TAKEN,
    MOST_ENERGY_TAKEN,
    NQ,
    NV,
    NY,
)

# Near rest the rates hold too little of the energy to carry its whole error.
LEAST_KINETIC = 0.05
# A larger error of the kinetic energy, relative, is not one to be smoothed over.
LARGEST_ERROR = 0.05


@jitted
def scale_energy(addresses, sizes, p, t, y, control, buffer):
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
    if addresses[ENERGY] == 0:
        return
    level = control[ENERGY_LEVEL]
    if sizes[NY] > sizes[NQ] + sizes[NV]:
        level += y[sizes[NQ] + sizes[NV]]
    control[ENERGY_STEP] = 0.0
    call_kernel(addresses[ENERGY], t, y, p, buffer)
    kinetic, potential = buffer[0], buffer[1]
    error = kinetic + potential - level
    if not (
        kinetic > LEAST_KINETIC * (abs(level) + abs(potential)) and abs(error) <= LARGEST_ERROR * kinetic
    ):
        return
    factor = math.sqrt((kinetic - error) / kinetic)
    for i in range(sizes[NQ], sizes[NQ] + sizes[NV]):
        y[i] *= factor
    control[ENERGY_STEP] = error


@jitted
def count_energy(addresses, control):
    """Add what the accepted step took to the sum, which is the error that the run would have."""
    if addresses[ENERGY] == 0:
        return
    control[ENERGY_TAKEN] += control[ENERGY_STEP]
    control[MOST_ENERGY_TAKEN] = max(control[MOST_ENERGY_TAKEN], abs(control[ENERGY_TAKEN]))
