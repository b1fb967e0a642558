"""Whether the Jacobian that implicit methods use is the derivative of the residual; a module may have been edited."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.batches import accelerations_and_multipliers, evaluate
from symgen.runtime.checks.entry import HealthCheck, advised
from symgen.runtime.names import rate_labels

if TYPE_CHECKING:
    from symgen.runtime.integrate.methods import Method
    from symgen.runtime.solution import Solution

_KERNEL = "residual_jacobian"
_MANY_ITERATIONS = 5.0  # of Newton in a step of one stage system; a right Jacobian takes two to four
_MANY_REJECTED = 0.1
_STEP = 1e-5
_LIMIT = 1e-5  # of the size of a row's terms
_LARGEST = 400  # unknowns
_SMALL = (
    2000  # operations of the residual: larger ones are compiled for this only where iterations had trouble
)


def jacobian(solution: Solution, method: Method) -> Iterator[HealthCheck]:
    """Yield one entry: J d against differences of the residual along one direction d, at the start and on the way.

    A wrong Jacobian leaves the result of a run as it is as long as Newton's iterations converge, so it is noted; where
    they do not, nothing else would say why. Large models are looked at only then.
    """
    system = solution.system
    n = system.nq + 2 * system.nv + system.m
    if (
        _KERNEL not in method.kernels
        or n > _LARGEST
        or system.input_descriptions
        or solution.forms is not None
    ):
        return
    if system.operations.get("residual", 0) > _SMALL and not _trouble(solution):
        return
    rows = [0, len(solution.t) // 2]
    t, states = solution.t[rows], solution.states[rows]
    a, multipliers = accelerations_and_multipliers(system, solution.p, t, states)
    y = np.hstack([states, a, multipliers])
    if not np.all(np.isfinite(y)):
        return
    direction = _directions(solution, t, states, y)
    matrix = evaluate(system, _KERNEL, solution.p, t, y).reshape(2, -1, n)
    middle, *ends = (
        evaluate(system, "residual", solution.p, t, y + k * _STEP * direction) for k in (0, -2, -1, 1, 2)
    )
    # Two step lengths, extrapolated: an error of order 4.
    far, near = (ends[3] - ends[0]) / (4.0 * _STEP), (ends[2] - ends[1]) / (2.0 * _STEP)
    # Where differences disagree, of two lengths or of two sides, there is a bend within a step: it proves nothing.
    bend = 4.0 * np.abs(near - far) + np.abs(ends[2] - 2.0 * middle + ends[1]) / _STEP
    terms = np.abs(matrix * direction[:, None]).max(axis=2)
    terms = np.maximum(terms, 1e-6 * terms.max())
    off = np.maximum(np.abs((matrix @ direction[:, :, None])[:, :, 0] - (4.0 * near - far) / 3.0) - bend, 0.0)
    off /= np.where(terms > 0.0, terms, 1.0)
    worst = int(np.argmax(off.max(axis=0)))
    names = [f"the equation of {name}" for name in rate_labels(system.coordinates, system.rates)]
    names += [f"constraint {record['name']!r}" for record in system.constraints]
    found = f"the Jacobian is off by {off.max():.2g} of its terms in {names[worst]}"
    yield advised(
        "jacobian", off.max(), _LIMIT, f"{found}, which is round-off",
        f"{found}: `{_KERNEL}` is not the derivative of `residual`; derive the module again, and do not edit it",
    )  # fmt: skip


def _directions(solution: Solution, t: np.ndarray, states: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return a direction for each row of `y`, along which quaternions turn as rates turn them.

    By quaternions the Jacobian is that by what rates can do to them, which is all that methods use of it.
    """
    system = solution.system
    nq, nv = system.nq, system.nv
    sizes = np.maximum(np.abs(y).max(axis=0), 1.0)
    direction = np.tile(sizes * np.cos(1.7 * np.arange(1.0, y.shape[1] + 1.0)), (len(y), 1))
    if nq != nv:
        moves = evaluate(system, "kinematics", solution.p, t, states)[:, : nq * nv].reshape(len(y), nq, nv)
        direction[:, :nq] = moves @ np.cos(np.arange(1.0, nv + 1.0))
    return direction


def _trouble(solution: Solution) -> bool:
    stats = solution.stats
    steps = max(stats["steps"], 1)
    return (
        solution.status == "failed"
        or stats["rejected"] > _MANY_REJECTED * (steps + stats["rejected"])
        or stats["newton"] > _MANY_ITERATIONS * steps
    )
