"""`feedback_jacobian` as a C function; importing this module compiles it, or reads it from the cache."""

from __future__ import annotations

from numba import carray, cfunc, types

from symgen.runtime.code.numba_setup import our_cache
from symgen.runtime.inputs.feedback_jacobian import N_CONTEXT, N_INPUTS, NP, ROWS, N, driven_jacobian

_DOUBLES = types.CPointer(types.float64)
_SIGNATURE = types.void(types.CPointer(types.int64), types.float64, _DOUBLES, _DOUBLES, _DOUBLES)


def _jacobian_path(context, t, y, p, out):
    c = carray(context, (N_CONTEXT + carray(context, (N_CONTEXT,))[N_INPUTS],))
    width = c[N] + c[ROWS]
    driven_jacobian(c, t, carray(y, (width,)), carray(p, (c[NP],)), carray(out, (c[ROWS] * width,)))


with our_cache():
    jacobian_path = cfunc(_SIGNATURE, cache=True, error_model="numpy")(_jacobian_path)
