"""What a call costs around its loop: `python benchmarks/calls.py`.

Processor time of repeated runs, the least of many turns: the loop alone, a prepared run, the same with checks at the
end, `system.run`, and its health report; SciPy's `solve_ivp` on the same compiled right-hand side, where there are no
constraints. Then many rows on one thread and on two, by the clock, and rows of constrained models whose starts have to
be assembled, beside the same from starts that meet the constraints; and calls of runs that go through Python.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp

import symgen
from symgen.runtime.code import stand_ins
from symgen.runtime.integrate import layout as at
from symgen.runtime.prepared.prepared import PreparedRun

_MODELS = (
    ("pendulum", 1.0),
    ("double_pendulum", 10.0),
    ("slider_crank", 5.0),
    ("andrews_squeezer", 0.03),
    ("seven_dof_arm", 5.0),
)
_BY_PYTHON = (
    ("cart_pole", {"F": (np.linspace(0.0, 5.0, 11), np.sin(np.linspace(0.0, 5.0, 11)))}),
    *(
        (name, None)
        for name in (
            "rack_and_pinion",
            "active_suspension",
            "rough_road",
            "clutch",
            "door_stop",
            "stick_slip",
        )
    ),
)
_TURNS, _REPEATS, _ROWS = 15, 20, 2000


def main() -> None:
    stand_ins.at_once = True  # what runs come to, however short they are here
    print(
        f"{'model':18}{'method':8}"
        + "".join(f"{x:>12}" for x in ("loop", "call", "checked", "run()", "health", "SciPy"))
        + "   [µs]"
    )
    for name, t_end in _MODELS:
        times = measure(name, t_end)
        method, *numbers = times
        print(
            f"{name:18}{method:8}"
            + "".join(f"{x:12.1f}" if np.isfinite(x) else f"{'–':>12}" for x in numbers)
        )
    (one, own), (two, both) = threads()
    print(
        f"double_pendulum, {_ROWS} rows: {one:.3f} s by the clock on one thread, {two:.3f} s on two; processor time "
        f"{own:.3f} and {both:.3f} s"
    )
    for name, (of_assembly, of_run) in assembled_rows().items():
        print(
            f"{name}, {_ROWS} rows: a start is assembled in {of_assembly:.1f} µs, its run takes {of_run:.1f}"
        )
    for name, inputs in _BY_PYTHON:
        call, whole, steps, events, why = by_python(name, inputs)
        print(f"{name}: call {call:.0f} µs, run() {whole:.0f}, {steps} steps, {events} events; {why}")


def measure(name: str, t_end: float) -> tuple:
    """Return the method, then the least processor times of each way [µs], by turns."""
    system = symgen.load(name)
    run = system.prepare(t_end)
    checked = system.prepare(t_end, checks="end")
    state = run.assemble()
    ways: list[Callable[[], object]] = [
        loop_alone(run, state),
        lambda: run(None, state),
        lambda: checked(None, state),
        lambda: system.run(t_end),
        lambda: system.run(t_end).health,
    ]
    if not system.m:
        kernel, p, n = system.kernel("rhs"), system.parameter_values(), system.nq + system.nv
        ways.append(
            lambda: solve_ivp(
                lambda t, y: kernel(t, y, p)[:n], (0.0, t_end), state, "DOP853", rtol=1e-8, atol=1e-10
            )
        )
    least = np.full(6, np.inf)
    for way in ways:
        way()
    for _ in range(_TURNS):
        for k, way in enumerate(ways):
            repeats = _REPEATS if k < 4 else 1
            began = time.thread_time()
            for _ in range(repeats):
                way()
            least[k] = min(least[k], (time.thread_time() - began) / repeats)
    least[4] -= least[3]
    return run.method, *(1e6 * least)


def by_python(name: str, inputs: dict | None) -> tuple[float, float, int, int, str]:
    """Return the least processor times [µs] of a prepared call and of `run()`, steps, events, and why it is Python."""
    system, t_end = symgen.load(name), 5.0
    run = system.prepare(t_end, inputs=inputs)
    ways, least = (run, lambda: system.run(t_end, inputs=inputs)), [np.inf, np.inf]
    for _ in range(_TURNS):
        for k, way in enumerate(ways):
            began = time.thread_time()
            way()
            least[k] = min(least[k], time.thread_time() - began)
    found = ways[1]()
    return 1e6 * least[0], 1e6 * least[1], found.stats["steps"], len(found.events), run.why_python


def loop_alone(run: PreparedRun, state: np.ndarray) -> Callable[[], object]:
    """Return the step loop of a run by itself: two calls, from the start with its first step to the end."""
    run(None, state)
    machine = run._machine
    arrays, block = machine._arrays, machine._plan_block
    control, counters, level = machine._plan.control, machine._plan.counters, arrays.control[at.ENERGY_LEVEL]

    def loop() -> None:
        arrays.control[:], arrays.counters[:], arrays.work[:], arrays.y[: len(state)] = (
            control,
            counters,
            0.0,
            state,
        )
        arrays.control[at.ENERGY_LEVEL] = level
        for stop, steps in ((np.inf, 0), (run.t_end, len(arrays.step_log))):
            arrays.set_limits(stop, steps, np.inf)
            block()

    return loop


def threads() -> list[tuple[float, float]]:
    """Return the seconds that many rows take on one thread and on two: by the clock, and of processors."""
    run = symgen.load("double_pendulum").prepare(10.0, parameters=["L1"])
    rows, least = np.linspace(0.8, 1.2, _ROWS)[:, None], [(np.inf, np.inf)] * 2
    for _ in range(5):
        for k in range(2):
            began, spent = time.perf_counter(), time.process_time()
            run.many(rows, threads=k + 1)
            least[k] = min(least[k], (time.perf_counter() - began, time.process_time() - spent))
    return least


def assembled_rows() -> dict[str, tuple[float, float]]:
    """Return the processor time of assembling a start, and of the run from it, for each model of a row [µs]."""
    found = {}
    for name, angle, t_end in (("slider_crank", "theta", 0.1), ("andrews_squeezer", "beta", 1e-3)):
        system = symgen.load(name)
        options = {"t_end": t_end, "method": "dop853", "parameters": ()}
        free = system.prepare(**options, start=[angle])
        angles = free.nominal_start * np.linspace(0.95, 1.05, _ROWS)[:, None]
        starts = np.array([free.assemble(row) for row in angles])
        whole = system.prepare(**options)
        least = np.full(2, np.inf)
        for _ in range(3):
            for k, (run, rows) in enumerate(((free, angles), (whole, starts))):
                spent = time.process_time()
                if not run.many(None, rows).ok.all():
                    raise ValueError(f"{name}: rows that did not end")
                least[k] = min(least[k], time.process_time() - spent)
        found[name] = 1e6 * (least[0] - least[1]) / _ROWS, 1e6 * least[1] / _ROWS
    return found


if __name__ == "__main__":
    main()
