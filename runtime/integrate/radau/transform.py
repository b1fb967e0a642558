"""The transformed variables of the Radau methods' Newton iteration, component by component."""

from symgen.runtime.code.jitted import jitted
from symgen.runtime.integrate.radau.work import DX, STAGES, X


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
