"""The position constraints of a model as a problem for the nearest point, in the unknowns of a chart."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.constraints.nearest_point import Problem, metric

if TYPE_CHECKING:
    from symgen.runtime.constraints.levels import Constraints
    from symgen.runtime.positions import Chart


def position_problem(
    constraints: Constraints,
    chart: Chart,
    x: np.ndarray,
    free: np.ndarray,
    sizes: np.ndarray,
    scales: np.ndarray,
) -> Problem:
    """Return the position constraints over the free unknowns of the chart, the others held at `x`.

    Parameters
    ----------
    constraints : Constraints
    chart : Chart
    x : ndarray, shape (nv,)
    free : ndarray of bool, shape (nv,)
    sizes : ndarray, shape (nv,)
        Characteristic sizes of the unknowns.
    scales : ndarray, shape (nh,)
        By which residuals are divided.
    """

    def at(z: np.ndarray) -> np.ndarray:
        full = x.copy()
        full[free] = z
        return chart.q(full)

    def jacobian(z: np.ndarray) -> np.ndarray:
        full = x.copy()
        full[free] = z
        by_unknowns = chart.by_unknowns(full, constraints.position_jacobian(chart.q(full)))
        return by_unknowns[:, free] / scales[:, None]

    return Problem(
        residual=lambda z: constraints.position(at(z)) / scales,
        jacobian=jacobian,
        factor=metric(constraints.mass(chart.q(x))[np.ix_(free, free)]),
        sizes=sizes[free],
    )
