"""What Numba must know of `bridge.call_kernel` to compile it: its types and its one indirect call."""

from __future__ import annotations

import functools
from collections.abc import Callable

from llvmlite import ir
from numba import types
from numba.core.errors import NumbaTypeError
from numba.extending import lower_builtin, type_callable
from numba.np.arrayobj import make_array


@functools.cache
def teach(call_kernel: Callable) -> None:
    """Let Numba know `symgen.runtime.code.bridge.call_kernel`."""
    type_callable(call_kernel)(_type_call_kernel)
    arguments = types.uint64, types.float64, types.Array, types.Array, types.Array
    lower_builtin(call_kernel, *arguments)(_lower_call_kernel)


def _type_call_kernel(context):
    def typer(address, t, y, p, out):
        if not isinstance(address, types.Integer):
            raise NumbaTypeError(f"call_kernel: address must be an integer (uint64), not {address}")
        for name, array in (("y", y), ("p", p), ("out", out)):
            fits = isinstance(array, types.Array) and array.ndim == 1 and array.layout == "C"
            if not fits or array.dtype != types.float64:
                raise NumbaTypeError(
                    f"call_kernel: {name} must be a C-contiguous 1-D float64 array, not {array}"
                )
        return types.void(types.uint64, types.float64, y, p, out)

    return typer


def _lower_call_kernel(context, builder, signature, arguments):
    address, t = arguments[:2]
    double, pointer = ir.DoubleType(), ir.DoubleType().as_pointer()
    data = [
        builder.bitcast(make_array(array_type)(context, builder, value).data, pointer)
        for array_type, value in zip(signature.args[2:], arguments[2:])
    ]
    function_type = ir.FunctionType(ir.VoidType(), [double, pointer, pointer, pointer])
    function = builder.inttoptr(address, function_type.as_pointer())
    builder.call(function, [t, *data])
    return context.get_dummy_value()
