"""A function worked out on numbers of another kind: ranges over cells of time, or many times at once."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.graph.carry_out import Arithmetic, NoArrays, carry_out
from symgen.runtime.graph.form import P
from symgen.runtime.graph.functions import IN_CODE
from symgen.runtime.timing.intervals import Intervals, Range

if TYPE_CHECKING:
    from collections.abc import Sequence

    from symgen.runtime.system import System

NAME = "time_terms"
_MOST_ASSIGNMENTS = 1_000_000


class TimeTerms:
    """What a function of a model makes of time, for one `p`.

    Parameters
    ----------
    system : System
    p : ndarray
        Parameters and inputs.
    name : str
        The function: what the equations have of time alone, if it is not given.
    """

    def __init__(self, system: System, p: np.ndarray, name: str = NAME):
        self._code = system.function_text(name)
        self._p = [float(x) for x in p]
        if sum(max(count, 1) for _, count in self._code.form.statements()) > _MOST_ASSIGNMENTS:
            self._code.refuse(1, "terms of time alone are assignments, a million of them at most")

    def values(self, operations: Arithmetic, y: Sequence[Any] = ()) -> list[Any]:
        """Return all that the function writes for some `y`; what are numbers does not change."""
        try:
            found = carry_out(self._code.form, operations, y.__getitem__, self._p.__getitem__)
            return [value for _, value in found]
        except NoArrays:
            self._code.refuse(1, "solves by loops are no operation on time, parameters and inputs")

    def numbers_read(self) -> tuple[int, ...]:
        """Return the places in `p` of the numbers that the function reads."""
        return tuple(sorted(self._code.form.places_read(P)))


class Samples:
    """The operations at many times at once, with what each choice on the way decided.

    Parameters
    ----------
    t : ndarray [s]

    Attributes
    ----------
    choices : list of ndarray
        Whether each comparison was true, or each argument negative whose sign makes a kink; the values of steps.
    """

    def __init__(self, t: np.ndarray):
        self._t = t
        self.choices: list[np.ndarray] = []

    def time(self) -> np.ndarray:
        return self._t

    def neg(self, x: Any) -> Any:
        return -x

    def add(self, x: Any, y: Any) -> Any:
        return x + y

    def sub(self, x: Any, y: Any) -> Any:
        return x - y

    def mul(self, x: Any, y: Any) -> Any:
        return x * y

    def div(self, x: Any, y: Any) -> Any:
        return np.divide(x, y)

    def call(self, name: str, *args: Any) -> Any:
        if all(isinstance(x, float) for x in args):
            return Intervals(self._t, self._t, []).call(name, *args)
        if name in ("fabs", "sqrt", "log", "copysign"):
            self._chose(np.asarray(args[-1]) < 0.0)
        entry = IN_CODE[name]
        function = getattr(np, entry.numpy) if entry.numpy else np.vectorize(entry.value, otypes=[float])
        value = function(*args)
        if entry.stepped:
            self._chose(value)
        return value

    def select(self, is_strict: bool, a: Any, b: Any, then: Any, otherwise: Any) -> Any:
        is_so = np.less(a, b) if is_strict else np.less_equal(a, b)
        self._chose(is_so)
        return np.where(is_so, then, otherwise)

    def _chose(self, what: np.ndarray) -> None:
        self.choices.append(np.broadcast_to(what, self._t.shape))


def all_times(terms: TimeTerms, t_start: float) -> list[float]:
    """Return the width of the range of every result over all times from the start of a run on."""
    everywhere = Intervals(np.array([t_start]), np.array([math.inf]), [], finding=True)
    terms.values(everywhere)
    return everywhere.widths


def ranges(terms: TimeTerms, begin: np.ndarray, end: np.ndarray, widths: list[float]) -> list[Range]:
    """Return the terms that change, over cells from `begin` to `end` [s]."""
    found = terms.values(Intervals(begin, end, widths))
    return [x for x in found if isinstance(x, Range)]
