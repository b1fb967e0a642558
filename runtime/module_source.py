"""A generated module as data: its header, its functions as texts and forms, and which solvers by loops it may bring."""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Callable, Mapping
from dataclasses import field, replace
from typing import TYPE_CHECKING, Any

from symgen.runtime.abi import array_sizes, setting_names
from symgen.runtime.code.facts import Facts, from_text
from symgen.runtime.code.function_text import FunctionText
from symgen.runtime.errors import ModuleError
from symgen.runtime.graph.layouts import Lengths
from symgen.runtime.lazy import Late
from symgen.runtime.record import record

if TYPE_CHECKING:
    from symgen.runtime.graph.form import Form

dataflow = Late("symgen.runtime.code.dataflow")
printing = Late("symgen.runtime.code.printing")

# Solvers that this run time knows under their names, and the modules that have them.
_DENSE, _FRONTS = "symgen.runtime.code.dense_ldl", "symgen.runtime.code.front_ldl"
SOLVERS = {"factor_ldl": _DENSE, "solve_ldl": _DENSE, "factor_fronts": _FRONTS, "solve_fronts": _FRONTS}


@record
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
    forms : mapping of str to Form
        Functions that passes have made; of the others there is only a text until someone asks for more.
    facts_text : str
        What functions are like, as lines (`code/facts.py`); empty where that was not looked at.
    rest : callable, optional
        Gives the whole module where this one leaves functions out.
    """

    file: str
    header: dict[str, Any]
    functions: dict[str, str]
    lines: dict[str, int]
    tables: dict[str, tuple[int, ...]]
    text_hash: str
    forms: Mapping[str, Form] = field(default_factory=dict, repr=False, compare=False)
    facts_text: str = field(default="", repr=False, compare=False)
    rest: Callable[[], ModuleSource] | None = field(default=None, repr=False, compare=False)

    @property
    def late(self) -> tuple[str, ...]:
        """Functions that the model has and this text has not: they are made when one is asked for."""
        return tuple(self.header.get("late", ()))

    def names(self) -> tuple[str, ...]:
        """Return the names of all functions, those left out last."""
        return (*self.functions, *self.late)

    @property
    def is_whole(self) -> bool:
        """Whether there is no function that is still to be derived."""
        return not self.late or "_whole" in self.__dict__

    def whole(self) -> ModuleSource:
        """Return the module with all functions: this one, or what `rest` gives, asked once.

        Raises
        ------
        ModuleError
            There is nobody to ask, or the model cannot be read any more, or has changed since.
        """
        if not self.late:
            return self
        if "_whole" not in self.__dict__:
            missing = ", ".join(self.late)
            if self.rest is None:
                raise ModuleError(
                    self.file, "", f"it was written without {missing}", "derive the model again"
                )
            try:
                found = self.rest()
            except Exception as error:  # whoever derives has errors of his own
                cause = f"{missing} of the model is derived when it is asked for, and cannot be: {error}"
                raise ModuleError(
                    self.file, "", cause, "put its file back, or load the model again"
                ) from error
            if found.late or _equations(found.header) != _equations(self.header):
                cause = f"{missing} of the model cannot be had: its file has changed since it was loaded"
                raise ModuleError(self.file, "", cause, "load the model again")
            self.__dict__["_whole"] = found
        return self.__dict__["_whole"]

    def made(self, header: dict[str, Any], forms: Mapping[str, Form]) -> ModuleSource:
        """Return the module of a model whose functions passes have made from this module's."""
        header = {key: value for key, value in header.items() if key != "late"}
        functions = {name: printing.text_of(form) for name, form in forms.items()}
        digest = hashlib.sha256("".join(functions.values()).encode()).hexdigest()
        lines = {name: self.lines.get(name, 1) for name in forms}
        return ModuleSource(self.file, header, functions, lines, {}, digest, forms)

    def renamed(self, header: dict[str, Any], names: Mapping[str, str]) -> ModuleSource:
        """Return the module of a model that has some functions in the places of others: by name here, name there."""
        moved = set(names.values())
        # The form with stops as constraints need not have a `solve` of its own; that of the other one is none for it.
        moved |= {
            name for name, there in names.items() if there not in self.functions and there not in self.late
        }
        functions, lines, facts = (
            {name: x for name, x in old.items() if name not in moved}
            | {n: old[there] for n, there in names.items() if there in old}
            for old in (self.functions, self.lines, self._facts)
        )
        late = [name for name, there in names.items() if there in self.late]
        late += [name for name in self.late if name not in moved and name not in names]
        header = {key: x for key, x in header.items() if key != "late"} | ({"late": late} if late else {})

        def rest() -> ModuleSource:
            whole = self.whole()
            return whole.renamed({key: x for key, x in header.items() if key != "late"}, names)

        result = replace(self, header=header, functions=functions, lines=lines, rest=rest if late else None)
        result.__dict__["_facts"] = facts
        return result

    def whole_if_possible(self) -> ModuleSource:
        """Return the module with all functions; without those left out where the model cannot be had any more."""
        try:
            return self.whole()
        except ModuleError:
            return self

    def __getstate__(self) -> dict[str, Any]:
        """What is pickled: all functions that can be had, and not what was read on the way."""
        whole = self.whole_if_possible().__dict__
        return {name: whole[name] for name in self.__dataclass_fields__} | {"rest": None}

    def function(self, name: str) -> FunctionText | None:
        """Return a function, whose form is read when it is asked for, once; None if the ABI has no such function."""
        known = self.__dict__.setdefault("_functions", {})
        if name not in known:
            known[name] = self._function(name)
        return known[name]

    def _function(self, name: str) -> FunctionText | None:
        if name in self.late:
            return self.whole().function(name)
        header, sizes = self.header, array_sizes(self.header, name)
        if sizes is None or name not in self.functions:
            return None
        n_p = len(header["parameters"]) + len(header["inputs"]) + len(setting_names(header))
        lengths, made = Lengths(sizes[0], n_p, sizes[1]), self.forms.get(name)
        tables = self.tables if made is None else made.tables
        text = FunctionText(name, self.functions[name], lengths, tables, self.file, self.lines[name])
        if made is not None:
            text.__dict__["form"] = replace(made, lengths=lengths)
        return text

    def facts(self, name: str) -> Facts:
        """Return what a function is like, without reading it where that is known."""
        return self.whole().facts(name) if name in self.late else self._facts[name]

    @functools.cached_property
    def _facts(self) -> dict[str, Facts]:
        if self.facts_text:
            return from_text(self.facts_text)
        n_parameters = len(self.header["parameters"])
        texts = {name: self.function(name) for name in self.functions}
        return {
            name: dataflow.facts_of(text.form, n_parameters, self.header)
            for name, text in texts.items()
            if text
        }

    @functools.cached_property
    def tables_hash(self) -> str:
        """SHA-256 of the index tables."""
        return hashlib.sha256(repr(self.tables).encode()).hexdigest()

    @functools.cached_property
    def functions_hash(self) -> str:
        """SHA-256 of what is compiled: functions and tables, without the header and the text around them."""
        return hashlib.sha256(repr((self.functions, self.tables)).encode()).hexdigest()


def _equations(header: Mapping[str, Any]) -> dict[str, Any]:
    """What a header says of a model, not of the functions that happen to be in its module, nor where it came from."""
    return {key: x for key, x in header.items() if key not in ("late", "operations", "hoisted", "source")}
