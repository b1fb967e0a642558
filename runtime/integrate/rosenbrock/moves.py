"""What rates move in a step of rodas5p: coordinates by increments, quaternions by rotation vectors from its start."""

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate.layout import NQ, NV
from symgen.runtime.integrate.quaternions import (
    chart_rate,
    n_quaternions,
    quaternion_at,
    rotate,
)
from symgen.runtime.integrate.radau.turns import add_turn, solve_turns
from symgen.runtime.integrate.rosenbrock.coefficients import N_STAGES, PLACES
from symgen.runtime.integrate.rosenbrock.work import STAGE, Y_STAGE


@jitted
def place(weights, n, sizes, y, w, out):
    """Write (q, v) of `y`, moved by the first `n` increments with their weights, to `out`."""
    nq, nv = sizes[NQ], sizes[NV]
    if nq == nv:  # loops from 0 need no checks of their indexes
        for i in range(2 * nv):
            out[i] = y[i] + weighted(weights, n, i, w)
        return
    start = 0
    for k in range(n_quaternions(sizes) + 1):
        end = quaternion_at(sizes, k)
        for i in range(start, end):
            j = nq + i - k
            out[i] = y[i] + weighted(weights, n, i - k, w)
            out[j] = y[j] + weighted(weights, n, nv + i - k, w)
        if end < nq:
            j = end - k
            a, b, c = turn(weights, n, j, w)
            rotate(y, end, a, b, c, out)
            for i in range(j, j + 3):
                out[nq + i] = y[nq + i] + weighted(weights, n, nv + i, w)
        start = end + 4


@jitted
def weighted(weights, n, i, w):
    """Return what entry `i` of the first `n` increments amounts to."""
    total = 0.0
    for j in range(n):
        total += weights[j] * w.increments[j, i]
    return total


@jitted
def turn(weights, n, j, w):
    """Return the rotation vector that the entries from `j` on of the first `n` increments amount to."""
    return weighted(weights, n, j, w), weighted(weights, n, j + 1, w), weighted(weights, n, j + 2, w)


@jitted
def stage_rates(s, method, h, sizes, y, w, out):
    """Write the derivatives at stage `s`, plus what the increments before it add to them, to `out`.

    Those of positions are divided by g = 1/(h γ), those of rotation vectors by g + ω× / 2.
    """
    nq, nv, row, couplings, g = (
        sizes[NQ],
        sizes[NV],
        w.rows[STAGE],
        method.couplings[s],
        1.0 / (h * method.gamma),
    )
    if nq == nv:
        for i in range(nv):
            out[i] = (row[i] + weighted(couplings, s, i, w) / h) / g
            out[nv + i] = row[nv + i] + weighted(couplings, s, nv + i, w) / h
        return
    start = 0
    for k in range(n_quaternions(sizes) + 1):
        end = quaternion_at(sizes, k)
        for i in range(start, end):
            j = i - k
            out[j] = (row[i] + weighted(couplings, s, j, w) / h) / g
            out[nv + j] = row[nq + j] + weighted(couplings, s, nv + j, w) / h
        if end < nq:
            j = end - k
            # The first stage is at the start of the step.
            z = w.states[Y_STAGE] if s > 0 else y
            a, b, c = turn(method.a[s], s, j, w)
            rates = chart_rate(a, b, c, z[nq + j], z[nq + j + 1], z[nq + j + 2])
            for axis in range(3):
                i = j + axis
                out[i] = rates[axis] + weighted(couplings, s, i, w) / h
                out[nv + i] = row[nq + i] + weighted(couplings, s, nv + i, w) / h
            solve_turns(g, j, nq + j, y, out)
        start = end + 4


@jitted
def add_divided_rates(g, sizes, y, increment):
    """Add the rates' part of an increment, divided likewise, to the positions' part."""
    nv, start = sizes[NV], 0
    if sizes[NQ] == nv:
        for i in range(nv):
            increment[i] += increment[nv + i] / g
        return
    for k in range(n_quaternions(sizes) + 1):
        end = quaternion_at(sizes, k) - k
        for i in range(start, end):
            increment[i] += increment[nv + i] / g
        if end < nv:
            add_turn(g, end, nv + end, sizes[NQ] + end, y, increment)
        start = end + 3


@jitted
def bend(method, r, i, w):
    """Return row `2 + r` of the dense output of entry `i` of the increments."""
    total = 0.0
    for s in range(N_STAGES):
        total += method.dense[r, s] * w.increments[s, i]
    return total


@jitted
def turn_dense(method, i, j, y, w, dense):
    """Write rows 2 to 4 of the quaternion at `i`: a quartic through what its rotation vector, at `j`, makes of it.

    Without the part that projection has moved, which the caller has added.
    """
    turned, ends = w.states[Y_STAGE], turn(method.end, N_STAGES, j, w)
    rotate(y, i, ends[0], ends[1], ends[2], turned)
    change = turned[i] - y[i], turned[i + 1] - y[i + 1], turned[i + 2] - y[i + 2], turned[i + 3] - y[i + 3]
    for r in range(3):
        for e in range(i, i + 4):
            dense[2 + r, e] = 0.0
    for c in range(3):
        x = PLACES[c]
        a, b = turn_at(method, x, ends[0], j, w), turn_at(method, x, ends[1], j + 1, w)
        rotate(y, i, a, b, turn_at(method, x, ends[2], j + 2, w), turned)
        for e in range(i, i + 4):
            off = turned[e] - y[e] - x * change[e - i]
            for r in range(3):
                dense[2 + r, e] += method.turns[r, c] * off


@jitted
def turn_at(method, x, end, j, w):
    """Return the rotation, in entry `j` of the increments, after the part `x` of the step; `end` is that of all."""
    bent = bend(method, 0, j, w) + x * (bend(method, 1, j, w) + (1.0 - x) * bend(method, 2, j, w))
    return x * (end + (1.0 - x) * bent)
