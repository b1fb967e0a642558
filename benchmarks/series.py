"""What a series of `taylor` costs by its order: `python benchmarks/series.py [MODEL ...]`.

Nanoseconds of a call of a bundled model's kernel, the least of many; what a call of a function that does nothing takes
from Python is taken off. Run it on two trees by turns to compare them.
"""

from __future__ import annotations

import ctypes
import sys
import time

import numpy as np

from symgen import load
from symgen.runtime.taylor.kernel import N_ROWS, taylor_addresses

_MODELS = ("spring_pendulum", "double_pendulum", "free_rigid_body", "spinning_top", "heavy_top_absolute", "four_bar",
           "car_axis", "andrews_squeezer", "seven_dof_arm")  # fmt: skip
_ORDERS = (8, 14, 20, 26)
_CALLS, _TURNS = 20, 1000
_KERNEL = ctypes.CFUNCTYPE(None, ctypes.c_double, *[ctypes.c_void_p] * 3)
_NOTHING = _KERNEL(ctypes.cast(ctypes.CDLL(None).abs, ctypes.c_void_p).value)


def main() -> None:
    print(f"{'ns of a series of order':26}" + "".join(f"{order:>8}" for order in _ORDERS))
    for name in sys.argv[1:] or _MODELS:
        print(f"{name:26}" + "".join(f"{each:8.0f}" for each in nanoseconds(name)), flush=True)


def nanoseconds(name: str) -> list[float]:
    """Return what a series of a model takes for each of the orders, at its start [ns]."""
    system = load(name)
    series = _KERNEL(int(taylor_addresses(system)[0]))
    p = system.parameter_values()
    y = np.zeros(system.ny)
    y[: system.nq + system.nv] = np.concatenate(system.initial_state(p)[:2])
    if system.n_precomputed:
        p = system.precomputed(p)
    out = np.zeros((N_ROWS + 4) * max(system.ny, 1))
    given = [a.ctypes.data for a in (y, p, out)]
    least, call = dict.fromkeys(_ORDERS, np.inf), np.inf
    for _ in range(_TURNS):
        call = min(call, _spent(_NOTHING, 0, out, given))
        for order in _ORDERS:
            least[order] = min(least[order], _spent(series, order, out, given))
    return [least[order] - call for order in _ORDERS]


def _spent(series: object, order: int, out: np.ndarray, given: list[int]) -> float:
    began = time.perf_counter_ns()
    for _ in range(_CALLS):
        out[0] = order  # where the kernel reads it; a coefficient of the result then
        series(0.0, *given)
    return (time.perf_counter_ns() - began) / _CALLS


if __name__ == "__main__":
    main()
