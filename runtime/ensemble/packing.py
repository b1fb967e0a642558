"""Messages and statistics of some members as bytes: a line of JSON that says what follows, then plain numbers."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.errors import RuntimeModelError

if TYPE_CHECKING:
    from symgen.runtime.ensemble.reduction import Reduction


def pack(messages: Mapping[int, str], blocks: Sequence[Sequence[Reduction]]) -> bytes:
    """Return messages and statistics as bytes; nothing where there are none."""
    arrays = [[r.numbers() for r in block] for block in blocks]
    if not messages and not any(arrays):
        return b""
    shapes = [[[list(np.shape(x)) for x in own] for own in block] for block in arrays]
    head = json.dumps({"messages": {str(k): said for k, said in messages.items()}, "shapes": shapes})
    flat = [np.ascontiguousarray(x, dtype="<f8").tobytes() for block in arrays for own in block for x in own]
    return b"\n".join([head.encode(), b"".join(flat)])


def unpack(content: bytes) -> tuple[dict[int, str], list[list[list[np.ndarray]]]]:
    """Return what `pack` was given, statistics as their numbers.

    Raises
    ------
    RuntimeModelError
        The bytes are something else.
    """
    if not content:
        return {}, []
    try:
        head, _, tail = content.partition(b"\n")
        said = json.loads(head)
        numbers, place = np.frombuffer(tail, dtype="<f8"), 0
        found: list[list[list[np.ndarray]]] = []
        for block in said["shapes"]:
            found.append([])
            for own in block:
                found[-1].append([])
                for shape in own:
                    if not all(type(x) is int and 0 <= x <= len(numbers) for x in shape):
                        raise ValueError("a shape that makes no sense")
                    length = int(np.prod(shape, dtype=float))
                    if place + length > len(numbers):
                        raise ValueError("numbers are missing")
                    found[-1][-1].append(numbers[place : place + length].reshape(shape).copy())
                    place += length
        return {int(k): str(x) for k, x in said["messages"].items()}, found
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise RuntimeModelError(f"statistics of members in a store cannot be read: {error}") from None
