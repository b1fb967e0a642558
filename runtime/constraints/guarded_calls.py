"""`robust_path` as C functions; importing this module compiles them, or reads them from the cache."""

from __future__ import annotations

from numba import carray, cfunc, types

from runtime.code.numba_setup import our_cache
from runtime.constraints.robust_path import (
    N_CONTEXT,
    N_QUATERNIONS,
    NH,
    NP,
    NQ,
    NV,
    NW,
    M,
    robust_project,
    robust_rhs,
)

_DOUBLES = types.CPointer(types.float64)
_SIGNATURE = types.void(types.CPointer(types.int64), types.float64, _DOUBLES, _DOUBLES, _DOUBLES)


def _rhs_path(context, t, y, p, out):
    c = carray(context, (N_CONTEXT + carray(context, (N_CONTEXT,))[N_QUATERNIONS],))
    n = c[NQ] + c[NV]
    robust_rhs(c, t, carray(y, (n,)), carray(p, (c[NP],)), carray(out, (n + c[NW] + c[M] + 1,)))


def _project_path(context, t, y, p, out):
    c = carray(context, (N_CONTEXT + carray(context, (N_CONTEXT,))[N_QUATERNIONS],))
    n = c[NQ] + c[NV]
    robust_project(c, t, carray(y, (n,)), carray(p, (c[NP],)), carray(out, (n + c[NH] + c[M],)))


with our_cache():
    rhs_path = cfunc(_SIGNATURE, cache=True, error_model="numpy")(_rhs_path)
    project_path = cfunc(_SIGNATURE, cache=True, error_model="numpy")(_project_path)
