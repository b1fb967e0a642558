"""Newton's iteration for the stages of the Gauss methods: a system of the size of v for each eigenvalue of a."""

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.gauss.work import FACTORED_FOR, HAVE_FACTORS
from symgen.runtime.integrate.linear import lu_factor, lu_solve
from symgen.runtime.integrate.quaternions import n_quaternions, quaternion_at, solve_rotation


@jitted
def factor_stages(method, h, loop, y, w):
    """Factor the Newton matrix of every eigenvalue, unless that was done for steps of length `h`.

    With g = hλ it is 1 - g ∂a/∂v - g² ∂a/∂q, where a quaternion's g² is g times the inverse of 1/g + ω× / 2.
    """
    if loop.counters[HAVE_FACTORS] and w.numbers[FACTORED_FOR] == h:
        return at.RUNNING
    nv = w.jacobian.shape[0]
    for k in range(method.eigenvalues.shape[0]):
        g = h * method.eigenvalues[k]
        for i in range(nv):
            for j in range(nv):
                w.matrices[k, i, j] = -g * (w.jacobian[i, nv + j] + g * w.jacobian[i, j])
            w.matrices[k, i, i] += 1.0
        for n in range(n_quaternions(loop.sizes)):
            j = quaternion_at(loop.sizes, n) - n
            factor_rotations(g, j, loop.sizes[at.NQ] + j, y, w.jacobian, w.matrices[k])
        status = lu_factor(w.matrices[k], w.pivots[k])
        if status != at.RUNNING:
            return status
    loop.counters[at.FACTORISATIONS] += 1
    loop.counters[HAVE_FACTORS] = 1
    w.numbers[FACTORED_FOR] = h
    return at.RUNNING


@jitted
def factor_rotations(g, j, first, y, jacobian, matrix):
    """Make the columns from `j` on, of the rates of a quaternion, which are in `y` from `first`."""
    a, b, c = -y[first], -y[first + 1], -y[first + 2]
    for i in range(matrix.shape[0]):
        # A row times the inverse of a matrix: the inverse of its transpose, which turns the other way.
        turned = solve_rotation(1.0 / g, a, b, c, jacobian[i, j], jacobian[i, j + 1], jacobian[i, j + 2])
        for axis in range(3):
            matrix[i, j + axis] += g * (g * jacobian[i, j + axis] - turned[axis])


@jitted
def correct_by_newton(method, h, sizes, w):
    """Correct the impulses by simplified Newton in the eigenvectors of a, a system of size nv for each eigenvalue."""
    n, nq, nv = method.c.shape[0], sizes[at.NQ], sizes[at.NV]
    for i in range(nv):
        for s in range(n):
            w.sums[i, s] = 0.0
    for k in range(method.eigenvalues.shape[0]):
        for i in range(nv):
            total = complex(0.0, 0.0)
            for s in range(n):
                defect = w.rows[s, nq + i] - w.impulses[i, s] / (h * method.b[s])
                total += method.from_stages[k, s] * defect
            w.complex[i] = total
        lu_solve(w.matrices[k], w.pivots[k], w.complex)
        for i in range(nv):
            for s in range(n):
                x = method.to_stages[s, k] * w.complex[i]
                w.sums[i, s] += x.real
    for i in range(nv):
        largest = 0.0
        for s in range(n):
            change = h * method.b[s] * w.sums[i, s]
            largest = max(largest, abs(change))
            w.impulses[i, s] += change
        w.change[i] = largest
