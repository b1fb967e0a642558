"""Index tables of a generated module: tuples of numbers, and of pieces by which long ones say what repeats in them."""

from __future__ import annotations

import re
from itertools import chain

LARGEST = 20_000_000  # entries of all tables of a module: a short text can say as many as it likes

_NUMBERS = re.compile(r"(?:[0-9]{1,15}, )*[0-9]{1,15},?$")
_N = r"[0-9]{1,15}"
_PIECE = re.compile(
    rf"(?P<number>{_N})"
    rf"|\*range\((?P<first>{_N}), (?P<end>-?{_N})(?:, (?P<step>-?[1-9][0-9]{{0,14}}))?\)"
    rf"|\*\((?P<repeated>{_N}(?:, {_N})*),?\)\*(?P<times>{_N})"
    rf"|\*\(a \+ b\*k for k in range\((?P<passes>{_N})\) for a, b in "
    rf"\((?P<pairs>\({_N}, -?{_N}\)(?:, \({_N}, -?{_N}\))+)\)\)"
)
_PAIR = re.compile(r"\(([0-9]+), (-?[0-9]+)\)")


def entries_of(text: str, room: int = LARGEST) -> tuple[int, ...] | None:
    """Return the entries of a table; None where its text is none, or says more than there is room for.

    Parameters
    ----------
    text : str
        What stands between the parentheses: numbers, `*range(a, b, s)`, `*(a, b)*n`, and
        `*(a + b*k for k in range(n) for a, b in ((a0, b0), (a1, b1)))`, each behind a comma and a blank.
    room : int
        The most entries.
    """
    if _NUMBERS.match(text):
        found = tuple(int(entry) for entry in text.split(",") if entry)
        return found if len(found) <= room else None
    pieces: list[range | list[int]] = []
    position, n = 0, 0
    while position < len(text):
        match = _PIECE.match(text, position)
        piece = None if match is None else _piece(match, room - n)
        if piece is None:
            return None
        pieces.append(piece)
        n += len(piece)
        position = match.end()
        if text.startswith(", ", position):
            position += 2
        elif text[position:] not in ("", ","):
            return None
        else:
            break
    found = tuple(chain.from_iterable(pieces))
    return found if found and min(found) >= 0 else None


def _piece(match: re.Match[str], room: int) -> range | list[int] | None:
    """The entries that a piece stands for; None where there are none, or too many."""
    if match["number"]:
        return [int(match["number"])] if room else None
    if match["first"]:
        found = range(int(match["first"]), int(match["end"]), int(match["step"] or 1))
        return found if 0 < len(found) <= room else None
    if match["repeated"]:
        numbers, times = [int(x) for x in match["repeated"].split(", ")], int(match["times"])
        return numbers * times if 0 < len(numbers) * times <= room else None
    pairs = [(int(a), int(b)) for a, b in _PAIR.findall(match["pairs"])]
    passes = int(match["passes"])
    if not 0 < len(pairs) * passes <= room:
        return None
    found = [0] * (len(pairs) * passes)
    for k, (a, b) in enumerate(pairs):
        found[k :: len(pairs)] = range(a, a + b * passes, b) if b else [a] * passes
    return found
