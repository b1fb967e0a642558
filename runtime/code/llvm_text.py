"""Pieces of LLVM IR as text: functions, loops, declarations, constants, and places in arrays."""

from __future__ import annotations

import struct

from symgen.runtime.graph.functions import IN_CODE

LIBRARY = tuple(name for name, function in IN_CODE.items() if function.llvm == "library")
PRECOMPUTED = "_precomputed"  # ends the symbol of a function that takes a precomputed `p`


def function(
    symbol: str, arguments: dict[str, str], lines: list[str], linkage: str = "", attributes: str = ""
) -> str:
    """Return the IR of a function without a result."""
    listed = ", ".join(
        f"{kind} noalias %{name}" if kind == "ptr" else f"{kind} %{name}" for name, kind in arguments.items()
    )
    linkage = f"{linkage} " if linkage else ""
    body = "\n".join(lines)
    return f"define {linkage}void @{symbol}({listed}) {attributes}nounwind {{\n{body}\nret void\n}}\n"


def call_arguments(arguments: dict[str, str]) -> str:
    """Return a call's arguments, which bear the names of the callee's."""
    return ", ".join(f"{kind} %{name}" for name, kind in arguments.items())


def loop(symbol: str, arguments: dict[str, str], count: int, entry: list[str], lines: list[str]) -> str:
    """Return the IR of a function that runs `lines` for `k` from 0 to `count`, after `entry`."""
    return function(
        symbol,
        arguments,
        [
            "entry:",
            *entry,
            "br label %again",
            "again:",
            "%k = phi i64 [ 0, %entry ], [ %next, %again ]",
            *lines,
            "%next = add nuw nsw i64 %k, 1",
            f"%more = icmp ult i64 %next, {count}",
            "br i1 %more, label %again, label %done",
            "done:",
        ],
        "internal",
        "noinline ",
    )


def table(name: str, entries: tuple[int, ...]) -> str:
    """Return the IR of a constant array of integers."""
    listed = ", ".join(f"i64 {entry}" for entry in entries)
    return f"@{name} = internal constant [{len(entries)} x i64] [{listed}], align 8\n"


def constant(value: float) -> str:
    """Return a float64 as LLVM writes it, exactly."""
    return f"0x{struct.unpack('<Q', struct.pack('<d', value))[0]:016X}"


def math_symbol(function: str) -> str:
    """Return what LLVM calls a mathematical function."""
    return f"llvm.{function}.f64" if IN_CODE[function].llvm == "intrinsic" else function


def math_declaration(function: str) -> str:
    """Return the IR that declares a mathematical function."""
    parameters = ", ".join(["double"] * IN_CODE[function].arity[0])
    attributes = "" if IN_CODE[function].llvm == "intrinsic" else " nounwind willreturn memory(none)"
    return f"declare double @{math_symbol(function)}({parameters}){attributes}"


def declarations(called: set[str]) -> str:
    """Return the IR that declares mathematical functions."""
    return "".join(f"{math_declaration(function)}\n" for function in sorted(called))
