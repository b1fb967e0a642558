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
    return Evaluator(system, function)(parameters, times, states)


class Evaluator:
    """Evaluates a function of a model again and again, as `evaluate_members`; each thread needs its own."""

    def __init__(self, system: System, function: str) -> None:
        self._system, self._function, self._table = system, function, Table()
        self._width = width = system._kernel_source(function).lengths.out
        try:
            self._address = lane_kernel(system, function, _LANES)
        except NoLanes:
            self._address = 0
            return
        self._lane_map, self._code = lane_map(_LANES)
        self._table.set_integers(
            rhs=self._address, setup=system.setup_address, n_p=system.n_p, n_precomputed=system.n_precomputed,
            n_row=width,
        )  # fmt: skip
        self._table.set_arrays(
            {
                "p": aligned(system.n_precomputed * _LANES), "k": aligned(width * _LANES), "numbers": aligned(_LANES),
                "member_of_lane": np.zeros(_LANES, dtype=np.int64),
            }
        )  # fmt: skip
        self._ny = 0

    def __call__(self, parameters: np.ndarray, times: np.ndarray, states: np.ndarray) -> np.ndarray:
        n, n_frames, ny = states.shape
        result = np.zeros((n, n_frames, self._width))
        if not result.size:
            return result
        if not self._address:
            for k in range(n):
                own = times[k] if times.ndim > 1 else times
                rows = self._system.kernel(self._function).rows
                result[k] = rows(own, np.ascontiguousarray(states[k]), parameters[k])
            return result
        held = {
            "start": np.ascontiguousarray(states, dtype=float), "end": result,
            "parameters": np.ascontiguousarray(parameters, dtype=float),
            "precomputed": np.zeros((n, self._system.n_precomputed)),
            "frame_times": np.ascontiguousarray(times, dtype=float),
        }  # fmt: skip
        if ny != self._ny:
            self._ny, held["y"] = ny, aligned(ny * _LANES)
        self._table.set_arrays(held)
        self._table.set_integers(n_members=n * n_frames, n_frames=n_frames, ny=ny, own_times=times.ndim > 1)
        self._lane_map(self._table.address)
        return result
