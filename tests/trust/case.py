"""What a case is, and what becomes of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from runtime.errors import RuntimeModelError
from symgen.errors import ModelError

if TYPE_CHECKING:
    from runtime.solution import Solution

REFUSED = "refused"
# Entries that are not objections: a run with redundant constraints is right, its multipliers are not unique.
_TOLD = ("redundant constraints", "rank")


@dataclass(frozen=True)
class Case:
    """One run.

    Attributes
    ----------
    kind : str
        What is wrong with it; "sound" where nothing is.
    name : str
    run : callable
        () -> Solution; may raise the errors that users get.
    check : str
        The name of the check that has to object, or "refused".
    word : str
        What its sentence has to name: a parameter, constraint, event or coordinate.
    short : bool
        Whether it belongs to the part that the test suite runs.
    """

    kind: str
    name: str
    run: Callable[[], Solution]
    check: str = ""
    word: str = ""
    short: bool = False


@dataclass(frozen=True)
class Verdict:
    """What was flagged: check -> sentence."""

    flags: dict[str, str]
    told: dict[str, str]

    def is_right(self, case: Case) -> bool:
        """Return whether a broken run is flagged by the check that its cause demands, or a sound one not at all."""
        if not case.check:
            return not self.flags
        says = {**self.told, **self.flags}.get(case.check)
        return says is not None and case.word in says


def judge(case: Case) -> Verdict:
    """Run a case and collect what its health report, or the error instead of a result, says."""
    try:
        solution = case.run()
    except (RuntimeModelError, ModelError) as error:
        return Verdict({REFUSED: str(error)}, {})
    flags = {entry.check: entry.says for entry in solution.health if not entry.ok}
    told = {entry.check: entry.says for entry in solution.health if entry.check in _TOLD}
    return Verdict(flags, told)
