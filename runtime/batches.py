"""Kernels evaluated at many states at once."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.abi import ENTRIES
from symgen.runtime.code.bridge import evaluate_rows
from symgen.runtime.lazy import Late
from symgen.runtime.sampling import row_maxima

if TYPE_CHECKING:
    from symgen.runtime.system import System

kkt = Late("symgen.runtime.constraints.kkt")

_GAUSS_STEPS = 4  # they converge quadratically


def evaluate(
    system: System, function: str, p: np.ndarray, times: np.ndarray, states: np.ndarray
) -> np.ndarray:
    """Evaluate a function of the model at many states.

    Parameters
    ----------
    function : str
        See docs/abi.md; one that the model does not have gives no columns.
    times : ndarray, shape (n,) [s]
    states : ndarray, shape (n, at least nq + nv)

    Returns
    -------
    ndarray, shape (n, width)
    """
    if not system.has(function.removesuffix(ENTRIES)):
        return np.zeros((len(times), 0))
    kernel = system.kernel(function)
    return _rows(kernel.precomputed_address, kernel.out_size, system.precomputed(p), times, states)


# Accelerations, multipliers, forces of stops and frictions.
Solved = tuple[np.ndarray, np.ndarray, np.ndarray]


def outputs(
    system: System, p: np.ndarray, times: np.ndarray, states: np.ndarray, solved: Callable[[], Solved]
) -> np.ndarray:
    """Return the model's outputs, shape (n, number of outputs).

    Parameters
    ----------
    times : ndarray, shape (n,) [s]
    states : ndarray, shape (n, at least nq + nv)
    solved : callable
        Gives accelerations, multipliers, and forces of stops and frictions, n rows each; called where outputs are made
        of these.
    """
    if system.sensed:
        states = np.hstack([states[:, : system.nq + system.nv], *solved()])
    return evaluate(system, "outputs", p, times, states)


def right_hand_sides(system: System, p: np.ndarray, times: np.ndarray, states: np.ndarray) -> np.ndarray:
    """Return rows of `rhs`, shape (n, n_row), also where constraints are redundant.

    `p` is that of all states, or, of a model without constraints, has shape (k, n_p): each row is that of as many
    states, one after another.
    """
    if p.ndim == 2:
        address = system.kernel("rhs").precomputed_address
        rows = system.precomputed_rows(p).repeat(len(times) // max(len(p), 1), axis=0)
        return _rows(address, system.n_row, rows, times, states)
    return solved_rows(system, system.precomputed(p), times, states)


def solved_rows(system: System, precomputed: np.ndarray, times: np.ndarray, states: np.ndarray) -> np.ndarray:
    """Return the same for a `p` with all that follows from it alone behind it."""
    if system.m:
        address, _keep = kkt.robust_rhs_address(system)
    else:
        address = system.kernel("rhs").precomputed_address
    return _rows(address, system.n_row, precomputed, times, states)


def projected(system: System, p: np.ndarray, times: np.ndarray, states: np.ndarray) -> np.ndarray:
    """Return states brought onto the constraints by Gauss steps; those that come no closer stay as they are.

    Parameters
    ----------
    states : ndarray, shape (n, nq + nv)

    Returns
    -------
    ndarray, shape (n, nq + nv)
    """
    address, _keep = kkt.robust_project_address(system)
    size, p = system.nq + system.nv, system.precomputed(p)
    nearest, least, found = states, np.full(len(states), np.inf), states
    for _ in range(_GAUSS_STEPS + 1):
        rows = _rows(address, size + system.nh + system.m, p, times, found)
        left = np.abs(rows[:, size:]).max(axis=1, initial=0.0)  # where the step began
        is_closer = left < least
        nearest, least = np.where(is_closer[:, None], found, nearest), np.where(is_closer, left, least)
        found = rows[:, :size]
    return nearest


def accelerations_and_multipliers(
    system: System, p: np.ndarray, times: np.ndarray, states: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return accelerations, shape (n, nv), and multipliers, shape (n, m), also where constraints are redundant.

    `p` may have rows, as in `right_hand_sides`.
    """
    rows = right_hand_sides(system, p, times, states)
    return rows[:, system.nq : system.nq + system.nv], rows[:, system.ny : system.ny + system.m]


def constraint_residuals(
    system: System, p: np.ndarray, times: np.ndarray, states: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the largest magnitudes of position and velocity residuals, shape (n,) each."""
    if not system.m:
        return np.zeros(len(times)), np.zeros(len(times))
    rows = np.abs(evaluate(system, "constraint_residual", p, times, states))
    return row_maxima(rows[:, : system.nh]), row_maxima(rows[:, system.nh :])


def _rows(address: int, width: int, p: np.ndarray, times: np.ndarray, states: np.ndarray) -> np.ndarray:
    out = np.zeros((len(times), width))
    if out.size:
        times, states = np.ascontiguousarray(times, dtype=float), np.ascontiguousarray(states, dtype=float)
        evaluate_rows(address, times, states, p, out)
    return out
