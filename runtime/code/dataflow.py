"""Whether a function of a module writes each of its results once, and reads nothing that it has not computed.

One pass over its form. Loops are followed through their index tables, element by element.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NoReturn

import numpy as np

from symgen.runtime.code.angles import side_by_side
from symgen.runtime.code.facts import Facts
from symgen.runtime.code.function_text import FunctionText
from symgen.runtime.code.recipe import recipe_of
from symgen.runtime.graph.form import OUT, Array, Form, Loop, Name, P, Place, Solve, Statement, T, Write, Y
from symgen.runtime.graph.functions import ENTRIES

_FACTORS = ("factor_ldl", "factor_fronts")
# What can be sharp in the state. Sines of coordinates are not, as long as steps follow the motion.
_SHARP = frozenset(
    (
        "exp",
        "tanh",
        "erf",
        "atan",
        "sinh",
        "cosh",
        "log",
        "sqrt",
        "pow",
        "tan",
        "asin",
        "acos",
        "atan2",
        "div",
    )
)
_SMOOTH = frozenset(("var", "const", "add", "sub", "mul", "neg", "sin", "cos"))
_SMOOTH_APART = frozenset(("div", "sqrt"))  # from zero
# Cycles until a result is there, and how many operations fill the same time; others are elementary functions.
_LATENCY = {"add": 4, "sub": 4, "mul": 4, "neg": 1, "select": 5, "select_le": 5, "div": 14, "sqrt": 18}
_WORK = {"div": 1, "sqrt": 6}
_LATENCY_OF_FUNCTION, _WORK_OF_FUNCTION, _WORK_SIDE_BY_SIDE = 40, 38, 18
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
    return _Pass(function, call_it).follow(function.form, sparse)


def facts_of(form: Form, n_parameters: int, header: Mapping[str, Any]) -> Facts:
    """Return what a function of a model with a header is like."""
    read = form.places_read(P) if form.lengths.p > n_parameters else ()
    nodes = form.nodes
    of_state = list(nodes.reachable(form.roots(), ~P))
    # What is divided by parameters alone is a product.
    ops = {nodes.op[x] for x in of_state if nodes.op[x] != "div" or nodes.mask[nodes.args[x][-1]] & ~P}
    smooth_where, turns_back = "", False
    if form.name == "residual" and not ops <= _SMOOTH and ops <= _SMOOTH | _SMOOTH_APART:
        smooth_where = _smooth_where(form, of_state)
    if form.name == "rhs":
        turns_back = _turns_back(form, header)
    is_sharp = any(nodes.op[node] in _SHARP and nodes.mask[nodes.args[node][-1]] & ~P for node in of_state)
    return Facts(
        tuple(sorted(place for place in read if place >= n_parameters)),
        is_sharp,
        ops <= _SMOOTH,
        *(_effort(form) if form.name == "rhs" else (0, 0)),
        smooth_where,
        turns_back,
    )


def _smooth_where(form: Form, of_state: list[int]) -> str:
    """Return a recipe of what a function divides by or takes roots of, as far as that depends on the state."""
    nodes = form.nodes
    near = [x for x in of_state if nodes.op[x] in _SMOOTH_APART and nodes.mask[nodes.args[x][-1]] & ~P]
    # A root is away from zero where that is which it is taken of.
    apart = {nodes.args[x][-1] for x in near}
    return "" if form.has_loops else recipe_of(nodes, {x for x in apart if nodes.op[x] != "sqrt"})


def _turns_back(form: Form, header: Mapping[str, Any]) -> bool:
    """Whether accelerations are even in the rates, and the power odd: as far as operations tell, one by one."""
    nq, nv, nodes = header["nq"], header["nv"], form.nodes
    if form.has_loops or any(type(statement) in (Array, Solve) for statement in form.body):
        return False
    wanted = {write.place.first: write.node for write, _ in form.writes()}
    wanted = {place: node for place, node in wanted.items() if nq <= place < nq + nv + header["nw"]}
    is_odd: dict[int, bool | None] = {}  # None: neither
    for node in nodes.reachable(wanted.values()):
        op, args = nodes.op[node], nodes.args[node]
        if op == "var":
            kind, place = args
            is_odd[node] = kind == Y and place.first >= nq if kind in (T, Y, P) else None
        else:
            is_odd[node] = _is_odd(op, [is_odd[x] for x in nodes.operands(node)])
    return all(is_odd[node] is (place >= nq + nv) for place, node in wanted.items())


def _is_odd(op: str, args: list[bool | None]) -> bool | None:
    """Whether an operation changes its sign with those operands that do; None where it is neither odd nor even."""
    if None in args:
        return None
    if op in ("mul", "div"):
        return args[0] != args[1]
    if op in ("add", "sub"):
        return args[0] if args[0] == args[1] else None
    if op == "neg":
        return args[0]
    if op in ("select", "select_le"):
        return None if args[0] or args[1] or args[2] != args[3] else args[2]
    if not any(args):
        return False
    parity = next((x.parity for x in ENTRIES if x.code == op), "") if len(args) == 1 else ""
    return {"odd": True, "even": False}.get(parity)


def _effort(form: Form) -> tuple[int, int]:
    """Return latency and work of a function (`Facts`), without what follows from parameters alone.

    Passes of a loop are taken to be independent of each other.
    """
    nodes, ready, work, together = form.nodes, {}, 0, side_by_side(form)
    met: set[int] = set()
    by_count: dict[int, list[int]] = {}
    for statement, count in form.statements():
        if type(statement) is Name or type(statement) is Write:
            by_count.setdefault(max(count, 1), []).append(statement.node)
    for count, roots in sorted(by_count.items()):
        for node in nodes.reachable(roots, ~P, met):
            op = nodes.op[node]
            if op == "var":
                continue
            waits = max(ready.get(x, 0) for x in nodes.operands(node))
            ready[node] = waits + _LATENCY.get(op, _LATENCY_OF_FUNCTION)
            if op in _LATENCY:
                work += count * _WORK.get(op, 1)
            elif op in ("sin", "cos") and nodes.args[node][0] in together:
                work += _WORK_SIDE_BY_SIDE
            else:
                work += count * _WORK_OF_FUNCTION
    return max(ready.values(), default=0), work


class _Array:
    """A local array: when each of its elements was computed first."""

    def __init__(self, length: int) -> None:
        self.when = np.full(length, _NEVER)
        self.is_factored = False


class _Pass:
    """One function on its way through.

    Moments are counted: a loop of N passes and S statements takes N S of them, one after another.
    """

    def __init__(self, function: FunctionText, call_it: Callable[[int], str]) -> None:
        self.function, self.call_it = function, call_it
        self.arrays: dict[str, _Array] = {}
        self.written: set[int] = set()  # not an array: most of a large matrix is zeros, which are left out
        self.now = 0
        self.line = 1

    def refuse(self, cause: str) -> NoReturn:
        self.function.refuse(self.line, cause)

    def follow(self, form: Form, sparse: bool) -> np.ndarray:
        for statement in form.body:
            if type(statement) is Loop:
                self._loop(statement)
            else:
                self._statement(statement)
        if not sparse:
            missing = [k for k in range(self.function.lengths.out) if k not in self.written]
            if missing:
                more = f", and {len(missing) - 1} others" if len(missing) > 1 else ""
                self.line = 1
                self.refuse(f"{self._result(missing[0])} is never written{more}")
        return np.array(sorted(self.written), dtype=np.int64)

    def _result(self, place: int) -> str:
        meaning = self.call_it(place)
        return f"out[{place}]" + (f" ({meaning})" if meaning else "")

    def _statement(self, statement: Statement) -> None:
        """A statement outside of loops, or in one where nothing but numbers are indices."""
        self.now += 1
        kind = type(statement)
        if kind is Name and not statement.reads:
            return
        if kind is Write and statement.array == OUT and not statement.reads:
            place = statement.place.first
            if place in self.written:
                self.line = statement.line
                self.refuse(f"{self._result(place)} is written twice")
            self.written.add(place)
            return
        self.line = statement.line
        if kind is Array:
            self.arrays[statement.name] = _Array(statement.length)
        elif kind is Solve:
            self._solve(statement)
        else:
            now = np.array([self.now])
            for array, place in statement.reads:
                self._read(array, self._places(place, 1), now)
            if kind is Write:
                self._write(statement.array, self._places(statement.place, 1), now)

    def _solve(self, statement: Solve) -> None:
        names = statement.arrays
        factors = self.arrays[names[0]]
        if statement.solver in _FACTORS:
            if factors.is_factored:
                self.refuse(f"{names[0]!r} is factored twice")
            factors.is_factored = True
        elif not factors.is_factored:
            self.refuse(f"{statement.solver} reads {names[0]!r}, which is not factored")
        self.arrays[names[-1]].when[:] = self.now

    def _places(self, place: Place, count: int) -> np.ndarray:
        """The elements that an index names in the passes of a loop: one, where it is the same in all."""
        if place.table:
            return np.array(self.function.tables[place.table][:count], dtype=np.int64)
        return place.first + place.step * np.arange(count if place.step else 1)

    def _read(self, array: str, places: np.ndarray, moments: np.ndarray) -> None:
        late = self.arrays[array].when[places] >= moments
        if late.any():
            self.refuse(f"{array}[{int(places[np.argmax(late)])}] is read before it is computed")

    def _write(self, array: str, places: np.ndarray, moments: np.ndarray, count: int = 1) -> None:
        """Note what a statement writes in `count` passes: to a place for each, or to one again and again."""
        if array == OUT:
            found = places.tolist()
            new = set(found)
            if not len(new) == len(found) == count or not new.isdisjoint(self.written):
                times = Counter(found)
                times.update(new & self.written)
                self.refuse(f"{self._result(max(found, key=times.__getitem__))} is written twice")
            self.written |= new
            return
        known = self.arrays[array]
        if known.is_factored:
            self.refuse(f"{array!r} is written after it was factored")
        # Backwards, as of several moments at one place the first counts.
        known.when[places[::-1]] = np.minimum(known.when[places[::-1]], moments[::-1])

    def _loop(self, loop: Loop) -> None:
        if any(type(x) is Array or type(x) is Solve for x in loop.body):
            # A solve for each member of several: arrays are made anew in each pass.
            before = set(self.arrays)
            for statement in loop.body:
                self._in_every_pass(statement, loop.count, before)
            for name in set(self.arrays) - before:
                del self.arrays[name]
        else:
            self._passes(loop.body, loop.count)

    def _passes(self, body: Sequence[Statement], count: int) -> None:
        """The statements of a loop: what all passes write, then what they read."""
        n, start = len(body), self.now + 1
        self.now += n * count
        read: list[tuple[int, str, np.ndarray, np.ndarray]] = []
        for number, statement in enumerate(body):
            self.line = statement.line
            for array, place in statement.reads:
                places = self._places(place, count)
                read.append((self.line, array, places, start + number + n * np.arange(len(places))))
            if type(statement) is Write:
                places = self._places(statement.place, count)
                self._write(statement.array, places, start + number + n * np.arange(len(places)), count)
        for self.line, array, places, moments in read:
            self._read(array, places, moments)

    def _in_every_pass(self, statement: Statement, count: int, before: set[str]) -> None:
        """A statement of a loop with arrays of its own, which numbers index; `out` may be indexed by k."""
        self.line = statement.line
        if type(statement) is Write and statement.array == OUT:
            self.now += 1
            for array, place in statement.reads:
                self._read(array, self._places(place, 1), np.array([self.now]))
            places = self._places(statement.place, count)
            self._write(OUT, places, np.full(len(places), self.now), count)
            return
        if type(statement) is Write and statement.array in before:
            self.refuse(f"{statement.array!r} is written in a loop that has arrays of its own")
        self._statement(statement)
