"""Read a generated module as data: its header and its functions' text. Nothing in it is ever executed."""

from __future__ import annotations

import ast
import gc
import hashlib
import importlib
import math
import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from symgen.runtime.abi import ABI, JUMP, MARKS, N_WATCHED, SOLIDS, required_functions
from symgen.runtime.errors import ModuleError
from symgen.runtime.graph.bounds import NUMBERS
from symgen.runtime.graph.layouts import BASE_PARAMETERS, FRAME_FUNCTIONS, LATE, LIMITS, ROBOT_FUNCTIONS
from symgen.runtime.index_tables import LARGEST, entries_of
from symgen.runtime.lazy import Late
from symgen.runtime.module_check import verified
from symgen.runtime.module_source import SOLVERS, ModuleSource

json = Late("json")  # for large headers only

_LARGEST = 1 << 26  # values that one function hoists, sizes of a body
_COUNTS = ("nq", "nv", "nh", "nn", "nw")
_NAME = re.compile(
    r"[A-Za-z][A-Za-z0-9_]{0,199}", re.ASCII
)  # the rules of model files, for names made of two as well
_DOTTED = re.compile(
    rf"(?=.{{1,200}}\Z){_NAME.pattern}(\.{_NAME.pattern})*", re.ASCII
)  # those of uses of assemblies
_ADDRESS = re.compile(r"[A-Za-z0-9_.\[\]]{1,400}", re.ASCII)
_NAMES_OF_ROBOTS = re.compile(
    r"[A-Za-z][A-Za-z0-9_]{0,199}(\.[A-Za-z]{1,3})?", re.ASCII
)  # base parameters: `q1.Izz`
_COLOUR = re.compile(r"#[0-9a-f]{6}", re.ASCII)
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
    ("events", "action"): ("terminate", "record", "reset", "jump", "stop", "friction"),
    ("switches", "kind"): tuple(N_WATCHED),
}


class HeaderFault(Exception):
    """What is wrong with a header."""


def check_header(header: Any) -> None:
    """Check that a literal is the header of a module: all keys there, of the right types, sizes that agree.

    Raises
    ------
    HeaderFault
        Says what is wrong, in words.
    """
    abi = _get(header, "abi", int, "")
    if abi != ABI:
        raise HeaderFault(f"the module has ABI {abi}, this run time reads ABI {ABI}")
    for check in (
        _check_fields, _check_facts, _check_options, _check_balances, _check_robot, _check_start, _check_marks,
        _check_windings, _check_limits, _check_sizes, _check_subsystems, _check_switches, _check_sayings,
    ):  # fmt: skip
        check(header)


def _check_fields(header: dict[str, Any]) -> None:
    """What every header has: texts, counts, a name, and records of what the model consists of."""
    for key in _TEXTS:
        _get(header, key, str, "")
    for key in _COUNTS:
        if _get(header, key, int, "") < 0:
            raise HeaderFault(f"{key!r} is {header[key]}, expected a count")
    if not _NAME.fullmatch(header["name"]):
        raise HeaderFault(
            f"'name' is {header['name']!r:.60}, which is no name: letters, digits and underscores"
        )
    for key, fields in _RECORDS.items():
        _check_records(key, _get(header, key, list, ""), fields)
    for index, record in enumerate(header["inputs"]):
        _check_input_over_time(record, f"inputs[{index}]")
    for index, record in enumerate(header["constraints"]):
        if "multiplier" in record:
            _get(record, "multiplier", str, f"constraints[{index}]")
    for index, body in enumerate(header["bodies"]):
        if "color" in body and not _COLOUR.fullmatch(_get(body, "color", str, f"bodies[{index}]")):
            raise HeaderFault(f"bodies[{index}]['color'] is {body['color']!r:.60}, expected '#rrggbb'")


def _check_facts(header: dict[str, Any]) -> None:
    """What is known of the equations and functions, and how the model wants to be run."""
    for flag in _FLAGS:
        _get(_get(header, "structure", dict, ""), flag, bool, "structure")
    for name in _get(header, "operations", dict, ""):
        _get(header["operations"], name, int, "operations")
    _get(header, "run", dict, "")
    for name in _get(header, "hoisted", dict, "") if "hoisted" in header else ():
        if not 1 <= _get(header["hoisted"], name, int, "hoisted") <= _LARGEST:
            raise HeaderFault(f"hoisted[{name!r}] is {header['hoisted'][name]}, expected a count")


def _check_options(header: dict[str, Any]) -> None:
    """What is missing where a model does without it."""
    for key, only in (("starts", True), ("sensed", True), ("impacts", "sequential")):
        if header.get(key, only) != only or type(header.get(key, only)) is not type(only):
            raise HeaderFault(f"{key!r} is {header[key]!r:.60}, expected {only!r}")
    if any(name not in LATE for name in (_get(header, "late", list, "") if "late" in header else ())):
        raise HeaderFault(f"'late' is {header['late']!r:.60}, expected some of {', '.join(LATE)}")
    if "time_terms" in header and _get(header, "time_terms", int, "") < 1:
        raise HeaderFault(f"'time_terms' is {header['time_terms']}, expected a count")


def _check_balances(header: dict[str, Any]) -> None:
    """Which constraint gives the balance of a coordinate without inertia."""
    m, names = len(header["constraints"]), {record["name"] for record in header["coordinates"]}
    balances = _get(header, "balances", dict, "") if "balances" in header else {}
    if any(type(k) is not int or not 0 <= k < m or name not in names for name, k in balances.items()):
        raise HeaderFault(f"'balances' is {balances!r:.60}, expected constraints by coordinates")


def _check_sayings(header: dict[str, Any]) -> None:
    """What events say when they act: plain text."""
    for index, event in enumerate(header["events"]):
        if event["action"] != JUMP and "says" not in event:
            continue
        says = _get(event, "says", str, f"events[{index}]")
        if not (says.isascii() and says.isprintable()):
            raise HeaderFault(f"events[{index}]['says'] is {event['says']!r:.60}, expected plain text")


def _check_robot(header: dict[str, Any]) -> None:
    """The functions of a robot's module, and names that what they write has."""
    if "robot" not in header:
        return
    made = _get(header, "robot", dict, "")
    for key in ("functions", "frames", "base_parameters", "actuators"):
        for name in _get(made, key, list, "robot"):
            if type(name) is not str or not _NAMES_OF_ROBOTS.fullmatch(name):
                raise HeaderFault(f"robot[{key!r}] has {name!r:.60}, which is no name")
    frames = [prefix + frame for frame in made["frames"] for prefix in FRAME_FUNCTIONS]
    known = {*ROBOT_FUNCTIONS, BASE_PARAMETERS, *frames}
    if unknown := [name for name in made["functions"] if name not in known]:
        raise HeaderFault(f"robot['functions'] has {unknown[0]!r:.60}, which is no function for robots")


def _check_start(header: dict[str, Any]) -> None:
    """What holds at the start, if anything is said of it: texts, parameters, rates and stops that are there."""
    if "start" not in header:
        return
    start = _get(header, "start", dict, "")
    for text in _get(start, "equations", list, "start"):
        if type(text) is not str or not text.isprintable():
            raise HeaderFault(f"start['equations'] has {text!r:.60}, expected plain text")
    if len(_get(start, "levels", list, "start")) != len(start["equations"]) or set(start["levels"]) - {
        0,
        1,
        2,
    }:
        raise HeaderFault(f"start['levels'] is {start['levels']!r:.60}, expected 0, 1 or 2 for each equation")
    _get(start, "balance", bool, "start")
    for key, size in (("find", len(header["parameters"])), ("steady", header["nv"])):
        places = start.get(key)
        if key == "steady" and places is True:
            continue
        if type(places) is not list or any(type(k) is not int or not 0 <= k < size for k in places):
            raise HeaderFault(f"start[{key!r}] is {places!r:.60}, expected indices below {size}")
    stops = [s["name"] for s in header.get("switches", []) if s["kind"] == "stop"]
    if any(name not in stops for name in _get(start, "closed", list, "start")):
        raise HeaderFault(f"start['closed'] is {start['closed']!r:.60}, expected names of stops")


def _check_marks(header: dict[str, Any]) -> None:
    """What is drawn besides bodies, if anything: as many numbers as its kind has, in a body that is there."""
    bodies = {"", *(body["name"] for body in header["bodies"])}
    for index, mark in enumerate(_get(header, "marks", list, "") if "marks" in header else ()):
        place = f"marks[{index}]"
        for key, kind in (("kind", str), ("name", str), ("body", str), ("numbers", int)):
            _get(mark, key, kind, place)
        if mark["numbers"] != MARKS.get(mark["kind"]):
            raise HeaderFault(
                f"{place} is of the kind {mark['kind']!r:.60} and has {mark['numbers']} numbers"
            )
        if mark["body"] not in bodies:
            raise HeaderFault(f"{place}['body'] is {mark['body']!r:.60}, and there is no such body")
        carried = mark.get("carries", [])
        if type(carried) is not list or any(name not in bodies for name in carried):
            raise HeaderFault(f"{place}['carries'] is {carried!r:.60}, expected names of bodies")
        held = mark.get("constraints", [])
        if type(held) is not list or any(type(k) is not int or not 0 <= k < header["nh"] for k in held):
            raise HeaderFault(
                f"{place}['constraints'] is {held!r:.60}, expected indices of holonomic constraints"
            )
        signs = mark.get("signs", [])
        if type(signs) is not list or len(signs) != len(held) or any(sign not in (1, -1) for sign in signs):
            raise HeaderFault(f"{place}['signs'] is {signs!r:.60}, expected 1 or -1 for each constraint")


def _check_windings(header: dict[str, Any]) -> None:
    """What is wound up: a bushing or a spring, and where the angles that the function `windings` writes of it end."""
    for index, record in enumerate(_get(header, "windings", list, "") if "windings" in header else ()):
        place = f"windings[{index}]"
        _get(record, "name", str, place)
        if _get(record, "kind", str, place) not in ("bushing", "spring"):
            raise HeaderFault(f"{place}['kind'] is {record['kind']!r:.60}, expected 'bushing' or 'spring'")
        bounds = _get(record, "bounds", list, place)
        if not bounds or any(type(x) is not float or not 0.0 < x < 4.0 for x in bounds):
            raise HeaderFault(f"{place}['bounds'] is {bounds!r:.60}, expected angles")


def _check_limits(header: dict[str, Any]) -> None:
    """What numbers of parameters have to be: bounds that are known, with as many numbers as each is about."""
    for index, record in enumerate(_get(header, LIMITS, list, "") if LIMITS in header else ()):
        place = f"{LIMITS}[{index}]"
        if not _ADDRESS.fullmatch(_get(record, "name", str, place)):
            raise HeaderFault(f"{place}['name'] is {record['name']!r:.60}, which is no address in a model")
        bound, n = _get(record, "bound", str, place), record.get("numbers", 1)
        if type(n) is not int or n not in NUMBERS.get(bound, ()):
            raise HeaderFault(f"{place} has the bound {bound!r:.60} on {n!r:.60} numbers")


def _get(table: Any, key: str, kind: type, place: str) -> Any:
    if not isinstance(table, dict):
        raise HeaderFault(f"{place or 'MODEL'} is a {type(table).__name__}, expected a dict")
    where = f"{place}[{key!r}]" if place else repr(key)
    if key not in table:
        raise HeaderFault(f"the key {where} is missing")
    value = table[key]
    if kind is float and type(value) is int:
        value = float(value)
    if type(value) is not kind:
        raise HeaderFault(f"{where} is {value!r:.60}, expected a {kind.__name__}")
    if kind is float and not math.isfinite(value):
        raise HeaderFault(f"{where} is {value}, expected a finite number")
    return value


def _check_records(key: str, records: list[Any], fields: dict[str, type]) -> None:
    for index, record in enumerate(records):
        for field, kind in fields.items():
            value = _get(record, field, kind, f"{key}[{index}]")
            choices = _CHOICES.get((key, field))
            if choices and value not in choices:
                raise HeaderFault(
                    f"{key}[{index}][{field!r}] is {value!r}, expected one of {', '.join(choices)}"
                )
    names = [record["name"] for record in records]
    seen: set[str] = set()
    for name in names:
        if not _DOTTED.fullmatch(name):
            raise HeaderFault(f"{key} has the name {name!r:.60}: names are letters, digits and underscores")
        if name in seen:
            raise HeaderFault(f"{key} has the name {name!r} twice")
        seen.add(name)


def _check_input_over_time(record: dict[str, Any], place: str) -> None:
    """What an input does over time, if the model says so: numbers, as many times as values."""
    lists = [(record, "polynomial", place)] if "polynomial" in record else []
    if "table" in record:
        table, inside = _get(record, "table", dict, place), f"{place}['table']"
        lists += [(table, "t", inside), (table, "values", inside)]
        if _get(table, "kind", str, inside) not in ("linear", "cubic", "hold"):
            raise HeaderFault(f"{inside}['kind'] is {table['kind']!r:.60}, expected linear, cubic or hold")
    for owner, key, where in lists:
        numbers = _get(owner, key, list, where)
        if not numbers or any(type(x) not in (int, float) or not math.isfinite(x) for x in numbers):
            raise HeaderFault(f"{where}[{key!r}] is no list of finite numbers")
    if "table" in record and len(record["table"]["t"]) != len(record["table"]["values"]):
        raise HeaderFault(f"{place}['table'] has not as many times as values")


def _check_sizes(header: dict[str, Any]) -> None:
    m = header["nh"] + header["nn"]
    for key, size, symbol in (
        ("coordinates", header["nq"], "nq"),
        ("rates", header["nv"], "nv"),
        ("constraints", m, "nh + nn"),
    ):
        if len(header[key]) != size:
            raise HeaderFault(f"{key} has {len(header[key])} entries, but {symbol} is {size}")
    _check_quaternions(header)
    _check_states(header)
    dependent = _get(header, "dependent", list, "") if "dependent" in header else []
    if any(type(k) is not int or not 0 <= k < m for k in dependent) or sorted(set(dependent)) != dependent:
        raise HeaderFault(f"'dependent' is {dependent!r:.60}, expected ascending indices of constraints")
    kinds = [constraint["kind"] for constraint in header["constraints"]]
    if kinds != ["holonomic"] * header["nh"] + ["velocity"] * header["nn"]:
        raise HeaderFault("constraints must list the nh holonomic ones, then the nn velocity constraints")
    if header["nw"] != (0 if header["structure"]["conservative"] else 1):
        raise HeaderFault(
            f"nw is {header['nw']}, but structure['conservative'] is {header['structure']['conservative']}"
        )
    if any(not 0 <= body["sizes"] <= _LARGEST for body in header["bodies"]):
        raise HeaderFault("a body has a negative count of sizes, or more than there can be")
    for index, body in enumerate(header["bodies"]):
        parts = _get(body, "parts", list, f"bodies[{index}]") if "parts" in body else []
        if (body["shape"] == "solids") != bool(parts) or any(kind not in SOLIDS for kind in parts):
            raise HeaderFault(f"bodies[{index}]['parts'] is {parts!r:.60}, expected the kinds of its solids")
        if parts and sum(SOLIDS[kind] for kind in parts) != body["sizes"]:
            raise HeaderFault(f"bodies[{index}] has {body['sizes']} sizes, and its solids have others")


def _check_subsystems(header: dict[str, Any]) -> None:
    """Every coordinate, rate and constraint belongs to one subsystem, if there are any."""
    kinds = _get(header, "subsystems", list, "") if "subsystems" in header else []
    for key, size in (("coordinates", "nq"), ("rates", "nv"), ("constraints", "nh")) if kinds else ():
        found: list[Any] = []
        for index, kind in enumerate(kinds):
            members = _get(kind, key, list, f"subsystems[{index}]")
            lengths = {len(member) if type(member) is list else -1 for member in members}
            if len(lengths) != 1 or -1 in lengths:
                raise HeaderFault(f"subsystems[{index}][{key!r}] is not a list of equally long lists")
            found += [k for member in members for k in member]
        count = header[size] + (header["nn"] if key == "constraints" else 0)
        if any(type(k) is not int for k in found) or sorted(found) != list(range(count)):
            raise HeaderFault(f"subsystems do not name each of the {count} {key} once")


def _check_switches(header: dict[str, Any]) -> None:
    """Each stop and friction has an event of its name; stops come first, their events in the same order and last."""
    switches = _get(header, "switches", list, "") if "switches" in header else []
    _check_records("switches", switches, {"name": str, "kind": str})
    normals = [s["name"] for s in switches if s["kind"] == "stop"]
    normals += [record["name"] for record in header["constraints"]]
    for index, record in enumerate(switches):
        names = _get(record, "normal", list, f"switches[{index}]") if "normal" in record else []
        if unknown := [name for name in names if name not in normals]:
            raise HeaderFault(f"switches[{index}]['normal'] names {unknown[0]!r:.60}: no stop, no constraint")
        if "smooth" in record and not (record["smooth"] is True and names):
            raise HeaderFault(
                f"switches[{index}] is smooth and has no 'normal': it would be a force like others"
            )
    _check_planes(switches)
    acting = [(e["name"], e["action"]) for e in header["events"] if e["action"] in N_WATCHED]
    listed = [(s["name"], s["kind"]) for s in switches]
    ordered = sorted(listed, key=lambda entry: entry[1] != "stop")
    last = [e["action"] in N_WATCHED for e in header["events"][len(header["events"]) - len(listed) :]]
    if not (listed == ordered == acting and all(last)):
        raise HeaderFault(
            "switches must list the stops, then the frictions, and have the last events in this order"
        )


def _check_planes(switches: list[dict[str, Any]]) -> None:
    """A friction with two directions has two records, one behind the other, alike but for their names."""
    waiting: dict[str, Any] | None = None
    for index, record in enumerate(switches):
        if ("circle" in record) != ("axis" in record) or record.get("axis", 1) not in (1, 2):
            raise HeaderFault(
                f"switches[{index}] has 'circle' without 'axis' 1 or 2, or 'axis' without 'circle'"
            )
        if (record.get("axis") == 2) != (waiting is not None):
            raise HeaderFault(
                f"switches[{index}]: of a friction with two directions, 1 and 2 follow each other"
            )
        if waiting is not None and record != waiting | {"name": record["name"], "axis": 2}:
            raise HeaderFault(f"switches[{index}] is not what the other direction of its friction is")
        waiting = record if record.get("axis") == 1 else None
    if waiting is not None:
        raise HeaderFault(f"the friction {waiting['name']!r:.60} has one direction of two")


def _check_quaternions(header: dict[str, Any]) -> None:
    """Quaternions are what makes coordinates and rates differ: each has four of the one and three of the other."""
    places = header.get("quaternions", [])
    if type(places) is not list or any(type(place) is not int for place in places):
        raise HeaderFault(f"'quaternions' is {places!r:.60}, expected a list of indices")
    ends = [0, *(place + 4 for place in places)]
    if any(place < end for place, end in zip(places, ends)) or ends[-1] > header["nq"]:
        raise HeaderFault(f"'quaternions' is {places}, expected ascending indices of four coordinates each")
    if header["nq"] - header["nv"] != len(places):
        raise HeaderFault(
            f"nq - nv is {header['nq'] - header['nv']}, but 'quaternions' has {len(places)} entries: "
            "every unit quaternion has one coordinate more than it has rates, all else as many"
        )


def _check_states(header: dict[str, Any]) -> None:
    """States are rates, each of a coordinate that is no element of a quaternion."""
    if "states" not in header:
        return
    places = _get(header, "states", list, "")
    turning = {first - k + j for k, first in enumerate(header.get("quaternions", [])) for j in range(3)}
    if (
        any(type(k) is not int or not 0 <= k < header["nv"] or k in turning for k in places)
        or sorted(set(places)) != places
        or not places
    ):
        raise HeaderFault(f"'states' is {places!r:.60}, expected ascending indices of rates")
    moved = _get(header, "constraints_of_states", list, "") if "constraints_of_states" in header else []
    known = [record["name"] for record in header["constraints"] if record["kind"] == "velocity"]
    if any(name not in known for name in moved):
        raise HeaderFault(f"'constraints_of_states' is {moved!r:.60}, expected names of velocity constraints")


DECORATOR = '@njit(error_model="numpy")'

_PREAMBLE_LINE = re.compile(r"(#.*|from (math|numba|numpy) import [A-Za-z0-9_, ()]*)?$")
_TOP_LEVEL_LINE = re.compile(r"^[^\s#].*$", re.MULTILINE)
_DEFINITION = re.compile(r"def ([A-Za-z_][A-Za-z0-9_]*)\(t, y, p, out\):$")
_TABLE = re.compile(r"(I[0-9]{1,9}) = \((.*)\)$")


def read_module(
    path_or_text: str | os.PathLike[str], rest: Callable[[], ModuleSource] | None = None
) -> ModuleSource:
    """Read a generated module from a file, or from its text (anything with a line break).

    Parameters
    ----------
    path_or_text : path-like or str
    rest : callable, optional
        Gives the whole module where this one leaves functions out (`late` in its header).

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
    tables = _tables(file, text, tops)
    functions, lines = _functions(file, text, end, tops[len(tables) :])
    for name in (*required_functions(header), *header.get("hoisted", ())):
        if name not in functions:
            raise ModuleError(file, "", f"the function {name!r} is missing")
    digest = hashlib.sha256(text.encode()).hexdigest()
    return verified(ModuleSource(file, header, functions, lines, tables, digest, rest=rest))


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


_LARGE_HEADER = (
    200_000  # characters from which on Python's parser takes long, and a hundred times their memory
)
_RECORD_LISTS = re.compile(r'^    "(\w+)": \[\n((?:        \{.*\},\n)+)    \],$', re.MULTILINE)
_WORD = re.compile(r"True|False|None")
_LONE_WORD = re.compile(r'(?<=": )(?:True|False|None)(?=[,}])')
_JSON = {"True": "true", "False": "false", "None": "null"}
_NOT_THE_SAME = re.compile(r"\\|\b(?:true|false|null|NaN|Infinity)\b|\"\"\"|'''")


def _literal(text: str) -> Any:
    """The value of a literal; of a large header, lists of records are read as the JSON that they nearly are."""
    if len(text) < _LARGE_HEADER or _NOT_THE_SAME.search(text):
        return ast.literal_eval(text)
    found: dict[str, list[Any]] = {}

    def taken_out(block: re.Match[str]) -> str:
        key, records = block.groups()
        if text.count(f'\n    "{key}": ') > 1 or len(_WORD.findall(records)) != len(
            _LONE_WORD.findall(records)
        ):
            return block.group()
        try:
            found[key] = json.loads(
                f"[{_LONE_WORD.sub(lambda word: _JSON[word.group()], records.rstrip()[:-1])}]"
            )
        except ValueError:
            return block.group()
        return f'    "{key}": [],'

    header = ast.literal_eval(_RECORD_LISTS.sub(taken_out, text))
    return header | found if isinstance(header, dict) else header


def _header(file: str, text: str, start: int, end: int) -> dict[str, Any]:
    line, collecting = _line(text, start), gc.isenabled()
    gc.disable()  # half of the parser's time, for objects that all survive
    try:
        header = _literal(text[start:end])
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


def _tables(file: str, text: str, tops: list[tuple[int, str]]) -> dict[str, tuple[int, ...]]:
    """Read the index tables that may stand between the header and the functions."""
    tables: dict[str, tuple[int, ...]] = {}
    room = LARGEST
    for position, line in tops:
        found = _TABLE.match(line)
        if found is None:
            break
        name, entries = found.group(1), entries_of(found.group(2), room)
        if entries is None or name in tables:
            cause = f"the index table {name!r} is not of whole numbers, or has more than {room} entries"
            cause = f"the index table {name!r} stands there twice" if name in tables else cause
            raise ModuleError(file, f"line {_line(text, position)}", cause, "derive the model again")
        tables[name] = entries
        room -= len(entries)
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
