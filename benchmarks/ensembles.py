"""Ensembles against heyoka's batches and a loop of runs: processor time of a member at equal median error of the end.

    python benchmarks/ensembles.py [double_pendulum] [outer_solar_system] [slider_crank] [--json FILE]

Members of the ensembles differ in a start each. Errors are those of the ends against the same members at a hundredth
of the smallest tolerance, medians over the members. heyoka (`pip install heyoka`) takes `taylor_adaptive_batch` of 8,
a batch of members with a step of its own each; its times leave out building, and ours building and sampling, but
nothing else. Programs take turns, processor time counts, the least of some turns.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from symgen import link, runtime
from symgen.model.library import find
from symgen.runtime.ensemble import uniform
from symgen.runtime.ensemble.sampling import Members

ROOT = Path(__file__).resolve().parent.parent
TURNS, MEMBERS, RUNS = 5, 4096, 8
OURS = {"taylor": (3e-4, 1e-5, 1e-8, 1e-11, 2e-14), "dop853": (3e-5, 1e-7, 1e-9, 1e-11, 1e-13)}
THEIRS = (1e-2, 1e-4, 1e-7, 1e-10, 1e-13)
LEVELS = (3e-4, 1e-7, 3e-11, 2e-13)
SCENES = {
    "double_pendulum": (10.0, "theta1", (1.37, 1.77), LEVELS),
    "slider_crank": (2.0, "theta", (0.4, 0.6), (3e-3, 5e-6, 8e-10, 2.5e-12)),
    "seven_dof_arm": (5.0, "q1", (-0.1, 0.1), (4e-6, 7e-9, 1.4e-12)),
}


def double_pendulum_of_heyoka() -> list:
    """The equations of `models/double_pendulum.toml`: absolute angles, unit masses and lengths."""
    import heyoka as hy

    a, b, u, w = hy.make_vars("a", "b", "u", "w")
    g, s, c = 9.81, hy.sin(a - b), hy.cos(a - b)
    first, second = -s * w * w - 2.0 * g * hy.sin(a), s * u * u - g * hy.sin(b)
    low = 2.0 - c * c
    du, dw = (first - c * second) / low, (2.0 * second - c * first) / low
    return [(a, u), (b, w), (u, du), (w, dw)]


HEYOKA = {"double_pendulum": double_pendulum_of_heyoka}


def least_time(calls: list[Callable[[], object]]) -> list[float]:
    """Least processor time of each call, taken by turns [s]."""
    least = [np.inf] * len(calls)
    for _ in range(TURNS):
        for k, call in enumerate(calls):
            began = time.process_time()
            call()
            least[k] = min(least[k], time.process_time() - began)
    return least


def at_level(points: list[tuple[float, float]], level: float) -> float:
    """The time at an error, from points of (error, time), straight between their logarithms; nan outside."""
    points = sorted(point for point in points if point[0] > 0.0)
    errors, times = np.log([p[0] for p in points]), np.log([p[1] for p in points])
    inside = errors[0] - 0.7 <= np.log(level) <= errors[-1] + 0.7
    return float(np.exp(np.interp(np.log(level), errors, times))) if inside else float("nan")


def measure(name: str) -> dict[str, list[tuple[float, float]]]:
    """Return points of (median error, seconds for a member) by program."""
    t_end, coordinate, bounds, _ = SCENES[name]
    system = runtime.load(link.module_for(Path(find(name)), {}, None).text)
    asked = {"n": MEMBERS, "seed": 1, "start": {coordinate: uniform(*bounds)}, "threads": 1}

    def ends(**how: object) -> np.ndarray:
        e = system.ensemble(t_end, **asked, **how)
        if e.n_failed or e.verdicts.singly.any():
            print(f"{name}: {e.n_failed} failed, {e.verdicts.singly.sum()} alone", file=sys.stderr)
        return np.array([e[x] for x in e.names]).T

    plan = system.ensemble(t_end, **{**asked, "n": 1}).plan
    whole = Members(plan.members.columns, MEMBERS, 1)
    starts, _ = plan.starts.of(*whole.arrays(plan.p, 0, MEMBERS))
    exact = ends(method="taylor", rtol=1e-15, atol=1e-16)
    scale = np.abs(exact).max(axis=0) + 1e-300
    found: dict[str, list[tuple[float, float]]] = {}
    labels, calls, errors = [], [], []

    def add(label: str, call: Callable[[], np.ndarray], members: int = MEMBERS) -> None:
        off = np.abs((call() - exact[:members]) / scale).max(axis=1)
        labels.append((label, members))
        calls.append(call)
        errors.append(float(np.median(off)))

    for method, tolerances in OURS.items():
        for rtol in tolerances:
            add(method, lambda method=method, rtol=rtol: ends(method=method, rtol=rtol, atol=rtol * 1e-2))
    if name in HEYOKA and importlib.util.find_spec("heyoka"):
        for tolerance in THEIRS:
            add("heyoka", heyoka_batch(name, t_end, starts.T.copy(), tolerance))
    values = starts[:RUNS, [record["name"] for record in system.coordinates].index(coordinate)]
    for rtol in (1e-4, 1e-7, 1e-10, 1e-13):
        add("loop of run", lambda rtol=rtol: np.array([
            system.run(t_end, rtol=rtol, atol=rtol * 1e-2, start={coordinate: float(x)}).states[-1] for x in values
        ]), RUNS)  # fmt: skip
    for (label, members), seconds, error in zip(labels, least_time(calls), errors, strict=True):
        found.setdefault(label, []).append((error, seconds / members))
    return found


def heyoka_batch(name: str, t_end: float, starts: np.ndarray, tolerance: float) -> Callable[[], np.ndarray]:
    """Return what runs all members with heyoka, eight at a time."""
    import heyoka as hy

    width = 8
    ta = hy.taylor_adaptive_batch(HEYOKA[name](), starts[:, :width].copy(), tol=tolerance)

    def call() -> np.ndarray:
        ends = np.empty_like(starts)
        for first in range(0, starts.shape[1], width):
            ta.set_time(0.0)
            ta.state[:] = starts[:, first : first + width]
            ta.propagate_until(t_end)
            ends[:, first : first + width] = ta.state
        return ends.T

    return call


def main() -> None:
    """Print a table for each scene: microseconds of a member at the errors of `SCENES`."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", default=["double_pendulum"], choices=[*SCENES, []])
    parser.add_argument("--json", type=Path)
    given = parser.parse_args()
    results = {}
    for name in given.scenes or ["double_pendulum"]:
        points, levels = measure(name), SCENES[name][3]
        results[name] = points
        print(f"{name}, {SCENES[name][0]:g} s, microseconds of processor time for a member")
        print("  error       " + "".join(f"{level:>12.0e}" for level in levels))
        for label, own in points.items():
            print(f"  {label:<12}" + "".join(f"{at_level(own, level) * 1e6:>12.1f}" for level in levels))
        for label, own in points.items():
            print(f"    {label}: " + ", ".join(f"{error:.1e} {seconds * 1e6:.1f}" for error, seconds in own))
    if given.json:
        given.json.write_text(json.dumps(results, indent=1) + "\n")


if __name__ == "__main__":
    main()
