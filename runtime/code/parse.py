"""The text of a generated function, read once: into the form that all of the run time works on.

This is the only place that knows how functions are written (the grammar is in docs/abi.md). It
reads the lines that the generator writes; Python that says the same in other lines, of people who write modules by
hand, is put into such lines first. What is outside of the grammar is refused, with the line and the reason.
"""

from __future__ import annotations

import ast
import gc
import re
from collections.abc import Iterator, Mapping
from typing import NoReturn, Protocol

from symgen.runtime.graph.form import (
    ELEMENT,
    HELD,
    OUT,
    Array,
    Form,
    Loop,
    Name,
    P,
    Place,
    Solve,
    T,
    Write,
    Y,
)
from symgen.runtime.graph.functions import IN_CODE
from symgen.runtime.graph.layouts import Lengths

MATH_FUNCTIONS = frozenset(IN_CODE)
ARGUMENTS = ("t", "y", "p", "out")
DEEPEST = 150  # parentheses in each other; Python reads 200
# A module may come from anybody: what it asks for must end, and have room.
LARGEST = 1 << 26  # values of a local array, passes of a loop
MOST_STATEMENTS = 1 << 30  # that a call of a function carries out

_HEAD = re.compile(r"def [A-Za-z_]\w*\(t, y, p, out\):")
_DOCSTRING = re.compile(r' {4}"""((?:[^"\\]|"(?!""))*)"""')
_ASSIGNMENT = re.compile(r"( {4}| {8})([A-Za-z_]\w*)(?:\[([\w +*]+(?:\[k\])?)\])? = (.+)")
_LOOP = re.compile(r" {4}for k in range\((\d{1,15})\):")
_CALL = re.compile(r"( {4}| {8})(\w+)\(([\w, ]*)\)")
_SIZE = re.compile(r"[0-9]{1,15}")
_ZEROS = re.compile(r"\[0\.0\] ?\* ?(\d{1,15})")
_PLACE = re.compile(r"(?:(\d{1,15})|(?:(\d{1,15}) \+ )?(?:(\d{1,15}) ?\* ?)?k|(\w+)\[k\])")
_TOKEN = re.compile(
    r"[A-Za-z_]\w*\[[\w +*]+(?:\[k\])?\]"  # an element
    r"|[A-Za-z_]\w*\(?"  # a name, or a function and its parenthesis
    r"|(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?(?![\w.])"
    r"|<=|\*\*|//|\S"
)
_HOISTED = re.compile(r"c[0-9]+")
_TOTAL = re.compile(r"e[0-9]+")  # a number that subsystems or passes of a loop make together
_BINARY = {"+": ("add", 1), "-": ("sub", 1), "*": ("mul", 2), "/": ("div", 2)}
_STRENGTH = {"add": 1, "sub": 1, "mul": 2, "div": 2}
_EXACT_INTEGERS = 2**53
_MOST_DIGITS = 400  # of an integer; Python refuses to read thousands of them
_NO_READS: tuple = ()
_SOLVERS_WITH_TABLES = {"factor_fronts": 1, "solve_fronts": 2}  # and how many arrays they take
_SOLVERS = {"factor_ldl": (1, 2), "solve_ldl": (2, 1)}  # how many arrays and numbers
SOLVERS = (*_SOLVERS, *_SOLVERS_WITH_TABLES)


class Text(Protocol):
    """A function's text, see `symgen.runtime.code.function_text.FunctionText`."""

    name: str
    text: str
    lengths: Lengths
    tables: Mapping[str, tuple[int, ...]]

    def refuse(self, line: int, cause: str) -> NoReturn: ...


class _OtherFormError(Exception):
    """A line that is not in the form in which the generator writes."""


def parse(function: Text) -> Form:
    """Return the form of a function's text.

    Raises
    ------
    symgen.runtime.errors.ModuleError
        The text is outside of the grammar, reads what has no value, or indexes beyond its arrays; names the line.
    """
    collecting = gc.isenabled()
    gc.disable()  # a quarter of the time, for objects that all survive
    try:
        try:
            return _Parser(function).read(_generated_lines(function.text))
        except _OtherFormError:
            statements = _python_statements(function)
        try:
            return _Parser(function).read(_rewritten_lines(statements))
        except _OtherFormError as error:
            _explain(function, statements)
            function.refuse(1, f"{error.args[0].strip()!r:.60} is no statement of this grammar")
    finally:
        if collecting:
            gc.enable()


def _generated_lines(text: str) -> Iterator[tuple[int, str]]:
    """Yield the lines of a function with their numbers, the docstring's first."""
    head, *lines = text.rstrip("\n").split("\n")
    if not _HEAD.fullmatch(head):
        raise _OtherFormError(head)
    return ((number, line) for number, line in enumerate(lines, 2) if line and not line.isspace())


def _rewritten_lines(statements: list[ast.stmt]) -> Iterator[tuple[int, str]]:
    """Yield statements in the generator's lines, with the numbers of the lines in which they begin."""
    for statement in statements:
        lines = ast.unparse(statement).split("\n")
        inner = statement.body if isinstance(statement, ast.For) else []
        numbers = [statement.lineno, *(x.lineno for x in inner)]
        if len(numbers) != len(lines):
            numbers = [statement.lineno] * len(lines)
        yield from ((number, f"    {line}") for number, line in zip(numbers, lines, strict=True))


def _python_statements(function: Text) -> list[ast.stmt]:
    """The function's statements as Python reads them, without the docstring."""
    try:
        module = ast.parse(function.text)
    except SyntaxError as error:
        function.refuse(error.lineno or 1, f"not Python ({error.msg})")
    except (ValueError, MemoryError, RecursionError):
        function.refuse(1, "an expression is nested too deeply to be read, or the text has a null byte")
    found = module.body[0] if len(module.body) == 1 else None
    if not isinstance(found, ast.FunctionDef) or found.decorator_list or found.returns:
        function.refuse(getattr(found, "lineno", 1), "expected one function 'def name(t, y, p, out):'")
    a = found.args
    special = (a.posonlyargs, a.kwonlyargs, a.defaults, a.kw_defaults, a.vararg, a.kwarg)
    if tuple(x.arg for x in a.args) != ARGUMENTS or any(special) or any(x.annotation for x in a.args):
        function.refuse(found.lineno, "a function's arguments must be (t, y, p, out)")
    first = found.body[0]
    is_docstring = isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant)
    return found.body[1:] if is_docstring and isinstance(first.value.value, str) else found.body


class _Parser:
    """One function on its way."""

    def __init__(self, function: Text) -> None:
        self.function = function
        self.form = Form(function.name, function.lengths)
        self.nodes = self.form.nodes
        self.line = 1
        # What words of the text stand for: names, numbers, elements of y and p.
        self.known: dict[str, int] = {"t": self.nodes.var(T)}
        self.here = self.known  # the same in the loop that is being read
        self.held: set[str] = set()
        self.versions: dict[str, int] = {}
        self.arrays: dict[str, int] = {}  # lengths of local arrays
        self.count = 0  # passes of the loop that is being read
        self.has_loops = False
        self.n_statements = 0
        self.reads: list[tuple[str, Place]] = []  # of the statement that is being read
        self.tables: set[str] = set()

    def refuse(self, cause: str) -> NoReturn:
        self.function.refuse(self.line, cause)

    def read(self, lines: Iterator[tuple[int, str]]) -> Form:
        """Read all lines."""
        blocks = self._blocks(lines)
        self._find_held(blocks)
        form = self.form
        for line, count, found, inner in blocks:
            self.line = line
            if inner is not None:
                form.body.append(self._loop(line, count, inner))
            elif found is None:
                form.sections.append(len(form.body))
            else:
                form.body.append(self._statement(found))
        given = self.function.tables
        form.tables = {name: given[name] for name in given if name in self.tables}
        return form

    def _blocks(self, lines: Iterator[tuple[int, str]]) -> list:
        """Statements outside of loops, loops with their statements, and where sections begin."""
        blocks: list[tuple] = []
        inner: list | None = None
        for number, line in lines:
            if line.lstrip(" ")[0] == "#":
                if line[:6] == "    # ":
                    blocks.append((number, 0, None, None))
                continue
            if number == 2 and line[:7] == '    """':
                found = _DOCSTRING.fullmatch(line)
                if found is None:
                    raise _OtherFormError(line)
                self.form.doc = found[1]
                continue
            found = _ASSIGNMENT.fullmatch(line) or _CALL.fullmatch(line)
            if found is None:
                found = _LOOP.fullmatch(line)
                if found is None:
                    raise _OtherFormError(line)
                inner = []
                blocks.append((number, int(found[1]), None, inner))
            elif len(found[1]) == 8:
                if inner is None:
                    raise _OtherFormError(line)
                inner.append((number, found))
            else:
                inner = None
                blocks.append((number, 0, found, None))
        return blocks

    def _find_held(self, blocks: list) -> None:
        """Which names get another value after their first; totals always count as such."""
        outside: set[str] = set()
        for _, _, found, inner in blocks:
            if inner is not None:
                self.has_loops = True
                inside: set[str] = set()
                for _, one in inner:
                    if one.re is _ASSIGNMENT and one[3] is None:
                        if one[2] in outside or one[2] in inside:
                            self.held.add(one[2])
                        inside.add(one[2])
            elif found is not None and found.re is _ASSIGNMENT and found[3] is None:
                if found[2] in outside or _TOTAL.fullmatch(found[2]):
                    self.held.add(found[2])
                outside.add(found[2])

    def _loop(self, line: int, count: int, inner: list) -> Loop:
        if count < 1 or not inner:
            self.refuse(f"a loop runs at least once, and does something; not {count} times")
        self.n_statements += count * len(inner)
        if count > LARGEST or self.n_statements > MOST_STATEMENTS:
            self.refuse(f"a loop runs {count} times, more than a function may do")
        assigned = dict.fromkeys(x[2] for _, x in inner if x.re is _ASSIGNMENT and x[3] is None)
        carried = tuple(name for name in assigned if name in self.known)
        self.here, self.count, outside = {}, count, dict(self.arrays)
        for name in carried:
            self._new_version(name)
        for name in self.arrays:
            self.versions[name] += 1  # of an element there are other values in each pass
        body = []
        for self.line, found in inner:
            body.append(self._statement(found))
        self.here, self.count, self.arrays = self.known, 0, outside
        for name in carried:
            self._new_version(name)
        for name in outside:
            self.versions[name] += 1
        return Loop(count, tuple(body), line)

    def _new_version(self, name: str) -> None:
        version = self.versions[name] = self.versions.get(name, 0) + 1
        self.here[name] = self.nodes.var(HELD, (name, version))

    def _statement(self, found: re.Match[str]) -> Name | Write | Array | Solve:
        if found.re is _CALL:
            return self._solve(found[2], found[3])
        _, name, index, value = found.groups()
        if index is not None:
            node = self._expression(value)
            reads = self._take_reads()
            place = self._written_place(name, index)
            if name != OUT:
                self.versions[name] += 1
            return Write(name, place, node, self.line, reads)
        if value[0] == "[":
            return self._array(name, value)
        node = self._expression(value)
        if (
            name in MATH_FUNCTIONS
            or name in ARGUMENTS
            or name in self.arrays
            or (name == "k" and self.has_loops)
        ):
            self.refuse(f"{name!r} cannot be assigned")
        held = name in self.held
        if held:
            self._new_version(name)
        else:
            self.here[name] = node
        return Name(name, node, self.line, _HOISTED.fullmatch(name) is not None, held, self._take_reads())

    def _take_reads(self) -> tuple[tuple[str, Place], ...]:
        if not self.reads:
            return _NO_READS
        reads, self.reads = tuple(self.reads), []
        return reads

    def _written_place(self, name: str, index: str) -> Place:
        if name == OUT:
            return self._place(name, index, self.function.lengths.out)
        if name not in self.arrays:
            self.refuse(f"{name!r} is no array that can be used here")
        return self._place(name, index, self.arrays[name])

    def _array(self, name: str, value: str) -> Array:
        found = _ZEROS.fullmatch(value)
        if found is None:
            raise _OtherFormError(value)
        length = int(found[1])
        if not 0 < length <= LARGEST:
            self.refuse(
                f"{name!r} has {length} values, more than {LARGEST}" if length else f"{name!r} is empty"
            )
        if name in self.known or name in self.here or name in ARGUMENTS or name in MATH_FUNCTIONS:
            self.refuse(f"{name!r} cannot be an array")
        if self.arrays.get(name, length) != length:
            self.refuse(f"{name!r} is an array of {self.arrays[name]} values already")
        self.arrays[name] = length
        self.versions[name] = self.versions.get(name, 0) + 1
        return Array(name, length, self.line)

    def _solve(self, solver: str, listed: str) -> Solve:
        if solver not in SOLVERS:
            self.refuse(f"the only statements that are calls are those of {', '.join(SOLVERS)}")
        words = [word.strip() for word in listed.split(",")]
        table = ""
        if solver in _SOLVERS_WITH_TABLES:
            n, rest = _SOLVERS_WITH_TABLES[solver], 1
            if len(words) == n + 2:
                table = words.pop(n)
                if table not in self.function.tables:
                    self.refuse(f"{solver} is called with a table {table!r}, which the module does not have")
                self.tables.add(table)
        else:
            n, rest = _SOLVERS[solver]
        arrays, numbers = tuple(words[:n]), words[n:]
        missing = [name for name in arrays if name not in self.arrays]
        if missing:
            self.refuse(f"{solver} is called with an array that is not there")
        if len(set(arrays)) != n or len(numbers) != rest or not all(map(_SIZE.fullmatch, numbers)):
            self.refuse(f"{solver} is called with local arrays that do not fit its sizes")
        for name in arrays:
            self.versions[name] += 1
        return Solve(solver, arrays, table, tuple(map(int, numbers)), self.line)

    def _place(self, array: str, index: str, length: int) -> Place:
        """The place that an index names, checked for all passes of the loop."""
        found = _PLACE.fullmatch(index)
        if found is None or (not self.count and found[1] is None):
            raise _OtherFormError(f"{array}[{index}]")
        number, first, step, table = found.groups()
        if table is not None:
            entries = self.function.tables.get(table)
            if entries is None:
                raise _OtherFormError(f"{array}[{index}]")
            if len(entries) < self.count:
                self.refuse(f"the table {table} has no entry for each of {self.count} passes")
            self.tables.add(table)
            place = Place(0, 0, table)
            low, high = min(entries[: self.count]), max(entries[: self.count])
        elif number is not None:
            place = Place(int(number))
            low = high = place.first
        else:
            place = Place(int(first or 0), int(step or 1))
            if step == "0":
                raise _OtherFormError(f"{array}[{index}]")
            low, high = place.first, place.first + place.step * (self.count - 1)
        if low < 0 or high >= length:
            whose = "" if array in self.arrays else " by the header's sizes"
            wrong = high if low >= 0 else low
            self.refuse(f"{array}[{wrong}] is out of range: {array} has {length} values{whose}")
        return place

    def _atom(self, word: str) -> int:
        """The node of a name, a number or an element that was not met before here."""
        node = self.known.get(word)
        if node is not None and word[-1] != "]":
            self.here[word] = node
            return node
        if word[-1] == "]":
            return self._element(word)
        if word[0].isdigit() or word[0] == ".":
            node = self.known[word] = self._number(word)
            return node
        if not word.isidentifier():
            raise _OtherFormError(word)
        if word in self.arrays:
            self.refuse(f"{word!r} is an array")
        self.refuse(f"{word!r} is read before it is computed")

    def _number(self, word: str) -> int:
        if not word.isascii():  # a digit of another script, which is none in Python
            raise _OtherFormError(word)
        if word.isdecimal():
            if len(word) > _MOST_DIGITS or int(word) > _EXACT_INTEGERS:
                self.refuse(f"{word:.40} is not a number of float64")
            return self.nodes.const(int(word))
        value = float(word)
        if value == float("inf"):
            self.refuse(f"{word:.40} is not a number of float64")
        return self.nodes.const(value)

    def _element(self, word: str) -> int:
        array, _, index = word[:-1].partition("[")
        lengths = self.function.lengths
        if array == "y":
            node = self.nodes.var(Y, self._place(array, index, lengths.y))
        elif array == "p":
            node = self.nodes.var(P, self._place(array, index, lengths.p))
        elif array in self.arrays:
            place = self._place(array, index, self.arrays[array])
            self.reads.append((array, place))
            return self.nodes.var(ELEMENT, (array, place, self.versions[array]))
        elif array == OUT:
            self.refuse("out cannot be read")
        else:
            self.refuse(f"{array!r} is no array that can be used here")
        self.here[word] = node
        return node

    def _expression(self, text: str) -> int:
        """The node of an expression, by its words from left to right: what binds less strongly waits on a stack."""
        known, operation = self.here, self.nodes.operation
        values: list[int] = []
        waiting: list = []
        depth = 0
        wants_value = True
        word = ""
        for word in _TOKEN.findall(text):
            if wants_value:
                node = known.get(word)
                if node is None:
                    if word == "-":
                        waiting.append("neg")
                        if len(waiting) > 4 * DEEPEST:
                            self.refuse(f"an expression is nested more than {DEEPEST} deep")
                        continue
                    if word[-1] == "(":
                        depth += 1
                        if depth > DEEPEST:
                            self.refuse(f"an expression has more than {DEEPEST} parentheses in each other")
                        if len(word) > 1 and word[:-1] not in MATH_FUNCTIONS:
                            listed = ", ".join(sorted(MATH_FUNCTIONS))
                            self.refuse(f"only these functions can be called: {listed}; not {word[:-1]!r}")
                        waiting.append((word[:-1], len(values)))
                        continue
                    node = self._atom(word)
                values.append(node)
                wants_value = False
            elif word in _BINARY:
                op, strength = _BINARY[word]
                while waiting and _STRENGTH.get(waiting[-1], 0) >= strength:
                    right = values.pop()
                    values[-1] = operation(waiting.pop(), values[-1], right)
                waiting.append(op)
                wants_value = True
                continue
            else:
                while waiting and waiting[-1] in _STRENGTH:
                    right = values.pop()
                    values[-1] = operation(waiting.pop(), values[-1], right)
                if word == ")":
                    self._close(values, waiting)
                    depth -= 1
                elif word == ",":
                    self._choose(values, waiting)
                    if not waiting or type(waiting[-1]) is not tuple or not waiting[-1][0]:
                        raise _OtherFormError(text)
                    wants_value = True
                    continue
                elif (word == "if" or (word in ("<", "<=") and waiting and waiting[-1] == "if")) or (
                    word == "else" and waiting and waiting[-1] in ("<", "<=")
                ):
                    waiting.append(word)
                    wants_value = True
                    continue
                else:
                    raise _OtherFormError(text)
            while waiting and waiting[-1] == "neg":
                waiting.pop()
                # -0 is 0 in Python, -0.0 is not.
                if word != "0":
                    values[-1] = operation("neg", values[-1])
        while waiting and waiting[-1] in _STRENGTH and len(values) > 1:
            right = values.pop()
            values[-1] = operation(waiting.pop(), values[-1], right)
        self._choose(values, waiting)
        if wants_value or waiting or len(values) != 1:
            raise _OtherFormError(text)
        return values[0]

    def _choose(self, values: list[int], waiting: list) -> None:
        """Put together `a if b < c else d` whose last part is complete."""
        while waiting and waiting[-1] == "else":
            waiting.pop()
            op = "select" if waiting.pop() == "<" else "select_le"
            if not waiting or waiting.pop() != "if" or len(values) < 4:
                raise _OtherFormError("else")
            chosen, left, right, other = values[-4:]
            values[-4:] = [self.nodes.operation(op, left, right, chosen, other)]

    def _close(self, values: list[int], waiting: list) -> None:
        """Take a closing parenthesis."""
        self._choose(values, waiting)
        if not waiting or type(waiting[-1]) is not tuple:
            raise _OtherFormError(")")
        function, first = waiting.pop()
        n = len(values) - first
        if function:
            arity = IN_CODE[function].arity[0]
            if n != arity:
                self.refuse(f"{function} takes {arity} argument{'s' * (arity > 1)}")
            values[first:] = [self.nodes.operation(function, *values[first:])]
        elif n != 1:
            raise _OtherFormError(")")


_ALLOWED = (
    ast.Name, ast.Constant, ast.BinOp, ast.UnaryOp, ast.Call, ast.IfExp, ast.Compare, ast.Subscript, ast.operator,
    ast.USub, ast.cmpop, ast.expr_context,
)  # fmt: skip


def _explain(function: Text, statements: list[ast.stmt]) -> None:
    """Refuse the first thing that the grammar does not have, in Python's words for it."""
    for statement in statements:
        in_loop = isinstance(statement, ast.For)
        if in_loop and not _LOOP.match("    " + ast.unparse(statement)):
            function.refuse(statement.lineno, "the only loop is 'for k in range(N):' with a number N")
        for one in statement.body if in_loop else [statement]:
            if isinstance(one, ast.For):
                function.refuse(one.lineno, "loops cannot stand in each other")
            if isinstance(one, ast.Expr) and isinstance(one.value, ast.Call):
                continue
            if not isinstance(one, ast.Assign) or len(one.targets) != 1:
                function.refuse(
                    one.lineno, "only 'name = expression' and 'out[i] = expression' are allowed here"
                )
            for node in ast.walk(one):
                _explain_node(function, node, in_loop)


def _explain_node(function: Text, node: ast.AST, in_loop: bool) -> None:
    line = getattr(node, "lineno", 1)
    if isinstance(node, (ast.BinOp, ast.UnaryOp)):
        if not isinstance(node.op, (ast.Add, ast.Sub, ast.Mult, ast.Div, ast.USub)):
            function.refuse(line, f"the operator {type(node.op).__name__} is not allowed")
    elif isinstance(node, ast.IfExp):
        test = node.test
        if not isinstance(test, ast.Compare) or [type(x) for x in test.ops] not in ([ast.Lt], [ast.LtE]):
            function.refuse(line, "the condition must be 'b < c' or 'b <= c'")
    elif isinstance(node, ast.Constant) and type(node.value) not in (int, float):
        function.refuse(line, f"{node.value!r:.40} is not a number of float64")
    elif isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name):
        index = ast.unparse(node.slice)
        found = _PLACE.fullmatch(index)
        if (
            found is None
            or (found[1] is None and not in_loop)
            or (found[4] or "") not in ("", *function.tables)
        ):
            kinds = "a number, a + b*k, or a table's entry I0[k]" if in_loop else "a number"
            function.refuse(line, f"the index of {node.value.id} must be {kinds}")
    elif isinstance(node, ast.expr) and not isinstance(node, _ALLOWED):
        function.refuse(line, f"{type(node).__name__} is not allowed in an expression")
