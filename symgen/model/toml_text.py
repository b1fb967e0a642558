"""TOML from strangers: what would take tomllib too long is refused before it is parsed."""

from __future__ import annotations

import re
import tomllib
from typing import Any

from ..errors import ModelError

MOST_PARTS = 64  # of a dotted key: tomllib needs a time in proportion to their square
_PART = r"""(?:[A-Za-z0-9_-]++|"[^"\n]*+"|'[^'\n]*+')"""
_LONG_KEY = re.compile(rf"(?<![A-Za-z0-9_-]){_PART}(?:[ \t]*+\.[ \t]*+{_PART}){{{MOST_PARTS},}}")
_POSITION = re.compile(r"\s*\(at line (\d+), column (\d+)\)\Z")


def parse(text: str, file: str) -> dict[str, Any]:
    """Return the document in `text`.

    Raises
    ------
    ModelError
        Names `file`, line and column.
    """
    long_key = _LONG_KEY.search(text)
    if long_key is not None:
        raise ModelError(
            f"TOML syntax: the key {long_key[0][:40]!r}… has more than {MOST_PARTS} parts",
            file=file,
            line=text.count("\n", 0, long_key.start()) + 1,
            hint="shorten it",
        )
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        message = str(error)
        where = _POSITION.search(message)
        if where is None:  # at the end of the document
            raise ModelError(
                f"TOML syntax: {message}", file=file, line=text.count("\n") + 1, hint="mend that line"
            ) from None
        raise ModelError(
            f"TOML syntax: {message[: where.start()]}",
            file=file,
            line=int(where[1]),
            column=int(where[2]),
            hint="mend that line",
        ) from None
    except (RecursionError, ValueError):  # nested too deeply; a number of thousands of digits
        raise ModelError(
            "TOML syntax: a value is nested too deeply, or a number is too long", file=file, hint="shorten it"
        ) from None
