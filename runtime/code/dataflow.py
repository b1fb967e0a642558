"""Whether a function of a module writes each of its results once, and reads nothing that it has not computed.

One pass over the text, line by line: fast enough for every function of every module that is loaded, long before one of
them is compiled. Loops are followed through their index tables, element by element.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterator
from typing import NoReturn

import numpy as np

from symgen.runtime.code.grammar import ARGUMENTS, LARGEST, MATH_FUNCTIONS, FunctionText
from symgen.runtime.module_source import SOLVERS

DEEPEST = 150  # parentheses in each other; Python reads 200
_LONG = 2 * DEEPEST  # characters, of an expression that may have as many
_STATEMENT = re.compile(r"( {4}| {8})([A-Za-z_]\w*)(?:\[([\w +*]+(?:\[k\])?)\])? = ([\w .+\-*/()<=,\[\]]+)")
_LOOP = re.compile(r" {4}for k in range\((\d{1,15})\):")
_CALL = re.compile(r"( {4}| {8})(\w+)\(([\w, ]*)\)")
_LOCAL_ARRAY = re.compile(r"\[0\.0\] ?\* ?(\d{1,15})")
_NAME = re.compile(r"(?<![\w.])[A-Za-z_]\w*(?![\w\[])")
_ELEMENT = re.compile(r"(?<![\w.])([A-Za-z_]\w*)\[([\w +*]+(?:\[k\])?)\]")
_INDEX = re.compile(r"(?:(\d{1,15})|(?:(\d{1,15}) \+ )?(?:(\d{1,15}) ?\* ?)?k|(I\d{1,9})\[k\])")
_LANGUAGE = frozenset(("if", "else", "t"))
_FACTORS = ("factor_ldl", "factor_fronts")
_NEVER = np.iinfo(np.int64).max


def follow(function: FunctionText, call_it: Callable[[int], str], *, sparse: bool = False) -> np.ndarray:
    """Follow what a function reads and writes, statement by statement.

    Parameters
    ----------
    function : FunctionText
        Its lengths say how many results it has.
    call_it : callable
        What people call the result at a place of `out`; empty where they have no word for it.
    sparse : bool
        Whether it may leave results out, which are zero then.

    Returns
    -------
    ndarray of int
        The places of `out` that it writes, ascending.

    Raises
    ------
    ModuleError
        Names the function, and the element or name.
    """
    lines = function.text.rstrip("\n").split("\n")
    try:
        return _Pass(function, call_it).follow(_body(lines), sparse)
    except _OtherFormError:
        # Python that says the same in other lines, of people who write modules by hand.
        from symgen.runtime.code.modules import lower_function

        text = "\n".join(ast.unparse(statement) for statement in function.statements())
        indented = [f"    {line}" for line in text.split("\n")]
        try:
            return _Pass(function, call_it, lines_known=False).follow(enumerate(indented, 1), sparse)
        except _OtherFormError as error:
            lower_function(function, "refused")  # says what is wrong in the statement's own terms
            function.refuse(None, f"{error.args[0].strip()!r:.60} is no statement of this grammar")


class _OtherFormError(Exception):
    """A line that is not in the form in which the generator writes."""


def _body(lines: list[str]) -> Iterator[tuple[int, str]]:
    """Yield the lines of statements, with their numbers in the function."""
    start = 1
    if len(lines) > 1 and lines[1].startswith('    """'):
        if not re.fullmatch(r' {4}"""(?:[^"\\]|"(?!""))*"""', lines[1]):
            raise _OtherFormError(lines[1])
        start = 2
    for number, line in enumerate(lines[start:], start + 1):
        if line and not re.match(r" *#", line):
            yield number, line


class _Array:
    """A local array: when each of its elements was computed first."""

    def __init__(self, length: int) -> None:
        self.when = np.full(length, _NEVER)
        self.is_factored = False


class _Pass:
    """One function on its way through.

    Moments are counted: a loop of N passes and S statements takes N S of them, one after another.
    """

    def __init__(
        self, function: FunctionText, call_it: Callable[[int], str], lines_known: bool = True
    ) -> None:
        self.function, self.call_it, self.lines_known = function, call_it, lines_known
        self.known = set(MATH_FUNCTIONS | _LANGUAGE)
        self.arrays: dict[str, _Array] = {}
        self.written = np.zeros(function.lengths.out, dtype=np.int32)
        self.now = 0
        self.line = 1

    def refuse(self, cause: str) -> NoReturn:
        self.function.refuse(ast.Pass(lineno=self.line) if self.lines_known else None, cause)

    def follow(self, body: Iterator[tuple[int, str]], sparse: bool) -> np.ndarray:
        loop: list[tuple[int, str]] = []
        count = 0
        for number, line in body:
            if line.startswith("        ") and count:
                loop.append((number, line))
                continue
            if count:
                self._loop(loop, count)
                loop, count = [], 0
            self.line = number
            found = _LOOP.fullmatch(line)
            if found:
                count = int(found[1])
            else:
                self._statement(line)
        if count:
            self._loop(loop, count)
        if not sparse:
            missing = np.flatnonzero(self.written == 0)
            if len(missing):
                more = f", and {len(missing) - 1} others" if len(missing) > 1 else ""
                self.line = 1
                self.refuse(f"{self._result(int(missing[0]))} is never written{more}")
        return np.flatnonzero(self.written)

    def _result(self, place: int) -> str:
        meaning = self.call_it(place)
        return f"out[{place}]" + (f" ({meaning})" if meaning else "")

    def _statement(self, line: str) -> None:
        """A statement outside of loops, or in one where nothing but numbers are indices."""
        self.now += 1
        found = _STATEMENT.fullmatch(line)
        if found is None or found[4].count("(") != found[4].count(")"):
            self._call(line)
            return
        _, name, index, value = found.groups()
        for array, place in self._checked(value):
            self._read(array, self._places(array, place, 1), np.array([self.now]))
        if index is not None:
            self._write(name, self._places(name, index, 1), np.array([self.now]))
        elif value.startswith("["):
            length = _LOCAL_ARRAY.fullmatch(value)
            if length is None:
                raise _OtherFormError(line)
            self._declare(name, int(length[1]))
        else:
            self._assign(name)

    def _checked(self, value: str) -> list[tuple[str, str]]:
        """Check the names in an expression; returns the elements of local arrays in it, with their indices."""
        if not self.known.issuperset(_NAME.findall(value)):
            unknown = [name for name in _NAME.findall(value) if name not in self.known]
            self.refuse(f"{unknown[0]!r} is read before it is computed")
        if len(value) > _LONG and _depth(value) > DEEPEST:
            self.refuse(f"an expression has more than {DEEPEST} parentheses in each other")
        if "[" not in value:
            return []
        return [found for found in _ELEMENT.findall(value) if found[0] not in ("y", "p")]

    def _assign(self, name: str) -> None:
        if name in MATH_FUNCTIONS or name in ARGUMENTS or name in self.arrays or name in _LANGUAGE:
            self.refuse(f"{name!r} cannot be assigned")
        self.known.add(name)

    def _declare(self, name: str, length: int) -> None:
        if length > LARGEST:
            self.refuse(f"{name!r} has {length} values, more than {LARGEST}")
        if name in self.known or name in ARGUMENTS:
            self.refuse(f"{name!r} cannot be an array")
        self.arrays[name] = _Array(length)

    def _call(self, line: str) -> None:
        found = _CALL.fullmatch(line)
        if found is None or found[2] not in SOLVERS:
            raise _OtherFormError(line)
        names = [word for word in found[3].split(", ") if word in self.arrays]
        if not names:
            self.refuse(f"{found[2]} is called with an array that is not there")
        factors = self.arrays[names[0]]
        if found[2] in _FACTORS:
            if factors.is_factored:
                self.refuse(f"{names[0]!r} is factored twice")
            factors.is_factored = True
        elif not factors.is_factored:
            self.refuse(f"{found[2]} reads {names[0]!r}, which is not factored")
        self.arrays[names[-1]].when[:] = self.now

    def _places(self, array: str, index: str, count: int) -> np.ndarray:
        """The elements that an index names in the passes of a loop, checked against the array's length."""
        found = _INDEX.fullmatch(index)
        if array == "out":
            length = len(self.written)
        elif array in self.arrays:
            length = len(self.arrays[array].when)
        else:
            self.refuse(f"{array!r} is no array that can be used here")
        if found is None:
            raise _OtherFormError(index)
        number, first, step, table = found.groups()
        if table is not None:
            entries = self.function.tables.get(table, ())
            if len(entries) < count:
                self.refuse(f"the table {table} has no entry for each of {count} passes")
            places = np.array(entries[:count], dtype=np.int64)
            low, high = int(places.min()), int(places.max())
        else:
            low = int(number if number is not None else first or 0)
            stride = 0 if number is not None else int(step or 1)
            high = low + stride * (count - 1)
        if low < 0 or high >= length:
            self.refuse(f"{array}[{high if low >= 0 else low}] is out of range: {array} has {length} values")
        if table is None:
            places = low + stride * np.arange(count if stride else 1)
        return places

    def _read(self, array: str, places: np.ndarray, moments: np.ndarray) -> None:
        if array == "out":
            self.refuse("out cannot be read")
        late = self.arrays[array].when[places] >= moments
        if late.any():
            self.refuse(f"{array}[{int(places[np.argmax(late)])}] is read before it is computed")

    def _write(self, array: str, places: np.ndarray, moments: np.ndarray, count: int = 1) -> None:
        """Note what a statement writes in `count` passes: to a place for each, or to one again and again."""
        if array == "out":
            np.add.at(self.written, places, 1 if len(places) == count else 2)
            if self.written[places].max() > 1:
                place = int(places[np.argmax(self.written[places])])
                self.refuse(f"{self._result(place)} is written twice")
            return
        known = self.arrays[array]
        if known.is_factored:
            self.refuse(f"{array!r} is written after it was factored")
        # Backwards, as of several moments at one place the first counts.
        known.when[places[::-1]] = np.minimum(known.when[places[::-1]], moments[::-1])

    def _loop(self, body: list[tuple[int, str]], count: int) -> None:
        """The statements of a loop: what all passes write, then what they read."""
        if count < 1 or not body:
            self.refuse("a loop runs at least once, and does something")
        if count > LARGEST:
            self.refuse(f"a loop runs {count} times, more than {LARGEST}")
        inside = [_STATEMENT.fullmatch(line) for _, line in body]
        own_arrays = any(found is None or _LOCAL_ARRAY.fullmatch(found[4]) for found in inside)
        outside = set(self.known)
        self.known.add("k")
        if own_arrays:
            # A solve for each member of several: arrays are made anew in each pass.
            before = set(self.arrays)
            for self.line, line in body:
                self._in_every_pass(line, count, before)
            for name in set(self.arrays) - before:
                del self.arrays[name]
        else:
            self._passes(body, inside, count)
        self.known = outside

    def _passes(self, body: list[tuple[int, str]], inside: list[re.Match[str]], count: int) -> None:
        n, start = len(body), self.now + 1
        self.now += n * count
        read: list[tuple[int, str, np.ndarray, np.ndarray]] = []
        for number, ((self.line, line), found) in enumerate(zip(body, inside, strict=True)):
            _, name, index, value = found.groups()
            if value.count("(") != value.count(")"):
                raise _OtherFormError(line)
            elements = self._checked(value)
            if index is None:
                self._assign(name)
            for array, place in elements:
                places = self._places(array, place, count)
                read.append((self.line, array, places, start + number + n * np.arange(len(places))))
            if index is not None:
                places = self._places(name, index, count)
                self._write(name, places, start + number + n * np.arange(len(places)), count)
        for self.line, array, places, moments in read:
            self._read(array, places, moments)

    def _in_every_pass(self, line: str, count: int, before: set[str]) -> None:
        """A statement of a loop with arrays of its own, which numbers index; `out` may be indexed by k."""
        found = _STATEMENT.fullmatch(line)
        if found is not None and found[2] == "out" and found[3] is not None:
            self.now += 1
            for array, place in self._checked(found[4]):
                self._read(array, self._places(array, place, 1), np.array([self.now]))
            places = self._places("out", found[3], count)
            self._write("out", places, np.full(len(places), self.now), count)
            return
        if found is not None and found[2] in before and found[3] is not None:
            self.refuse(f"{found[2]!r} is written in a loop that has arrays of its own")
        self._statement(line)


def _depth(text: str) -> int:
    """How many parentheses are open at once."""
    steps = np.array([(c == "(") - (c == ")") for c in text if c in "()"])
    return int(np.cumsum(steps).max(initial=0))
