"""Evaluate a model's functions at states of many members, each with its parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.code.lower import NoLanes
from symgen.runtime.ensemble.arrays import Table, aligned
from symgen.runtime.ensemble.machine import lane_kernel, lane_map

if TYPE_CHECKING:
    from symgen.runtime.system import System

_LANES = 8


def evaluate_members(
    system: System, function: str, parameters: np.ndarray, times: np.ndarray, states: np.ndarray
) -> np.ndarray:
    """Evaluate a function at states of members.

    Parameters
    ----------
    function : str
        See docs/abi.md.
    parameters : ndarray, shape (n, n_p)
    times : ndarray, shape (F,), or (n, F) where members have times of their own [s]
    states : ndarray, shape (n, F, at least nq + nv)

    Returns
    -------
    ndarray, shape (n, F, width)
    """
    kernel = system._kernel_source(function)
    n, n_frames, width = len(parameters), times.shape[-1], kernel.lengths.out
    result = np.zeros((n, n_frames, width))
    if not result.size:
        return result
    try:
        address = lane_kernel(system, function, _LANES)
    except NoLanes:
        for k in range(n):
            own = times[k] if times.ndim > 1 else times
            result[k] = system.kernel(function).rows(own, np.ascontiguousarray(states[k]), parameters[k])
        return result
    table = Table()
    held = {
        "start": np.ascontiguousarray(states, dtype=float), "end": result,
        "parameters": np.ascontiguousarray(parameters, dtype=float),
        "precomputed": np.zeros((n, system.n_precomputed)),
        "frame_times": np.ascontiguousarray(times, dtype=float),
        "y": aligned(states.shape[2] * _LANES), "p": aligned(system.n_precomputed * _LANES),
        "k": aligned(width * _LANES), "numbers": aligned(_LANES),
        "member_of_lane": np.zeros(_LANES, dtype=np.int64),
    }  # fmt: skip
    table.set_arrays(held)
    table.set_integers(
        rhs=address, setup=system.setup_address, n_members=n * n_frames, n_frames=n_frames, ny=states.shape[2],
        n_p=system.n_p, n_precomputed=system.n_precomputed, n_row=width,
        own_times=times.ndim > 1,
    )  # fmt: skip
    mapping, _code = lane_map(_LANES)
    mapping(table.address)
    return result
