"""The rank that a constraint Jacobian has around a state, and whether it is that of the code derived for the model."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.constraints.levels import Constraints
from symgen.runtime.constraints.nearest_point import Problem
from symgen.runtime.constraints.position_problem import position_problem
from symgen.runtime.constraints.redundancy import Redundancy, find_redundancy
from symgen.runtime.positions import Chart

if TYPE_CHECKING:
    from symgen.runtime.system import System

_INDEPENDENT = 1e-6  # ratio of pivots from which on constraints are independent


def usual_rank(system: System, p: np.ndarray, t: float, q: np.ndarray) -> int:
    """Return the rank of G at q, on the constraints, or near it where q is a singular configuration."""
    v = np.zeros(system.nv)
    if not system.dependent and system.kernel("rhs")(t, np.concatenate([q, v]), p)[-1] >= _INDEPENDENT:
        return system.m
    constraints = Constraints(system, np.ascontiguousarray(p, dtype=float), t)
    chart, sizes = Chart(constraints.positions, q), constraints.characteristic_sizes(q)
    scales, free = constraints.position_scales(q, sizes), np.ones(len(chart.start), dtype=bool)
    problem = position_problem(constraints, chart, chart.start, free, sizes, scales)
    return ranks_near(problem, constraints, chart, chart.start, v, sizes).rank


def has_dependence(system: System, p: np.ndarray, t: float, q: np.ndarray) -> bool:
    """Whether the constraints that depended on others where the model was derived do so at q, and near it."""
    return not system.dependent or usual_rank(system, p, t, q) == system.m - len(system.dependent)


def ranks_near(
    problem: Problem, constraints: Constraints, chart: Chart, x: np.ndarray, v: np.ndarray, sizes: np.ndarray
) -> Redundancy:
    """Return the ranks of G at `x`, in the unknowns of a chart, and near it."""

    def jacobian(place: np.ndarray) -> np.ndarray:
        return constraints.jacobian(chart.q(place), v) * sizes

    return find_redundancy(problem, x, jacobian)
