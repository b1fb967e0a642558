"""Pieces of LLVM IR as text: functions, loops, declarations, constants, and places in arrays."""

from __future__ import annotations

import struct

from symgen.runtime.graph.functions import IN_CODE

LIBRARY = tuple(name for name, function in IN_CODE.items() if function.llvm == "library")
PRECOMPUTED = "_precomputed"  # ends the symbol of a function that takes a precomputed `p`
ENTRY, PLACE = ".entry", ".place"  # end the symbols of what `entry` makes for a function


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


def entry(symbol: str) -> str:
    """Return the IR of a kernel that goes on to the one whose address stands in a variable, at first `symbol`."""
    passed = "double %t, ptr %y, ptr %p, ptr %out"
    return (
        f"@{symbol}{PLACE} = global ptr @{symbol}\n"
        f"define void @{symbol}{ENTRY}({passed}) nounwind {{\n"
        f"%code = load atomic ptr, ptr @{symbol}{PLACE} monotonic, align 8\n"
        f"tail call void %code({passed})\nret void\n}}\n"
    )


def call_arguments(arguments: dict[str, str]) -> str:
    """Return a call's arguments, which bear the names of the callee's."""
    return ", ".join(f"{kind} %{name}" for name, kind in arguments.items())


def loop(
    symbol: str,
    arguments: dict[str, str],
    stop: int | str,
    entry: list[str],
    lines: list[str],
    start: int = 0,
    step: int = 1,
) -> str:
    """Return the IR of a function that runs `lines` for `k` from `start` to `stop`, after `entry`."""
    return function(
        symbol,
        arguments,
        [
            "entry:",
            *entry,
            "br label %again",
            "again:",
            f"%k = phi i64 [ {start}, %entry ], [ %next, %again ]",
            *lines,
            f"%next = add nuw nsw i64 %k, {step}",
            f"%more = icmp ult i64 %next, {stop}",
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


def number_table(name: str, entries: list[float]) -> str:
    """Return the IR of a constant array of numbers."""
    listed = ", ".join(f"double {constant(entry)}" for entry in entries)
    return f"@{name} = internal constant [{len(entries)} x double] [{listed}], align 8"


def constant(value: float) -> str:
    """Return a float64 as LLVM writes it, exactly."""
    return f"0x{struct.unpack('<Q', struct.pack('<d', value))[0]:016X}"


def lanes_type(lanes: int) -> str:
    """Return the type of a number in code for so many members of an ensemble at once; 0: for one, as a plain number."""
    return f"<{lanes} x double>" if lanes else "double"


def lanes_suffix(lanes: int) -> str:
    """Return how names of intrinsics on that type end."""
    return f"v{lanes}f64" if lanes else "f64"


def lanes_constant(value: float, lanes: int) -> str:
    """Return a float64 in all lanes."""
    return f"splat (double {constant(value)})" if lanes else constant(value)


def math_symbol(function: str) -> str:
    """Return what LLVM calls a mathematical function."""
    return f"llvm.{function}.f64" if IN_CODE[function].llvm == "intrinsic" else function


def math_declaration(function: str) -> str:
    """Return the IR that declares a mathematical function."""
    parameters = ", ".join(["double"] * IN_CODE[function].arity[0])
    attributes = "" if IN_CODE[function].llvm == "intrinsic" else " nounwind willreturn memory(none)"
    return f"declare double @{math_symbol(function)}({parameters}){attributes}"


# Functions of numbers that processors have for vectors too, to the same bits.
VECTOR_INTRINSICS = ("sqrt", "fabs", "floor", "copysign")


def lanes_call(function: str, n_arguments: int, lanes: int) -> tuple[str, str]:
    """Return the symbol of a mathematical function on vectors, and the IR that declares or defines it."""
    kind = lanes_type(lanes)
    if function in VECTOR_INTRINSICS:
        symbol = f"llvm.{function}.{lanes_suffix(lanes)}"
        return symbol, f"declare {kind} @{symbol}({', '.join([kind] * n_arguments)})\n"
    symbol = f"symgen.each.{function}"
    return symbol, each_lane(symbol, function, n_arguments, lanes)


def each_lane(symbol: str, function: str, n_arguments: int, lanes: int) -> str:
    """Return the IR of a function on vectors that calls a mathematical function for one lane after another."""
    kind, names = lanes_type(lanes), [f"a{k}" for k in range(n_arguments)]
    lines, result = [], "poison"
    for lane in range(lanes):
        lines += [f"%{name}.{lane} = extractelement {kind} %{name}, i32 {lane}" for name in names]
        passed = ", ".join(f"double %{name}.{lane}" for name in names)
        lines += [
            f"%r.{lane} = call double @{math_symbol(function)}({passed})",
            f"%all.{lane} = insertelement {kind} {result}, double %r.{lane}, i32 {lane}",
        ]
        result = f"%all.{lane}"
    arguments = ", ".join(f"{kind} %{name}" for name in names)
    body = "\n".join(lines)
    return f"define internal {kind} @{symbol}({arguments}) noinline nounwind {{\n{body}\nret {kind} {result}\n}}\n"


def declarations(called: set[str]) -> str:
    """Return the IR that declares mathematical functions."""
    return "".join(f"{math_declaration(function)}\n" for function in sorted(called))
