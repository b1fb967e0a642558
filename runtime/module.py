"""Read a generated module as data: its header and its functions' text. Nothing in it is ever executed."""

from __future__ import annotations

import ast
import hashlib
import math
import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from runtime.abi import ABI, required_functions
from runtime.code import dense_ldl
from runtime.errors import ModuleError

DECORATOR = '@njit(error_model="numpy")'

_PREAMBLE_LINE = re.compile(r"(#.*|from (math|numba) import [A-Za-z0-9_, ()]*)?$")
_TOP_LEVEL_LINE = re.compile(r"^[^\s#].*$", re.MULTILINE)
_DEFINITION = re.compile(r"def ([A-Za-z_][A-Za-z0-9_]*)\(t, y, p, out\):$")
_TABLE = re.compile(r"(I[0-9]{1,9}) = \(((?:[0-9]{1,15}, )*[0-9]{1,15},?)\)$")

_COUNTS = ("nq", "nv", "nh", "nn", "nw")
_TEXTS = ("generator", "source", "name", "description")
_FLAGS = (
    "conservative",
    "time_dependent",
    "constant_mass",
    "diagonal_mass",
    "velocity_dependent",
    "separable",
)
_VALUE = {"name": str, "unit": str, "value": float}
_RECORDS: dict[str, dict[str, type]] = {
    "coordinates": {**_VALUE, "enforced": bool},
    "rates": {**_VALUE, "enforced": bool},
    "parameters": _VALUE,
    "inputs": _VALUE,
    "constants": _VALUE,
    "constraints": {"name": str, "kind": str},
    "outputs": {"name": str, "unit": str},
    "events": {"name": str, "direction": str, "action": str},
    "bodies": {"name": str, "planar": bool, "shape": str, "sizes": int, "mesh": str},
}
_CHOICES = {
    ("constraints", "kind"): ("holonomic", "velocity"),
    ("events", "direction"): ("rising", "falling", "both"),
    ("events", "action"): ("terminate", "record", "reset"),
}


@dataclass(frozen=True)
class ModuleSource:
    """A generated module, read.

    Attributes
    ----------
    file : str
        Where it came from, for messages.
    header : dict
        The literal `MODEL`, checked.
    functions : dict of str
        The text of each function, from its `def` line on.
    lines : dict of int
        The line of each function's `def` in the module.
    tables : dict of tuple of int
        Index tables, which the functions' loops use.
    text_hash : str
        SHA-256 of the whole text.
    """

    file: str
    header: dict[str, Any]
    functions: dict[str, str]
    lines: dict[str, int]
    tables: dict[str, tuple[int, ...]]
    text_hash: str


def read_module(path_or_text: str | os.PathLike[str]) -> ModuleSource:
    """Read a generated module from a file, or from its text (anything with a line break).

    Raises
    ------
    ModuleError
        The text is not a module of ABI 1; says where and why.
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
    return ModuleSource(file, header, functions, lines, tables, digest)


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
    line = _line(text, start)
    try:
        header = ast.literal_eval(text[start:end])
    except (ValueError, SyntaxError, TypeError, MemoryError, RecursionError) as error:
        cause = f"MODEL is not a literal ({error})" if str(error) else "MODEL is not a literal"
        raise ModuleError(file, f"line {line}", cause) from None
    try:
        _check_header(header)
    except _Fault as fault:
        raise ModuleError(file, f"MODEL at line {line}", str(fault)) from None
    return header


class _Fault(Exception):
    """What is wrong with a header."""


def _get(table: Any, key: str, kind: type, place: str) -> Any:
    if not isinstance(table, dict):
        raise _Fault(f"{place or 'MODEL'} is a {type(table).__name__}, expected a dict")
    where = f"{place}[{key!r}]" if place else repr(key)
    if key not in table:
        raise _Fault(f"the key {where} is missing")
    value = table[key]
    if kind is float and type(value) is int:
        value = float(value)
    if type(value) is not kind:
        raise _Fault(f"{where} is {value!r:.60}, expected a {kind.__name__}")
    if kind is float and not math.isfinite(value):
        raise _Fault(f"{where} is {value}, expected a finite number")
    return value


def _check_header(header: Any) -> None:
    abi = _get(header, "abi", int, "")
    if abi != ABI:
        raise _Fault(f"the module has ABI {abi}, this run time reads ABI {ABI}")
    for key in _TEXTS:
        _get(header, key, str, "")
    for key in _COUNTS:
        if _get(header, key, int, "") < 0:
            raise _Fault(f"{key!r} is {header[key]}, expected a count")
    for key, fields in _RECORDS.items():
        _check_records(key, _get(header, key, list, ""), fields)
    for flag in _FLAGS:
        _get(_get(header, "structure", dict, ""), flag, bool, "structure")
    for name in _get(header, "operations", dict, ""):
        _get(header["operations"], name, int, "operations")
    _get(header, "run", dict, "")
    for name in _get(header, "hoisted", dict, "") if "hoisted" in header else ():
        if _get(header["hoisted"], name, int, "hoisted") < 1:
            raise _Fault(f"hoisted[{name!r}] is {header['hoisted'][name]}, expected a count")
    _check_sizes(header)
    _check_subsystems(header)


def _check_records(key: str, records: list[Any], fields: dict[str, type]) -> None:
    for index, record in enumerate(records):
        for field, kind in fields.items():
            value = _get(record, field, kind, f"{key}[{index}]")
            choices = _CHOICES.get((key, field))
            if choices and value not in choices:
                raise _Fault(f"{key}[{index}][{field!r}] is {value!r}, expected one of {', '.join(choices)}")
    names = [record["name"] for record in records]
    seen: set[str] = set()
    for name in names:
        if name in seen:
            raise _Fault(f"{key} has the name {name!r} twice")
        seen.add(name)


def _check_sizes(header: dict[str, Any]) -> None:
    m = header["nh"] + header["nn"]
    for key, size, symbol in (
        ("coordinates", header["nq"], "nq"),
        ("rates", header["nv"], "nv"),
        ("constraints", m, "nh + nn"),
    ):
        if len(header[key]) != size:
            raise _Fault(f"{key} has {len(header[key])} entries, but {symbol} is {size}")
    _check_quaternions(header)
    kinds = [constraint["kind"] for constraint in header["constraints"]]
    if kinds != ["holonomic"] * header["nh"] + ["velocity"] * header["nn"]:
        raise _Fault("constraints must list the nh holonomic ones, then the nn velocity constraints")
    if header["nw"] != (0 if header["structure"]["conservative"] else 1):
        raise _Fault(
            f"nw is {header['nw']}, but structure['conservative'] is {header['structure']['conservative']}"
        )
    if any(body["sizes"] < 0 for body in header["bodies"]):
        raise _Fault("a body has a negative count of sizes")


def _check_subsystems(header: dict[str, Any]) -> None:
    """Every coordinate, rate and constraint belongs to one subsystem, if there are any."""
    kinds = _get(header, "subsystems", list, "") if "subsystems" in header else []
    for key, size in (("coordinates", "nq"), ("rates", "nv"), ("constraints", "nh")) if kinds else ():
        found: list[Any] = []
        for index, kind in enumerate(kinds):
            members = _get(kind, key, list, f"subsystems[{index}]")
            lengths = {len(member) if type(member) is list else -1 for member in members}
            if len(lengths) != 1 or -1 in lengths:
                raise _Fault(f"subsystems[{index}][{key!r}] is not a list of equally long lists")
            found += [k for member in members for k in member]
        count = header[size] + (header["nn"] if key == "constraints" else 0)
        if any(type(k) is not int for k in found) or sorted(found) != list(range(count)):
            raise _Fault(f"subsystems do not name each of the {count} {key} once")


def _check_quaternions(header: dict[str, Any]) -> None:
    """Quaternions are what makes coordinates and rates differ: each has four of the one and three of the other."""
    places = header.get("quaternions", [])
    if type(places) is not list or any(type(place) is not int for place in places):
        raise _Fault(f"'quaternions' is {places!r:.60}, expected a list of indices")
    ends = [0, *(place + 4 for place in places)]
    if any(place < end for place, end in zip(places, ends)) or ends[-1] > header["nq"]:
        raise _Fault(f"'quaternions' is {places}, expected ascending indices of four coordinates each")
    if header["nq"] - header["nv"] != len(places):
        raise _Fault(
            f"nq - nv is {header['nq'] - header['nv']}, but 'quaternions' has {len(places)} entries: "
            "every unit quaternion has one coordinate more than it has rates, all else as many"
        )


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
    if name not in dense_ldl.SOLVERS:
        return False
    if not dense_ldl.is_known(text):
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
