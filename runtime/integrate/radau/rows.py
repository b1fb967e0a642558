"""Newton's iteration of the Radau methods for many coordinates whose rates are their own: a row of all at a time.

The functions of `stages.py` go from coordinate to coordinate, through arrays that might overlap for all that a compiler
knows. Here each row is an argument of its own, so that vector code takes eight coordinates at a time. Each number goes
through the same operations, but sums are added up in eight parts.
"""

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate import layout as at
from symgen.runtime.integrate.linear import unsigned
from symgen.runtime.integrate.radau.work import DX, ERROR, F_STAGES, SCALE, STAGES, X, shift_of


@jitted
def predict_rows(method, h, extrapolate, loop, w):
    """Start Newton from the last step's collocation polynomial, or from zero increments of v, as `predict_stages`."""
    nq, nv, n = loop.sizes[at.NQ], loop.sizes[at.NV], len(method.c)
    for s in range(n):
        rates = w.states[STAGES + s, nq : nq + nv]
        if extrapolate:
            extrapolate_row(method, 1.0 + method.c[s] * h / loop.control[at.H_LAST], nq, loop.dense, rates)
        else:
            for i in range(unsigned(nv)):
                rates[i] = 0.0
    stages = w.states[STAGES:]
    combine_row(method, method.from_stages[0], stages, nq, w.real_vectors[X, nv:])
    for k in range(n // 2):
        by_real, by_imag = method.from_stages[2 * k + 1], method.from_stages[2 * k + 2]
        combine_pair(method, by_real, by_imag, stages, nq, w.complex_vectors[k, nv:])
    for s in range(n):
        move_row(method, method.c[s], method.a[s], h, loop.y, nq, stages, w.states[STAGES + s, :nq])


@jitted(distinct_arrays=True)
def extrapolate_row(method, theta, first, dense, rates):
    """Write the increments of rates, from `first` on in `dense`, at the place theta of the last step's polynomial."""
    n = len(method.c)
    for i in range(unsigned(rates.shape[0])):
        bend = dense[n, unsigned(first) + i]
        for j in range(n - 1, 1, -1):
            bend = bend * (theta if j % 2 == 0 else 1.0 - theta) + dense[j, unsigned(first) + i]
        rates[i] = (theta - 1.0) * (dense[1, unsigned(first) + i] - theta * bend)


@jitted(distinct_arrays=True)
def combine_row(method, weights, rows, first, out):
    """Write the sum of the stages' rows, from `first` on, each times its weight."""
    for i in range(unsigned(out.shape[0])):
        total = 0.0
        for s in range(len(method.c)):
            total += weights[s] * rows[s, unsigned(first) + i]
        out[i] = total


@jitted(distinct_arrays=True)
def combine_pair(method, by_real, by_imag, rows, first, out):
    """Write two such sums as complex numbers."""
    for i in range(unsigned(out.shape[0])):
        real, imag = 0.0, 0.0
        for s in range(len(method.c)):
            real += by_real[s] * rows[s, unsigned(first) + i]
            imag += by_imag[s] * rows[s, unsigned(first) + i]
        out[i] = complex(real, imag)


@jitted(distinct_arrays=True)
def move_row(method, place, weights, h, y, first, rows, out):
    """Write the increments of positions at one stage: the integral of the stages' rates, which begin at `first`."""
    for i in range(unsigned(out.shape[0])):
        total = place * y[unsigned(first) + i]
        for r in range(len(method.c)):
            total += weights[r] * rows[r, unsigned(first) + i]
        out[i] = h * total


@jitted
def set_defects_of_rows(method, h, sizes, w):
    """Set the transformed defects of all rates from the stages' rhs rows."""
    nq, nv, n_pairs, per_h = sizes[at.NQ], sizes[at.NV], len(method.c) // 2, 1.0 / h
    rows = w.rows[F_STAGES:]
    g = method.mu * per_h
    defects = w.real_vectors[DX, nv:]
    combine_row(method, method.from_stages[0], rows, nq, defects)
    subtract_shifted(g, w.real_vectors[X, nv:], defects)
    for k in range(n_pairs):
        by_real, by_imag = method.from_stages[2 * k + 1], method.from_stages[2 * k + 2]
        pair = w.complex_vectors[n_pairs + k, nv:]
        combine_pair(method, by_real, by_imag, rows, nq, pair)
        subtract_shifted(shift_of(method, k, per_h), w.complex_vectors[k, nv:], pair)


@jitted(distinct_arrays=True)
def subtract_shifted(g, increments, defects):
    """Subtract the shift times the increments from the defects."""
    for i in range(unsigned(defects.shape[0])):
        defects[i] -= g * increments[i]


@jitted
def apply_corrections_to_rows(method, h, sizes, y, w):
    """Correct the transformed rates, and with them the stages; returns the sum of squares in tolerances.

    What `pairs` holds of an error is overwritten.
    """
    nq, nv, n, n_pairs = sizes[at.NQ], sizes[at.NV], len(method.c), len(method.c) // 2
    squares, moves = w.pairs[ERROR, nv:], w.pairs[ERROR, :nv]
    correct_row(method.inverse_squares[0], w.real_vectors[DX, nv:], w.real_vectors[X, nv:], squares, moves)
    for k in range(n_pairs):
        correct_pair(
            method.inverse_squares[1 + k], w.complex_vectors[n_pairs + k, nv:], w.complex_vectors[k, nv:],
            squares, moves,
        )  # fmt: skip
    for s in range(n):
        rates = w.states[STAGES + s, nq : nq + nv]
        restore_row(method, method.to_stages[s], w.real_vectors[X], w.complex_vectors, rates)
    stages = w.states[STAGES:]
    for s in range(n):
        move_row(method, method.c[s], method.a[s], h, y, nq, stages, w.states[STAGES + s, :nq])
    total = sum_of_quotients(1.0, squares, w.pairs[SCALE, nv:])
    return total + sum_of_quotients(h * h, moves, w.pairs[SCALE, :nv])


@jitted(distinct_arrays=True)
def correct_row(shift, change, increments, squares, moves):
    """Add a correction to increments, and write its squares, and those of how far it moves positions per h²."""
    for i in range(unsigned(change.shape[0])):
        increments[i] += change[i]
        squares[i] = change[i] * change[i]
        moves[i] = shift * squares[i]


@jitted(distinct_arrays=True)
def correct_pair(shift, change, increments, squares, moves):
    """The same for complex numbers; squares add up."""
    for i in range(unsigned(change.shape[0])):
        real, imag = change[i].real, change[i].imag
        increments[i] = complex(increments[i].real + real, increments[i].imag + imag)
        size = real * real + imag * imag
        squares[i] += size
        moves[i] += shift * size


@jitted(distinct_arrays=True)
def restore_row(method, weights, real, pairs, out):
    """Write the increments of one stage from the transformed ones."""
    n = unsigned(out.shape[0])
    for i in range(n):
        total = weights[0] * real[n + i]
        for k in range(len(method.c) // 2):
            x = pairs[k, n + i]
            total += weights[2 * k + 1] * x.real + weights[2 * k + 2] * x.imag
        out[i] = total


@jitted(distinct_arrays=True)
def sum_of_quotients(factor, squares, scale):
    """The sum of squares, each by the square of its tolerance; eight sums at a time."""
    n = unsigned(squares.shape[0])
    for i in range(n):
        squares[i] = factor * squares[i] / (scale[i] * scale[i])
    a, b, c, d, e, f, g, h = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    whole = n - n % unsigned(8)
    for i in range(unsigned(0), whole, unsigned(8)):
        a += squares[i]
        b += squares[i + unsigned(1)]
        c += squares[i + unsigned(2)]
        d += squares[i + unsigned(3)]
        e += squares[i + unsigned(4)]
        f += squares[i + unsigned(5)]
        g += squares[i + unsigned(6)]
        h += squares[i + unsigned(7)]
    for i in range(whole, n):
        a += squares[i]
    return a + b + (c + d) + (e + f + (g + h))
