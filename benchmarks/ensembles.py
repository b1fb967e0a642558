"""Ensembles against heyoka's batches and loops of runs: processor time of a member at equal median error of the end.

    python benchmarks/ensembles.py [double_pendulum] [slider_crank] … [--json FILE]
    python benchmarks/ensembles.py --dynamics seven_dof_arm
    python benchmarks/ensembles.py --scaling double_pendulum [--seconds 8]

Members differ in one number each: a start, a rate or a parameter. Errors are those of the ends against the same
members at a hundredth of the smallest tolerance, medians over the members. `run.many` is the loop in machine code of a
prepared run, with the method that "auto" takes there and no checks; `loop of run` is `system.run` in Python. heyoka
(`pip install heyoka`) takes `taylor_adaptive_batch` of 8, a batch of members with a step of its own each; its times
leave out building, and ours building and sampling, but nothing else. Programs take turns, processor time counts, the
least of some turns.
"""

from __future__ import annotations

import argparse
import ctypes
import importlib.util
import json
import logging
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from symgen import link, runtime
from symgen.model.library import find
from symgen.runtime.code import engine
from symgen.runtime.ensemble import uniform
from symgen.runtime.ensemble.arrays import aligned
from symgen.runtime.ensemble.evaluate import Evaluator
from symgen.runtime.ensemble.machine import lane_kernel
from symgen.runtime.ensemble.sampling import Members

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "benchmarks" / "peers"))
TURNS = 3
LOOPED, RUNS = 64, 4  # members of `run.many` and of `loop of run`
LEVELS = (3e-4, 1e-7, 3e-11, 2e-13)
_EXACT = 1e-17  # of errors that are none
# Tolerances of the methods that run in lanes, and of those that "auto" takes where there are none.
OURS = {"taylor": (1e-2, 3e-4, 1e-5, 1e-8, 1e-11, 2e-14), "dop853": (1e-3, 3e-5, 1e-7, 1e-9, 1e-11, 1e-13)}
ALONE = {"auto": (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)}
LOOPS = (1e-4, 1e-7, 1e-10, 1e-13)
THEIRS = (1e-2, 1e-4, 1e-7, 1e-10, 1e-13)


@dataclass(frozen=True)
class Scene:
    """A model of which members differ in one number, and the errors at which programs are compared."""

    t_end: float
    place: str  # "parameters", "start" or "rate"
    name: str
    bounds: tuple[float, float]
    levels: tuple[float, ...] = (1e-4, 1e-6, 1e-8, 1e-10)
    methods: Mapping[str, tuple[float, ...]] = field(default_factory=lambda: OURS)
    members: int = 4096


SCENES = {
    "double_pendulum": Scene(10.0, "start", "theta1", (1.37, 1.77), LEVELS, members=16384),
    "slider_crank": Scene(2.0, "start", "theta", (0.4, 0.6), (3e-3, 5e-6, 8e-10, 2.5e-12), members=16384),
    "seven_dof_arm": Scene(5.0, "start", "q1", (-0.1, 0.1), (4e-6, 7e-9, 1.4e-12), members=2048),
    "outer_solar_system": Scene(
        20_000.0, "rate", "x_sun", (-1e-8, 1e-8), (2.7e-3, 4.6e-6, 5.1e-9, 5.9e-12), members=4096
    ),
    "bricard": Scene(2.0, "parameters", "g", (9.0, 10.0), members=256),
    "rolling_disc": Scene(10.0, "parameters", "g", (9.0, 10.0), members=1024),
    "quarter_car": Scene(5.0, "parameters", "bump", (0.06, 0.1), (1e-3, 1e-5, 1e-7), ALONE, 256),
    "bouncing_ball": Scene(5.0, "start", "y", (1.0, 1.2), (1e-6, 1e-9), ALONE, 256),
    "stick_slip": Scene(8.0, "rate", "x", (0.2, 0.25), (1e-5, 1e-8), ALONE, 256),
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


def outer_solar_system_of_heyoka() -> list:
    """Its own model of bodies under gravity, all positions before all velocities."""
    import heyoka as hy

    p = {record["name"]: record["value"] for record in loaded("outer_solar_system").parameters}
    masses = [p[f"m_{name}"] for name in ("sun", "jupiter", "saturn", "uranus", "neptune", "pluto")]
    found = hy.model.nbody(6, masses=masses, Gconst=p["G"])
    return [found[6 * body + half + axis] for half in (0, 3) for body in range(6) for axis in range(3)]


def generated_of_heyoka(name: str) -> list:
    """The generated right-hand side, run on its symbols."""
    from heyoka_peer import equations
    from job import Job

    text = link.module_for(Path(find(name)), {}, None).text
    system = runtime.load(text)
    start = np.zeros(system.nq + system.nv)
    empty = np.zeros(0)
    return equations(Job(system, text, system.parameter_values(), start, start, start, 0.0, 0.0, empty, {}))


# Equations as its users would write them, and models of its own; of others what is generated.
HEYOKA = {
    "double_pendulum": double_pendulum_of_heyoka,
    "outer_solar_system": outer_solar_system_of_heyoka,
}


def loaded(name: str) -> runtime.System:
    """A bundled model."""
    return runtime.load(link.module_for(Path(find(name)), {}, None).text)


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
    """The time at an error, from points of (error, time), straight between their logarithms.

    Of the least exact run where that is better than asked for; nan where none is as good.
    """
    points = sorted((max(error, _EXACT), seconds) for error, seconds in points)
    errors, times = np.log([p[0] for p in points]), np.log([p[1] for p in points])
    if np.log(level) < errors[0] - 0.7:
        return float("nan")
    return float(np.exp(np.interp(np.log(level), errors, times)))


def measure(name: str) -> dict[str, list[tuple[float, float]]]:
    """Return points of (median error, seconds for a member) by program."""
    scene = SCENES[name]
    system = loaded(name)
    asked = {"n": scene.members, "seed": 1, scene.place: {scene.name: uniform(*scene.bounds)}, "threads": 1}

    def ends(**how: object) -> np.ndarray:
        e = system.ensemble(scene.t_end, **asked, **how)
        alone = int(e.verdicts.singly.sum())
        if e.n_failed or (scene.methods is OURS and alone):
            print(f"{name} {how}: {e.n_failed} failed, {alone} alone", file=sys.stderr)
        return np.array([e[x] for x in e.names]).T

    plan = system.ensemble(scene.t_end, **{**asked, "n": 1}).plan
    whole = Members(plan.members.columns, scene.members, 1)
    parameters, varied = whole.arrays(plan.p, 0, scene.members)
    starts, _ = plan.starts.of(parameters, varied)
    values = next(iter(whole.values(0, scene.members).values()))
    tightest = {"taylor": 1e-15, "auto": 3e-14}[next(iter(scene.methods))]
    exact = ends(method=next(iter(scene.methods)), rtol=tightest, atol=tightest * 0.1)
    scale = np.abs(exact).max(axis=0) + 1e-300
    found: dict[str, list[tuple[float, float]]] = {}
    labels, calls, errors = [], [], []

    def add(label: str, call: Callable[[], np.ndarray], members: int = scene.members) -> None:
        off = np.abs((call() - exact[:members]) / scale).max(axis=1)
        labels.append((label, members))
        calls.append(call)
        errors.append(float(np.median(off)))

    for method, tolerances in scene.methods.items():
        for rtol in tolerances:
            label = "ensemble" if method == "auto" else method
            add(label, lambda method=method, rtol=rtol: ends(method=method, rtol=rtol, atol=rtol * 1e-2))
    if scene.methods is OURS and scene.place != "parameters" and importlib.util.find_spec("heyoka"):
        for tolerance in THEIRS:
            add("heyoka", heyoka_batch(name, scene.t_end, starts.T.copy(), tolerance))
    several = min(LOOPED, scene.members)
    for rtol in LOOPS:
        add("run.many", prepared_loop(system, scene, values[:several], rtol), several)
    for rtol in LOOPS:
        add("loop of run", lambda rtol=rtol: np.array([
            system.run(
                scene.t_end, rtol=rtol, atol=rtol * 1e-2, **{scene.place: {scene.name: float(x)}}
            ).states[-1] for x in values[:RUNS]
        ]), RUNS)  # fmt: skip
    for (label, members), seconds, error in zip(labels, least_time(calls), errors, strict=True):
        found.setdefault(label, []).append((error, seconds / members))
    return found


def prepared_loop(
    system: runtime.System, scene: Scene, values: np.ndarray, rtol: float
) -> Callable[[], np.ndarray]:
    """Return what runs members by `run.many`, one after another in machine code."""
    of_parameters = scene.place == "parameters"
    name = f"dot({scene.name})" if scene.place == "rate" else scene.name
    run = system.prepare(
        scene.t_end, rtol=rtol, atol=rtol * 1e-2, **{"parameters" if of_parameters else "start": [name]}
    )
    if run.why_python:
        print(f"{system.name}: run.many goes through Python: {run.why_python}", file=sys.stderr)
    rows = values[:, None]
    return lambda: (run.many(P=rows) if of_parameters else run.many(Y0=rows)).y


def heyoka_batch(name: str, t_end: float, starts: np.ndarray, tolerance: float) -> Callable[[], np.ndarray]:
    """Return what runs all members with heyoka, eight at a time."""
    import heyoka as hy

    width = 8
    equations = HEYOKA[name]() if name in HEYOKA else generated_of_heyoka(name)
    ta = hy.taylor_adaptive_batch(equations, starts[:, :width].copy(), tol=tolerance)

    def call() -> np.ndarray:
        ends = np.empty_like(starts)
        for first in range(0, starts.shape[1], width):
            ta.set_time(0.0)
            ta.state[:] = starts[:, first : first + width]
            ta.propagate_until(t_end)
            ends[:, first : first + width] = ta.state
        return ends.T

    return call


def measure_dynamics(name: str) -> tuple[float, float]:
    """Return how many states a second forward dynamics are found of, on one core, at parameters of one member.

    First by calls of the machine code alone, for eight states that stand side by side; then of states in an array, to
    accelerations in an array.
    """
    system, n = loaded(name), 1 << 13
    states = np.random.default_rng(0).uniform(-1.0, 1.0, (1, n, system.nq + system.nv))
    p, times = system.parameter_values()[None], np.zeros(n)
    evaluator = Evaluator(system, "rhs")
    calls = [lambda: evaluator(p, times, states)] * 20
    calls[0]()
    return measure_calls(system, states[0, :8], p[0]), n / min(least_time(calls))


def measure_calls(system: runtime.System, states: np.ndarray, parameters: np.ndarray) -> float:
    """Return how many states a second the function `rhs` in lanes takes that is called again and again."""
    lanes, n = len(states), 20_000
    code = engine.MachineCode()
    content = engine.object_code(
        engine.cache_key(_CALLS), "calls", "calls", lambda _: (_CALLS.format(lanes=lanes), 0)
    )
    arguments = [ctypes.c_uint64, *[ctypes.c_void_p] * 3, ctypes.c_int64]
    call = ctypes.CFUNCTYPE(None, *arguments)(code.add(content, "calls"))
    longer = np.append(parameters, np.zeros(system.n_precomputed - len(parameters)))
    ctypes.CFUNCTYPE(None, ctypes.c_double, *[ctypes.c_void_p] * 3)(system.setup_address)(
        0.0, longer.ctypes.data, longer.ctypes.data, longer[len(parameters) :].ctypes.data
    )
    y, p, out = (aligned(length * lanes) for length in (system.ny, system.n_precomputed, system.n_row))
    y.reshape(-1, lanes)[: states.shape[1]] = states.T
    p.reshape(-1, lanes)[:] = longer[:, None]
    kernel = lane_kernel(system, "rhs", lanes)
    took = least_time([lambda: call(kernel, y.ctypes.data, p.ctypes.data, out.ctypes.data, n)] * 20)
    return n * lanes / min(took)


_CALLS = """
define void @calls(ptr %f, ptr %y, ptr %p, ptr %out, i64 %n) {{
entry:
  br label %loop
loop:
  %i = phi i64 [0, %entry], [%next, %loop]
  call void %f(<{lanes} x double> zeroinitializer, ptr %y, ptr %p, ptr %out)
  %next = add i64 %i, 1
  %more = icmp slt i64 %next, %n
  br i1 %more, label %loop, label %done
done:
  ret void
}}
"""


def measure_scaling(name: str, seconds: float) -> None:
    """Print how much faster two threads are than one, and four processes by Dask, by the clock.

    Parameters
    ----------
    name : str
    seconds : float
        What one thread is to take beside two; beside Dask, whose parts are of a second each, three times as long.
    """
    from distributed import Client, LocalCluster

    scene, system = SCENES[name], loaded(name)
    asked = {"seed": 1, "rtol": 1e-8, "keep": None, "reduce": {scene.name: ["mean", "std"]}}
    asked[scene.place] = {scene.name: uniform(*scene.bounds)}

    def run(n: int, **how: object) -> tuple[float, float]:
        began, worked = time.perf_counter(), time.process_time()
        e = system.ensemble(scene.t_end, n=n, **asked, **how)
        if e.n_failed:
            raise SystemExit(f"{name}: {e.n_failed} members of {n} failed")
        return time.perf_counter() - began, time.process_time() - worked

    def compare(label: str, n: int, turns: int, **how: object) -> None:
        least, other, quiet = np.inf, np.inf, 0.0
        for _ in range(turns):
            clock, worked = run(n, threads=1)
            least, quiet = min(least, clock), max(quiet, worked / clock)
            other = min(other, run(n, **how)[0])
        print(f"  {n} members, {label}: {least / other:.2f} times as fast as one thread", end=" ")
        print(f"({other:.2f} s and {least:.2f} s; the quietest run had {quiet:.2f} of a core)")

    first = 1 << 14
    run(first, threads=1)  # compiles
    n = first * max(1, round(seconds / run(first, threads=1)[0]))
    print(f"{name}, {scene.t_end:g} s, rtol 1e-8")
    compare("two threads", n, TURNS, threads=2)
    local = {"threads_per_worker": 1, "dashboard_address": None, "silence_logs": logging.CRITICAL}
    with LocalCluster(n_workers=4, **local) as cluster, Client(cluster) as client:
        run(first, executor=client)  # sends the model out
        compare("four processes by Dask", 3 * n, TURNS - 1, executor=client)


def main() -> None:
    """Print a table for each scene: microseconds of a member at the errors of `SCENES`."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "scenes", nargs="*", metavar="SCENE", help=f"of {', '.join(SCENES)} (default: double_pendulum)"
    )
    parser.add_argument("--json", type=Path)
    parser.add_argument("--dynamics", metavar="MODEL", help="forward dynamics of a model alone")
    parser.add_argument("--scaling", metavar="SCENE", help="two threads and four processes, by the clock")
    parser.add_argument(
        "--seconds", type=float, default=8.0, help="of one thread, for --scaling (default: 8)"
    )
    given = parser.parse_args()
    if given.scaling in SCENES:
        measure_scaling(given.scaling, given.seconds)
        return
    if given.dynamics:
        alone, of_arrays = measure_dynamics(given.dynamics)
        print(f"{given.dynamics}: forward dynamics of {alone:.3g} states a second, {of_arrays:.3g} of arrays")
        return
    unknown = [name for name in (*given.scenes, *filter(None, [given.scaling])) if name not in SCENES]
    if unknown:
        parser.error(f"there is no scene {unknown[0]!r}; there are {', '.join(SCENES)}")
    results = {}
    for name in given.scenes or ["double_pendulum"]:
        points, scene = measure(name), SCENES[name]
        levels = scene.levels
        results[name] = points
        print(f"{name}, {scene.t_end:g} s, microseconds of processor time for a member")
        print("  error       " + "".join(f"{level:>12.0e}" for level in levels))
        for label, own in points.items():
            print(f"  {label:<12}" + "".join(f"{at_level(own, level) * 1e6:>12.1f}" for level in levels))
        for label, own in points.items():
            print(f"    {label}: " + ", ".join(f"{error:.1e} {seconds * 1e6:.1f}" for error, seconds in own))
    if given.json:
        given.json.write_text(json.dumps(results, indent=1) + "\n")


if __name__ == "__main__":
    main()
