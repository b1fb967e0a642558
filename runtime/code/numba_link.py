"""Kernels that a user's own `numba.njit` code calls by name: their IR is linked into that code."""

from __future__ import annotations

import hashlib
from collections.abc import Callable

import llvmlite.binding as llvm
from llvmlite import ir
from numba import njit, types
from numba.core.errors import NumbaTypeError
from numba.extending import intrinsic
from numba.np.arrayobj import make_array

from symgen.runtime.code import numba_setup
from symgen.runtime.code.sincos import standing_alone
from symgen.runtime.kernel import KernelSource


def linked_function(source: KernelSource) -> Callable:
    """Return a jitted `f(t, y, p, out)` whose machine code is the kernel's.

    Unlike a call by address, it holds no address that would be wrong in the next process, so it may be
    cached.
    """
    if numba_setup.DISABLE_JIT:
        return checked(source.python_function(), source)
    symbol = "symgen_" + hashlib.sha256(source.key_text().encode()).hexdigest()[:24]
    text, _ = source.lower(symbol)
    return checked(_intrinsic(symbol, source.name, standing_alone(text)), source)


def checked(function: Callable, source: KernelSource) -> Callable:
    """Return a jitted `f(t, y, p, out)` that calls `function` if its arrays are long enough for it.

    Machine code checks no index: it would write behind an array that is short. The lengths are attributes
    `n_y`, `n_p` and `n_out`, and stand in the docstring.
    """
    n_y, n_p, n_out = source.lengths
    too_short = f"{source.name} reads {n_y} values of y and {n_p} of p, and writes {n_out} to out: an array is shorter"

    def sized(t, y, p, out):
        if y.size < n_y or p.size < n_p or out.size < n_out:
            raise ValueError(too_short)
        function(t, y, p, out)

    sized.__name__ = source.name
    sized.__doc__ = f"{source.name}(t, y, p, out): {n_y} values of y, {n_p} of p; {n_out} are written to out."
    jitted = njit(error_model="numpy", inline="always")(sized)
    jitted.n_y, jitted.n_p, jitted.n_out = source.lengths
    return jitted


def _intrinsic(symbol: str, name: str, text: str):
    def generate(context, builder, signature, arguments):
        library = context.codegen().create_library(symbol)
        library.add_llvm_module(llvm.parse_assembly(text))
        library.finalize()
        context.active_code_library.add_linking_library(library)
        pointer = ir.DoubleType().as_pointer()
        function_type = ir.FunctionType(ir.VoidType(), [ir.DoubleType(), pointer, pointer, pointer])
        function = builder.module.globals.get(symbol) or ir.Function(builder.module, function_type, symbol)
        arrays = [
            builder.bitcast(make_array(kind)(context, builder, value).data, pointer)
            for kind, value in zip(signature.args[1:], arguments[1:])
        ]
        builder.call(function, [arguments[0], *arrays])
        return context.get_dummy_value()

    @intrinsic
    def linked(typing_context, t, y, p, out):
        for label, array in (("y", y), ("p", p), ("out", out)):
            fits = isinstance(array, types.Array) and array.ndim == 1 and array.layout == "C"
            if not fits or array.dtype != types.float64:
                raise NumbaTypeError(f"{name}: {label} must be a C-contiguous 1-D float64 array, not {array}")
        return types.void(types.float64, y, p, out), generate

    return linked
