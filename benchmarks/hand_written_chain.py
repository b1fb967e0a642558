"""Chains of point masses against equations written by hand, with numbalsoda's dop853.

    python benchmarks/hand_written_chain.py [LINKS …]

The hand-written form solves for the tensions of the rods, which is a tridiagonal system, in a loop that Numba compiles
for this number of links. Both are run over tolerances, by turns, in processor time, the least of many runs; the time at
an end error is interpolated between two settings, on a straight line in logarithms. The error is the largest of a
coordinate or rate at the end, in parts of its size, against the reference of the scene.
"""

from __future__ import annotations

import argparse
import itertools
import json
import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from calls import loop_alone
from numba import carray, cfunc, njit
from numbalsoda import dop853, lsoda_sig

from symgen.link import derive
from symgen.model.library import find, load
from symgen.runtime.code import stand_ins
from work_precision.scenes import SCENES

LEVELS = (1e-3, 1e-6, 1e-9, 1e-12)
ROUNDS, G = 30, 9.81


def hand_written(n: int) -> Any:
    """Return the C function of the chain of n links of 1 m and 1 kg: angles, then rates."""

    @cfunc(lsoda_sig)
    def f(t, y, dy, data):
        a, w, right = carray(y, (2 * n,))[:n], carray(y, (2 * n,))[n:], carray(dy, (2 * n,))
        work = carray(data, (6, n))
        s, c, along, across, pivot, tension = work[0], work[1], work[2], work[3], work[4], work[5]
        for k in range(n):
            s[k], c[k] = math.sin(a[k]), math.cos(a[k])
        for k in range(n - 1):
            along[k] = c[k] * c[k + 1] + s[k] * s[k + 1]
            across[k] = c[k] * s[k + 1] - s[k] * c[k + 1]
        pivot[0], tension[0] = 1.0, w[0] ** 2 + G * c[0]
        for k in range(1, n):
            part = along[k - 1] / pivot[k - 1]
            pivot[k] = 2.0 - part * along[k - 1]
            tension[k] = w[k] ** 2 + part * tension[k - 1]
        tension[n - 1] /= pivot[n - 1]
        for k in range(n - 2, -1, -1):
            tension[k] = (tension[k] + along[k] * tension[k + 1]) / pivot[k]
        right[n] = -G * s[0] + (tension[1] * across[0] if n > 1 else 0.0)
        for k in range(n):
            right[k] = w[k]
        for k in range(1, n - 1):
            right[n + k] = tension[k + 1] * across[k] - tension[k - 1] * across[k - 1]
        if n > 1:
            right[2 * n - 1] = -tension[n - 2] * across[n - 2]

    return f


@njit
def integrate(address, start, times, data, rtol, atol):
    states, success = dop853(address, start, times, data=data, rtol=rtol, atol=atol)
    return states[-1], success


def main() -> None:
    stand_ins.at_once = True  # what runs come to, however short they are here
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("links", nargs="*", type=int, default=[5, 10, 20, 50])
    print("| links | this project, ms at 1e-3 / 1e-6 / 1e-9 / 1e-12 | by hand, numbalsoda | by hand / this |")
    print("|---|---|---|---|")
    for n in parser.parse_args().links:
        ours, by_hand = measure(n)
        ratio = " / ".join("–" if np.isnan(x) else f"{x:.2f}" for x in by_hand / ours)
        cells = (
            " / ".join("–" if np.isnan(x) else f"{1e3 * x:.3g}" for x in times) for times in (ours, by_hand)
        )
        print(f"| {n} | {' | '.join(cells)} | {ratio} |", flush=True)


def measure(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the seconds at each level of the faster of `taylor` and `dop853`, and of the equations by hand."""
    scene = SCENES[f"chain_{n}"]
    system = derive(load(find(scene.model), dict(scene.options)))
    stored = json.loads((Path(__file__).parents[1] / "models/references" / f"{scene.name}.json").read_text())
    end = np.array([float(x) for part in ("q", "v") for x in stored["end"][part]])
    size = np.repeat([stored["size"]["q"], stored["size"]["v"]], n)
    f, data, times = hand_written(n), np.zeros(6 * n), np.array([0.0, scene.t_end])
    state = system.prepare(scene.t_end).assemble()
    start = np.ascontiguousarray(state[: 2 * n])
    row = np.zeros(2 * n)
    f.ctypes(0.0, start.ctypes.data_as(f.ctypes.argtypes[1]), row.ctypes.data_as(f.ctypes.argtypes[2]),
             data.ctypes.data_as(f.ctypes.argtypes[3]))  # fmt: skip
    expected = np.asarray(system.kernel("rhs")(0.0, state, system.parameter_values()))[: 2 * n]
    np.testing.assert_allclose(row, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())

    curves: dict[str, list[tuple[float, float]]] = {"taylor": [], "dop853": [], "by hand": []}
    for power in np.arange(2.0, 14.1, 0.5):
        rtol = 10.0**-power
        atol = rtol * scene.atol_ratio
        ways: dict[str, tuple[Callable[[], object], np.ndarray]] = {}
        for method in ("taylor", "dop853"):
            run = system.prepare(scene.t_end, method=method, rtol=rtol, atol=atol)
            ways[method] = loop_alone(run, state), np.asarray(run(None, state))

        def by_hand(rtol: float = rtol, atol: float = atol) -> np.ndarray:
            return integrate(f.address, start, times, data, rtol, atol)[0]

        ways["by hand"] = by_hand, by_hand()
        least = dict.fromkeys(ways, math.inf)
        for _ in range(ROUNDS):
            for name, (way, _) in ways.items():
                began = time.thread_time()
                way()
                least[name] = min(least[name], time.thread_time() - began)
        for name, (_, found) in ways.items():
            curves[name].append((least[name], float(np.max(np.abs(found[: 2 * n] - end) / size))))
    ours = np.fmin(*(at_levels(curves[name]) for name in ("taylor", "dop853")))
    return ours, at_levels(curves["by hand"])


def at_levels(curve: list[tuple[float, float]]) -> np.ndarray:
    """Return the time at each level, between the first two settings on either side of it."""
    found = np.full(len(LEVELS), np.nan)
    for k, level in enumerate(LEVELS):
        for (before, large), (after, small) in itertools.pairwise(curve):
            if large >= level >= small > 0.0:
                part = math.log(large / level) / max(math.log(large / small), 1e-300)
                found[k] = before * (after / before) ** part
                break
        else:
            if curve[0][1] < level:
                found[k] = curve[0][0]
    return found


if __name__ == "__main__":
    main()
