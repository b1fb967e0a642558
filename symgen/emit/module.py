"""The text of a generated module: its header, index tables, solvers and functions."""

from __future__ import annotations

import functools
import math

from symgen.runtime.graph.functions import IN_CODE

from ..derive.contacts import SETTINGS
from ..derive.graph.kinds import INPUT, LAM, PARAM, A, Q, T, V
from ..derive.jumps import ACTION as JUMP
from ..derive.program import CLOSED_PREFIX, Program
from ..derive.solve import dense_solve, fronts
from .function import FunctionText
from .tables import Tables

TEXT = dense_solve.TEXT | fronts.TEXT
DECORATOR = '@njit(error_model="numpy")\n'


def emit(program: Program) -> str:
    """The text of the generated module.

    The text is a function of the program alone: no dates, paths or hashes of the process.
    """
    names = _variable_names(program)
    tables = Tables()
    functions = {name: FunctionText(program, name, names, tables) for name in program.names()}
    functions |= _closed_functions(program, tables)
    used = sorted({name for function in functions.values() for name in function.calls})
    of_math = [name for name in used if IN_CODE[name].value is getattr(math, name, None)]
    of_numpy = [name for name in used if name not in of_math]
    solvers = [DECORATOR + TEXT[name] for name in TEXT if any(name in f.solvers for f in functions.values())]
    hoisted = {name: function.n_hoisted for name, function in functions.items() if function.n_hoisted}
    head = _with_hoisted(program.header, hoisted)
    parts = [
        f'"""{_one_line(head["name"])}: equations of motion, written by {head["generator"]}. Do not edit.',
        "",
        f"{_one_line(head['description'])}" if head["description"] else "No description.",
        '"""',
        "",
        *([f"from math import {', '.join(of_math)}", ""] if of_math else []),
        "from numba import njit",
        *([f"from numpy import {', '.join(of_numpy)}"] if of_numpy else []),
        "",
        *_header_lines(head),
        *(f"{name} = {_tuple(places)}" for places, name in tables.names.items()),
        "",
    ]
    return (
        "\n".join(parts)
        + "\n"
        + "\n\n".join([*solvers, *("\n".join(f.lines) + "\n" for f in functions.values())])
    )


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


def _tuple(places: tuple[int, ...]) -> str:
    return f"({', '.join(map(str, places))})"


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
    text = ascii(value)
    return text if '"' in text else '"' + text[1:-1].replace("\\'", "'") + '"'


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
    settings = [f"s_{s['name']}_{key}" for s in head.get("switches", ()) for key in SETTINGS[s["kind"]]]
    settings += [f"b_{k}" for k in range(sum(event["action"] == JUMP for event in head.get("events", ())))]
    names |= {(INPUT, len(head["inputs"]) + k): name for k, name in enumerate(settings)}
    return names
