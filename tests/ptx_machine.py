"""A machine for PTX, one thread after another: the part of NVIDIA's language that programs of ensembles are made of.

Written from the manual of the language (PTX ISA), and from nothing that LLVM knows: registers hold bits, every
operation says how it reads them. Numbers are rounded by Python's own arithmetic and the C library's fma.
"""

from __future__ import annotations

import ctypes
import math
import re
import struct
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

_WORD, _HALF = (1 << 64) - 1, (1 << 32) - 1
_fma = getattr(math, "fma", None)
if _fma is None:
    _fma = ctypes.CDLL(None).fma
    _fma.restype, _fma.argtypes = ctypes.c_double, [ctypes.c_double] * 3
_SIZES = {"8": 1, "16": 2, "32": 4, "64": 8}
_CALL = re.compile(r"call(?:\.uni)?\s+(?:\((\w+)\),\s*)?([\w$]+),\s*\(([\w, ]*)\)")
_OPERANDS = re.compile(r"\{[^}]*\}|\[[^\]]*\]|[^,\s{}\[\]]+")


def number(bits: int) -> float:
    return struct.unpack("<d", struct.pack("<Q", bits))[0]


def bits(value: float) -> int:
    return struct.unpack("<Q", struct.pack("<d", value))[0]


@dataclass
class Function:
    """Instructions, where labels stand, and how much local memory a call takes."""

    name: str
    parameters: list[str]
    instructions: list[tuple] = field(default_factory=list)
    labels: dict[str, int] = field(default_factory=dict)
    depots: dict[str, int] = field(default_factory=dict)


class Machine:
    """A program with its memory.

    Parameters
    ----------
    text : str
        PTX.
    """

    def __init__(self, text: str) -> None:
        self._memory: list[memoryview] = [
            memoryview(bytearray())
        ]  # the place of a byte is (number << 32) + offset
        self._symbols: dict[str, int] = {}
        self.functions: dict[str, Function] = {}
        self.executed: dict[str, int] = {}  # how often, by the kind of instruction
        self._special: dict[str, int] = {}
        self._read(text)

    def place(self, array: np.ndarray) -> int:
        """Give an array a place in memory; what the program writes there is seen in the array."""
        return self._hold(memoryview(array).cast("B") if array.size else memoryview(bytearray()))

    def _hold(self, memory: memoryview) -> int:
        self._memory.append(memory)
        return (len(self._memory) - 1) << 32

    def run(self, entry: str, arguments: list[int | float], blocks: int, threads: int) -> None:
        """Run all threads of a grid; numbers that are floats become their bits."""
        function = self.functions[entry]
        given = [bits(x) if isinstance(x, float) else x & _WORD for x in arguments]
        assert len(given) == len(function.parameters)
        held = len(self._memory)
        for block in range(blocks):
            for thread in range(threads):
                self._special = {
                    "%tid.x": thread, "%ctaid.x": block, "%ntid.x": threads, "%nctaid.x": blocks,
                }  # fmt: skip
                self._call(
                    function, {(name, 0): x for name, x in zip(function.parameters, given, strict=True)}
                )
                del self._memory[held:]  # local memory

    # Reading.

    def _read(self, text: str) -> None:
        text = re.sub(r"//[^\n]*", "", text)
        for name, size, values in re.findall(r"\.global [^=;]*?([\w$]+)\[(\d+)\] = \{([^}]*)\};", text):
            content = bytearray(int(x) for x in values.split(","))
            assert len(content) == int(size)
            self._symbols[name] = self._hold(memoryview(content))
        pattern = r"\.(?:func|entry)\s*(?:\([^)]*\))?\s*([\w$]+)\s*\(([^)]*)\)[^{;]*(\{|;)"
        for found in re.finditer(pattern, text):
            if found[3] == ";":
                continue
            function = Function(found[1], re.findall(r"([\w$]+_param_\d+)", found[2]))
            depth, end = 1, found.end()
            while depth:
                depth += {"{": 1, "}": -1}.get(text[end], 0)
                end += 1
            self._read_body(function, text[found.end() : end - 1])
            self.functions[function.name] = function

    def _read_body(self, function: Function, body: str) -> None:
        # Braces of vectors stay: those of blocks stand on lines of their own.
        lines = [line.strip() for line in re.sub(r"(?m)^\s*[{}]\s*$", "", body).splitlines()]
        for line in lines:
            for size in re.findall(r"\.local \.align \d+ \.b8\s+(\w+)\[(\d+)\];", line):
                function.depots[size[0]] = int(size[1])
            if not line or line[0] == ".":
                continue
            if line.endswith(":"):
                function.labels[line[:-1]] = len(function.instructions)
                continue
            assert line.endswith(";"), line
            function.instructions.append(self._read_instruction(line[:-1].strip()))

    def _read_instruction(self, text: str) -> tuple:
        condition, negated = "", False
        if text[0] == "@":
            guard, text = text.split(None, 1)
            negated, condition = guard[1] == "!", guard.lstrip("@!")
        if text.startswith("call"):
            found = _CALL.fullmatch(text)
            assert found, text
            passed = [name.strip() for name in found[3].split(",") if name.strip()]
            return condition, negated, "call", (found[1], found[2], passed)
        operation, _, rest = text.partition(" ") if " " in text and "\t" not in text else text.partition("\t")
        return condition, negated, operation.strip(), _OPERANDS.findall(rest)

    # Running.

    def _call(self, function: Function, passed: dict[tuple[str, int], int]) -> dict[tuple[str, int], int]:
        """Run a function with what stands in its parameters; returns what it leaves in its result's."""
        frame = Frame(self, function, passed)
        at, instructions = 0, function.instructions
        while True:
            condition, negated, operation, operands = instructions[at]
            at += 1
            if condition and frame.registers[condition] == negated:
                continue
            self.executed[operation] = self.executed.get(operation, 0) + 1
            if operation == "ret":
                return frame.parameters
            if operation in ("bra", "bra.uni"):
                at = function.labels[operands[0]]
            elif operation == "call":
                self._call_from(frame, *operands)
            else:
                frame.execute(operation, operands)

    def _call_from(self, frame: Frame, result: str, name: str, passed: list[str]) -> None:
        callee = self.functions[name]
        given = {
            (inner, offset): value
            for inner, outer in zip(callee.parameters, passed, strict=True)
            for (known, offset), value in frame.parameters.items()
            if known == outer
        }
        for (known, offset), value in self._call(callee, given).items():
            if result and known.startswith("func_retval"):
                frame.parameters[result, offset] = value


class Frame:
    """A call: registers, local memory, and the values in the space of parameters."""

    def __init__(self, machine: Machine, function: Function, passed: dict[tuple[str, int], int]) -> None:
        self.machine, self.parameters = machine, dict(passed)
        self.registers: dict[str, int | bool] = {}
        self._symbols = {
            name: machine._hold(memoryview(bytearray(size))) for name, size in function.depots.items()
        }
        self._carry = 0

    def execute(self, operation: str, operands: list[str]) -> None:
        kind, *modifiers = operation.split(".")
        if kind in ("ld", "st"):
            self._move(kind, modifiers, operands)
        elif kind == "mov" and "{" in "".join(operands):
            self._pack(operands)
        else:
            self._set(operands[0], _OPERATIONS[kind](self, modifiers, [self.value(x) for x in operands[1:]]))

    def value(self, text: str) -> int | bool:
        if text[0] == "%":
            special = self.machine._special.get(text)
            return self.registers[text] if special is None else special
        if text.startswith(("0d", "0D")):
            return int(text[2:], 16)
        if text.lstrip("-").isdigit():
            return int(text) & _WORD
        return self._symbols.get(text) or self.machine._symbols[text]

    def _set(self, register: str, value: int | bool) -> None:
        assert register[0] == "%", register
        self.registers[register] = value & _WORD if type(value) is int else value

    def _pack(self, operands: list[str]) -> None:
        target, source = operands
        if target[0] == "{":
            whole = self.value(source)
            for k, register in enumerate(_OPERANDS.findall(target[1:-1])):
                if register != "_":
                    self._set(register, whole >> (32 * k) & _HALF)
            return
        parts = [self.value(x) & _HALF for x in _OPERANDS.findall(source[1:-1])]
        self._set(target, parts[0] | parts[1] << 32)

    def _move(self, kind: str, modifiers: list[str], operands: list[str]) -> None:
        place, held = operands if kind == "st" else operands[::-1]
        names = _OPERANDS.findall(held[1:-1]) if held[0] == "{" else [held]
        size = _SIZES[modifiers[-1][1:]]
        base, _, offset = place[1:-1].partition("+")
        for k, name in enumerate(names):
            shift = int(offset or 0) + k * size
            if "param" in modifiers:
                if kind == "ld":
                    self._set(name, self.parameters[base, shift])
                else:
                    self.parameters[base, shift] = self.value(name) & _WORD
                continue
            address = self.value(base) + shift
            memory, at = self.machine._memory[address >> 32], address & _HALF
            assert at + size <= len(memory), f"{place} is beyond its array"
            if kind == "ld":
                self._set(name, int.from_bytes(memory[at : at + size], "little"))
            else:
                memory[at : at + size] = (self.value(name) & ((1 << 8 * size) - 1)).to_bytes(size, "little")


def _signed(value: int, width: int) -> int:
    value &= (1 << width) - 1
    return value - (1 << width) if value >> (width - 1) else value


def _width(modifiers: list[str]) -> int:
    return int(modifiers[-1][1:])


def _as_integer(modifiers: list[str], value: int) -> int:
    width = _width(modifiers)
    return _signed(value, width) if modifiers[-1][0] == "s" else value & ((1 << width) - 1)


def _of_numbers(function: Callable[..., float]) -> Callable:
    def apply(_frame: Frame, modifiers: list[str], values: list[int]) -> int:
        assert "rn" in modifiers or function in (abs, _negated, _smaller, _larger), modifiers
        return bits(function(*map(number, values)))

    return apply


def _quotient(a: float, b: float) -> float:
    if b == 0.0:
        return math.nan if a == 0.0 or a != a else math.copysign(math.inf, a) * math.copysign(1.0, b)
    return a / b


def _negated(a: float) -> float:
    return -a


def _smaller(a: float, b: float) -> float:
    if a != a or b != b:
        return b if a != a else a
    return min(a, b, key=lambda x: (x, math.copysign(1.0, x)))


def _larger(a: float, b: float) -> float:
    if a != a or b != b:
        return b if a != a else a
    return max(a, b, key=lambda x: (x, math.copysign(1.0, x)))


def _fused(a: float, b: float, c: float) -> float:
    return _fma(a, b, c)


def _arithmetic(of_numbers: Callable, of_integers: Callable[[int, int], int]) -> Callable:
    """`add`, `sub` and `mul`, of numbers, or of whole numbers with or without what is carried."""
    exact = _of_numbers(of_numbers)

    def apply(frame: Frame, modifiers: list[str], values: list[int]) -> int:
        if modifiers[-1] == "f64":
            return exact(frame, modifiers, values)
        width = _width(modifiers)
        a, b = (x & ((1 << width) - 1) for x in values)
        result = of_integers(a, b)
        if "cc" in modifiers:
            frame._carry = int(result < 0 or result >> width > 0)
        return result & ((1 << width) - 1)

    return apply


def _with_carry(sign: int) -> Callable:
    def apply(frame: Frame, modifiers: list[str], values: list[int]) -> int:
        width = _width(modifiers)
        a, b = (x & ((1 << width) - 1) for x in values)
        result = a + sign * (b + frame._carry)
        if "cc" in modifiers:
            frame._carry = int(result < 0 or result >> width > 0)
        return result & ((1 << width) - 1)

    return apply


def _product(frame: Frame, modifiers: list[str], values: list[int]) -> int:
    if modifiers[-1] == "f64":
        return _of_numbers(lambda a, b: a * b)(frame, modifiers, values)
    a, b = (_as_integer(modifiers, x) for x in values)
    return a * b >> _width(modifiers) if "hi" in modifiers else a * b


def _compare(_frame: Frame, modifiers: list[str], values: list[int]) -> bool:
    relation, kind = modifiers[0], modifiers[-1]
    if kind == "f64":
        a, b = map(number, values)
        unordered = a != a or b != b
        if relation in ("num", "nan"):
            return unordered == (relation == "nan")
        if unordered:
            return relation[-1] == "u" and len(relation) == 3
        relation = relation[:2]
    else:
        a, b = (_as_integer(modifiers, x) for x in values)
        relation = {"lo": "lt", "ls": "le", "hi": "gt", "hs": "ge"}.get(relation, relation)
    return {"eq": a == b, "ne": a != b, "lt": a < b, "le": a <= b, "gt": a > b, "ge": a >= b}[relation]


def _convert(_frame: Frame, modifiers: list[str], values: list[int]) -> int:
    *rounding, to, source = modifiers
    if source == "f64" and to == "f64":
        assert rounding == ["rni"], modifiers
        a = number(values[0])
        return bits(math.copysign(float(round(a)), a) if math.isfinite(a) and abs(a) < 2.0**52 else a)
    if source == "f64":
        assert rounding == ["rzi"] and to == "s64", modifiers
        a = number(values[0])
        return 0 if a != a else int(max(min(a, 2.0**63 - 1024), -(2.0**63)))
    whole = _as_integer([source], values[0])
    if to == "f64":
        assert rounding == ["rn"], modifiers
        return bits(float(whole))
    return whole & ((1 << int(to[1:])) - 1)


def _logic(function: Callable[[int, int], int]) -> Callable:
    return lambda _frame, _modifiers, values: function(*values)


def _shift(frame: Frame, modifiers: list[str], values: list[int]) -> int:
    a, n = _as_integer(modifiers, values[0]), values[1] & _HALF
    return a >> min(n, 64)


def _funnel(_frame: Frame, modifiers: list[str], values: list[int]) -> int:
    assert modifiers == ["l", "wrap", "b32"], modifiers
    low, high, n = values[0] & _HALF, values[1] & _HALF, values[2] & 31
    return ((high << 32 | low) << n) >> 32 & _HALF


_OPERATIONS: dict[str, Callable] = {
    "add": _arithmetic(lambda a, b: a + b, lambda a, b: a + b),
    "sub": _arithmetic(lambda a, b: a - b, lambda a, b: a - b),
    "addc": _with_carry(1),
    "subc": _with_carry(-1),
    "mul": _product,
    "mad": lambda f, m, x: _product(f, m, x[:2]) + x[2],
    "fma": _of_numbers(_fused),
    "div": _of_numbers(_quotient),
    "rcp": _of_numbers(lambda a: _quotient(1.0, a)),
    "sqrt": _of_numbers(lambda a: math.sqrt(a) if a >= 0.0 else math.nan),
    "abs": _of_numbers(abs),
    "neg": lambda f, m, x: _of_numbers(_negated)(f, m, x) if m[-1] == "f64" else -x[0],
    "min": _of_numbers(_smaller),
    "max": _of_numbers(_larger),
    "setp": _compare,
    "selp": lambda _f, _m, x: x[0] if x[2] else x[1],
    "cvt": _convert,
    "cvta": lambda _f, _m, x: x[0],
    "mov": lambda _f, m, x: bool(x[0]) if m[-1] == "pred" else x[0],
    "and": _logic(lambda a, b: a & b),
    "or": _logic(lambda a, b: a | b),
    "xor": _logic(lambda a, b: a ^ b),
    "not": lambda _f, m, x: not x[0] if m[-1] == "pred" else ~x[0] & ((1 << _width(m)) - 1),
    "shl": lambda _f, m, x: x[0] << min(x[1] & _HALF, 64) & ((1 << _width(m)) - 1),
    "shr": _shift,
    "shf": _funnel,
}
