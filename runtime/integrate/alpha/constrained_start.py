"""What the generalised-α method starts from, so that no order is lost in the first steps."""

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.alpha.constrained import guess_start
from symgen.runtime.integrate.alpha.constrained_work import (
    ACCELERATION,
    AVERAGE,
    HAVE_FACTORS,
    HAVE_START,
    NEW_ACCELERATION,
    NEW_AVERAGE,
    RATE,
    START,
    STARTED_FOR,
)
from symgen.runtime.integrate.evaluation import evaluate
from symgen.runtime.integrate.quaternions import n_quaternions, quaternion_at, retract
from symgen.runtime.integrate.saddle import factor, solve

# Of the step: how far accelerations are looked at on either side of the start.
_REACH = 0.05


@jitted
def start(method, h, loop, t, w):
    """Set A, a, v and λ for steps of length `h` from the state `y`, whose rhs row is `f`; returns a status.

    A runs behind a by (α_f - α_m) h. In index-3 form the formula for positions misses h³ c a', and the turn of a
    quaternion by h³ ω×ω'/12 besides, which constraints make up for in the velocities across them, by 1/h of that in
    the long run: those that start without it shake the multipliers by O(h) (Arnold, Brüls, Cardona, Numer. Math. 129
    (2015) 149).
    """
    nq, nv, m = loop.sizes[at.NQ], loop.sizes[at.NV], loop.sizes[at.NM]
    status = jerk(h, loop, t, w)
    if status != at.RUNNING:
        return status
    lead = method.alpha_m - method.alpha_f
    for i in range(nv):
        w.vectors[ACCELERATION, i] = loop.f[nq + i]
        w.vectors[AVERAGE, i] = loop.f[nq + i] + lead * h * w.vectors[NEW_AVERAGE, i]
        w.vectors[RATE, i] = loop.y[nq + i]
    for k in range(m):
        w.multipliers[START, k] = loop.f[nq + nv + loop.sizes[at.NW] + k]
    if not method.stabilised:
        for i in range(nv):
            w.vectors[NEW_AVERAGE, i] *= 1.0 / 6.0 - 0.5 * lead - method.beta
        add_rotations_missed(loop.sizes, loop.y, loop.f, w.vectors[NEW_AVERAGE])
        status = lean_rates(h * h, loop, t, w)
    guess_start(loop.sizes, w)
    w.numbers[STARTED_FOR] = h
    loop.counters[HAVE_START], loop.counters[HAVE_FACTORS] = 1, 0
    return status


@jitted
def jerk(h, loop, t, w):
    """Write the derivative of the accelerations along the motion to NEW_AVERAGE; returns a status."""
    nq, nv = loop.sizes[at.NQ], loop.sizes[at.NV]
    reach = _REACH * h
    for side in range(2):
        shift = reach if side == 0 else -reach
        retract(loop.sizes, loop.y, shift, loop.y, nq, w.y_new)
        for i in range(nq, loop.y.shape[0]):
            w.y_new[i] = loop.y[i] + shift * loop.f[i]
        if not evaluate(loop, t + shift, w.y_new, w.row):
            return at.NOT_FINITE
        for i in range(nv):
            if side == 0:
                w.vectors[NEW_ACCELERATION, i] = w.row[nq + i]
            else:
                w.vectors[NEW_AVERAGE, i] = (w.vectors[NEW_ACCELERATION, i] - w.row[nq + i]) / (2.0 * reach)
    return at.RUNNING


@jitted
def add_rotations_missed(sizes, y, f, missed):
    """Add ω×ω'/12 for every quaternion: Magnus' series of a turn, whose rate changes its axis."""
    for k in range(n_quaternions(sizes)):
        j = quaternion_at(sizes, k) - k
        i = sizes[at.NQ] + j
        missed[j] += (y[i + 1] * f[i + 2] - y[i + 2] * f[i + 1]) / 12.0
        missed[j + 1] += (y[i + 2] * f[i] - y[i] * f[i + 2]) / 12.0
        missed[j + 2] += (y[i] * f[i + 1] - y[i + 1] * f[i]) / 12.0


@jitted
def lean_rates(amount, loop, t, w):
    """Add `amount` times NEW_AVERAGE, the part across the holonomic constraints, to the rates; returns a status."""
    nv, m = loop.sizes[at.NV], loop.sizes[at.NM]
    mass = w.derivative[: nv * nv]
    for i in range(nv * nv):
        mass[i] = 0.0
    call_kernel(loop.addresses[at.MASS_MATRIX], t, loop.y, loop.p, mass)
    call_kernel(loop.addresses[at.CONSTRAINT_JACOBIAN], t, loop.y, loop.p, w.gradient)
    for i in range(nv + m):
        w.right[i, 0] = 0.0
        for j in range(nv + m):
            w.matrix[i, j] = 0.0
    for i in range(nv):
        for j in range(nv):
            w.matrix[i, j] = mass[i * nv + j]
    for k in range(m):
        for i in range(nv):
            w.matrix[nv + k, i] = w.gradient[k * nv + i]
            w.matrix[i, nv + k] = w.gradient[k * nv + i]
            if k < loop.sizes[at.NH]:
                w.right[nv + k, 0] += w.gradient[k * nv + i] * w.vectors[NEW_AVERAGE, i]
    status = solve(factor(loop.counters, w), nv, w)
    for i in range(nv):
        w.vectors[RATE, i] += amount * w.right[i, 0]
    for i in range(w.derivative.shape[0]):
        w.derivative[i] = 0.0
    return status
