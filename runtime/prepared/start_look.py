"""Whether a start is as plain as most are, so that a run can begin there without Python.

Python looks at a start in many ways (`constraints/assembly.py`, `checks/inertia.py`): it moves what does not meet the
constraints, looks for branches, names what is wrong. Here is tested, with room to spare, that it would find
nothing; where that fails, Python looks.
"""

import math

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.constraints import branch
from symgen.runtime.constraints.guard_code import NEAR_LIMIT, PIVOT_LIMIT
from symgen.runtime.constraints.row_weights import fill_row_weights, retract
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.loop import copy
from symgen.runtime.integrate.projection import LEAST_USUAL, MOST_USUAL, RESIDUAL_LEFT
from symgen.runtime.integrate.quaternions import scale_to_unit
from symgen.runtime.prepared import layout as here

SATISFIED = 2e-14  # of a constraint's scale: `assembly._SATISFIED`
SLOWEST = 1e-6  # `levels.SLOWEST`
LOST_DIGITS = 5e-10  # half of `kkt._LOST_DIGITS`
LEAST_PIVOT = 1e-6  # of unit rows, of M with unit diagonal: far from what counts as singular
EQUAL = 1e-12  # `energy_level._EQUAL`


@jitted
def look_at_start(loop, plan, look, given_sizes, is_assembled):
    """Look at the state of a loop that is about to run, and set up the guard for it.

    Parameters
    ----------
    given_sizes : ndarray, shape (nv,) or (0,)
        Characteristic sizes; found here if there are none.
    is_assembled : int
        1: the start is known to meet the constraints.

    Returns
    -------
    int
        SUCCESS, NEEDS_ASSEMBLY or NEEDS_PYTHON.
    """
    nq = loop.sizes[at.NQ]
    copy(loop.y[: nq + loop.sizes[at.NV]], look.y)
    for k in range(look.mass.shape[0]):
        look.mass[k] = 0.0  # structural zeros are not written, and factors fill them
    call_kernel(plan.addresses[here.MASS], loop.control[at.T], look.y, loop.p, look.mass)
    if not is_definite(loop.sizes[at.NV], look.mass):
        return here.NEEDS_PYTHON
    if loop.sizes[at.NM] == 0:
        return here.SUCCESS
    sizes = plan.weights[loop.sizes[at.NM] * loop.sizes[at.NV] + loop.sizes[at.NM] :]
    if given_sizes.shape[0] > 0:
        copy(given_sizes, sizes)
    else:
        find_sizes(nq, loop.y, loop.p, look, sizes)
    if not constraints_are_plain(loop, plan, look, sizes):
        return here.NEEDS_PYTHON
    if is_assembled == 0 and not meets_constraints(loop, plan, look, sizes):
        return here.NEEDS_ASSEMBLY
    set_guard(loop, plan, look)
    return here.SUCCESS


@jitted
def is_definite(n, matrix):
    """Whether a symmetric matrix, scaled to a unit diagonal, is positive definite with room to spare; overwrites it.

    Parameters
    ----------
    matrix : ndarray, shape (n * n,)
        Row by row.
    """
    for j in range(n):
        if not (matrix[j * n + j] > 0.0 and math.isfinite(matrix[j * n + j])):
            return False
    for j in range(n):
        size = matrix[j * n + j]
        pivot = size
        for k in range(j):
            pivot -= matrix[j * n + k] * matrix[j * n + k]
        if not pivot > LEAST_PIVOT * size:
            return False
        root = math.sqrt(pivot)
        matrix[j * n + j] = root
        for i in range(j + 1, n):
            total = matrix[i * n + j]
            for k in range(j):
                total -= matrix[i * n + k] * matrix[j * n + k]
            matrix[i * n + j] = total / root
    return True


@jitted
def find_sizes(nq, y, p, look, sizes):
    """Write what counts as large for what each rate moves, as `levels.coordinate_sizes` has it, to `sizes`."""
    largest = look.largest
    for k in range(largest.shape[0]):
        largest[k] = 0.0
    for k in range(look.unit_of_value.shape[0]):
        value = abs(y[k]) if k < nq else abs(p[k - nq])
        unit = look.unit_of_value[k]
        largest[unit] = max(largest[unit], value)
    bare = 1.0
    for k in range(nq):
        if look.is_bare[k]:
            bare = max(bare, abs(y[k]))
    for j in range(sizes.shape[0]):
        unit = look.unit_of_rate[j]
        sizes[j] = (
            1.0 if unit == -1 else bare if unit == -2 else largest[unit] if largest[unit] != 0.0 else 1.0
        )


@jitted
def constraints_are_plain(loop, plan, look, sizes):
    """Whether constraints are independent, and straight-line code solves for them, at the start; writes the weights."""
    nq, nv, m = loop.sizes[at.NQ], loop.sizes[at.NV], loop.sizes[at.NM]
    t = loop.control[at.T]
    for j in range(nv):
        look.y[nq + j] = 0.0
    call_kernel(plan.addresses[here.STRAIGHT_RHS], t, look.y, loop.p, look.row)
    if not look.row[loop.sizes[at.N_ROW] - 1] >= PIVOT_LIMIT:
        return False
    fill_row_weights(
        plan.addresses[here.JACOBIAN], t, loop.y[:nq], loop.p, look.steps, look.quaternions, look.y, look.rows,
        plan.weights, look.squares,
    )  # fmt: skip
    for i in range(m):
        if not look.squares[i] >= NEAR_LIMIT:
            return False
    copy(loop.y[:nq], look.y)
    call_kernel(plan.addresses[here.JACOBIAN], t, look.y, loop.p, look.rows)
    for i in range(m):
        for k in range(i + 1):
            total = 0.0
            for j in range(nv):
                total += look.rows[i * nv + j] * look.rows[k * nv + j] * sizes[j] * sizes[j]
            look.gram[i * m + k] = total
    if not is_definite(m, look.gram):
        return False
    retract(look.quaternions, loop.y[:nq], look.nearby, look.y)
    call_kernel(plan.addresses[here.STRAIGHT_RHS], t, look.y, loop.p, look.row)
    call_kernel(plan.addresses[here.JACOBIAN], t, look.y, loop.p, look.rows)
    call_kernel(plan.addresses[here.GAMMA], t, look.y, loop.p, look.gamma)
    for i in range(m):
        off, size = -look.gamma[i], abs(look.gamma[i])
        for j in range(nv):
            term = look.rows[i * nv + j] * look.row[nq + j]
            off += term
            size += abs(term)
        if not abs(off) <= LOST_DIGITS * size:
            return False
    return True


@jitted
def meets_constraints(loop, plan, look, sizes):
    """Whether assembly would leave the start as it is. The scales are at most those that it takes."""
    nq, nv, nh, m = loop.sizes[at.NQ], loop.sizes[at.NV], loop.sizes[at.NH], loop.sizes[at.NM]
    t = loop.control[at.T]
    copy(loop.y[: nq + nv], look.y)
    call_kernel(plan.addresses[here.JACOBIAN], t, look.y, loop.p, look.rows)
    for j in range(nv):
        look.y[nq + j] = 0.0
    call_kernel(plan.addresses[here.RESIDUAL], t, look.y, loop.p, look.residual)
    for i in range(m):
        look.squares[i] = abs(look.residual[nh + i])  # what is driven
    copy(loop.y[: nq + nv], look.y)
    call_kernel(plan.addresses[here.RESIDUAL], t, look.y, loop.p, look.residual)
    for i in range(m):
        position, velocity = 0.0, look.squares[i]
        for j in range(nv):
            entry = abs(look.rows[i * nv + j])
            position = max(position, entry * sizes[j])
            velocity = max(velocity, entry * abs(loop.y[nq + j]))
        if i < nh and not abs(look.residual[i]) <= SATISFIED * position:
            return False
        if not abs(look.residual[nh + i]) <= SATISFIED * max(velocity, SLOWEST * position):
            return False
    return True


@jitted
def set_guard(loop, plan, look):
    """Say to the guard what `Lease.expect` would say of such a start, and set the tolerance of projections."""
    m, nv = loop.sizes[at.NM], loop.sizes[at.NV]
    plan.guard[branch.USUAL_RANK] = m
    plan.guard[branch.ILL_CONDITIONED] = 0
    plan.guard[branch.NEAR_SINGULAR] = 0
    branch.fill(plan.curve, 0.0)
    least = plan.weights[m * nv]
    for i in range(m):
        least = min(least, plan.weights[m * nv + i])
    size = 1.0 / least
    usual = LEAST_USUAL <= size <= MOST_USUAL
    loop.control[at.PROJECTION_TOL] = RESIDUAL_LEFT * (1.0 if usual else size * size)


@jitted
def energy_can_be_kept(loop, plan, look):
    """Whether the energy of the start can be scaled to: what `energy_level.choose_energy_level` asks of the state."""
    nq, nv = loop.sizes[at.NQ], loop.sizes[at.NV]
    size = 0.0
    for j in range(nv):
        size = max(size, abs(loop.y[nq + j]))
    size = size if size > 0.0 else 1.0
    if loop.sizes[at.NW] > 0 and not powers_are_constant(loop, plan, look, size):
        return False
    copy(loop.y[:nq], look.y)
    for trial in range(2):
        for j in range(nv):
            look.y[nq + j] = size * look.turning[0, j] if trial else loop.y[nq + j]
        call_kernel(plan.addresses[here.ENERGY], loop.control[at.T], look.y, loop.p, look.energy)
        once = look.energy[0]
        for j in range(nv):
            look.y[nq + j] *= 2.0
        call_kernel(plan.addresses[here.ENERGY], loop.control[at.T], look.y, loop.p, look.energy)
        if not abs(look.energy[0] - 4.0 * once) <= EQUAL * abs(look.energy[0]):
            return False
    return True


@jitted
def powers_are_constant(loop, plan, look, size):
    """Whether the power of what has no potential is linear in the rates, and the same at all places."""
    nq, nv = loop.sizes[at.NQ], loop.sizes[at.NV]
    power_1 = power_2 = power_3 = power_4 = 0.0
    for trial in range(4):
        copy(loop.y[:nq], look.y)
        if trial > 0:
            for k in range(nq):
                look.y[k] += look.places[trial - 1, k]
        scale_to_unit(loop.sizes, look.y)
        for j in range(nv):
            one, two = size * look.turning[1, j], size * look.turning[2, j]
            look.y[nq + j] = (
                one if trial == 0 else two if trial == 1 else one + two if trial == 2 else 2.0 * one
            )
        call_kernel(plan.addresses[here.STRAIGHT_RHS], loop.control[at.T], look.y, loop.p, look.row)
        power = look.row[nq + nv]
        if trial == 0:
            power_1 = power
        elif trial == 1:
            power_2 = power
        elif trial == 2:
            power_3 = power
        else:
            power_4 = power
    largest = max(max(abs(power_1), abs(power_2)), max(abs(power_3), abs(power_4)))
    off = max(abs(power_1 + power_2 - power_3), abs(2.0 * power_1 - power_4))
    return off <= EQUAL * largest
