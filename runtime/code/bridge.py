"""Call a kernel by its address, from jitted code and from Python, for one state or for many."""

from __future__ import annotations

import contextlib
import ctypes
import functools
from collections.abc import Callable

import numpy as np

from symgen.runtime.code import stand_ins
from symgen.runtime.lazy import Late

engine = Late("symgen.runtime.code.engine")

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
            is_double = array.dtype is _DOUBLE or array.dtype == _DOUBLE  # the latter takes longest
            if not is_double or array.ndim != 1 or not array.flags.c_contiguous:
                raise TypeError(
                    f"{name} must be a contiguous 1-D float64 array, not {array.dtype} of shape {array.shape}: "
                    f"use np.ascontiguousarray({name}, dtype=float)"
                )
        if not address:
            raise ValueError("the model has no such function: its kernel's address is 0")
        _callable(int(address))(float(t), address_of(y), address_of(p), address_of(out))

    @property
    def _numba_type_(self):
        # Numba takes half a second to import, and most processes do without it.
        from numba.core.typing.templates import builtin_registry

        from symgen.runtime.code.bridge_numba import teach

        teach(self)
        return next(kind for value, kind in builtin_registry.globals if value is self)


call_kernel = _KernelCall()

_NOTHING, _DOUBLE = ctypes.c_char * 0, np.dtype(np.float64)


def address_of(array: np.ndarray) -> int:
    """Return where the numbers of a C-contiguous array are, in a third of the time that `array.ctypes.data` takes.

    It is valid as long as the array lives.
    """
    try:
        return ctypes.addressof(_NOTHING.from_buffer(array))
    except TypeError:  # it is read-only
        return array.ctypes.data


@functools.lru_cache(maxsize=256)
def _callable(address: int):
    return KERNEL_PROTOTYPE(address)


# Few rows take less time than a call through a jitted function's many arguments.
_ROWS = """
define void @rows(ptr %kernel, i64 %n, ptr %times, ptr %states, i64 %n_state, ptr %all_p, i64 %n_p,
                  ptr %out, i64 %n_out) nounwind {
entry:
  br label %head
head:
  %i = phi i64 [ 0, %entry ], [ %next, %body ]
  %more = icmp slt i64 %i, %n
  br i1 %more, label %body, label %done
body:
  %t_at = getelementptr inbounds double, ptr %times, i64 %i
  %t = load double, ptr %t_at
  %y_offset = mul i64 %i, %n_state
  %y = getelementptr inbounds double, ptr %states, i64 %y_offset
  %p_offset = mul i64 %i, %n_p
  %p = getelementptr inbounds double, ptr %all_p, i64 %p_offset
  %out_offset = mul i64 %i, %n_out
  %row = getelementptr inbounds double, ptr %out, i64 %out_offset
  call void %kernel(double %t, ptr %y, ptr %p, ptr %row)
  %next = add i64 %i, 1
  br label %head
done:
  ret void
}
"""


def evaluate_rows(
    address: int, times: np.ndarray, states: np.ndarray, p: np.ndarray, out: np.ndarray
) -> None:
    """Call the kernel at `address` for each row of `states`; `out`, shape (n, width), is written in place.

    `p` is for all rows, or has a row for each. All arrays are float64 and C-contiguous; their lengths are not checked.
    """
    n_p = p.shape[1] if p.ndim == 2 else 0
    with stand_ins.counted() if stand_ins.any_waits() else contextlib.nullcontext():
        rows_caller()(
            int(address), len(times), address_of(times), address_of(states), states.shape[1], address_of(p), n_p,
            address_of(out), out.shape[1],
        )  # fmt: skip


@functools.lru_cache(maxsize=1)
def rows_caller() -> Callable:
    """Return what `evaluate_rows` calls: (address, n, times, states, width, p, width of p, out, width of out)."""
    code = engine.MachineCode()
    content = engine.object_code(engine.cache_key(_ROWS), "rows", "rows", lambda _: (_ROWS, 0))
    size, pointer = ctypes.c_int64, ctypes.c_void_p
    types = [pointer, size, pointer, pointer, size, pointer, size, pointer, size]
    caller = ctypes.CFUNCTYPE(None, *types)(code.add(content, "rows"))
    caller.code = code  # threads that come here at once have a caller each: its code lives as long as it does
    return caller
