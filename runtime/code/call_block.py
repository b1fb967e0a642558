"""Calls of jitted functions as data: a block of arguments, and code with a kernel's signature that passes them on.

Handing a hundred arguments over from Python takes longer than short runs do, and jitted code can call nothing but
kernels. A block is filled once; Python then calls it with four arguments, and other jitted code by `call_kernel`.
"""

from __future__ import annotations

import ctypes
import functools
import struct
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.code import engine, stand_ins
from symgen.runtime.code.bridge import KERNEL_PROTOTYPE
from symgen.runtime.code.jitted import DISABLE_JIT
from symgen.runtime.code.native import argument_types, flat
from symgen.runtime.record import record

if TYPE_CHECKING:
    from symgen.runtime.code.jitted import Jitted
    from symgen.runtime.code.native import NativeFunction

_TYPES = {
    ctypes.c_void_p: "ptr",
    ctypes.c_ssize_t: "i64",
    ctypes.c_int64: "i64",
    ctypes.c_uint64: "i64",
    ctypes.c_double: "double",
    ctypes.c_uint8: "i8",
}
# The same in `struct`, each of eight bytes.
_SLOTS = {
    ctypes.c_void_p: "Q",
    ctypes.c_uint64: "Q",
    ctypes.c_ssize_t: "q",
    ctypes.c_int64: "q",
    ctypes.c_double: "d",
    ctypes.c_uint8: "B7x",
}
_known: dict[
    str, tuple[struct.Struct, engine.MachineCode, int]
] = {}  # by types of arguments, of which there are few
_FAILED = -1000.0  # what is written where the function has raised an exception


@record(eq=False)
class CallBlock:
    """A call of a jitted function that returns an integer, ready to be made.

    Attributes
    ----------
    address : int
        Of code with a kernel's signature: it reads the block as `y`, and writes the result to `out[0]`.
    block : ndarray of float64
        What it reads: the function's address and its arguments, eight bytes each.
    """

    address: int
    block: np.ndarray
    _call: Any
    _result: np.ndarray
    _keep: Any

    def __post_init__(self):
        vars(self)["_places"] = self.block.ctypes.data, 0, self._result.ctypes.data

    def __call__(self) -> int:
        """Make the call; the interpreter's lock is free meanwhile."""
        if stand_ins.any_waits():
            with stand_ins.counted():
                self._call(0.0, *self._places)
        else:
            self._call(0.0, *self._places)
        return int(self._result[0])

    def take(self, code: NativeFunction) -> None:
        """Call this code of the same function from now on."""
        # What was called may be called still, in another thread.
        vars(self)["_keep"] = (*self._keep, code)
        self.block.view(np.uint64)[0] = code.address


def call_block(function: Jitted, *args: Any) -> CallBlock:
    """Return the call of a function with arguments; arrays are read and written where they are now.

    Parameters
    ----------
    function : Jitted
        It returns an integer.
    """
    if DISABLE_JIT:
        return _interpreted(function, args)
    variant = function.variant(args)
    packing, owner, address = _passing(variant[0], args)
    slots = packing.pack(0, *(0 if x is None else x for x in flat(args)))
    block = np.frombuffer(bytearray(slots), dtype=np.float64)
    call = CallBlock(address, block, KERNEL_PROTOTYPE(address), np.zeros(1), (args, owner))
    call.take(function.follow(call, args, variant))
    return call


def _interpreted(function: Any, args: tuple) -> CallBlock:
    """The same without a compiler, for runs with NUMBA_DISABLE_JIT."""

    def call(_t: float, _y: int, _p: int, out: int) -> None:
        ctypes.c_double.from_address(out).value = float(function(*args))

    callback = KERNEL_PROTOTYPE(call)
    address = ctypes.cast(callback, ctypes.c_void_p).value
    return CallBlock(address, np.zeros(1), callback, np.zeros(1), args)


def _passing(types: str, args: tuple) -> tuple[struct.Struct, engine.MachineCode, int]:
    """Return how a function's address and such arguments are laid out in a block, and the code that passes them on."""
    found = _known.get(types)
    if found is None:
        kinds = argument_types(args)
        layout = struct.Struct("=Q" + "".join(_SLOTS[kind] for kind in kinds))
        found = _known[types] = layout, *_code(tuple(_TYPES[kind] for kind in kinds))
    return found


@functools.lru_cache(maxsize=64)
def _code(kinds: tuple[str, ...]) -> tuple[engine.MachineCode, int]:
    """Return the code that passes arguments of such types on, and its address."""
    owner, ir = engine.MachineCode(), _ir(kinds)
    code = engine.object_code(engine.cache_key(ir), "call block", "pass_on", lambda _: (ir, 0))
    return owner, owner.add(code, "pass_on")


def _ir(kinds: tuple[str, ...]) -> str:
    """Return the code: it loads the arguments from the block, calls, and turns the result into a number.

    A function of Numba's writes its result through the first pointer, an exception through the second, and returns
    0 for a value.
    """
    lines = ["%function = load ptr, ptr %y", "%result = alloca i64", "%error = alloca ptr"]
    passed = ["ptr %result", "ptr %error"]
    for k, kind in enumerate(kinds, 1):
        lines += [f"%at{k} = getelementptr inbounds i64, ptr %y, i64 {k}", f"%a{k} = load {kind}, ptr %at{k}"]
        passed.append(f"{kind} %a{k}")
    lines += [
        f"%status = call i32 %function({', '.join(passed)})",
        "%ok = icmp eq i32 %status, 0",
        "%value = load i64, ptr %result",
        "%number = sitofp i64 %value to double",
        f"%answer = select i1 %ok, double %number, double {_FAILED:e}",
        "store double %answer, ptr %out",
        "ret void",
    ]
    body = "\n".join(lines)
    return f"define void @pass_on(double %t, ptr %y, ptr %p, ptr %out) nounwind {{\nentry:\n{body}\n}}\n"
