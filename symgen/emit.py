"""From a derived program to the text of its generated module: plain, readable, deterministic Python."""

from __future__ import annotations

from collections import Counter

from .derive.graph import INPUT, LAM, PARAM, UNARY, A, Graph, Q, T, V
from .derive.program import Function, Program

LONGEST_INLINE = 60  # characters of an expression that is written where it is used instead of getting a name

# Binding strength of printed expressions.
_CONDITIONAL, _SUM, _PRODUCT, _SIGN, _ATOM = range(5)


def emit(program: Program) -> str:
    """The text of the generated module.

    The text is a function of the program alone: no dates, paths or hashes of the process.
    """
    names = _variable_names(program)
    bodies = [_FunctionText(program.graph, f, names, program.header).text() for f in program.functions]
    used = sorted({name for _, calls in bodies for name in calls})
    head = program.header
    parts = [
        f'"""{_one_line(head["name"])}: equations of motion, written by {head["generator"]}. Do not edit.',
        "",
        f"{_one_line(head['description'])}" if head["description"] else "No description.",
        '"""',
        "",
        *([f"from math import {', '.join(used)}", ""] if used else []),
        "from numba import njit",
        "",
        *_header_lines(head),
        "",
    ]
    return "\n".join(parts) + "\n" + "\n\n".join(text for text, _ in bodies)


def _one_line(text: str) -> str:
    """Text that may stand in a docstring: no control characters, quotes or escapes."""
    text = "".join(c if c.isprintable() else " " for c in text)
    return " ".join(text.split()).replace("\\", "/").replace('"', "'")


def _header_lines(head: dict) -> list[str]:
    lines = ["MODEL = {"]
    for key, value in head.items():
        if isinstance(value, list) and value:
            lines.append(f'    "{key}": [')
            lines += [f"        {_literal(item)}," for item in value]
            lines.append("    ],")
        elif isinstance(value, dict) and value:
            lines.append(f'    "{key}": {{')
            lines += [f"        {_literal(k)}: {_literal(v)}," for k, v in value.items()]
            lines.append("    },")
        else:
            lines.append(f'    "{key}": {_literal(value)},')
    return [*lines, "}"]


def _literal(value: object) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_literal(k)}: {_literal(v)}" for k, v in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_literal(v) for v in value) + "]"
    if isinstance(value, str):
        text = ascii(value)
        return text if '"' in text else '"' + text[1:-1].replace("\\'", "'") + '"'
    return repr(value)


def _variable_names(program: Program) -> dict[tuple[int, int], str]:
    """Prefixed names, so that a model's own names can clash neither with each other nor with temporaries."""
    head = program.header
    groups = {
        Q: ("q", head["coordinates"]),
        V: ("v", head["rates"]),
        A: ("a", head["rates"]),
        LAM: ("lam", head["constraints"]),
        PARAM: ("p", head["parameters"]),
        INPUT: ("u", head["inputs"]),
    }
    names = {(T, 0): "t"}
    for kind, (prefix, entries) in groups.items():
        names |= {(kind, k): f"{prefix}_{entry['name']}" for k, entry in enumerate(entries)}
    return names


class _FunctionText:
    """Prints one function: inputs unpacked, one line per shared or long operation, outputs."""

    def __init__(self, g: Graph, function: Function, names: dict[tuple[int, int], str], head: dict) -> None:
        self.g, self.function, self.names, self.head = g, function, names, head
        self.written = function.written(g)
        self.uses = Counter(node for _, node in self.written)
        self.nodes = g.reachable(node for _, node in self.written)
        for node in self.nodes:
            self.uses.update(g.operands(node))
        self.calls: set[str] = set()
        self.printed: dict[int, tuple[str, int]] = {}  # expression and its binding strength
        self.lines: list[str] = []

    def text(self) -> tuple[str, set[str]]:
        for node in self._schedule():
            self._print(node)
        operations = sum(self.g.op[n] not in ("const", "var") for n in self.nodes)
        lines = ['@njit(error_model="numpy")', f"def {self.function.name}(t, y, p, out):"]
        lines.append(f'    """{self.function.doc} {operations} operations."""')
        lines += [f"    {line}" for line in (*self._inputs(), *self.lines)]
        lines += [f"    out[{k}] = {self.printed[node][0]}" for k, node in self.written]
        return "\n".join(lines) + "\n", self.calls

    def _inputs(self) -> list[str]:
        return [
            f"{self.names[args]} = {self._place(*args)}"
            for args in sorted(self.g.args[n] for n in self.nodes if self.g.op[n] == "var")
            if args[0] != T
        ]

    def _place(self, kind: int, index: int) -> str:
        head = self.head
        offsets = {Q: 0, V: head["nq"], A: head["nq"] + head["nv"], LAM: head["nq"] + 2 * head["nv"]}
        if kind in (PARAM, INPUT):
            return f"p[{index + (len(head['parameters']) if kind == INPUT else 0)}]"
        return f"y[{offsets[kind] + index}]"

    def _schedule(self) -> list[int]:
        """Depth-first post-order from the outputs: short lifetimes, which halves LLVM's time."""
        done: set[int] = set()
        order: list[int] = []
        for _, output in self.written:
            stack = [output]
            while stack:
                node = stack[-1]
                waiting = [x for x in self.g.operands(node) if x not in done] if node not in done else []
                if waiting:
                    stack.extend(reversed(waiting))
                    continue
                stack.pop()
                if node not in done:
                    done.add(node)
                    order.append(node)
        return order

    def _print(self, node: int) -> None:
        g = self.g
        op, args = g.op[node], g.args[node]
        if op == "var":
            self.printed[node] = (self.names[args], _ATOM)
            return
        if op == "const":
            self.printed[node] = (repr(args[0]), _SIGN if args[0] < 0.0 else _ATOM)
            return
        text, strength = self._expression(op, args)
        if self.uses[node] > 1 or len(text) > LONGEST_INLINE:
            name = f"x{len(self.lines)}"
            self.lines.append(f"{name} = {text}")
            text, strength = name, _ATOM
        self.printed[node] = (text, strength)

    def _expression(self, op: str, args: tuple[int, ...]) -> tuple[str, int]:
        at = self._at
        match op:
            case "add":
                return f"{at(args[0], _SUM)} + {at(args[1], _PRODUCT)}", _SUM
            case "sub":
                return f"{at(args[0], _SUM)} - {at(args[1], _PRODUCT)}", _SUM
            case "mul":
                return f"{at(args[0], _PRODUCT)}*{at(args[1], _SIGN)}", _PRODUCT
            case "div":
                return f"{at(args[0], _PRODUCT)}/{at(args[1], _SIGN)}", _PRODUCT
            case "neg":
                return f"-{at(args[0], _ATOM)}", _SIGN
            case "select":
                a, b, then, otherwise = (at(x, _SUM) for x in args)
                return f"({then} if {a} < {b} else {otherwise})", _ATOM
        self.calls.add(op)
        assert op in UNARY or op in ("pow", "atan2"), op
        return f"{op}({', '.join(at(x, _CONDITIONAL) for x in args)})", _ATOM

    def _at(self, node: int, strength: int) -> str:
        text, own = self.printed[node]
        return text if own >= strength else f"({text})"
