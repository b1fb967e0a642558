"""What functions of a model leave of the equations in `residual`, in machine code; see `equations.py`."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate.loop import copy
from symgen.runtime.sampling import quasi_random

if TYPE_CHECKING:
    from symgen.runtime.system import System

PROBES = 2  # of other accelerations and multipliers
CHANGES, CHANGE = (
    2,
    1e-5,
)  # relative, of all that enters, to see how large the terms are of which sums are made
LEAST_RATIO = (
    1e-6  # of pivots; below, equations of constraints may contradict each other within their tolerance
)
# Size of terms, of the largest in other equations, below which there is nothing but round-off.
SMALLEST = 1e-6
FUNCTIONS = ("rhs", "rhs", "mass_matrix", "forces", "gamma", "constraint_jacobian")
RHS, MOVES, MASS, FORCES, GAMMA, JACOBIAN = range(len(FUNCTIONS))


class Held(NamedTuple):
    """The equations of a model at up to k states, and what looking at them takes.

    `residual` is linear in accelerations and multipliers, so what it makes of some of them shows M, G and γ as well.

    Attributes
    ----------
    addresses : ndarray of uint64
        Of `residual`, in the place of `rhs`, and of the other `FUNCTIONS`; 0 of what is not looked at.
    sizes : ndarray of int64
        nq, nv, m, ny, and how many states there are.
    times, states : ndarray, shapes (k,), (k, nq + nv) [s]
    rows : ndarray, shape (1 + CHANGES, k, n_row)
        What `rhs` says of the states, and of the `changed` ones.
    changed, changed_p : ndarray, shapes (CHANGES, k, nq + nv), (CHANGES, n_precomputed)
        Slightly other states and parameters.
    p : ndarray, shape (n_precomputed,)
    moves : ndarray, shape (k, nq)
        Derivatives of the coordinates, as quaternions are turned.
    numbers, numbers_m : ndarray, shapes (PROBES, nv), (PROBES, m)
        Weights between -1 and 1: terms that cancel do so no more with other weights.
    dependent : ndarray, shape (m,)
        1.0 for constraints that depend on others.
    worst : ndarray, shape (1,)
        The largest that is left of an equation, in parts of its terms.
    where : ndarray of int64, shape (3,)
        The function, the equation and the state of that; -1 if nothing is left.
    place : ndarray, shape (nq + nv + nv + m,)
        What `residual` is asked for: a state, accelerations, multipliers.
    probes, made : ndarray, shapes (1 + PROBES, nv), (1 + PROBES, nv + m)
        Accelerations, and what they add to the equations.
    zero, left, inertia : ndarray, shape (nv + m,)
        What `residual` says of no accelerations and multipliers, of those of `rhs`, of accelerations of size one.
    scale, part, change : ndarray, shape (nv + m,)
        The size of the terms of each equation; scratch.
    of_mass, of_jacobian : ndarray, shapes (nv * nv,), (m * nv,)
    """

    addresses: np.ndarray
    sizes: np.ndarray
    times: np.ndarray
    states: np.ndarray
    rows: np.ndarray
    changed: np.ndarray
    changed_p: np.ndarray
    p: np.ndarray
    moves: np.ndarray
    numbers: np.ndarray
    numbers_m: np.ndarray
    dependent: np.ndarray
    worst: np.ndarray
    where: np.ndarray
    place: np.ndarray
    probes: np.ndarray
    made: np.ndarray
    zero: np.ndarray
    left: np.ndarray
    inertia: np.ndarray
    scale: np.ndarray
    part: np.ndarray
    change: np.ndarray
    of_mass: np.ndarray
    of_jacobian: np.ndarray


def make_held(system: System, k: int, n_precomputed: int, largest_matrix: int) -> Held:
    """Return the arrays for up to k states of a model; those of matrices where there are no more rates than that."""
    nq, nv, m, n = system.nq, system.nv, system.m, system.nq + system.nv
    dependent = np.zeros(m)
    dependent[list(system.dependent)] = 1.0
    has_matrices = nv <= largest_matrix
    return Held(
        np.zeros(len(FUNCTIONS), dtype=np.uint64), np.array([nq, nv, m, system.ny, 0]), np.zeros(k), np.zeros((k, n)),
        np.zeros((1 + CHANGES, k, system.n_row)), np.zeros((CHANGES, k, n)), np.zeros((CHANGES, n_precomputed)),
        np.zeros(n_precomputed), np.zeros((k, nq)), _weights(nv), _weights(m), dependent, np.zeros(1),
        np.zeros(3, dtype=np.int64), np.zeros(n + nv + m), np.zeros((1 + PROBES, nv)), np.zeros((1 + PROBES, nv + m)),
        *(np.zeros(nv + m) for _ in range(6)), np.zeros(nv * nv * has_matrices), np.zeros(m * nv * has_matrices),
    )  # fmt: skip


def _weights(n: int) -> np.ndarray:
    """Return weights for n numbers, shape (PROBES, n)."""
    return quasi_random(PROBES * n).reshape(PROBES, n).copy()


@jitted
def hold_equations(held):
    """Write to `worst` and `where` which equation least holds; returns 0."""
    held.worst[0] = 0.0
    held.where[:] = -1
    for i in range(held.sizes[4]):
        find_terms(held, i)
        find_changes(held, i)
        compare_rows(held, i)
        if held.addresses[MASS] != 0:
            compare_matrix(held, i, MASS, held.of_mass, 0)
        if held.addresses[FORCES] != 0:
            compare_vector(held, i, FORCES, 0)
        if held.addresses[GAMMA] != 0:
            compare_vector(held, i, GAMMA, held.sizes[1])
        if held.addresses[JACOBIAN] != 0:
            compare_matrix(held, i, JACOBIAN, held.of_jacobian, held.sizes[1])
    return 0


@jitted
def find_terms(held, i):
    """Find what is left of the equations, and the size of their terms, by accelerations and multipliers one by one."""
    nq, nv, m, ny = held.sizes[0], held.sizes[1], held.sizes[2], held.sizes[3]
    row = held.rows[0, i]
    a, lam = row[nq : nq + nv], row[ny : ny + m]
    copy(held.states[i], held.place)
    put(held, a, 0.0, lam, 0.0)
    find_residual(held, i, held.p, held.zero)
    put(held, a, 1.0, lam, 1.0)
    find_residual(held, i, held.p, held.left)
    for j in range(nv + m):
        held.scale[j] = 0.0
    for k in range(held.probes.shape[0]):
        for j in range(nv):
            held.probes[k, j] = a[j] if k == 0 else held.numbers[k - 1, j] * a[j]
        put(held, held.probes[k], 1.0, lam, 0.0)
        find_residual(held, i, held.p, held.part)
        for j in range(nv + m):
            held.made[k, j] = held.part[j] - held.zero[j]
            held.scale[j] += abs(held.made[k, j])
    if m > 0:
        for k in range(held.probes.shape[0]):
            put(held, a, 0.0, lam, 1.0)
            if k > 0:
                for j in range(m):
                    held.place[nq + 2 * nv + j] *= held.numbers_m[k - 1, j]
            find_residual(held, i, held.p, held.part)
            for j in range(nv + m):
                held.scale[j] += abs(held.part[j] - held.zero[j])
    put(held, held.numbers[0], 1.0, lam, 0.0)
    find_residual(held, i, held.p, held.inertia)
    for j in range(nv + m):
        held.inertia[j] -= held.zero[j]
        held.scale[j] += abs(held.zero[j])


@jitted
def find_changes(held, i):
    """Let the size of each equation's terms be what small relative changes of all that enters make of it as well.

    Forces in balance are sums of terms that are larger, and solutions of nearly singular equations have more
    round-off. What constraints hold is what is left of forces that would change each rate alone.
    """
    nq, nv, m, ny = held.sizes[0], held.sizes[1], held.sizes[2], held.sizes[3]
    for k in range(held.changed.shape[0]):
        row = held.rows[1 + k, i]
        copy(held.changed[k, i], held.place)
        put(held, row, 0.0, row, 0.0)
        find_residual(held, i, held.changed_p[k], held.part)
        for j in range(nv + m):
            held.change[j] = abs(held.part[j] - held.zero[j])
        copy(held.states[i], held.place)
        put(held, row[nq : nq + nv], 1.0, row[ny : ny + m], 1.0)
        find_residual(held, i, held.p, held.part)
        for j in range(nv + m):
            change = held.change[j] + abs(held.part[j] - held.left[j])
            if math.isfinite(change):
                held.scale[j] += change / CHANGE
    if m > 0:
        for k in range(held.numbers.shape[0]):
            for j in range(nv):
                mass = abs(held.inertia[j]) / abs(held.numbers[0, j])
                free = held.scale[j] / mass if mass > 0.0 else 0.0
                held.place[nq + nv + j] = held.numbers[k, j] * free
            for j in range(m):
                held.place[nq + 2 * nv + j] = 0.0
            find_residual(held, i, held.p, held.part)
            for j in range(nv, nv + m):
                held.scale[j] += abs(held.part[j] - held.zero[j])
    raise_to_part(held.scale[:nv])
    raise_to_part(held.scale[nv:])


@jitted
def compare_rows(held, i):
    """Look at what `rhs` leaves of the equations, and of how rates move coordinates."""
    nq, nv, m = held.sizes[0], held.sizes[1], held.sizes[2]
    row = held.rows[0, i]
    for j in range(nv + m):
        if j < nv or (held.dependent[j - nv] == 0.0 and row[row.shape[0] - 1] >= LEAST_RATIO):
            take_if_worse(held, held.left[j], held.scale[j], RHS, j, i)
    fastest = 0.0
    for j in range(nv):
        fastest = max(fastest, abs(held.states[i, nq + j]))
    for j in range(nq):
        size = max(abs(held.moves[i, j]), SMALLEST * fastest)
        take_if_worse(held, row[j] - held.moves[i, j], size, MOVES, j, i)


@jitted
def compare_matrix(held, i, function, matrix, first):
    """Hold a matrix against what `residual` makes of accelerations, from equation `first` on."""
    nv = held.sizes[1]
    call_kernel(held.addresses[function], held.times[i], held.states[i], held.p, matrix)
    for k in range(held.probes.shape[0]):
        for j in range(matrix.shape[0] // nv):
            total = size = 0.0
            for l in range(nv):
                term = matrix[j * nv + l] * held.probes[k, l]
                total += term
                size += abs(term)
            off = total - held.made[k, first + j]
            take_if_worse(held, off, size + held.scale[first + j], function, first + j, i)


@jitted
def compare_vector(held, i, function, first):
    """Hold forces, or γ, against what `residual` leaves without accelerations, from equation `first` on."""
    n = held.sizes[1] if first == 0 else held.sizes[2]
    for j in range(n):
        held.part[j] = 0.0  # structural zeros are not written
    call_kernel(held.addresses[function], held.times[i], held.states[i], held.p, held.part)
    for j in range(n):
        take_if_worse(
            held, held.part[j] + held.zero[first + j], held.scale[first + j], function, first + j, i
        )


@jitted
def put(held, a, of_a, lam, of_lam):
    """Put accelerations and multipliers behind a state, or zeros in their place."""
    n, nv = held.states.shape[1], held.sizes[1]
    for j in range(nv):
        held.place[n + j] = a[j] if of_a > 0.0 else 0.0
    for j in range(held.sizes[2]):
        held.place[n + nv + j] = lam[j] if of_lam > 0.0 else 0.0


@jitted
def find_residual(held, i, p, out):
    """Write what `residual` makes of a state, accelerations and multipliers."""
    for j in range(out.shape[0]):
        out[j] = 0.0  # structural zeros are not written
    call_kernel(held.addresses[RHS], held.times[i], held.place, p, out)


@jitted
def raise_to_part(sizes):
    """Let no size be less than a small part of the largest; none is known where one is not a number."""
    largest = 0.0
    for j in range(sizes.shape[0]):
        if not sizes[j] <= largest:
            largest = sizes[j]
        if math.isnan(largest):
            break
    for j in range(sizes.shape[0]):
        sizes[j] = max(sizes[j], SMALLEST * largest) if not math.isnan(largest) else math.nan


@jitted
def take_if_worse(held, off, size, function, equation, i):
    """Keep what is left of an equation if it is the largest so far in parts of its terms."""
    if not (math.isfinite(off) and math.isfinite(size)):
        return
    value = abs(off) / size if size > 0.0 else abs(off)
    if value > held.worst[0]:
        held.worst[0] = value
        held.where[0], held.where[1], held.where[2] = function, equation, i
