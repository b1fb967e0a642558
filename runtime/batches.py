"""Kernels evaluated at many states at once."""

from __future__ import annotations

import ctypes
import functools
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.abi import ENTRIES
from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.code.jitted import DISABLE_JIT, jitted
from symgen.runtime.lazy import Late

if TYPE_CHECKING:
    from symgen.runtime.system import System

kkt = Late("symgen.runtime.constraints.kkt")

_GAUSS_STEPS = 4  # they converge quadratically


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


def right_hand_sides(system: System, p: np.ndarray, times: np.ndarray, states: np.ndarray) -> np.ndarray:
    """Return rows of `rhs`, shape (n, n_row), also where constraints are redundant."""
    if system.m:
        address, _keep = kkt.robust_rhs_address(system)
    else:
        address = system.kernel("rhs").precomputed_address
    return _rows(address, system.n_row, system.precomputed(p), times, states)


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
        times, states = np.ascontiguousarray(times, dtype=float), np.ascontiguousarray(states, dtype=float)
        if DISABLE_JIT:
            evaluate_rows(np.uint64(address), times, states, p, out)
        else:
            call, nothing = _machine_code()
            call(*nothing, address, *_flat(times), *_flat(states), *_flat(p), *_flat(out))
    return out


@functools.lru_cache(maxsize=1)
def _machine_code() -> tuple[Callable, tuple]:
    """Return the machine code of `evaluate_rows`, and where it puts its result and an error, of which it has none.

    To find it by the types of arguments takes longer than some rows.
    """
    one, row = np.zeros(1), np.zeros((1, 1))
    code = evaluate_rows.compiled(np.uint64(0), one, row, one, row)
    size, pointer = ctypes.c_ssize_t, ctypes.c_void_p
    vector = [pointer, pointer, size, size, pointer, size, size]
    matrix = [*vector, size, size]
    types = [pointer, pointer, ctypes.c_uint64, *vector, *matrix, *vector, *matrix]
    call = ctypes.CFUNCTYPE(ctypes.c_int32, *types)(code.address)
    call.code = code  # lives as long
    return call, (ctypes.byref(pointer()), ctypes.byref(pointer()))


def _flat(array: np.ndarray) -> tuple:
    """Return an array as machine code takes it, see `symgen.runtime.code.native`."""
    return None, None, array.size, array.itemsize, array.ctypes.data, *array.shape, *array.strides
