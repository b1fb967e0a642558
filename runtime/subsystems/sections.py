"""The text of a generated function by kind of subsystem: what all share, and the section of each kind."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

# Places in arrays: a number, or in loops `k`, `b*k`, `a + k`, `a + b*k` and an entry of an index table.
PLACE = re.compile(r"\b(y|p|out)\[(I\d+\[k\]|[^\[\]]+)\]")
_TITLE, _LOOP = re.compile(r"    # "), re.compile(r"    for k in range\(\d+\):")
_TOTAL = re.compile(r"    out\[(\d+)\] = (e\d+)")
_OPERATION = re.compile(r" [-+] |[*/]|(?<![ \w)\]])-|\b[a-z]+\d?\((?=[^\d])")


@dataclass(frozen=True)
class SectionedText:
    """A function that works on each kind of subsystem by itself.

    Attributes
    ----------
    doc : str
        Its docstring, a line.
    head : list of str
        What all sections share: parameters, values that follow from them, and the starts of totals.
    sections : list of list of str
        The sections' lines, those of a loop's body without the loop.
    totals : dict of int to str
        Numbers that all make together: place in `out`, and name.
    """

    doc: str
    head: list[str]
    sections: list[list[str]]
    totals: dict[int, str] = field(default_factory=dict)


def sectioned(text: str) -> SectionedText | None:
    """Return the sections of a function's text; None where it has none, because it looks at all subsystems."""
    lines = text.rstrip().split("\n")[1:]
    doc = lines.pop(0) if lines[0].lstrip().startswith('"""') else ""
    starts = [i for i, line in enumerate(lines) if _TITLE.match(line)]
    if not starts:
        return None
    end, totals = len(lines), {}
    while found := _TOTAL.fullmatch(lines[end - 1]):
        totals[int(found[1])] = found[2]
        end -= 1
    sections = [_body(lines[i + 1 : j]) for i, j in zip(starts, [*starts[1:], end], strict=True)]
    return SectionedText(doc, lines[: starts[0]], sections, totals)


def _body(lines: list[str]) -> list[str]:
    if lines and _LOOP.fullmatch(lines[0]):
        return [line[4:] for line in lines[1:]]
    return lines


def indices(place: str, count: int, tables: Mapping[str, tuple[int, ...]]) -> np.ndarray:
    """Return the value of an index for each of `count` members."""
    if place.endswith("[k]"):
        return np.array(tables[place[:-3]][:count])
    if not place.endswith("k"):
        return np.full(count, int(place))
    first, _, step = place.rpartition(" + ")
    return int(first or 0) + int(step[:-1].rstrip("*") or 1) * np.arange(count)


def needed_lines(head: list[str], body: list[str]) -> list[str]:
    """Return the lines of `head`, all of them assignments, that those of `body` need."""
    wanted, kept = set(re.findall(r"\w+", " ".join(body))), []
    for line in reversed(head):
        name, _, value = line.strip().partition(" = ")
        if name in wanted:
            kept.append(line)
            wanted.update(re.findall(r"\w+", value))
    return kept[::-1]


def operations(lines: list[str]) -> int:
    """Count the operations in some lines, roughly as the generator does."""
    return sum(len(_OPERATION.findall(line.partition(" = ")[2])) for line in lines)
