"""The errors that a model's author can mend: where, what, and what to do about it."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

# What to do about constants that have no finite value.
TOO_LARGE = "numbers of the model are too large, or too small, for its equations: look at exponents and units"


class SymgenError(Exception):
    """Base class of the errors that symgen raises on purpose."""


class ModelError(SymgenError):
    """A model description is wrong.

    Parameters
    ----------
    message : str
        What is wrong, with the names involved.
    file : str, optional
        The model file, or the model's name where it was made in Python.
    line : int, optional
        Line in the file, where one is known.
    table : str, optional
        TOML table (`bodies.rod`), or the call of the Python interface (`body('rod')`).
    key : str, optional
        Key in the table, or argument of the call.
    column : int, optional
        Place in the expression as the author wrote it; the first character is 1.
    hint : str, optional
        What to do about it.
    use : str, optional
        The use of an assembly that it comes through, `engine.c1` where one is inside another.
    """

    FIELDS = ("file", "line", "table", "key", "column", "hint", "use")

    def __init__(
        self,
        message: str,
        *,
        file: str | None = None,
        line: int | None = None,
        table: str | None = None,
        key: str | None = None,
        column: int | None = None,
        hint: str | None = None,
        use: str | None = None,
    ) -> None:
        super().__init__(message)
        self.message = message
        self.file = file
        self.line = line
        self.table = table
        self.key = key
        self.column = column
        self.hint = hint
        self.use = use

    def located(self, **fields: Any) -> ModelError:
        """Fill in the fields that are not known yet; returns the error itself."""
        for name, value in fields.items():
            if getattr(self, name) is None:
                setattr(self, name, value)
        return self

    @property
    def place(self) -> str:
        """File, line, table, key and column, as far as they are known."""
        where = [] if self.file is None else [self.file]
        if self.line is not None:
            where.append(f"line {self.line}")
        inside = []
        if self.table:
            inside.append(self.table if "(" in self.table else f"[{self.table}]")
        if self.key:
            inside.append(self.key)
        if inside:
            where.append(" ".join(inside))
        if self.column is not None:
            where.append(f"column {self.column}")
        if self.use is not None:
            where.append(f"used as '{self.use}'")
        return ", ".join(where)

    def __str__(self) -> str:
        text = f"{self.place}: {self.message}" if self.place else self.message
        return f"{text}; {self.hint}" if self.hint else text

    def __reduce__(self):
        state = {name: getattr(self, name) for name in self.FIELDS}
        return _rebuild, (type(self), self.message, state)


def _rebuild(cls: type[ModelError], message: str, fields: dict[str, Any]) -> ModelError:
    return cls(message, **fields)


def nearest(name: str, names: Iterable[str], what: str = "known names") -> str | None:
    """A hint for a misspelt name: its nearest neighbour, or the list of the names where none is near."""
    import difflib

    known = list(dict.fromkeys(names))
    close = difflib.get_close_matches(name, known, n=1, cutoff=0.5)
    if not close:
        lower = {k.lower(): k for k in known}
        close = [lower[m] for m in difflib.get_close_matches(name.lower(), lower, n=1, cutoff=0.5)]
    if close:
        return f"did you mean '{close[0]}'?"
    if not known:
        return f"there are no {what}; declare it"
    return f"{what}: {', '.join(known[:12])}" + (", …" if len(known) > 12 else "")
