"""Memory by its address, in jitted code."""

from __future__ import annotations

from llvmlite import ir
from numba import types
from numba.extending import intrinsic


@intrinsic
def pointer_to(typing_context, address):
    """A pointer to an address; whoever uses it sees that what lies there stays alive."""

    def generate(context, builder, signature, arguments):
        return builder.inttoptr(arguments[0], ir.IntType(8).as_pointer())

    return types.voidptr(types.uint64), generate
