"""Constraints of index-2 equations that depend on others: left idle, so that Newton's matrices stay regular."""

import math

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.row_rank import independent_rows


@jitted
def leave_open(sizes, b, w):
    """Take constraints that are switched off (λ = 0 instead) off the derivatives; returns how many there are."""
    nv, n_off = sizes[at.NV], 0
    for k in range(sizes[at.NM]):
        if w.block[nv + k, nv + k] != 0.0:
            n_off += 1
            b.idle[k] = 1.0
            for j in range(nv):
                b.gradients[k, j] = b.rotated_gradients[k, j] = b.reactions[j, k] = 0.0
    return n_off


@jitted
def leave_idle(sizes, b, w):
    """Take constraints that depend on others off the derivatives and `w.block`; returns how many there are."""
    nv, m, nh = sizes[at.NV], sizes[at.NM], sizes[at.NH]
    scaled = w.right[:m, :nv]
    scale_gradients(sizes, b, scaled)
    rows, columns = w.pivots[:m], w.pivots[m:]
    _, rank, _ = independent_rows(nh, scaled, rows, columns)
    for r in range(rank, m):
        b.idle[rows[r]] = 1.0
    for i in range(nv + m):
        for j in range(nv + m):
            w.block[i, j] = 0.0
    for k in range(m):
        if b.idle[k] == 1.0:
            w.block[nv + k, nv + k] = 1.0
            for j in range(nv):
                b.gradients[k, j] = b.rotated_gradients[k, j] = b.reactions[j, k] = 0.0
    for i in range(nv):
        for j in range(nv):
            w.block[i, j] = b.mass[i, j]
        for k in range(m):
            w.block[i, nv + k] = b.reactions[i, k]
            w.block[nv + k, i] = b.gradients[k, i]
    return m - rank


@jitted
def scale_gradients(sizes, b, scaled):
    """Write G with columns in units of equal kinetic energy, rows in units of their largest entry."""
    nv, heaviest = sizes[at.NV], 0.0
    for j in range(nv):
        heaviest = max(heaviest, b.mass[j, j])
    for k in range(sizes[at.NM]):
        largest = 0.0
        for j in range(nv):
            inertia = max(b.mass[j, j], 1e-6 * heaviest)
            scaled[k, j] = b.gradients[k, j] / math.sqrt(inertia) if inertia > 0.0 else b.gradients[k, j]
            largest = max(largest, abs(scaled[k, j]))
        for j in range(nv):
            scaled[k, j] /= largest if largest > 0.0 else 1.0
