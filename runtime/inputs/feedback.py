"""`feedback_jacobian` as a C function; importing this module compiles it, or reads it from the cache."""

from __future__ import annotations

import numpy as np
from numba import carray, cfunc, types

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.numba_setup import jit, our_cache

# The context: addresses of the model's kernels and of the one that writes all inputs, sizes, and which inputs a
# controller gives.
JACOBIAN, RESIDUAL, INPUTS, N, ROWS, NP, FIRST_INPUT, N_INPUTS = range(8)
N_CONTEXT = 8
_STEP = 6e-6  # cube root of the round-off: where a central difference is best


@jit
def driven_jacobian(context, t, y, p, out):
    """Write the Jacobian, all of its entries: J + ∂r/∂u ∂u/∂(q, v), the latter two by central differences.

    The residual is affine in most inputs, and most controllers are linear: their differences are exact but for
    round-off.
    """
    n, rows, first, n_inputs = context[N], context[ROWS], context[FIRST_INPUT], context[N_INPUTS]
    width = n + rows
    whole = np.zeros(rows * width)
    gain, high, low = np.zeros((n_inputs, n)), np.zeros(n_inputs), np.zeros(n_inputs)
    state = y.copy()
    for j in range(n):
        kept = state[j]
        step = _STEP * max(1.0, abs(kept))
        state[j] = kept + step
        above = state[j]
        call_kernel(np.uint64(context[INPUTS]), t, state, p, high)
        state[j] = kept - step
        call_kernel(np.uint64(context[INPUTS]), t, state, p, low)
        for k in range(n_inputs):
            gain[k, j] = (high[k] - low[k]) / (above - state[j])
        state[j] = kept
    call_kernel(np.uint64(context[INPUTS]), t, y, p, high)
    call_kernel(np.uint64(context[JACOBIAN]), t, y, p, whole)
    more, less = np.zeros(rows), np.zeros(rows)
    for k in range(n_inputs):
        if context[N_CONTEXT + k]:
            kept = p[first + k]
            step = _STEP * max(1.0, abs(kept))
            p[first + k] = kept + step
            call_kernel(np.uint64(context[RESIDUAL]), t, y, p, more)
            p[first + k] = kept - step
            call_kernel(np.uint64(context[RESIDUAL]), t, y, p, less)
            p[first + k] = kept
            for i in range(rows):
                slope = (more[i] - less[i]) / (2.0 * step)
                for j in range(n):
                    whole[i * width + j] += slope * gain[k, j]
    for i in range(rows * width):
        out[i] = whole[i]


_DOUBLES = types.CPointer(types.float64)
_SIGNATURE = types.void(types.CPointer(types.int64), types.float64, _DOUBLES, _DOUBLES, _DOUBLES)


def _jacobian_path(context, t, y, p, out):
    c = carray(context, (N_CONTEXT + carray(context, (N_CONTEXT,))[N_INPUTS],))
    width = c[N] + c[ROWS]
    driven_jacobian(c, t, carray(y, (width,)), carray(p, (c[NP],)), carray(out, (c[ROWS] * width,)))


with our_cache():
    jacobian_path = cfunc(_SIGNATURE, cache=True, error_model="numpy")(_jacobian_path)
