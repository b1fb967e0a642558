"""Whether anything in the equations can be sharp in the state, so that steps may have gone over it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from symgen.runtime.checks.work import operations_of_run

if TYPE_CHECKING:
    from symgen.runtime.solution import Solution

_SMALL = 150  # operations of a residual that is quick to look at
_COST, _SHARE = 4e5, 0.02  # operations of a look, for each of the residual's; of the run


def may_be_sharp(solution: Solution) -> bool:
    """Whether there is something to look for, at little cost (`jumped_over.py`)."""
    operations = solution.system.operations.get("residual", 0)
    if operations > max(_SMALL, _SHARE / _COST * operations_of_run(solution)) or len(solution.t) < 3:
        return False
    return solution.system.source.facts("residual").is_sharp
