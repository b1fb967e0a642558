"""What an event costs with all that follows it: `python benchmarks/events.py [--million]`.

Processor time of runs in which a ball bounces, for each flight with its event: resets and impacts, in `system.run` and
in prepared runs. Beside them SciPy's `solve_ivp` with an event that ends a flight, called again for each, on the same
compiled right-hand side.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from functools import partial

import numpy as np
from scipy.integrate import solve_ivp

from symgen import Model

_BALL = """
name = "ball"
[parameters]
e = 1.0
g = "9.81"
[coordinates]
y = { start = 1.0 }
[energy]
kinetic = "dot(y)^2/2"
potential = "g*y"
"""
_FLOORS = {
    "reset": '[events.floor]\nwhen = "y"\ndirection = "falling"\nthen = { reset = { "dot(y)" = "-e*dot(y)" } }\n',
    "impact": '[stops.floor]\ngap = "y"\nrestitution = "e"\n',
}
_FLIGHT = 2.0 * np.sqrt(2.0 / 9.81)  # [s]
_EVENTS, _PEER_EVENTS, _TURNS = 10_000, 50, 5


def main() -> None:
    million = "--million" in sys.argv
    print(f"{'event':10}{'method':10}{'run':>10}{'prepared':>10}{'SciPy':>10}   [µs for each]")
    for kind, floor in _FLOORS.items():
        system = Model.from_toml(_BALL + floor).derive()
        for method in ("taylor", "dop853"):
            t_end = _EVENTS * _FLIGHT
            ways = (partial(system.run, t_end, method=method), system.prepare(t_end, method=method))
            ours = [1e6 * least(way) / _EVENTS for way in ways]
            print(f"{kind:10}{method:10}{ours[0]:10.1f}{ours[1]:10.1f}{scipy_events(system):10.1f}")
    if million:
        began = time.thread_time()
        solution = system.run(1e6 * _FLIGHT, method="dop853")
        spent, off = time.thread_time() - began, solution.energy.max_error
        print(f"{len(solution.events)} impacts: {spent:.1f} s, energy off by {off:.1e}")


def least(way: Callable[[], object]) -> float:
    """Return the least processor time of a call [s]."""
    way()
    found = []
    for _ in range(_TURNS):
        began = time.thread_time()
        way()
        found.append(time.thread_time() - began)
    return min(found)


def scipy_events(system: object) -> float:
    """Return the processor time of a flight and its event in SciPy [µs]."""
    kernel, p = system.kernel("rhs"), system.parameter_values()

    def slope(t: float, y: np.ndarray) -> np.ndarray:
        return kernel(t, y, p)[:2]

    def floor(t: float, y: np.ndarray) -> float:
        return y[0]

    floor.terminal, floor.direction = True, -1

    def bounces() -> None:
        t, y = 0.0, np.array([1.0, 0.0])
        for _ in range(_PEER_EVENTS):
            found = solve_ivp(slope, (t, t + 10.0), y, "DOP853", events=floor, rtol=1e-8, atol=1e-10)
            t, y = found.t[-1], found.y[:, -1] * [1.0, -1.0]

    return 1e6 * least(bounces) / _PEER_EVENTS


if __name__ == "__main__":
    main()
