"""About how many operations steps take: what checks that integrate again may cost."""

from __future__ import annotations

from typing import TYPE_CHECKING

from symgen.runtime.integrate.methods import find_method

if TYPE_CHECKING:
    from symgen.runtime.integrate.methods import Method
    from symgen.runtime.solution import Solution
    from symgen.runtime.system import System

# Operations of straight-line code in the time that other things take, by `benchmarks/health_cost.py` and profiles; such
# an operation takes a quarter of a nanosecond.
_OF_CALL, _OF_NEWTON = 100.0, 1200.0  # what evaluations and iterations cost besides
_OF_GUARD, _OF_ENTRY = (
    200.0,
    8.0,
)  # what the guard of a constrained model adds to a call, and for each entry of G
_OF_EVENTS = 1500.0  # what looking for events adds to a step
_OF_FRAME, _OF_NUMBER = 400.0, 100.0  # a frame, and each number in it
_OF_EVENT = 1e6  # what an event is acted on in
_OF_STOP = 2e5  # a step that lands on a break of an input
SHORT = 1e8  # operations of runs that are followed to their end: nobody waits for that


def operations_of_run(solution: Solution) -> float:
    """Return about how many operations a run took."""
    in_all = solution.stats["steps"] * _operations_per_step(
        solution, find_method(solution.method), is_own=True
    )
    in_all += (
        solution.states.size * _OF_NUMBER + len(solution.t) * _OF_FRAME + len(solution.events) * _OF_EVENT
    )
    if solution.parts is None:
        return in_all
    # The steps are those of all subsystems, each of a part of the equations.
    return in_all / sum(len(kind["coordinates"]) for kind in solution.system.subsystems)


def operations_by_series(solution: Solution) -> float:
    """Return about how many a run by series took: they ask for accelerations, and their guard, once in a step.

    What companions may take is by the number above, which is larger with constraints.
    """
    system, steps = solution.system, solution.stats["steps"]
    asked = find_method(solution.method).evaluations - 1.0
    return operations_of_run(solution) - (steps * asked * _of_guard(system) if system.m else 0.0)


def _of_guard(system: System) -> float:
    return _OF_GUARD + _OF_ENTRY * system.m * system.nv


def operations_per_step(solution: Solution, method: Method) -> float:
    """Return about how many operations a step takes.

    Parameters
    ----------
    method : Method
        That of the run in the run's form of constraints, whose statistics tell, or an explicit one.
    """
    # One of the same name in another form does not iterate as the run did.
    alike = solution.constraints in ("none", method.form)
    return _operations_per_step(solution, method, method.name == solution.method and alike)


def _operations_per_step(solution: Solution, method: Method, is_own: bool) -> float:
    system, stats, operations = solution.system, solution.stats, solution.system.operations
    steps = max(stats["steps"], 1)
    if not is_own:
        calls, solved, derived, iterations = method.evaluations, 0.0, 0.0, 0.0
    else:
        calls = method.evaluations if method.series else stats["rhs"] / steps
        solved = stats["factorisations"] / steps * (solution.system.nv + solution.system.m) ** 3
        derived = stats["jacobians"] / steps * operations.get("residual_jacobian", 0)
        unknowns = method.order * (system.nv + system.m) ** 2  # of all stages
        if solution.constraints == "partition":  # dependent coordinates, and what they follow
            unknowns = system.m * (system.nv + system.m)
        iterations = stats["newton"] / steps * (_OF_NEWTON + unknowns)
    if system.m and not method.stiff:
        solved += calls * _of_guard(system) + operations.get("project", 0)
    if system.events:
        solved += _OF_EVENTS
    breaks = sum(len(pieces.breaks) for pieces in getattr(system, "all_pieces", ()))
    stops = _OF_STOP * min(breaks / steps, 1.0)
    return (
        calls * operations.get("rhs", 0) + max(calls, 1.0) * _OF_CALL + derived + solved + iterations + stops
    )
