"""Call a kernel by its address, from jitted code and from Python."""

from __future__ import annotations

import ctypes
import functools

import numpy as np

KERNEL_PROTOTYPE = ctypes.CFUNCTYPE(None, ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p)
"""The one shape of all kernels: `void f(double t, const double *y, const double *p, double *out)`."""


class _KernelCall:
    """`call_kernel`; Numba learns what it is when it first meets it, which needs no entry point in its start."""

    def __call__(self, address, t, y, p, out):
        """Call the kernel at `address`: `out` is written in place.

        In jitted code this is one indirect call, without checks; from Python the arrays are checked for type and
        contiguity, but not for length.

        Parameters
        ----------
        address : uint64
            From `symgen.runtime.system.Kernel.address`; whoever owns the code must stay alive.
        t : float [s]
        y, p : ndarray of float64, 1-D, C-contiguous
        out : ndarray of float64, 1-D, C-contiguous
        """
        for name, array in (("y", y), ("p", p), ("out", out)):
            if array.dtype != np.float64 or array.ndim != 1 or not array.flags.c_contiguous:
                raise TypeError(
                    f"{name} must be a contiguous 1-D float64 array, not {array.dtype} of shape {array.shape}: "
                    f"use np.ascontiguousarray({name}, dtype=float)"
                )
        if not address:
            raise ValueError("the model has no such function: its kernel's address is 0")
        _callable(int(address))(float(t), y.ctypes.data, p.ctypes.data, out.ctypes.data)

    @property
    def _numba_type_(self):
        # Numba takes half a second to import, and most processes do without it.
        from numba.core.typing.templates import builtin_registry

        from symgen.runtime.code.bridge_numba import teach

        teach(self)
        return next(kind for value, kind in builtin_registry.globals if value is self)


call_kernel = _KernelCall()


@functools.lru_cache(maxsize=256)
def _callable(address: int):
    return KERNEL_PROTOTYPE(address)
