"""The transformed variables of the Radau methods' Newton iteration, component by component."""

from typing import NamedTuple

import numpy as np

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.after_step import finish_scratch_size
from symgen.runtime.integrate.jacobian import jacobian_work_size
from symgen.runtime.integrate.newton import N_MONITOR
from symgen.runtime.integrate.quaternions import n_quaternions

# Counters of this family: whether work holds a Jacobian, one of the present state, factors; whether `dense` and
# ERROR_OLD are those of the step before; whether stages are coupled, how many steps speak against that they are not,
# and how many times more of them than at first it takes (see `coupled.py`).
HAVE_JACOBIAN, JACOBIAN_IS_FRESH, HAVE_FACTORS, HAVE_HISTORY, COUPLED, HELD_BACK, PATIENCE = range(16, 23)

# `numbers` of the work arrays: Newton's monitor, then these.
FACTORED_FOR, NEWTON_BOUND, ITERATIONS, LAST_RATE, H_UNCOUPLED, CREDIT = range(N_MONITOR, N_MONITOR + 6)
N_NUMBERS = N_MONITOR + 6

# Rates of the largest models whose stages may be coupled: of larger ones the matrix costs more than steps gain.
MOST_COUPLED = 10


# Rows of `states` and of `rows`, where those of the stages begin; rows of `real_vectors`, of `pairs`.
Y_STAGE, Y_NEW, STAGES = range(3)
F_NEW, F_STAGES = range(2)
X, DX = range(2)
SCALE, ERROR = range(2)


class RadauWork(NamedTuple):
    """Work arrays of a Radau method with s = 2 k + 1 stages.

    They are few, because every array makes every call of a jitted function longer.

    Attributes
    ----------
    numbers : ndarray, shape (N_NUMBERS,)
    jacobian : ndarray, shape (nv, 2 nv)
        [A, B] = [∂a/∂q, ∂a/∂v], see `acceleration_jacobian`.
    real, complex : ndarray, shapes (nv, nv), (k, nv, nv)
        Factors of μ/h - B - A h/μ and of every ν/h - B - A h/ν; see `factor_stages` for quaternions.
    pivots : ndarray of int64, shape (k + 1, nv)
        Of the real one, then of the complex ones.
    states : ndarray, shape (2 + s, NY)
        The argument of a stage; the new state; increments of (q, v, w) from the start of the step to each stage, in
        place of a quaternion's the rotation vector that turns it.
    rows : ndarray, shape (1 + s, N_ROW)
        The rhs rows of the new state and of the stages.
    real_vectors : ndarray, shape (2, 2 nv)
        The increments of (positions, v), transformed, and their corrections; of positions only those that turn
        quaternions, as the others follow from those of v.
    complex_vectors : ndarray, shape (2 k, 2 nv)
        The same for every ν: all increments, then all corrections.
    pairs : ndarray, shape (2, 2 nv)
        Tolerance and estimated error of every component, for quaternions of the rotation vector.
    rotation_rates : ndarray, shape (s, 3)
        Derivatives of a rotation vector at the stages.
    implicit : ndarray
        See `acceleration_jacobian`.
    coupled : ndarray
        What `coupled.divide_coupled` divides; empty where stages cannot be coupled.
    scratch : ndarray
        See `finish_step`.
    """

    numbers: np.ndarray
    jacobian: np.ndarray
    real: np.ndarray
    complex: np.ndarray
    pivots: np.ndarray
    states: np.ndarray
    rows: np.ndarray
    real_vectors: np.ndarray
    complex_vectors: np.ndarray
    pairs: np.ndarray
    rotation_rates: np.ndarray
    implicit: np.ndarray
    coupled: np.ndarray
    scratch: np.ndarray


@jitted
def can_couple(sizes):
    """Whether the stages of such a model may be coupled: something can turn, they are few, and none is a quaternion."""
    return 2 <= sizes[at.NV] <= MOST_COUPLED and n_quaternions(sizes) == 0


@jitted
def coupled_size(method, sizes):
    """Length of the array that `coupled.divide_coupled` divides; 0 where stages cannot be coupled."""
    nv, n = sizes[at.NV], len(method.c) * sizes[at.NV]
    return n * n + 2 * n + 2 * nv * nv if can_couple(sizes) else 0


@jitted
def radau_work_size(method, sizes):
    """Length of `work` for `advance_radau`."""
    s, k = len(method.c), len(method.c) // 2
    nv, ny, n_row = sizes[at.NV], sizes[at.NY], sizes[at.N_ROW]
    own = N_NUMBERS + (3 + 2 * k) * nv * nv + (k + 1) * nv + (s + 2) * ny + (s + 1) * n_row
    own += (8 + 8 * k) * nv + 3 * s
    own += coupled_size(method, sizes)
    return own + jacobian_work_size(sizes) + finish_scratch_size(sizes)


@jitted
def radau_work(method, sizes, work):
    """Divide `work`, of length `radau_work_size(method, sizes)`, into a `RadauWork`."""
    s, k = len(method.c), len(method.c) // 2
    nv, ny, n_row = sizes[at.NV], sizes[at.NY], sizes[at.N_ROW]
    numbers, rest = work[:N_NUMBERS], work[N_NUMBERS:]
    jacobian, rest = rest[: 2 * nv * nv].reshape((nv, 2 * nv)), rest[2 * nv * nv :]
    real, rest = rest[: nv * nv].reshape((nv, nv)), rest[nv * nv :]
    n = 2 * k * nv * nv
    complex_, rest = rest[:n].view(np.complex128).reshape((k, nv, nv)), rest[n:]
    n = (k + 1) * nv
    pivots, rest = rest[:n].view(np.int64).reshape((k + 1, nv)), rest[n:]
    n = (s + 2) * ny
    states, rest = rest[:n].reshape((s + 2, ny)), rest[n:]
    n = (s + 1) * n_row
    rows, rest = rest[:n].reshape((s + 1, n_row)), rest[n:]
    real_vectors, rest = rest[: 4 * nv].reshape((2, 2 * nv)), rest[4 * nv :]
    n = 8 * k * nv
    complex_vectors, rest = rest[:n].view(np.complex128).reshape((2 * k, 2 * nv)), rest[n:]
    pairs, rest = rest[: 4 * nv].reshape((2, 2 * nv)), rest[4 * nv :]
    rotation_rates, rest = rest[: 3 * s].reshape((s, 3)), rest[3 * s :]
    n = jacobian_work_size(sizes)
    implicit, rest = rest[:n], rest[n:]
    n = coupled_size(method, sizes)
    return RadauWork(
        numbers, jacobian, real, complex_, pivots, states, rows, real_vectors, complex_vectors, pairs,
        rotation_rates, implicit, rest[:n], rest[n:],
    )  # fmt: skip


@jitted
def transform_stages(method, i, column, w):
    """Set the transformed increments in `column` from the stages' increments of component `i`."""
    t, n = method.from_stages, len(method.c)
    real = 0.0
    for s in range(n):
        real += t[0, s] * w.states[STAGES + s, i]
    w.real_vectors[X, column] = real
    for k in range(len(method.c) // 2):
        real, imag = 0.0, 0.0
        for s in range(n):
            real += t[2 * k + 1, s] * w.states[STAGES + s, i]
            imag += t[2 * k + 2, s] * w.states[STAGES + s, i]
        w.complex_vectors[k, column] = complex(real, imag)


@jitted
def set_defect(method, per_h, derivatives, first, i, column, w):
    """Set the transformed defect of a component whose derivatives at the stages are `derivatives[first:, i]`."""
    t, n, n_pairs = method.from_stages, len(method.c), len(method.c) // 2
    real = 0.0
    for s in range(n):
        real += t[0, s] * derivatives[first + s, i]
    w.real_vectors[DX, column] = real - method.mu * per_h * w.real_vectors[X, column]
    for k in range(n_pairs):
        real, imag = 0.0, 0.0
        for s in range(n):
            real += t[2 * k + 1, s] * derivatives[first + s, i]
            imag += t[2 * k + 2, s] * derivatives[first + s, i]
        x = w.complex_vectors[k, column]
        w.complex_vectors[n_pairs + k, column] = complex(real, imag) - shift_of(method, k, per_h) * x


@jitted
def shift_of(method, k, per_h):
    """Return ν/h of complex pair `k`."""
    nu = method.nu[k]
    return complex(nu.real * per_h, nu.imag * per_h)


@jitted
def add_correction(method, column, w):
    """Add a correction to its transformed increments; returns the sum of the squares of its real and complex parts."""
    real = w.real_vectors[DX, column]
    w.real_vectors[X, column] += real
    total, n_pairs = real**2, len(method.c) // 2
    for k in range(n_pairs):
        other = w.complex_vectors[n_pairs + k, column]
        w.complex_vectors[k, column] += other
        total += other.real**2 + other.imag**2
    return total


@jitted
def restore_stages(method, i, column, w):
    """Set the stages' increments of component `i` from the transformed ones in `column`."""
    t = method.to_stages
    for s in range(len(method.c)):
        total = t[s, 0] * w.real_vectors[X, column]
        for k in range(len(method.c) // 2):
            x = w.complex_vectors[k, column]
            total += t[s, 2 * k + 1] * x.real + t[s, 2 * k + 2] * x.imag
        w.states[STAGES + s, i] = total
