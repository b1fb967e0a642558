"""Kernels evaluated at many states at once."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import jitted
from symgen.runtime.lazy import Late

if TYPE_CHECKING:
    from symgen.runtime.system import System

kkt = Late("symgen.runtime.constraints.kkt")


@jitted
def evaluate_rows(address, times, states, p, out):
    """Call the kernel at `address` for each row of `states`; `out`, shape (n, width), is written in place."""
    for i in range(times.shape[0]):
        call_kernel(address, times[i], states[i], p, out[i])


def evaluate(
    system: System, function: str, p: np.ndarray, times: np.ndarray, states: np.ndarray
) -> np.ndarray:
    """Evaluate a function of the model at many states.

    Parameters
    ----------
    function : str
        See docs/architecture.md; one that the model does not have gives no columns.
    times : ndarray, shape (n,) [s]
    states : ndarray, shape (n, at least nq + nv)

    Returns
    -------
    ndarray, shape (n, width)
    """
    if not system.has(function):
        return np.zeros((len(times), 0))
    kernel = system.kernel(function)
    return _rows(kernel.precomputed_address, kernel.out_size, system.precomputed(p), times, states)


def right_hand_sides(system: System, p: np.ndarray, times: np.ndarray, states: np.ndarray) -> np.ndarray:
    """Return rows of `rhs`, shape (n, n_row), also where constraints are redundant."""
    if system.m:
        address, _keep = kkt.robust_rhs_address(system)
    else:
        address = system.kernel("rhs").precomputed_address
    return _rows(address, system.n_row, system.precomputed(p), times, states)


def accelerations_and_multipliers(
    system: System, p: np.ndarray, times: np.ndarray, states: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return accelerations, shape (n, nv), and multipliers, shape (n, m), also where constraints are redundant."""
    rows = right_hand_sides(system, p, times, states)
    return rows[:, system.nq : system.nq + system.nv], rows[:, system.ny : system.ny + system.m]


def constraint_residuals(
    system: System, p: np.ndarray, times: np.ndarray, states: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the largest magnitudes of position and velocity residuals, shape (n,) each."""
    rows = np.abs(evaluate(system, "constraint_residual", p, times, states))
    return rows[:, : system.nh].max(axis=1, initial=0.0), rows[:, system.nh :].max(axis=1, initial=0.0)


def _rows(address: int, width: int, p: np.ndarray, times: np.ndarray, states: np.ndarray) -> np.ndarray:
    out = np.zeros((len(times), width))
    if len(times) and width:
        evaluate_rows(np.uint64(address), np.ascontiguousarray(times), np.ascontiguousarray(states), p, out)
    return out
