"""Solve M a = f + Gᵀλ, G a = γ when the rows of G may depend on each other.

M is factored by Cholesky, S = G M⁻¹ Gᵀ by Cholesky with diagonal pivoting, stopped at the rank. `a` comes
from a set of independent rows; the multipliers are those of least norm among all that give this `a`.
"""

from __future__ import annotations

import math

from symgen.runtime.code.jitted import jitted

# Relative to the largest pivot of S with its diagonal scaled to 1. A value that follows the integration's
# tolerance makes most runs through a change point fail.
RANK_TOLERANCE = 1e-4
# Of the largest pivot: a row that comes first stays first. Off the constraints each choice of independent rows gives
# other accelerations, so that an order that follows round-off makes them jump between the stages of a step.
_NEARLY_AS_LARGE = 0.1
_SINGULAR_MASS = 1e-12
_TINY_INERTIA = 1e-8  # of the largest: where a constraint carries the coordinate, as many digits are lost


@jitted
def cholesky(a, n):
    """Replace the lower triangle of the leading n × n block by its Cholesky factor; False if indefinite."""
    for j in range(n):
        largest = a[j, j]
        for k in range(j):
            a[j, j] -= a[j, k] * a[j, k]
        if not a[j, j] > _SINGULAR_MASS * abs(largest):
            return False
        a[j, j] = math.sqrt(a[j, j])
        for i in range(j + 1, n):
            for k in range(j):
                a[i, j] -= a[i, k] * a[j, k]
            a[i, j] /= a[j, j]
    return True


@jitted
def forward_substitution(lower, n, x):
    """Replace x by L⁻¹x."""
    for i in range(n):
        for k in range(i):
            x[i] -= lower[i, k] * x[k]
        x[i] /= lower[i, i]


@jitted
def back_substitution(lower, n, x):
    """Replace x by L⁻ᵀx."""
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            x[i] -= lower[k, i] * x[k]
        x[i] /= lower[i, i]


@jitted
def factor_mass(mass, kept, jacobian):
    """Factor M in place; if (nearly) singular, M + s GᵀG, which has the same solution once s Gᵀγ is added to f.

    Returns s (0 when M is definite), or nan when that is singular too: the motion is not determined. `kept` is a
    buffer as large as M.
    """
    n, m = mass.shape[0], jacobian.shape[0]
    for i in range(n):
        for j in range(n):
            kept[i, j] = mass[i, j]
    least, most = math.inf, 0.0
    for i in range(n):
        least, most = min(least, kept[i, i]), max(most, kept[i, i])
    if least > _TINY_INERTIA * most and cholesky(mass, n):
        return 0.0
    trace_mass, trace_g = 0.0, 0.0
    for i in range(n):
        trace_mass += abs(kept[i, i])
        for k in range(m):
            trace_g += jacobian[k, i] * jacobian[k, i]
    shift = (trace_mass if trace_mass > 0.0 else 1.0) / trace_g
    for i in range(n):
        for j in range(n):
            for k in range(m):
                kept[i, j] += shift * jacobian[k, i] * jacobian[k, j]
            mass[i, j] = kept[i, j]
    if cholesky(mass, n):
        return shift
    for i in range(n):
        for j in range(n):
            mass[i, j] = kept[i, j]
            for k in range(m):
                mass[i, j] -= shift * jacobian[k, i] * jacobian[k, j]
    return 0.0 if least > 0.0 and cholesky(mass, n) else math.nan


@jitted
def factor_constraints(lower_mass, jacobian, sizes, tolerance, z, lower, order, scale):
    """Factor E S E with pivoting, E = diag(scale); return the rank and the ratio of last to first pivot.

    Parameters
    ----------
    lower_mass : ndarray, shape (n, n)
        Cholesky factor of M.
    jacobian : ndarray, shape (m, n)
    sizes : ndarray, shape (m,)
        How large each row of the Jacobian is compared with what it is nearby, squared, at most 1.
    tolerance : float
        Pivots below this part of the first count as zero.
    z : ndarray, shape (m, n)
        Written: the transpose of L⁻¹Gᵀ.
    lower : ndarray, shape (m, m)
        Written: the factor, rows in the order of the pivots.
    order : ndarray of int64, shape (m,)
        Written: which constraint each pivot is.
    scale : ndarray, shape (m,)
        Written: makes the diagonal of S `sizes`, so that units of constraints do not matter, and a row that vanishes
        is seen.
    """
    m, n = z.shape
    trace = 0.0
    for j in range(m):
        for k in range(n):
            z[j, k] = jacobian[j, k]
        forward_substitution(lower_mass, n, z[j])
        square = 0.0
        for k in range(n):
            square += z[j, k] * z[j, k]
        scale[j] = math.sqrt(sizes[j] / square) if square != 0.0 else 1.0
        order[j] = j
        trace += square
    if not math.isfinite(trace):
        # Comparisons with nan would call these rows dependent, and lose them.
        for i in range(m):
            for j in range(m):
                lower[i, j] = math.nan
        return m, math.nan
    for i in range(m):
        for j in range(i + 1):
            total = 0.0
            for k in range(n):
                total += z[i, k] * z[j, k]
            lower[i, j] = total * scale[i] * scale[j]
            lower[j, i] = lower[i, j]
    ratio, first = 0.0, 0.0
    for k in range(m):
        best = k
        for i in range(k + 1, m):
            if lower[i, i] > lower[best, best]:
                best = i
        if k == 0:
            first = lower[best, best]
        pivot = best
        if lower[k, k] > max(_NEARLY_AS_LARGE * lower[best, best], tolerance * first):
            pivot = k
        value = lower[pivot, pivot]
        if not (value > tolerance * first and value > 0.0):
            return k, ratio
        ratio = value / first
        _swap(lower, order, k, pivot)
        root = math.sqrt(value)
        lower[k, k] = root
        for i in range(k + 1, m):
            lower[i, k] /= root
        for j in range(k + 1, m):
            for i in range(j, m):
                lower[i, j] -= lower[i, k] * lower[j, k]
                lower[j, i] = lower[i, j]
    return m, ratio


@jitted
def truncated(lower, rank, tolerance):
    """Return rank and ratio of last to first pivot as `factor_constraints` would have with another tolerance."""
    first = lower[0, 0] ** 2
    ratio = 0.0
    for k in range(rank):
        value = lower[k, k] ** 2
        if not value > tolerance * first:
            return k, ratio
        ratio = value / first
    return rank, ratio


@jitted
def least_pivot(lower, rank, x):
    """Return the least that any of the independent rows leaves for a pivot if it comes last: 1 / max diag((E S E)⁻¹).

    Other than the last pivot this does not jump when the order of the pivots changes. `x` is a buffer of `rank`.
    """
    largest = 0.0
    for i in range(rank):
        for k in range(rank):
            x[k] = 1.0 if k == i else 0.0
        forward_substitution(lower, rank, x)
        total = 0.0
        for k in range(i, rank):
            total += x[k] * x[k]
        largest = max(largest, total)
    return 1.0 / largest if largest > 0.0 else 0.0


@jitted
def _swap(lower, order, k, pivot):
    """Exchange rows and columns k and pivot: of the finished columns their rows, of the rest both."""
    if pivot == k:
        return
    m = order.shape[0]
    order[k], order[pivot] = order[pivot], order[k]
    for j in range(m):
        lower[k, j], lower[pivot, j] = lower[pivot, j], lower[k, j]
    for i in range(k, m):
        lower[i, k], lower[i, pivot] = lower[i, pivot], lower[i, k]


@jitted
def buffer_size(m):
    """Length of the buffer of `constrained_solve`."""
    return m + 2 * m * m


@jitted
def constrained_solve(b, rank):
    """Solve for `b.step` and `b.multipliers` with the factors above and `b.forces`, `b.target` on the right.

    `b` is a `branch.Buffers`. `b.forces` (with s Gᵀγ in it if M was singular) is overwritten.
    """
    lower_mass, z, lower, order, scale = b.mass, b.z, b.lower, b.order, b.scale
    f, gamma, a, multipliers = b.forces, b.target, b.step, b.multipliers
    m, n = z.shape
    basic = b.solver[:m]
    forward_substitution(lower_mass, n, f)
    for j in range(m):
        multipliers[j] = 0.0
    for i in range(rank):
        j = order[i]
        basic[i] = gamma[j]
        for k in range(n):
            basic[i] -= z[j, k] * f[k]
        basic[i] *= scale[j]
    forward_substitution(lower, rank, basic)
    back_substitution(lower, rank, basic)
    for k in range(n):
        a[k] = f[k]
    for i in range(rank):
        j = order[i]
        multipliers[j] = basic[i] * scale[j]
        for k in range(n):
            a[k] += z[j, k] * multipliers[j]
    back_substitution(lower_mass, n, a)
    if 0 < rank < m:
        _least_norm(lower, order, scale, rank, multipliers, b.solver)


@jitted
def _least_norm(lower, order, scale, rank, multipliers, buffer):
    """Take from the multipliers their part in the null space of Gᵀ."""
    m = order.shape[0]
    free = m - rank
    part = buffer[:m]
    null = buffer[m:][: free * m].reshape((free, m))  # rows span the null space
    gram = buffer[m + m * m :][: free * free].reshape((free, free))
    for c in range(free):
        row = null[c]
        for k in range(m):
            row[k] = -lower[rank + c, k] if k < rank else 0.0
        back_substitution(lower, rank, row)
        row[rank + c] = 1.0
        for k in range(m):
            row[k] *= scale[order[k]]
    for c in range(free):
        for d in range(free):
            gram[c, d] = 0.0
            for k in range(m):
                gram[c, d] += null[c, k] * null[d, k]
    cholesky(gram, free)
    for _ in range(2):  # rows of very different scales leave too much after once
        for c in range(free):
            part[c] = 0.0
            for k in range(m):
                part[c] += null[c, k] * multipliers[order[k]]
        forward_substitution(gram, free, part)
        back_substitution(gram, free, part)
        for c in range(free):
            for k in range(m):
                multipliers[order[k]] -= null[c, k] * part[c]
