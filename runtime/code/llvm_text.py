"""Pieces of LLVM IR as text: functions, loops, declarations, constants, and places in arrays."""

from __future__ import annotations

import struct
from dataclasses import dataclass

INTRINSICS = ("sin", "cos", "exp", "log", "sqrt", "fabs", "pow", "copysign")
LIBM = ("tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh")
BINARY = ("pow", "copysign", "atan2")
PREPARED = "_prepared"  # ends the symbol of a function that takes a prepared `p`

# What LLVM calls them.
MATH_SYMBOLS = {
    **{name: f"llvm.{name}.f64" for name in INTRINSICS},
    **{name: name for name in LIBM},
}


@dataclass(frozen=True)
class Index:
    """A place in an array: `first + step*k`, or the entry `k` of a table where one is named."""

    first: int
    step: int = 0
    table: str = ""

    def label(self) -> str:
        """A text that tells places apart within names of the IR."""
        if self.table:
            return f".{self.table}"
        return f"{self.first}.{self.step}" if self.step else str(self.first)


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


def declarations(called: set[str]) -> str:
    """Return the IR that declares mathematical functions."""
    return "".join(map(_declaration, sorted(called)))


def _declaration(function: str) -> str:
    parameters = "double, double" if function in BINARY else "double"
    attributes = "" if function in INTRINSICS else " nounwind willreturn memory(none)"
    return f"declare double @{MATH_SYMBOLS[function]}({parameters}){attributes}\n"
