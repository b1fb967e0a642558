"""A generated module as data: its header, its functions' text, and which solvers by loops it may bring."""

from __future__ import annotations

import functools
import hashlib
from dataclasses import dataclass
from typing import Any

# Solvers that this run time knows under their names, and the modules that have them.
_DENSE, _FRONTS = "symgen.runtime.code.dense_ldl", "symgen.runtime.code.front_ldl"
SOLVERS = {"factor_ldl": _DENSE, "solve_ldl": _DENSE, "factor_fronts": _FRONTS, "solve_fronts": _FRONTS}


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

    @functools.cached_property
    def functions_hash(self) -> str:
        """SHA-256 of what is compiled: functions and tables, without the header and the text around them."""
        return hashlib.sha256(repr((self.functions, self.tables)).encode()).hexdigest()
