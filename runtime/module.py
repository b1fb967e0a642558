"""Read a generated module as data: its header and its functions' text. Nothing in it is ever executed."""

from __future__ import annotations

import ast
import gc
import hashlib
import importlib
import os
import re
from pathlib import Path
from typing import Any

from symgen.runtime.abi import required_functions
from symgen.runtime.errors import ModuleError
from symgen.runtime.header import HeaderFault, check_header
from symgen.runtime.module_check import verified
from symgen.runtime.module_source import SOLVERS, ModuleSource

DECORATOR = '@njit(error_model="numpy")'

_PREAMBLE_LINE = re.compile(r"(#.*|from (math|numba|numpy) import [A-Za-z0-9_, ()]*)?$")
_TOP_LEVEL_LINE = re.compile(r"^[^\s#].*$", re.MULTILINE)
_DEFINITION = re.compile(r"def ([A-Za-z_][A-Za-z0-9_]*)\(t, y, p, out\):$")
_TABLE = re.compile(r"(I[0-9]{1,9}) = \(((?:[0-9]{1,15}, )*[0-9]{1,15},?)\)$")


def read_module(path_or_text: str | os.PathLike[str]) -> ModuleSource:
    """Read a generated module from a file, or from its text (anything with a line break).

    Parameters
    ----------
    path_or_text : path-like or str

    Returns
    -------
    ModuleSource

    Raises
    ------
    ModuleError
        The text is not a module of ABI 1, or one of its functions is not complete; says where and why.
    """
    if isinstance(path_or_text, str) and "\n" in path_or_text:
        file, text = "<text>", path_or_text
    else:
        file = os.fspath(path_or_text)
        try:
            text = Path(file).read_text(encoding="utf-8")
        except UnicodeDecodeError as error:
            raise ModuleError(file, "", f"it is not UTF-8 text ({error})") from None
        except OSError as error:
            raise ModuleError(file, "", f"it cannot be read ({error.strerror})", "check the path") from None
    start, end = _header_span(file, text)
    header = _header(file, text, start, end)
    tops = [(match.start(), match.group().rstrip()) for match in _TOP_LEVEL_LINE.finditer(text, end + 1)]
    tables = _tables(tops)
    functions, lines = _functions(file, text, end, tops[len(tables) :])
    for name in (*required_functions(header), *header.get("hoisted", ())):
        if name not in functions:
            raise ModuleError(file, "", f"the function {name!r} is missing")
    digest = hashlib.sha256(text.encode()).hexdigest()
    return verified(ModuleSource(file, header, functions, lines, tables, digest))


def _line(text: str, position: int) -> int:
    return text.count("\n", 0, position) + 1


def _header_span(file: str, text: str) -> tuple[int, int]:
    """Return where the literal `MODEL` begins and ends; before it only a docstring and imports may stand."""
    found = re.search(r"^MODEL = (?=\{)", text, re.MULTILINE)
    if found is None:
        raise ModuleError(file, "", "there is no line that begins with 'MODEL = {': not a generated module")
    preamble = text[: found.start()]
    docstring = re.match(r'\s*"""(?:[^"\\]|\\.|"(?!""))*"""', preamble)
    rest = preamble[docstring.end() :] if docstring else preamble
    first = preamble.count("\n") - rest.count("\n") + 1
    for number, line in enumerate(rest.split("\n"), first):
        if not _PREAMBLE_LINE.match(line.rstrip()):
            raise ModuleError(file, f"line {number}", f"unexpected before MODEL: {line.strip()[:60]!r}")
    close = re.compile(r"^\}[ \t]*$|\}[ \t]*$(?=\n(?:\s*\n)*(?:@|\Z))", re.MULTILINE).search(
        text, found.end()
    )
    if close is None:
        raise ModuleError(file, f"line {_line(text, found.start())}", "the literal MODEL does not end")
    return found.end(), close.end()


def _header(file: str, text: str, start: int, end: int) -> dict[str, Any]:
    line, collecting = _line(text, start), gc.isenabled()
    gc.disable()  # half of the parser's time, for objects that all survive
    try:
        header = ast.literal_eval(text[start:end])
    except (ValueError, SyntaxError, TypeError, MemoryError, RecursionError) as error:
        cause = f"MODEL is not a literal ({error})" if str(error) else "MODEL is not a literal"
        raise ModuleError(file, f"line {line}", cause) from None
    finally:
        if collecting:
            gc.enable()
    try:
        check_header(header)
    except HeaderFault as fault:
        raise ModuleError(file, f"MODEL at line {line}", str(fault)) from None
    return header


def _tables(tops: list[tuple[int, str]]) -> dict[str, tuple[int, ...]]:
    """Read the index tables that may stand between the header and the functions."""
    tables: dict[str, tuple[int, ...]] = {}
    for _, line in tops:
        found = _TABLE.match(line)
        if found is None or found.group(1) in tables:
            break
        tables[found.group(1)] = tuple(int(entry) for entry in found.group(2).split(",") if entry)
    return tables


def _is_solver(text: str, file: str, line: int) -> bool:
    """Whether the text of a function is that of a solver which this run time knows under its name."""
    name = text[4 : text.find("(")]
    if name not in SOLVERS:
        return False
    if not importlib.import_module(SOLVERS[name]).is_known(text):
        cause = f"the function {name!r} is not the one that this run time knows"
        raise ModuleError(file, f"line {line}", cause, "derive the model again")
    return True


def _functions(
    file: str, text: str, start: int, tops: list[tuple[int, str]]
) -> tuple[dict[str, str], dict[str, int]]:
    """Split what follows the header at the lines in column 0: decorator, definition, decorator, …"""
    functions: dict[str, str] = {}
    lines: dict[str, int] = {}
    line, counted = _line(text, start), start
    for index in range(0, len(tops), 2):
        position, decorator = tops[index]
        line, counted = line + text.count("\n", counted, position), position
        begin = tops[index + 1][0] if index + 1 < len(tops) else len(text)
        end = tops[index + 2][0] if index + 2 < len(tops) else len(text)
        if decorator == DECORATOR and _is_solver(text[begin:end], file, line + 1):
            continue
        definition = _DEFINITION.match(tops[index + 1][1]) if index + 1 < len(tops) else None
        if decorator != DECORATOR or definition is None:
            cause = f"expected {DECORATOR} and 'def name(t, y, p, out):', found {decorator[:60]!r}"
            raise ModuleError(file, f"line {line}", cause)
        name = definition.group(1)
        if name in functions:
            raise ModuleError(file, f"line {line}", f"the function {name!r} is defined twice")
        functions[name] = text[begin:end].rstrip() + "\n"
        lines[name] = line + text.count("\n", position, begin)
    return functions, lines
