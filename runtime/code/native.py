"""Machine code of jitted functions, called without Numba.

Arguments are passed flat, as Numba's own calling convention has it: an array is (owner, parent, size, item size, data,
shape…, strides…), a named tuple its fields; the result and an error come back through pointers.
"""

from __future__ import annotations

import ast
import ctypes
import functools
from collections.abc import Callable
from typing import Any

import numpy as np

from symgen.runtime.code import engine
from symgen.runtime.code.bridge import address_of

RESULTS = {"int64": ctypes.c_int64, "float64": ctypes.c_double, "bool": ctypes.c_uint8}
_RETURNED = (0, -2)  # Numba's return codes for a value and for None

# Numba's reshape of an array asks for the new strides; here arrays are contiguous, so they follow from the shape.
_RESHAPE = """
define i32 @reshape(i64 %nd, ptr %dims, ptr %strides, i64 %n, ptr %shape, ptr %new, i64 %itemsize, i32 %order) {
entry:
  br label %head
head:
  %i = phi i64 [ %n, %entry ], [ %j, %body ]
  %stride = phi i64 [ %itemsize, %entry ], [ %next, %body ]
  %more = icmp sgt i64 %i, 0
  br i1 %more, label %body, label %done
body:
  %j = sub i64 %i, 1
  %slot = getelementptr i64, ptr %new, i64 %j
  store i64 %stride, ptr %slot
  %length_at = getelementptr i64, ptr %shape, i64 %j
  %length = load i64, ptr %length_at
  %next = mul i64 %stride, %length
  br label %head
done:
  ret i32 1
}
"""


def signature(args: tuple) -> str:
    """Return the types of arguments, as a text that decides which machine code fits them.

    Raises
    ------
    TypeError
        An argument is none of: number, C-contiguous array, named tuple of these.
    """
    return ",".join(_type_name(value) for value in args)


def _type_name(value: Any) -> str:
    if isinstance(value, np.ndarray):
        if not value.flags.carray:
            raise TypeError(
                f"a jitted function takes contiguous, writable arrays; got strides {value.strides}"
            )
        return f"{value.dtype.str}{value.ndim}"
    if isinstance(value, tuple) and hasattr(value, "_fields"):
        return f"{type(value).__qualname__}({','.join(_type_name(item) for item in value)})"
    if isinstance(value, (bool, np.bool_)):
        return "b"
    if isinstance(value, np.uint64):
        return "u"
    if isinstance(value, (int, np.integer)):
        return "i"
    if isinstance(value, (float, np.floating)):
        return "f"
    raise TypeError(
        f"a jitted function takes numbers, arrays and named tuples of them, not {type(value).__name__}"
    )


def layout(args: tuple) -> str:
    """Return `signature` with the names of fields: what machine code for these arguments is compiled for."""
    return ",".join(_layout(value) for value in args)


def _layout(value: Any) -> str:
    if isinstance(value, tuple) and hasattr(value, "_fields"):
        fields = (f"{name}:{_layout(item)}" for name, item in zip(value._fields, value))
        return f"{type(value).__qualname__}({','.join(fields)})"
    return _type_name(value)


def _flatten(value: Any, out: list) -> None:
    if isinstance(value, np.ndarray):
        out += [None, None, value.size, value.itemsize, address_of(value), *value.shape, *value.strides]
    elif isinstance(value, tuple):
        for item in value:
            _flatten(item, out)
    elif isinstance(value, (float, np.floating)):
        out.append(float(value))
    else:
        out.append(int(value))


def argument_types(args: tuple) -> list:
    """Return the types in C of arguments, flat."""
    kinds: list = []
    for value in args:
        if isinstance(value, np.ndarray):
            pointer, size = ctypes.c_void_p, ctypes.c_ssize_t
            kinds += [pointer, pointer, size, size, pointer, *[size] * (2 * value.ndim)]
        elif isinstance(value, tuple):
            kinds += argument_types(value)
        elif isinstance(value, (bool, np.bool_)):
            kinds.append(ctypes.c_uint8)
        elif isinstance(value, (float, np.floating)):
            kinds.append(ctypes.c_double)
        else:
            kinds.append(ctypes.c_uint64 if isinstance(value, np.uint64) else ctypes.c_int64)
    return kinds


def flat(args: tuple) -> list:
    """Return arguments one by one, as they are passed."""
    values: list = []
    for value in args:
        _flatten(value, values)
    return values


def pack(code: bytes, symbol: str, results: list[str], needs: list[str]) -> bytes:
    """Put object code or bitcode, and what is needed to call it, into one block.

    Parameters
    ----------
    code : bytes
    symbol : str
        The function in it.
    results : list of str
        Types of its results, keys of `RESULTS`; none, one, or those of a tuple.
    needs : list of str
        Symbols that it refers to.
    """
    head = repr({"symbol": symbol, "results": results, "needs": needs}).encode()
    return len(head).to_bytes(8, "little") + head + code


def unpack(content: bytes) -> tuple[dict, bytes]:
    """Return what `pack` was given: symbol, results and needs by name, and the code."""
    end = 8 + int.from_bytes(content[:8], "little")
    return ast.literal_eval(content[8:end].decode()), content[end:]


class NativeFunction:
    """Machine code of one jitted function for one signature.

    Parameters
    ----------
    name : str
    content : bytes
        From `pack`.
    kinds : list
        Types in C of the arguments that it was compiled for, from `argument_types`.

    Attributes
    ----------
    address : int
    size : int
        Bytes of the object code.
    """

    def __init__(self, name: str, content: bytes, kinds: list) -> None:
        head, code = unpack(content)
        self.name, self.size = name, len(code)
        self._code = engine.MachineCode(_provided(head["needs"]))
        self.address = self._code.add(code, head["symbol"])
        fields = [(f"f{k}", RESULTS[kind]) for k, kind in enumerate(head["results"])]
        self._result = type("Result", (ctypes.Structure,), {"_fields_": fields})
        self._n_results = len(fields)
        self._booleans = [kind == "bool" for kind in head["results"]]
        self._kinds = kinds

    @functools.cached_property
    def _call(self) -> Any:
        """The function for calls from Python, whose ctypes pass 1024 arguments at most; a `CallBlock` passes more."""
        prototype = ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.c_void_p, ctypes.c_void_p, *self._kinds)
        return prototype(self.address)

    def __call__(self, *args: Any) -> Any:
        return self.bind(*args)()

    def bind(self, *args: Any) -> Callable[[], Any]:
        """Return the call with these arguments, for calls in a row: converting arrays takes longer than a short run."""
        values = flat(args)
        result, error = self._result(), ctypes.c_void_p()
        pointers = [ctypes.addressof(result), ctypes.addressof(error)]
        passed = [kind(value) for kind, value in zip(self._call.argtypes, pointers + values)]

        def call(_keep: tuple = (args, error)) -> Any:
            return self._returned(self._call(*passed), result)

        return call

    def _returned(self, status: int, result: Any) -> Any:
        if status not in _RETURNED:
            raise RuntimeError(
                f"internal error: the jitted function {self.name} raised an exception (code {status})"
            )
        values = [getattr(result, field) for field, _ in self._result._fields_]
        values = [bool(v) if flag else v for v, flag in zip(values, self._booleans)]
        if self._n_results == 0:
            return None
        return values[0] if self._n_results == 1 else tuple(values)


def _provided(needs: list[str]) -> dict[str, int]:
    """Return addresses of what the code refers to and the process does not define.

    Numba's own entries are never reached from step loops, except the one for reshaping: the others end the process.
    """
    missing = [name for name in needs if not engine.process_symbol(name)]
    return {
        name: _reshape() if name == "numba_attempt_nocopy_reshape" else engine.process_symbol("abort")
        for name in missing
    }


@functools.lru_cache(maxsize=1)
def _reshape() -> int:
    code = engine.MachineCode()
    content = engine.object_code(engine.cache_key(_RESHAPE), "reshape", "reshape", lambda _: (_RESHAPE, 0))
    _reshape_codes.append(code)
    return code.add(content, "reshape")


_reshape_codes: list[
    engine.MachineCode
] = []  # live as long as the process; one for each thread that came at once
