"""About how many operations steps take: what checks that integrate again may cost."""

from __future__ import annotations

from typing import TYPE_CHECKING

from symgen.runtime.integrate.methods import find_method

if TYPE_CHECKING:
    from symgen.runtime.integrate.methods import Method
    from symgen.runtime.solution import Solution

_OF_CALL, _OF_NEWTON = 100.0, 800.0  # operations that evaluations and iterations cost besides
_OF_STOP = 2e5  # operations in the time that a step takes which lands on a break of an input


def operations_of_run(solution: Solution) -> float:
    """Return about how many operations a run took."""
    in_all = solution.stats["steps"] * operations_per_step(solution, find_method(solution.method))
    if solution.parts is None:
        return in_all
    # The steps are those of all subsystems, each of a part of the equations.
    return in_all / sum(len(kind["coordinates"]) for kind in solution.system.subsystems)


def operations_per_step(solution: Solution, method: Method) -> float:
    """Return about how many operations a step takes.

    Parameters
    ----------
    method : Method
        That of the run, whose statistics tell, or an explicit one.
    """
    stats, operations = solution.stats, solution.system.operations
    steps = max(stats["steps"], 1)
    if method.name != solution.method:
        calls, solved, derived, iterations = method.evaluations, 0.0, 0.0, 0.0
    else:
        calls = method.evaluations if method.series else stats["rhs"] / steps
        solved = stats["factorisations"] / steps * (solution.system.nv + solution.system.m) ** 3
        derived = stats["jacobians"] / steps * operations.get("residual_jacobian", 0)
        iterations = stats["newton"] / steps * _OF_NEWTON
    breaks = sum(len(pieces.breaks) for pieces in getattr(solution.system, "all_pieces", ()))
    stops = _OF_STOP * min(breaks / steps, 1.0)
    return (
        calls * operations.get("rhs", 0) + max(calls, 1.0) * _OF_CALL + derived + solved + iterations + stops
    )
