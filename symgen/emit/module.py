"""The text of a generated module: its header, index tables, solvers and functions."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator
from dataclasses import dataclass

from symgen.derive.rolling import OUT, find, may_be_short, schedule
from symgen.runtime.graph.functions import IN_CODE
from symgen.runtime.graph.layouts import LIMITS, settings_of
from symgen.runtime.graph.spelling import spelled

from ..derive.graph.graph import Graph
from ..derive.graph.nodes import INPUT, LAM, PARAM, VIRTUAL, A, Q, T, V
from ..derive.jumps import ACTION as JUMP
from ..derive.program import CLOSED_PREFIX, Function, Program, reductions
from ..derive.program import START as START_VALUES
from ..derive.solve import dense_solve, fronts
from .index_text import table_text
from .rolled import RolledSection
from .section import Section, Shared, Tables

# Operations and variables of a function that loops are tried for: from here on, straight-line code takes seconds to
# compile. Where a large solve is by loops anyway, the rest need not be so long.
SMALLEST_ROLLED = 12_000
# The same of loops whose passes wait for each other: calls take a fifth longer, which only many seconds outweigh.
SMALLEST_IN_TURNS = 30_000
SMALLEST_WITH_FRONTS = 1000
# What only looks is called once a frame, if at all: loops that take twice as long are worth text that is read at once.
SMALLEST_OBSERVER = 1000
OBSERVERS = ("poses", "shapes", LIMITS)
TEXT = dense_solve.TEXT | fronts.TEXT
DECORATOR = '@njit(error_model="numpy")\n'


class FunctionText(Shared):
    """The text of one function.

    Attributes
    ----------
    lines : list of str
    """

    def __init__(
        self,
        program: Program,
        name: str,
        names: dict[tuple[int, int], str],
        tables: Tables,
        by_loops: bool = False,
    ) -> None:
        super().__init__(program.header, names, tables)
        self.by_loops = by_loops
        if any(part.function(name) for part in program.parts):
            kinds = reductions(name, program.sizes)
            self.totals = {place: f"e{k}" for k, place in enumerate(kinds)}
            self.kinds = kinds
        self.columns = program.own[name].columns if name in program.own else None
        if self.columns:
            self.target = self.new_name("w")
        self._written: list[Section] = list(self._sections(program, name))
        operations = sum(program.counts(name))
        doc = max((s.function.doc for s in self._written), key=len)
        self.lines = ['@njit(error_model="numpy")', f"def {name}(t, y, p, out):"]
        self.lines += [f'    """{doc} {operations} operation{"s" * (operations != 1)}."""']
        self.lines += [f"    {line}" for line in self._body()]
        self._written = []  # what they know of a long function takes much memory, and is not needed any more

    def _sections(self, program: Program, name: str) -> Iterator[Section]:
        for part in program.parts:
            function = part.function(name)
            if function is not None:
                yield Section(self, part.graph, function, part, part.places(function, program.sizes))
        if name in program.own:
            yield self._whole_section(program.graph, program.own[name])

    def _whole_section(self, g: Graph, function: Function) -> Section:
        """A function of its own: in loops over what repeats in it, where it is large and they make it short."""
        n_nodes = len(g.reachable(node for _, node in function.written()))
        smallest = SMALLEST_WITH_FRONTS if g.front_plans else SMALLEST_ROLLED
        if function.name in OBSERVERS:
            smallest = SMALLEST_OBSERVER
        elif function.name == "solve" and not g.front_plans:  # only series call it, and they take no arrays
            smallest = math.inf
        size = n_nodes + len(function.outputs)
        if size >= smallest or self.by_loops:
            clusters = find(g, function.written())
            in_turns = size >= SMALLEST_IN_TURNS or self.by_loops or function.name in OBSERVERS
            by_fronts = any(g.op[node] in fronts.TEXT for node in clusters.solves)
            if by_fronts or may_be_short(g, clusters):
                found = schedule(g, clusters)
                if by_fronts or found.is_short(in_turns):
                    return RolledSection(self, g, function, found)
        return Section(self, g, function)

    def _body(self) -> Iterator[str]:
        self._note_shared_parameters()
        for section in self._written:
            section.print()
        self._note_shared_parameters()  # rolled sections know theirs once they are printed
        yield from (f"{self.names[args]} = p[{args[1]}]" for args in sorted(self.read_once))
        for section in self._written:
            yield from section.hoisted
        yield from (f"{name} = {START_VALUES[self.kinds[k]]}" for k, name in self.totals.items())
        if self.columns:
            yield from self.columns.beginning(self.target)
        for section in self._written:
            yield from section.text()
        if self.columns:
            yield from self.columns.end(self.target, OUT)
        yield from (f"out[{place}] = {name}" for place, name in self.totals.items())

    def _note_shared_parameters(self) -> None:
        self.read_once.update(args for s in self._written for args in s.shared_parameters())


@dataclass(frozen=True)
class Pieces:
    """A module's text but for its header: lines of imports, index tables with their names, solvers and functions.

    `hoisted` counts the values that each function makes from parameters alone.
    """

    imports: tuple[str, ...]
    hoisted: dict[str, int]
    tables: dict[tuple[int, ...], str]
    functions: tuple[str, ...]


def emit(program: Program) -> str:
    """The text of the generated module.

    The text is a function of the program alone: no dates, paths or hashes of the process.
    """
    return assembled(program.header, pieces(program))


def pieces(program: Program, by_loops: bool = False) -> Pieces:
    """What stands in a module beside its header.

    Parameters
    ----------
    program : Program
    by_loops : bool
        Whether loops are tried for short functions, too: the program stands for a longer one.
    """
    names = _variable_names(program)
    tables = Tables()
    functions = {name: FunctionText(program, name, names, tables, by_loops) for name in program.names()}
    functions |= _closed_functions(program, tables)
    used = sorted({name for function in functions.values() for name in function.calls})
    of_math = [name for name in used if IN_CODE[name].value is getattr(math, name, None)]
    of_numpy = [name for name in used if name not in of_math]
    solvers = [DECORATOR + TEXT[name] for name in TEXT if any(name in f.solvers for f in functions.values())]
    return Pieces(
        (
            *([f"from math import {', '.join(of_math)}", ""] if of_math else []),
            "from numba import njit",
            *([f"from numpy import {', '.join(of_numpy)}"] if of_numpy else []),
        ),
        {name: f.n_hoisted for name, f in functions.items() if f.n_hoisted and name != LIMITS},
        tables.names,
        (*solvers, *("\n".join(f.lines) + "\n" for f in functions.values())),
    )


def assembled(head: dict, made: Pieces) -> str:
    """The text of a module."""
    head = _with_hoisted(head, made.hoisted)
    parts = [
        f'"""{_one_line(head["name"])}: equations of motion, written by {head["generator"]}. Do not edit.',
        "",
        f"{_one_line(head['description'])}" if head["description"] else "No description.",
        '"""',
        "",
        *made.imports,
        "",
        *_header_lines(head),
        *(f"{name} = {table_text(places)}" for places, name in made.tables.items()),
        "",
    ]
    return "\n".join(parts) + "\n" + "\n\n".join(made.functions)


def _closed_functions(program: Program, tables: Tables) -> dict[str, FunctionText]:
    """The functions of a model with its stops closed, under names of their own."""
    if program.closed is None:
        return {}
    names = _variable_names(program.closed)
    texts = {name: FunctionText(program.closed, name, names, tables) for name in program.closed.names()}
    for name, text in texts.items():
        text.lines[1] = text.lines[1].replace(f"def {name}(", f"def {CLOSED_PREFIX}{name}(", 1)
    return {CLOSED_PREFIX + name: text for name, text in texts.items()}


def _with_hoisted(header: dict, hoisted: dict[str, int]) -> dict:
    """The header with the numbers of hoisted values, behind the numbers of operations."""
    result: dict = {}
    for key, value in header.items():
        result[key] = value
        if key == "operations":
            result["hoisted"] = hoisted
    return result


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
    if isinstance(value, str):
        return _quoted(value)
    if isinstance(value, dict):
        return "{" + ", ".join([f"{_literal(k)}: {_literal(v)}" for k, v in value.items()]) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join([_literal(v) for v in value]) + "]"
    return repr(value)


@functools.lru_cache(maxsize=1024)  # the records of a table have the same keys, and much the same units
def _quoted(value: str) -> str:
    text = ascii("".join(value))  # of a subclass such as NumPy's the plain text
    return text if '"' in text else '"' + text[1:-1].replace("\\'", "'") + '"'


def _variable_names(program: Program) -> dict[tuple[int, int], str]:
    """Prefixed names, so that a model's own names can clash neither with each other nor with temporaries."""
    head = program.header
    behind = head.get("sensed") or head.get("start")
    groups = {
        Q: ("q", head["coordinates"]),
        V: ("v", head["rates"]),
        A: ("a", head["rates"]),
        LAM: ("lam", [*head["constraints"], *(head.get("switches", ()) if behind else ())]),
        VIRTUAL: ("tau", head["rates"] if "robot" in head else ()),
        PARAM: ("p", head["parameters"]),
        INPUT: ("u", head["inputs"]),
    }
    names = {(T, 0): "t"}
    for kind, (prefix, entries) in groups.items():
        taken: set[str] = set()
        for k, entry in enumerate(entries):
            name = f"{prefix}_{spelled(entry['name'])}"
            while name in taken:  # the friction in a gear is called as the gear is
                name += "_"
            taken.add(name)
            names[kind, k] = name
    settings = [f"s_{spelled(s['name'])}_{key}" for s in head.get("switches", ()) for key in settings_of(s)]
    settings += [f"b_{k}" for k in range(sum(event["action"] == JUMP for event in head.get("events", ())))]
    names |= {(INPUT, len(head["inputs"]) + k): name for k, name in enumerate(settings)}
    return names
