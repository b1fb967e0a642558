"""Lower the nodes of a form to LLVM IR, one to one, in the order in which Python evaluates the text."""

from __future__ import annotations

from typing import NoReturn

from symgen.runtime.code.function_text import FunctionText
from symgen.runtime.code.llvm_text import constant
from symgen.runtime.code.straight_line import StraightLine
from symgen.runtime.graph.form import ELEMENT, HELD, P, Place, T

_INSTRUCTIONS = {"add": "fadd", "sub": "fsub", "mul": "fmul", "div": "fdiv"}
_COMPARISONS = {"select": "olt", "select_le": "ole"}


class ExpressionLowering:
    """What nodes stand for at the place in a function that is being lowered.

    Parameters
    ----------
    function : FunctionText
    part : {"whole", "setup", "body"}
        See `lower.Lowering`.
    """

    code: StraightLine

    def __init__(self, function: FunctionText, part: str):
        self._function, self._part = function, part
        self._nodes = function.form.nodes
        self._values: dict[int | str, str] = {}  # of nodes that a name stands for, and of names that are held
        self._outer: dict[int | str, str] = {}  # values of the code around a loop, while in the loop
        self._outer_code: StraightLine | None = None
        # Held names that the loop which is being lowered finds, and gives new values.
        self._carried: list[str] = []
        self._entering: list[int | str] = []  # what goes into that loop
        self._frame: dict[int | str, int] = {}  # places of the values that go into loops and come out
        # Local arrays: their first place in `work`, and their length.
        self._arrays: dict[str, tuple[int, int]] = {}

    def _refuse(self, line: int, cause: str) -> NoReturn:
        self._function.refuse(line, cause)

    def _lower(self, node: int) -> str:
        value = self._values.get(node)
        if value is not None:
            return self.code.reuse(value)
        if node in self._outer:
            return self._outer_value(node)
        op, args = self._nodes.op[node], self._nodes.args[node]
        if op == "var":
            return self._variable(*args)
        if op == "const":
            return constant(args[0])
        if op in _INSTRUCTIONS:
            return self._binary(node)
        if op == "neg":
            if self._nodes.op[args[0]] == "const":
                return constant(-self._nodes.args[args[0]][0])
            return self.code.negative(self._lower(args[0]))
        values = [self._lower(x) for x in args]
        if op in _COMPARISONS:
            return self.code.select(_COMPARISONS[op], *values)
        return self.code.call(op, values)

    def _variable(self, kind: int, index: object) -> str:
        if kind == T:
            return "%t"
        if kind == HELD:
            value = self._values.get(index[0])
            return self._outer_value(index[0]) if value is None else self.code.reuse(value)
        if kind == ELEMENT:
            return self.code.fresh_load("work", self._local_place(*index[:2]))
        return self.code.load("p" if kind == P else "y", index)

    def _binary(self, node: int) -> str:
        # Sums and products of many terms nest to the left: walk down that side without recursion.
        op, args = self._nodes.op, self._nodes.args
        spine, left = [node], args[node][0]
        while op[left] in _INSTRUCTIONS and left not in self._values and left not in self._outer:
            spine.append(left)
            left = args[left][0]
        value = self._lower(left)
        for part in reversed(spine):
            value = self.code.operation(_INSTRUCTIONS[op[part]], value, self._lower(args[part][1]))
        return value

    def _local_place(self, array: str, place: Place) -> Place:
        """The place in `work` of an element of a local array."""
        return place._replace(first=self._arrays[array][0] + place.first)

    def _slot(self, what: int | str) -> int:
        return self._frame.setdefault(what, len(self._frame))

    def _outer_value(self, what: int | str) -> str:
        """The value of a node or name from the code around a loop, in the loop."""
        value = self._outer[what]
        if what not in self._carried:
            if value[0] != "%" or value == "%t":
                return value
            place = self._outer_code.stands_in(value)
            if place is not None:
                return self.code.load(*place)
        if what not in self._entering:
            self._entering.append(what)
        return self.code.load("frame", Place(self._slot(what)))
