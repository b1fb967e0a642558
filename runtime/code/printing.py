"""A form as the text of a function: for what keeps or shows a function that a pass has made; nobody reads it again."""

from __future__ import annotations

from collections.abc import Iterator

from symgen.runtime.graph.form import ELEMENT, HELD, Array, Form, Loop, Name, P, Place, Solve, Statement, T, Y

_SUM, _PRODUCT, _SIGN, _ATOM = range(4)
_BINARY = {
    "add": (" + ", _SUM, _PRODUCT),
    "sub": (" - ", _SUM, _PRODUCT),
    "mul": ("*", _PRODUCT, _SIGN),
    "div": ("/", _PRODUCT, _SIGN),
}  # and how strongly operands bind at least, on the right; on the left as the operation itself


def text_of(form: Form) -> str:
    """Return a form in the grammar of ABI 1, from its `def` line on."""
    body = [f"    {line}" for line in _Printer(form).lines()]
    return "\n".join((f"def {form.name}(t, y, p, out):", *(body or ["    h = 0.0"]))) + "\n"


class _Printer:
    def __init__(self, form: Form) -> None:
        self.form, self.nodes = form, form.nodes
        self.named: dict[int, str] = {}
        self.outside: dict[int, str] = {}

    def lines(self) -> Iterator[str]:
        for statement in self.form.body:
            if type(statement) is not Loop:
                yield self._line(statement)
                continue
            yield f"for k in range({statement.count}):"
            self.outside, self.named = self.named, {}
            for inner in statement.body:
                yield f"    {self._line(inner)}"
            self.named, self.outside = self.outside, {}

    def _line(self, statement: Statement) -> str:
        if type(statement) is Array:
            return f"{statement.name} = [0.0]*{statement.length}"
        if type(statement) is Solve:
            words = [*statement.arrays, *([statement.table] if statement.table else [])]
            return f"{statement.solver}({', '.join((*words, *map(str, statement.numbers)))})"
        text, _ = self._expression(statement.node)
        if type(statement) is Name:
            if not statement.held and self.nodes.op[statement.node] != "const":
                self.named.setdefault(statement.node, statement.name)
            return f"{statement.name} = {text}"
        return f"{statement.array}[{place_text(statement.place)}] = {text}"

    def _expression(self, node: int) -> tuple[str, int]:
        """The text of a node and how strongly it binds."""
        known = self.named.get(node) or self.outside.get(node)
        if known is not None:
            return known, _ATOM
        op, args = self.nodes.op[node], self.nodes.args[node]
        if op == "const":
            return repr(args[0]), _ATOM if args[0] >= 0.0 else _SIGN
        if op == "var":
            return self._variable(*args), _ATOM
        if op in _BINARY:
            return self._binary(node)
        if op == "neg":
            return f"-{self._at(args[0], _ATOM)}", _SIGN
        if op in ("select", "select_le"):
            left, right, chosen, other = (self._at(x, _SUM) for x in args)
            return f"({chosen} if {left} {'<' if op == 'select' else '<='} {right} else {other})", _ATOM
        return f"{op}({', '.join(self._at(x, _SUM) for x in args)})", _ATOM

    def _variable(self, kind: int, index: object) -> str:
        if kind == T:
            return "t"
        if kind == HELD:
            return index[0]
        if kind == ELEMENT:
            return f"{index[0]}[{place_text(index[1])}]"
        return f"{'y' if kind == Y else 'p'}[{place_text(index)}]" if kind in (Y, P) else ""

    def _binary(self, node: int) -> tuple[str, int]:
        """Long sums nest to the left: walked down without recursion."""
        op, args = self.nodes.op, self.nodes.args
        spine = [node]
        while op[args[spine[-1]][0]] in _BINARY and not self._has_name(args[spine[-1]][0]):
            spine.append(args[spine[-1]][0])
        text, strength = self._expression(args[spine[-1]][0])
        for part in reversed(spine):
            sign, own, least = _BINARY[op[part]]
            left = text if strength >= own else f"({text})"
            text, strength = f"{left}{sign}{self._at(args[part][1], least)}", own
        return text, strength

    def _has_name(self, node: int) -> bool:
        return node in self.named or node in self.outside

    def _at(self, node: int, least: int) -> str:
        text, strength = self._expression(node)
        return text if strength >= least else f"({text})"


def place_text(place: Place) -> str:
    """Return an index as a function's text has it."""
    if place.table:
        return f"{place.table}[k]"
    if not place.step:
        return str(place.first)
    multiple = "k" if place.step == 1 else f"{place.step}*k"
    return f"{place.first} + {multiple}" if place.first else multiple
