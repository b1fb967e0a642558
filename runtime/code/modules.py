"""LLVM modules of kernels: a function as it stands, a function apart from its hoisted work, and all hoisted work."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from symgen.runtime.code.function_text import FunctionText
from symgen.runtime.code.llvm_text import PRECOMPUTED, declarations, function, lanes_type, table
from symgen.runtime.code.lower import Lowering, NoLanes
from symgen.runtime.code.sincos import inlined_where_few

_ABI = {"t": "double", "y": "ptr", "p": "ptr", "out": "ptr"}
_PASSED = "double %t, ptr %y, ptr %p, ptr %out"
_LARGEST_ON_STACK = 16_384  # values


@dataclass(frozen=True)
class Lowered:
    """A module as LLVM IR, and the number of operations in it; loops count once."""

    ir: str
    operations: int


class _Module:
    """Collects the functions of one LLVM module, which work on so many lanes at once; 0: on plain numbers."""

    def __init__(self, lanes: int = 0) -> None:
        self._lanes, self._number = lanes, lanes_type(lanes)
        self._abi = {**_ABI, "t": self._number}
        self.passed = _PASSED.replace("double", self._number)
        self._parts: list[str] = []
        self._called: set[str] = set()
        self._tables: dict[str, tuple[int, ...]] = {}
        self._solvers: dict[str, str] = {}
        self.operations = 0

    def add(self, source: FunctionText, part: str, symbol: str, linkage: str = "internal") -> Lowering:
        """Define `symbol`: a part of a function, that takes `h` besides unless the part is "whole"."""
        lowering = Lowering(source, part, self._lanes)
        inner = f"{symbol}.code"
        lowering.lower(inner)
        self._called |= lowering.code.called
        self._tables |= {name: source.tables[name] for name in sorted(lowering.code.tables)}
        self.operations += lowering.code.operations
        self._solvers |= lowering.code.solvers
        if not lowering.spaces:
            self._parts.append(lowering.code.text(symbol, linkage))
            return lowering
        self._parts.append(lowering.code.text(inner, "internal"))
        more = {} if part == "whole" else {"h": "ptr"}
        passed = self.passed + "".join(f", ptr %{name}" for name in more)
        passed += "".join(f", ptr %{name}" for name in lowering.spaces)
        begin, end = self.make_spaces(lowering.spaces)
        self.define(symbol, [*begin, f"call void @{inner}({passed})", *end], linkage, more)
        return lowering

    def make_spaces(self, spaces: dict[str, int]) -> tuple[list[str], list[str]]:
        """Lines that make arrays, on the stack unless they are large, and lines that give them back."""
        begin, end = [], []
        for name, length in spaces.items():
            size = 8 * max(self._lanes, 1)
            if length * size <= 8 * _LARGEST_ON_STACK:
                begin.append(f"%{name} = alloca {self._number}, i64 {length}, align {max(64, size)}")
                continue
            if self._lanes:
                raise NoLanes(f"it works on arrays of {length} numbers for each member")
            self._solvers["malloc"] = "declare noalias ptr @malloc(i64)\ndeclare void @free(ptr)\n"
            begin += [
                f"%{name} = call ptr @malloc(i64 {size * length})",
                f"%{name}.none = icmp eq ptr %{name}, null",
                f"br i1 %{name}.none, label %{name}.missing, label %{name}.there",
                # Without room for it the result is nan, which is told to the user.
                f"{name}.missing:",
                "store double 0x7FF8000000000000, ptr %out",
                *end,
                "ret void",
                f"{name}.there:",
            ]
            end.append(f"call void @free(ptr %{name})")
        return begin, end

    def define(
        self, symbol: str, lines: list[str], linkage: str = "", more: dict[str, str] | None = None
    ) -> None:
        """Define a function by the lines of its body."""
        self._parts.append(function(symbol, {**self._abi, **(more or {})}, lines, linkage))

    def lowered(self) -> Lowered:
        tables = [table(name, entries) for name, entries in self._tables.items()]
        before = (*tables, declarations(self._called), *self._solvers.values())
        return Lowered(inlined_where_few("".join((*before, *self._parts))), self.operations)


def lower_function(source: FunctionText, symbol: str) -> Lowered:
    """Lower one function to LLVM IR, as it stands.

    Parameters
    ----------
    source : FunctionText
    symbol : str
        The name of the machine-code function `void symbol(double, ptr, ptr, ptr)`.

    Raises
    ------
    ModuleError
        The text is outside of the grammar of ABI 1 or indexes beyond its arrays; names the line.
    """
    module = _Module()
    module.add(source, "whole", symbol, "")
    return module.lowered()


def lower_kernel(source: FunctionText, symbol: str, n_hoisted: int, offset: int) -> Lowered:
    """Lower one function apart from its hoisted work.

    Parameters
    ----------
    source : FunctionText
    symbol : str
        Keeps to the ABI: it does the hoisted work on every call. `symbol_precomputed` takes a longer `p`, from
        `System.precomputed`, in which the hoisted values stand.
    n_hoisted : int
        How many hoisted values the header says that the function has.
    offset : int
        The place of the first in the longer `p`.
    """
    module = _Module()
    met = module.add(source, "setup", f"{symbol}.setup").n_hoisted
    body = module.add(source, "body", f"{symbol}.body").n_hoisted
    if not met == body == n_hoisted:
        source.refuse(1, f"it has {max(met, body)} hoisted values, but the header says {n_hoisted}")
    call = f"call void @{symbol}.body({_PASSED}, ptr %h)"
    begin, end = module.make_spaces({"h": n_hoisted})
    module.define(symbol, [*begin, f"call void @{symbol}.setup({_PASSED}, ptr %h)", call, *end])
    there = f"%h = getelementptr inbounds double, ptr %p, i64 {offset}"
    module.define(symbol + PRECOMPUTED, [there, f"tail {call}"])
    return module.lowered()


def lower_setup(sources: Sequence[tuple[FunctionText, int]], symbol: str) -> Lowered:
    """Lower the hoisted work of several functions, with the numbers of their values, to one function.

    It writes all values to `out`, one function's after another's.
    """
    module, lines, offset = _Module(), [], 0
    for number, (source, n_hoisted) in enumerate(sources):
        name = f"{symbol}.{number}"
        met = module.add(source, "setup", name).n_hoisted
        if met != n_hoisted:
            source.refuse(1, f"it has {met} hoisted values, but the header says {n_hoisted}")
        lines.append(f"%h{number} = getelementptr inbounds double, ptr %out, i64 {offset}")
        lines.append(f"call void @{name}({_PASSED}, ptr %h{number})")
        offset += n_hoisted
    module.define(symbol, lines)
    return module.lowered()


def lower_lanes(source: FunctionText, symbol: str, n_hoisted: int, offset: int, lanes: int) -> Lowered:
    """Lower one function for several members of an ensemble at once.

    The function is `void symbol(V t, ptr y, ptr p, ptr out)` with V a vector of `lanes` numbers, one for each member;
    arrays hold such vectors. Each member's results have the bits that they have alone, at any number of lanes.

    Parameters
    ----------
    source : FunctionText
    symbol : str
    n_hoisted, offset : int
        As in `lower_kernel`: `p` is a precomputed one.
    lanes : int

    Raises
    ------
    NoLanes
        It cannot be done; says why.
    """
    module = _Module(lanes)
    if not n_hoisted:
        module.add(source, "whole", symbol, "")
        return module.lowered()
    module.add(source, "body", f"{symbol}.body")
    there = f"%h = getelementptr inbounds {lanes_type(lanes)}, ptr %p, i64 {offset}"
    module.define(symbol, [there, f"tail call void @{symbol}.body({module.passed}, ptr %h)"])
    return module.lowered()
