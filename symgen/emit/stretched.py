"""The text of a long model from those of shorter ones: equal but for numbers, which follow from the number of blocks.

A model of equal blocks (`derive/scenes/repetition.py`) is derived at four lengths, in loops. Where the texts are the
same but for whole numbers, each of these is a polynomial in the length: how often a loop runs (linear), where an entry
of a matrix stands (quadratic). Three lengths determine it, the fourth must agree; so must each entry of index tables.
Whatever does not agree is no such model, and is derived in full.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..derive.header import own_records
from ..derive.jumps import has_jumps
from ..derive.marks import marks
from ..derive.program import Program
from ..derive.scenes.components import split
from ..derive.scenes.repetition import repetition
from ..derive.scenes.subsystems import derive_whole
from ..errors import ModelError
from ..model.description import Description
from .module import Pieces, assembled, pieces

FEWEST_BLOCKS = (
    600  # below, a model is derived as fast in full, and its short functions are straight-line code
)
# Blocks of the shortest model, in which everything has taken the form that it has in long ones, and of one step, which
# holds whatever goes by twos, threes or fours.
SHORTEST, STEP, LENGTHS = 96, 12, 4
LONGEST_PERIOD = 64  # entries of a table that repeat
FEWEST_PERIODS = 4
# What the header says in the same words of all lengths.
_SAME = frozenset(
    ("abi", "generator", "nw", "quaternions", "structure", "run", "subsystems", "late", "solve", "limits")
)  # fmt: skip
_NUMBER = re.compile(r"(?<![\w.])\d+(?![\w.])")  # whole numbers that stand by themselves


class Irregular(Exception):
    """What was looked at does not follow from the number of blocks."""


@dataclass(frozen=True)
class Stretched:
    """Functions and index tables of a long model, and what is counted of them.

    Attributes
    ----------
    header : dict
    pieces : Pieces
    counts, written, findings
        See `all_counts`, `written_operations`, `Program.findings`.
    """

    header: dict[str, Any]
    pieces: Pieces
    counts: dict[str, tuple[int, int]]
    written: dict[str, int]
    findings: tuple[str, ...]

    @property
    def text(self) -> str:
        """The text of the module."""
        return assembled(self.header, self.pieces)

    def all_counts(self) -> dict[str, tuple[int, int]]:
        """As `Program.all_counts`."""
        return self.counts

    def written_operations(self) -> dict[str, int]:
        """As `Program.written_operations`."""
        return self.written

    @property
    def parts(self) -> tuple[()]:
        """It is no scene of several subsystems."""
        return ()


def long_model(description: Description, source: str, late: Collection[str]) -> Stretched | None:
    """Derive a long model from shorter ones; None where it is not long, or not made of equal blocks.

    Parameters
    ----------
    description : Description
        A checked description.
    source : str
        Hash of the model's text, kept in the module's header.
    late : collection of str
        Functions that are left out.
    """
    found = repetition(description, FEWEST_BLOCKS)
    if found is None or marks(description):
        return None
    steps, more = divmod(found.n_blocks - SHORTEST, STEP)
    try:
        short = [found.shortened(SHORTEST + more + k * STEP) for k in range(LENGTHS)]
        if has_jumps(short[0]) or sum(map(len, split(short[0]))) > 1:
            return None
        programs = [derive_whole(d, late, gathered=False) for d in short]
        return stretched(programs, steps, own_records(description), source)
    except (Irregular, ModelError):
        return None  # a wrong model is told so in its own words


def stretched(
    programs: Sequence[Program], steps: int, records: dict[str, Any] | None = None, source: str = ""
) -> Stretched:
    """What the model says that is `steps` steps longer than the first of four programs, each one longer than the last.

    Parameters
    ----------
    programs : sequence of Program
    steps : int
    records : dict, optional
        What the header says of the long model alone, `header.own_records`.
    source : str
        For the header.

    Raises
    ------
    Irregular
        It does not follow from these.
    """
    made = [pieces(program, by_loops=True) for program in programs]
    counted = [program.all_counts() for program in programs]
    written = [program.written_operations() for program in programs]
    names = [*counted[0]]
    if any([*x] != names for x in counted) or any([*x] != [*written[0]] for x in written):
        raise Irregular("functions")
    values = _integers([[x for pair in c.values() for x in pair] for c in counted], steps)
    code = _integers([[*w.values()] for w in written], steps)
    counts = dict(zip(names, zip(values[::2], values[1::2], strict=True), strict=True))
    return Stretched(
        _header([program.header for program in programs], counts, records or {}) | {"source": source},
        Pieces(
            imports=_same([p.imports for p in made]),
            hoisted=_same([p.hoisted for p in made]),
            tables=_tables([p.tables for p in made], steps),
            functions=tuple(_texts(texts, steps) for texts in zip(*(p.functions for p in made), strict=True)),
        ),
        counts,
        dict(zip(written[0], code, strict=True)),
        tuple(_texts(texts, steps) for texts in _columns([p.findings for p in programs])),
    )


def _header(heads: Sequence[dict[str, Any]], counts: dict, records: dict[str, Any]) -> dict[str, Any]:
    """The long model's header: its own records, its operations, and what is the same for all lengths."""
    operations = {name: sum(counts[name]) for name in heads[0]["operations"]}
    changed = {"source": "", **records, "operations": operations}
    rest = [{key: value for key, value in head.items() if key not in changed} for head in heads]
    if not rest[0].keys() <= _SAME:
        raise Irregular("what the header says")
    _same(rest)
    return heads[0] | changed


def _same(found: Sequence[Any]) -> Any:
    if any(x != found[0] for x in found):
        raise Irregular("what stands once")
    return found[0]


def _columns(rows: Sequence[Sequence[Any]]) -> list[tuple]:
    if any(len(row) != len(rows[0]) for row in rows):
        raise Irregular("how many there are")
    return list(zip(*rows, strict=True))


def polynomial(values: np.ndarray) -> Callable[[int], np.ndarray]:
    """The polynomials of degree two through values at 0, 1, 2, and 3, whole numbers.

    Parameters
    ----------
    values : ndarray of int, shape (4, n)

    Raises
    ------
    Irregular
        They are none.
    """
    first = np.diff(values, axis=0)
    second = np.diff(first, axis=0)
    if (second[0] != second[1]).any():
        raise Irregular("no polynomial of degree two")
    return lambda k: values[0] + k * first[0] + k * (k - 1) // 2 * second[0]


def _integers(rows: Sequence[Sequence[int]], steps: int) -> list[int]:
    _columns(rows)
    return polynomial(np.array(rows, dtype=np.int64))(steps).tolist()


def _texts(texts: Sequence[str], steps: int) -> str:
    """A text whose whole numbers are where they lead."""
    between = _same([_NUMBER.split(text) for text in texts])
    numbers = _integers([[int(x) for x in _NUMBER.findall(text)] for text in texts], steps)
    pieces = [part for pair in zip(between, map(str, [*numbers, 0]), strict=True) for part in pair]
    return "".join(pieces[:-1])


def _tables(found: Sequence[dict[tuple[int, ...], str]], steps: int) -> dict[tuple[int, ...], str]:
    names = _same([[*tables.values()] for tables in found])
    longer = [
        _table([np.array(x, dtype=np.int64) for x in column], steps)
        for column in _columns([*map(list, found)])
    ]
    result = dict(zip(longer, names, strict=True))
    if len(result) != len(names):
        raise Irregular("tables that become equal")
    return result


def _table(tables: Sequence[np.ndarray], steps: int) -> tuple[int, ...]:
    """A table made of stretches in which what is a period apart differs by as much each time."""
    parsed = [_stretches(table) for table in tables]
    made: list[np.ndarray] = []
    for column in _columns(parsed):
        period = _same([len(first) for _, first, _ in column])
        length = _integers([[n] for n, _, _ in column], steps)[0]
        begin = polynomial(np.array([first for _, first, _ in column]))(steps)
        growth = polynomial(np.array([change for _, _, change in column]))(steps)
        turn, place = np.divmod(np.arange(length), period)
        made.append(begin[place] + turn * growth[place])
    return tuple(np.concatenate(made).tolist()) if made else ()


def _stretches(table: np.ndarray) -> list[tuple[int, np.ndarray, np.ndarray]]:
    """Stretches of a table, from its beginning: length, the first period, the change from each to the next."""
    found, begin, n = [], 0, len(table)
    while begin < n:
        best, best_end = 1, begin + 1
        for period in range(1, min(LONGEST_PERIOD, (n - begin) // FEWEST_PERIODS) + 1):
            rest = table[begin:]
            change = rest[period:] - rest[:-period]
            differs = np.flatnonzero(change[period:] != change[:-period])
            end = begin + (int(differs[0]) + 2 * period if len(differs) else n - begin)
            if end - begin >= FEWEST_PERIODS * period and end > best_end + 2 * period:
                best, best_end = period, end
        first = table[begin : begin + best]
        change = (
            table[begin + best : begin + 2 * best] - first
            if best_end - begin >= 2 * best
            else np.zeros_like(first)
        )
        found.append((best_end - begin, first, change))
        begin = best_end
    return found
