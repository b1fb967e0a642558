"""The transformed variables of radau5's Newton iteration, component by component."""

from runtime.code.jitted import jitted
from runtime.integrate.radau5_work import DX, X


@jitted
def transform_stages(method, i, column, w):
    """Set the transformed increments in `column` from the stages' increments of component `i`."""
    t = method.from_stages
    z0, z1, z2 = w.states[0, i], w.states[1, i], w.states[2, i]
    w.real_vectors[X, column] = t[0, 0] * z0 + t[0, 1] * z1 + t[0, 2] * z2
    w.complex_vectors[X, column] = complex(
        t[1, 0] * z0 + t[1, 1] * z1 + t[1, 2] * z2, t[2, 0] * z0 + t[2, 1] * z1 + t[2, 2] * z2
    )


@jitted
def set_defect(method, g, g_complex, f0, f1, f2, column, w):
    """Set the transformed defect of a component whose derivatives at the stages are f0, f1, f2."""
    t = method.from_stages
    real = t[0, 0] * f0 + t[0, 1] * f1 + t[0, 2] * f2
    transformed = complex(
        t[1, 0] * f0 + t[1, 1] * f1 + t[1, 2] * f2, t[2, 0] * f0 + t[2, 1] * f1 + t[2, 2] * f2
    )
    w.real_vectors[DX, column] = real - g * w.real_vectors[X, column]
    w.complex_vectors[DX, column] = transformed - g_complex * w.complex_vectors[X, column]


@jitted
def add_correction(column, w):
    """Add a correction to its transformed increment; returns the squares of its real and complex part."""
    real, other = w.real_vectors[DX, column], w.complex_vectors[DX, column]
    w.real_vectors[X, column] += real
    w.complex_vectors[X, column] += other
    return real**2, other.real**2 + other.imag**2


@jitted
def restore_stages(method, i, column, w):
    """Set the stages' increments of component `i` from the transformed ones in `column`."""
    t = method.to_stages
    x = w.complex_vectors[X, column]
    for s in range(3):
        w.states[s, i] = t[s, 0] * w.real_vectors[X, column] + t[s, 1] * x.real + t[s, 2] * x.imag
