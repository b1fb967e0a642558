"""What pushes momenta at one end of a RATTLE step, L_q + Q = f + M' u, where M' is the derivative of M along u.

For the rates of a quaternion, whose momentum turns with the body, f + M' u + ω×(M u).
"""

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.jacobian import by_positions
from symgen.runtime.integrate.quaternions import n_quaternions, quaternion_at
from symgen.runtime.integrate.rattle.work import MEAN, PROBE, PUSH, TRIAL, TURN


@jitted
def push(method, which, h, loop, t, y, w):
    """Write h/2 (L_q + Q) at the positions of `y` and the mean rate to PUSH; -∂(M u)/∂q to the block TURN of slopes."""
    nq, nv, state = loop.sizes[at.NQ], loop.sizes[at.NV], w.states[TRIAL]
    for i in range(nq):
        state[i] = y[i]
    for i in range(nv):
        state[nq + i] = w.vectors[MEAN, i]
    call_kernel(loop.addresses[at.FORCES], t, state, loop.p, w.vectors[PUSH])
    add_rotation(which, loop.sizes, w)
    for i in range(nv):
        w.vectors[PUSH, i] *= 0.5 * h
    if method.constant_mass:
        return
    slope(loop, t, y, True, w, w.slopes[TURN])
    for i in range(nv):
        for j in range(nv):
            w.slopes[TURN, i, j] -= w.slopes[which, i, j]
            w.vectors[PUSH, i] -= 0.5 * h * w.slopes[TURN, i, j] * w.vectors[MEAN, j]


@jitted
def slope(loop, t, y, moving, w, out):
    """Write -∂residual/∂q at (q, PROBE) with λ = 0 and a = MEAN, or 0 where `moving` is not set, to `out`."""
    nq, nv = loop.sizes[at.NQ], loop.sizes[at.NV]
    n_columns = w.arguments.shape[0]
    for i in range(n_columns):
        w.arguments[i] = 0.0
    for i in range(nq):
        w.arguments[i] = y[i]
    for i in range(nv):
        w.arguments[nq + i] = w.vectors[PROBE, i]
        if moving:
            w.arguments[nq + nv + i] = w.vectors[MEAN, i]
    call_kernel(loop.addresses[at.RESIDUAL_JACOBIAN], t, w.arguments, loop.p, w.derivative)
    loop.counters[at.JACOBIANS] += 1
    for i in range(nv):
        by_positions(loop.sizes, y, w.derivative[i * n_columns : (i + 1) * n_columns], out[i])


@jitted
def add_rotation(which, sizes, w):
    """Add ω×(M u) for the rates of every quaternion to PUSH."""
    nv, u, force = sizes[at.NV], w.vectors[MEAN], w.vectors[PUSH]
    for k in range(n_quaternions(sizes)):
        j = quaternion_at(sizes, k) - k
        mass = w.masses[which]
        x, y, z = momentum(j, nv, mass, u), momentum(j + 1, nv, mass, u), momentum(j + 2, nv, mass, u)
        force[j] += u[j + 1] * z - u[j + 2] * y
        force[j + 1] += u[j + 2] * x - u[j] * z
        force[j + 2] += u[j] * y - u[j + 1] * x


@jitted
def momentum(i, nv, mass, rates):
    """Return entry `i` of M times `rates`."""
    total = 0.0
    for j in range(nv):
        total += mass[i * nv + j] * rates[j]
    return total
