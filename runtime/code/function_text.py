"""The text of a generated function, with what decides how it is read (`parse.py` says how)."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import FunctionType
from typing import TYPE_CHECKING, NoReturn

from symgen.runtime.errors import ModuleError
from symgen.runtime.graph.functions import IN_CODE
from symgen.runtime.graph.layouts import Lengths
from symgen.runtime.lazy import Late

if TYPE_CHECKING:
    from symgen.runtime.graph.form import Form

# A function whose machine code is in the cache is not read.
parsing = Late("symgen.runtime.code.parse")
printing = Late("symgen.runtime.code.printing")
forms = Late("symgen.runtime.graph.form")
dense_ldl = Late("symgen.runtime.code.dense_ldl")
front_ldl = Late("symgen.runtime.code.front_ldl")


def _as_it_is(function: Callable) -> Callable:
    return function


@dataclass(frozen=True)
class FunctionText:
    """The text of one function, from its `def` line on.

    Attributes
    ----------
    name : str
    text : str
    lengths : Lengths
        Of its arrays.
    tables : mapping of str to tuple of int
        The module's index tables.
    file, first_line
        Where the text came from, for messages.
    """

    name: str
    text: str
    lengths: Lengths
    tables: Mapping[str, tuple[int, ...]] = field(default_factory=dict)
    file: str = "<text>"
    first_line: int = 1

    @classmethod
    def of(cls, form: Form, file: str = "<text>", first_line: int = 1) -> FunctionText:
        """Return a form that a pass has made, with a text that says the same."""
        made = cls(form.name, printing.text_of(form), form.lengths, form.tables, file, first_line)
        made.__dict__["form"] = form
        return made

    @functools.cached_property
    def form(self) -> Form:
        """What the text says: read on first use, once.

        Raises
        ------
        ModuleError
            The text is outside of the grammar; names the line.
        """
        return parsing.parse(self)

    def refuse(self, line: int, cause: str) -> NoReturn:
        """Raise the error that says what is wrong, and in which line of the function."""
        raise ModuleError(self.file, f"line {self.first_line + line - 1}, function {self.name!r}", cause)

    def python_function(self, decorate: Callable[[Callable], Callable] = _as_it_is) -> Callable:
        """Return the function as plain Python reads it: for a debugger, for Numba, and as an oracle of this reader.

        The names of the grammar are all that it can see. `decorate` is applied to it and to the solvers that it calls.
        """
        used = {
            s.solver for s, _ in self.form.statements() if type(s) is forms.Solve
        }  # the grammar's check, besides
        functions = {
            key: decorate(entry.value) if isinstance(entry.value, FunctionType) else entry.value
            for key, entry in IN_CODE.items()
        }
        for solvers in (dense_ldl, front_ldl):
            functions |= {key: decorate(getattr(solvers, key)) for key in solvers.SOLVERS if key in used}
        namespace = {"__builtins__": {}, "__name__": self.name, "range": range, **self.tables, **functions}
        before = set(namespace)
        exec(compile("\n" * (self.first_line - 1) + self.text, self.file, "exec"), namespace)
        (name,) = set(namespace) - before  # a closed form's text has another name than its function
        return decorate(namespace[name])
